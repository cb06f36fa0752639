//! The XML of a .vti file: everything but the numbers, whose positions are noted and which are skipped.

use std::io::{self, BufRead, Read, SeekFrom};

use quick_xml::errors::SyntaxError;
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

use crate::error::Shown;
use crate::files::{ByteSource, n_bytes_left, read_head};
use crate::lines::{MAX_HEADER_BYTES, numbers};
use crate::{ByteOrder, Format, ReadError};

/// Whether values belong to the points of the grid or to its cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Support {
    Points,
    Cells,
}

/// The bytes of the words that precede binary data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum WordSize {
    Four,
    Eight,
}

/// How the numbers of an array are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ArrayStorage {
    Text,
    Base64,
    Raw,
}

#[derive(Clone, Debug)]
pub(super) struct Array {
    pub(super) name: String,
    pub(super) type_name: String,
    pub(super) support: Support,
    pub(super) n_components: u64,
    format: String,
    /// Position of inline data in the file.
    position: u64,
    /// Position of appended data after the underscore.
    offset: u64,
}

#[derive(Clone, Debug)]
pub(super) struct Document {
    pub(super) order: ByteOrder,
    pub(super) word: WordSize,
    pub(super) is_compressed: bool,
    /// First and last point along x, y, z.
    pub(super) extent: [i64; 6],
    pub(super) origin: [f64; 3],
    pub(super) spacing: [f64; 3],
    pub(super) direction: [f64; 9],
    pub(super) point_scalars: Option<String>,
    pub(super) cell_scalars: Option<String>,
    pub(super) arrays: Vec<Array>,
    appended: Option<(ArrayStorage, u64)>,
    has_piece: bool,
    support: Option<Support>,
    /// The length of a file that ends before its root element does.
    cut_off_at: Option<u64>,
}

/// The step that an element asks of the reader.
enum Next {
    Go,
    SkipText,
    FindAppended(ArrayStorage),
}

impl Document {
    /// Reads the document up to its end or to appended data.
    pub(super) fn read(source: &mut dyn ByteSource) -> Result<Document, ReadError> {
        let rewind = |source: &mut dyn ByteSource| {
            source.seek(SeekFrom::Start(0)).map(|_| ()).map_err(|e| ReadError::io("the document", e))
        };
        rewind(source)?;
        let n_file_bytes = n_bytes_left(source)?;
        let head = read_head(source, 4096)?;
        rewind(source)?;
        let mut document = None;
        let outcome = read_elements(source, n_file_bytes, &mut document);
        let Some(document) = document else {
            return Err(no_root(outcome, &head));
        };
        outcome?;
        match document.has_piece {
            true => Ok(document),
            false => Err(document.missing("the element Piece")),
        }
    }

    /// The error of a part that is not there, or would have been if the file went on.
    pub(super) fn missing(&self, field: &'static str) -> ReadError {
        match self.cut_off_at {
            None => ReadError::Missing { field },
            Some(n_file_bytes) => ends_within_document(n_file_bytes),
        }
    }

    pub(super) fn storage(&self, array: &Array) -> Result<ArrayStorage, ReadError> {
        match (array.format.as_str(), self.appended) {
            ("ascii", _) => Ok(ArrayStorage::Text),
            ("binary", _) => Ok(ArrayStorage::Base64),
            ("appended", Some((storage, _))) => Ok(storage),
            ("appended", None) => Err(self.missing("the element AppendedData")),
            (other, _) => Err(ReadError::unsupported("DataArray format", other, "ascii, binary and appended are")),
        }
    }

    /// Where the array's numbers begin.
    pub(super) fn position(&self, array: &Array) -> Result<u64, ReadError> {
        match (array.format.as_str(), self.appended) {
            ("appended", Some((_, start))) => start
                .checked_add(array.offset)
                .filter(|p| *p <= i64::MAX as u64)
                .ok_or_else(|| ReadError::field("offset", array.offset, "a position in the file")),
            _ => Ok(array.position),
        }
    }

    fn of_root(e: &BytesStart) -> Result<Document, ReadError> {
        let kind = attribute(e, "type")?.unwrap_or_default();
        if kind != "ImageData" {
            return Err(ReadError::unsupported("VTKFile type", kind, "ImageData is"));
        }
        let order = match attribute(e, "byte_order")?.as_deref() {
            Some("LittleEndian") | None => ByteOrder::Little,
            Some("BigEndian") => ByteOrder::Big,
            Some(other) => return Err(ReadError::field("byte_order", other, "LittleEndian or BigEndian")),
        };
        let word = match attribute(e, "header_type")?.as_deref() {
            Some("UInt32") | None => WordSize::Four,
            Some("UInt64") => WordSize::Eight,
            Some(other) => return Err(ReadError::field("header_type", other, "UInt32 or UInt64")),
        };
        let is_compressed = match attribute(e, "compressor")?.as_deref() {
            None | Some("") => false,
            Some("vtkZLibDataCompressor") => true,
            Some(other) => return Err(ReadError::unsupported("compressor", other, "vtkZLibDataCompressor is")),
        };
        Ok(Document {
            order,
            word,
            is_compressed,
            extent: [0; 6],
            origin: [0.0; 3],
            spacing: [1.0; 3],
            direction: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            point_scalars: None,
            cell_scalars: None,
            arrays: Vec::new(),
            appended: None,
            has_piece: false,
            support: None,
            cut_off_at: None,
        })
    }

    fn enter_image(&mut self, e: &BytesStart) -> Result<(), ReadError> {
        self.extent = several(e, "WholeExtent")?.ok_or(ReadError::Missing { field: "WholeExtent" })?;
        self.origin = several(e, "Origin")?.unwrap_or(self.origin);
        self.spacing = several(e, "Spacing")?.unwrap_or(self.spacing);
        self.direction = several(e, "Direction")?.unwrap_or(self.direction);
        Ok(())
    }

    fn enter_piece(&mut self, e: &BytesStart) -> Result<(), ReadError> {
        if self.has_piece {
            return Err(ReadError::unsupported("number of pieces", "2 or more", "1 is"));
        }
        self.has_piece = true;
        self.extent = several(e, "Extent")?.unwrap_or(self.extent);
        Ok(())
    }

    fn enter_array(&mut self, e: &BytesStart, position: u64) -> Result<(), ReadError> {
        let Some(support) = self.support else { return Ok(()) };
        self.arrays.push(Array {
            name: attribute(e, "Name")?.unwrap_or_default(),
            type_name: attribute(e, "type")?.unwrap_or_default(),
            support,
            n_components: integer(e, "NumberOfComponents")?.unwrap_or(1),
            format: attribute(e, "format")?.unwrap_or_else(|| "ascii".to_owned()),
            position,
            offset: integer(e, "offset")?.unwrap_or(0),
        });
        Ok(())
    }
}

/// Reads elements up to the end or to appended data into the document, which the first of them makes.
fn read_elements(
    source: &mut dyn ByteSource,
    n_file_bytes: u64,
    document: &mut Option<Document>,
) -> Result<(), ReadError> {
    let mut reader = Reader::from_reader(Metered { source, n_bytes_left: MAX_HEADER_BYTES });
    reader.config_mut().check_end_names = false;
    let mut buffer = Vec::new();
    let mut is_closed = false;
    loop {
        buffer.clear();
        let event = reader.read_event_into(&mut buffer).map_err(|e| xml_fault(e, n_file_bytes))?;
        let next = match &event {
            Event::Eof => break,
            Event::Start(e) | Event::Empty(e) => element(document, e, reader.buffer_position())?,
            Event::End(e) => end(document, e.name().as_ref()),
            _ => Next::Go,
        };
        is_closed |= closes_root(&event);
        match (next, event) {
            (Next::SkipText, Event::Start(_)) => {
                skip_text(&mut reader).map_err(|e| ReadError::io("the document", e))?
            }
            (Next::FindAppended(storage), _) => {
                let start = find_underscore(&mut reader)?;
                if let Some(document) = document {
                    document.appended = Some((storage, start));
                }
                return Ok(());
            }
            _ => {}
        }
    }
    if let Some(document) = document {
        document.cut_off_at = (!is_closed).then_some(n_file_bytes);
    }
    Ok(())
}

fn closes_root(event: &Event) -> bool {
    match event {
        Event::End(e) => e.name().as_ref() == "VTKFile",
        Event::Empty(e) => e.name().as_ref() == "VTKFile",
        _ => false,
    }
}

fn ends_within_document(n_file_bytes: u64) -> ReadError {
    ReadError::EndsWithin { part: "the XML document".to_owned(), n_file_bytes, end: None }
}

/// All syntax errors of `quick-xml` but one are that something is not closed when the file ends.
fn xml_fault(fault: quick_xml::Error, n_file_bytes: u64) -> ReadError {
    match fault {
        quick_xml::Error::Syntax(s) if s != SyntaxError::InvalidBangMarkup => ends_within_document(n_file_bytes),
        other => ReadError::decoder("the XML document", other),
    }
}

/// Why there is no root element: the fault that was found, but only where the file begins as XML of VTK does.
fn no_root(outcome: Result<(), ReadError>, head: &[u8]) -> ReadError {
    match outcome {
        Err(fault @ ReadError::WrongMagic { .. }) => fault,
        Err(fault) if Format::from_magic(head) == Some(Format::Vti) => fault,
        _ => ReadError::wrong_start(Format::Vti, head, "XML with the root element VTKFile"),
    }
}

fn element(document: &mut Option<Document>, e: &BytesStart, position: u64) -> Result<Next, ReadError> {
    let name = e.name();
    let Some(document) = document else {
        if name.as_ref() != "VTKFile" {
            let found = Shown::new(name.as_ref());
            return Err(ReadError::WrongMagic {
                format: Format::Vti,
                what: "the root element",
                found,
                expected: "VTKFile",
            });
        }
        *document = Some(Document::of_root(e)?);
        return Ok(Next::Go);
    };
    match name.as_ref() {
        "ImageData" => document.enter_image(e)?,
        "Piece" => document.enter_piece(e)?,
        "PointData" => {
            document.support = Some(Support::Points);
            document.point_scalars = attribute(e, "Scalars")?;
        }
        "CellData" => {
            document.support = Some(Support::Cells);
            document.cell_scalars = attribute(e, "Scalars")?;
        }
        "DataArray" => {
            document.enter_array(e, position)?;
            return Ok(Next::SkipText);
        }
        "AppendedData" => return appended(e),
        _ => {}
    }
    Ok(Next::Go)
}

fn appended(e: &BytesStart) -> Result<Next, ReadError> {
    match attribute(e, "encoding")?.as_deref() {
        Some("raw") => Ok(Next::FindAppended(ArrayStorage::Raw)),
        Some("base64") | None => Ok(Next::FindAppended(ArrayStorage::Base64)),
        Some(other) => Err(ReadError::unsupported("AppendedData encoding", other, "raw and base64 are")),
    }
}

fn end(document: &mut Option<Document>, name: &str) -> Next {
    if let Some(document) = document
        && matches!(name, "PointData" | "CellData")
    {
        document.support = None;
    }
    Next::Go
}

fn attribute(e: &BytesStart, name: &'static str) -> Result<Option<String>, ReadError> {
    let malformed = |source| ReadError::decoder(format!("attribute {name}"), source);
    let Some(found) = e.try_get_attribute(name).map_err(|e| malformed(quick_xml::Error::from(e)))? else {
        return Ok(None);
    };
    let value = found.normalized_value(XmlVersion::Implicit1_0).map_err(malformed)?;
    Ok(Some(value.into_owned()))
}

fn integer(e: &BytesStart, name: &'static str) -> Result<Option<u64>, ReadError> {
    let Some(text) = attribute(e, name)? else { return Ok(None) };
    text.trim().parse().map(Some).map_err(|_| ReadError::field(name, text, "an integer of at least 0"))
}

fn several<T: std::str::FromStr, const N: usize>(
    e: &BytesStart,
    name: &'static str,
) -> Result<Option<[T; N]>, ReadError> {
    let Some(text) = attribute(e, name)? else { return Ok(None) };
    let values = numbers::<T>(name, &text)?;
    values.try_into().map(Some).map_err(|_| ReadError::field(name, text, format!("{N} numbers")))
}

/// A source that gives only so many bytes of XML; skipped bytes do not count.
struct Metered<'a> {
    source: &'a mut dyn ByteSource,
    n_bytes_left: u64,
}

impl Read for Metered<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.fill_buf()?.read(buffer)?;
        self.consume(n);
        Ok(n)
    }
}

impl BufRead for Metered<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.n_bytes_left == 0 {
            return Err(io::Error::other(format!("the XML outside of arrays is longer than {MAX_HEADER_BYTES} bytes")));
        }
        self.source.fill_buf()
    }

    fn consume(&mut self, n: usize) {
        self.n_bytes_left = self.n_bytes_left.saturating_sub(n as u64);
        self.source.consume(n);
    }
}

/// Skips to the next tag.
fn skip_text(reader: &mut Reader<Metered>) -> io::Result<()> {
    let mut stream = reader.stream();
    loop {
        let bytes = stream.fill_buf()?;
        let n = bytes.iter().position(|b| *b == b'<').unwrap_or(bytes.len());
        let is_found = n < bytes.len();
        let is_end = bytes.is_empty();
        stream.consume(n);
        stream.get_mut().n_bytes_left += n as u64;
        if is_found || is_end {
            return Ok(());
        }
    }
}

/// The position after the underscore that marks the start of appended data.
fn find_underscore(reader: &mut Reader<Metered>) -> Result<u64, ReadError> {
    let mut stream = reader.stream();
    let mut byte = [0];
    loop {
        match stream.read(&mut byte) {
            Ok(1) if byte[0] == b'_' => return Ok(stream.offset()),
            Ok(1) if byte[0].is_ascii_whitespace() => {}
            Ok(0) => return Err(ends_within_document(stream.offset())),
            Ok(_) => return Err(ReadError::Missing { field: "the underscore at the start of AppendedData" }),
            Err(e) => return Err(ReadError::io("the document", e)),
        }
    }
}
