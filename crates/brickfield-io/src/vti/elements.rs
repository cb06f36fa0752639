//! The elements of a .vti file, one after the other.

use std::io::SeekFrom;

use quick_xml::Reader;
use quick_xml::errors::SyntaxError;
use quick_xml::events::{BytesStart, Event};

use super::attributes::attribute;
use super::document::{Around, ArrayStorage, Document};
use super::metered::{Metered, ends_within_document, find_underscore, skip_text};
use crate::error::Shown;
use crate::files::{ByteSource, n_bytes_left, read_head};
use crate::lines::MAX_HEADER_BYTES;
use crate::vtk_arrays::Support;
use crate::{Format, ReadError};

/// The step that an element asks of the reader.
enum Next {
    Go,
    SkipText,
    FindAppended(ArrayStorage),
}

/// Reads the document up to its end or to appended data.
pub(super) fn read_document(source: &mut dyn ByteSource) -> Result<Document, ReadError> {
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
    match document.pieces.is_empty() {
        false => Ok(document),
        true => Err(document.missing("the element Piece")),
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
        "ImageData" | "PImageData" | "RectilinearGrid" | "StructuredGrid" => document.enter_image(e)?,
        "Piece" => document.enter_piece(e)?,
        "PointData" | "PPointData" => document.around = Some(Around::Data(Support::Points, attribute(e, "Scalars")?)),
        "CellData" | "PCellData" => document.around = Some(Around::Data(Support::Cells, attribute(e, "Scalars")?)),
        "Points" | "Coordinates" => document.around = Some(Around::Geometry),
        "DataArray" | "PDataArray" => {
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
        && matches!(name, "PointData" | "CellData" | "PPointData" | "PCellData" | "Points" | "Coordinates")
    {
        document.around = None;
    }
    Next::Go
}
