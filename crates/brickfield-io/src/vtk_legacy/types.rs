//! The names of types, and names of arrays.

use brickfield_core::ScalarType;

use crate::stored_type::StoredType;
use crate::vtk_arrays::VtkSample;

/// The sample of a type name, in any case. `long` has 8 bytes, as everywhere but on Windows.
pub(super) fn sample(type_name: &str) -> Option<VtkSample> {
    Some(match type_name.to_ascii_lowercase().as_str() {
        "bit" => VtkSample::Bit,
        "unsigned_char" => ScalarType::U8.into(),
        "char" | "signed_char" => ScalarType::I8.into(),
        "unsigned_short" => ScalarType::U16.into(),
        "short" => ScalarType::I16.into(),
        "unsigned_int" => ScalarType::U32.into(),
        // VTK writes identifiers as integers of 32 bits.
        "int" | "vtkidtype" => ScalarType::I32.into(),
        "float" => ScalarType::F32.into(),
        "double" => ScalarType::F64.into(),
        "long" | "vtktypeint64" => VtkSample::Bytes(StoredType::I64),
        "unsigned_long" | "vtktypeuint64" => VtkSample::Bytes(StoredType::U64),
        _ => return None,
    })
}

/// A name with its % codes resolved: "a%20b" is "a b".
pub(super) fn decoded(name: &str) -> String {
    let (mut bytes, mut rest) = (Vec::new(), name.as_bytes());
    while let [first, tail @ ..] = rest {
        let code = tail.first_chunk::<2>().filter(|_| *first == b'%').and_then(|digits| {
            let digits = std::str::from_utf8(digits).ok()?;
            u8::from_str_radix(digits, 16).ok()
        });
        bytes.push(code.unwrap_or(*first));
        rest = if code.is_some() { &tail[2..] } else { tail };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_decoded() {
        assert_eq!(decoded("rgb%20colours"), "rgb colours");
        assert_eq!(decoded("50%"), "50%");
        assert_eq!(decoded("%zz%4"), "%zz%4");
    }
}
