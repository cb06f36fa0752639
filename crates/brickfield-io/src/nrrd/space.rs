//! The axes of an NRRD: which are space, and where they lie.

use brickfield_core::glam::DVec3;

use super::header::NrrdHeader;
use crate::error::counted;
use crate::length_unit::{CommonUnit, common_unit};
use crate::placement::{AXES, GridPlacement, usable_spacing};
use crate::{Note, ReadError, WorldFrame};

/// Which axes of the file are the volume's, and where they lie in the world.
pub(super) struct Space {
    pub(super) dims: [u64; 3],
    /// The axes of the file that are the volume's.
    pub(super) axes: Vec<usize>,
    pub(super) placement: GridPlacement,
    pub(super) frame: WorldFrame,
    pub(super) unit: Option<String>,
}

impl Space {
    pub(super) fn of(header: &NrrdHeader, notes: &mut Vec<Note>) -> Result<Space, ReadError> {
        let directions = directions(header)?;
        let axes = volume_axes(header, &directions);
        let mut dims = [1; 3];
        for (dim, axis) in dims.iter_mut().zip(&axes) {
            *dim = header.sizes[*axis];
        }
        let (frame, factors) = frame_of(header);
        let placement = match &directions {
            Some(directions) => oriented(header, directions, &axes)?,
            None => by_spacings(header, &axes, notes)?,
        };
        let CommonUnit { name: unit, factors: to_common } = common_unit(units(header, &axes), notes);
        Ok(Space { dims, placement: placement.scaled(factors * to_common), frame, unit, axes })
    }
}

/// One vector per axis, or none for an axis outside space.
type Directions = Vec<Option<DVec3>>;

fn directions(header: &NrrdHeader) -> Result<Option<Directions>, ReadError> {
    let Some(text) = header.text("spacedirections") else { return Ok(None) };
    let vectors = vectors("space directions", text)?;
    if vectors.len() != header.sizes.len() {
        let expected = format!("{} or none, one per axis", counted(header.sizes.len(), "vector", "vectors"));
        return Err(ReadError::field("space directions", text, expected));
    }
    Ok(Some(vectors))
}

/// `(a,b,c) none (d,e,f)`; components beyond the third are of no use here.
fn vectors(field: &'static str, text: &str) -> Result<Directions, ReadError> {
    let bad = || ReadError::field(field, text, "vectors such as (1,0,0), or none");
    let mut vectors = Vec::new();
    let mut rest = text.trim();
    while !rest.is_empty() {
        if let Some(after) = rest.strip_prefix("none") {
            vectors.push(None);
            rest = after.trim_start();
            continue;
        }
        let (inner, after) = rest.strip_prefix('(').and_then(|r| r.split_once(')')).ok_or_else(bad)?;
        let numbers: Vec<f64> =
            inner.split(',').map(|n| n.trim().parse()).collect::<Result<_, _>>().map_err(|_| bad())?;
        let at = |i: usize| numbers.get(i).copied().unwrap_or(0.0);
        let vector = DVec3::new(at(0), at(1), at(2));
        vectors.push((!vector.is_nan()).then_some(vector));
        rest = after.trim_start();
    }
    Ok(vectors)
}

/// The up to three axes that make the volume.
fn volume_axes(header: &NrrdHeader, directions: &Option<Directions>) -> Vec<usize> {
    let is_spatial = |axis: usize| match (directions, header.kind(axis)) {
        (Some(d), _) => d[axis].is_some(),
        (None, Some(kind)) => matches!(kind, "domain" | "space" | "???" | "none"),
        (None, None) => true,
    };
    let mut axes: Vec<usize> = (0..header.sizes.len()).filter(|axis| is_spatial(*axis)).collect();
    while axes.len() > 3 {
        match axes.iter().rposition(|axis| header.sizes[*axis] == 1) {
            Some(i) => drop(axes.remove(i)),
            None => axes.truncate(3),
        }
    }
    axes
}

/// The frame, and the factors that bring the file's axes to it.
fn frame_of(header: &NrrdHeader) -> (WorldFrame, DVec3) {
    let stated = header.key(WorldFrame::KEY).and_then(WorldFrame::of_name);
    let space = header.text("space").unwrap_or("").to_ascii_lowercase();
    let factors = match space.trim_end_matches("-time").trim_end_matches('t') {
        "left-posterior-superior" | "lps" => DVec3::ONE,
        "right-anterior-superior" | "ras" => DVec3::new(-1.0, -1.0, 1.0),
        "left-anterior-superior" | "las" => DVec3::new(1.0, -1.0, 1.0),
        _ => return (stated.unwrap_or(WorldFrame::Plain), DVec3::ONE),
    };
    (stated.unwrap_or(WorldFrame::Lps), factors)
}

fn oriented(header: &NrrdHeader, directions: &Directions, axes: &[usize]) -> Result<GridPlacement, ReadError> {
    let origin = match header.text("spaceorigin") {
        None => DVec3::ZERO,
        Some(text) => match vectors("space origin", text)?.as_slice() {
            [Some(origin)] => *origin,
            [None] => DVec3::ZERO,
            _ => return Err(ReadError::field("space origin", text, "one vector such as (0,0,0)")),
        },
    };
    let steps: Vec<DVec3> = axes.iter().filter_map(|axis| directions[*axis]).collect();
    Ok(GridPlacement::from_axes(&steps, origin))
}

/// Without directions: spacings, axis mins and axis maxs, each with NaN for "unknown".
fn by_spacings(header: &NrrdHeader, axes: &[usize], notes: &mut Vec<Note>) -> Result<GridPlacement, ReadError> {
    let spacings = per_axis(header, "spacings", "spacings")?;
    let mins = per_axis(header, "axismins", "axis mins")?;
    let maxs = per_axis(header, "axismaxs", "axis maxs")?;
    let centerings = header.text("centerings").or(header.text("centers")).unwrap_or("");
    let mut spacing = DVec3::ONE;
    let mut first_sample = DVec3::ZERO;
    for (i, axis) in axes.iter().enumerate() {
        let at = |v: &Option<Vec<f64>>| v.as_ref().map(|v| v[*axis]);
        let is_node = centerings.split_whitespace().nth(*axis) == Some("node");
        let n_steps = header.sizes[*axis] as f64 - if is_node { 1.0 } else { 0.0 };
        let by_bounds = at(&mins).zip(at(&maxs)).map(|(min, max)| (max - min) / n_steps).filter(|s| s.is_finite());
        let stated = at(&spacings).filter(|s| !s.is_nan()).or(by_bounds).or(at(&spacings));
        spacing[i] = stated.map_or(1.0, |s| usable_spacing(s, AXES[i], notes));
        let to_centre = if is_node { 0.0 } else { 0.5 * spacing[i] };
        first_sample[i] = at(&mins).filter(|m| m.is_finite()).map_or(0.0, |m| m + to_centre);
    }
    Ok(GridPlacement::axis_aligned(spacing, first_sample))
}

fn per_axis(header: &NrrdHeader, name: &str, field: &'static str) -> Result<Option<Vec<f64>>, ReadError> {
    let Some(text) = header.text(name) else { return Ok(None) };
    let values = crate::lines::numbers::<f64>(field, text)?;
    if values.len() != header.sizes.len() {
        return Err(ReadError::field(
            field,
            text,
            format!("{}, one per axis", counted(header.sizes.len(), "number", "numbers")),
        ));
    }
    Ok(Some(values))
}

/// The units along the axes of the world, as far as they are stated, without their quotes.
fn units<'h>(header: &'h NrrdHeader, axes: &[usize]) -> [Option<&'h str>; 3] {
    let quoted = |text: &'h str, i: usize| text.split('"').nth(2 * i + 1).map(str::trim);
    let unit = |i: usize| match header.text("spaceunits") {
        Some(text) => quoted(text, i),
        None => quoted(header.text("units")?, *axes.get(i)?),
    };
    [0, 1, 2].map(|i| unit(i).filter(|unit| !unit.is_empty() && *unit != "???"))
}
