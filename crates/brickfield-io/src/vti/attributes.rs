//! The attributes of an element.

use quick_xml::XmlVersion;
use quick_xml::events::BytesStart;

use crate::ReadError;
use crate::lines::numbers;

pub(super) fn attribute(e: &BytesStart, name: &'static str) -> Result<Option<String>, ReadError> {
    let malformed = |source| ReadError::decoder(format!("attribute {name}"), source);
    let Some(found) = e.try_get_attribute(name).map_err(|e| malformed(quick_xml::Error::from(e)))? else {
        return Ok(None);
    };
    let value = found.normalized_value(XmlVersion::Implicit1_0).map_err(malformed)?;
    Ok(Some(value.into_owned()))
}

pub(super) fn integer(e: &BytesStart, name: &'static str) -> Result<Option<u64>, ReadError> {
    let Some(text) = attribute(e, name)? else { return Ok(None) };
    text.trim().parse().map(Some).map_err(|_| ReadError::field(name, text, "an integer of at least 0"))
}

pub(super) fn several<T: std::str::FromStr, const N: usize>(
    e: &BytesStart,
    name: &'static str,
) -> Result<Option<[T; N]>, ReadError> {
    let Some(text) = attribute(e, name)? else { return Ok(None) };
    let values = numbers::<T>(name, &text)?;
    values.try_into().map(Some).map_err(|_| ReadError::field(name, text, format!("{N} numbers")))
}
