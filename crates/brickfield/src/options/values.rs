//! From the text of an option to its value, for clap.
//! Errors say what the text must be, in a line.

use brickfield_bricks::Downsampling;
use brickfield_core::glam::{DVec3, UVec2};
use brickfield_core::{Aabb, BlockSide, BrickSide, Interblock, Level, ScalarType, WorldPos};
use brickfield_curvilinear::IndexPlane;
use brickfield_frame::{Division, Join, Lengths, Mode, Placement, Slices, Target, Upload};
use brickfield_io::{ByteOrder, RawSpec};
use brickfield_lod::Criterion;
use brickfield_optics::{LightSource, LitSides, Normals, QuadratureRule};

use super::{Background, Boxes};
#[cfg(feature = "formats")]
use crate::Codec;
use crate::{Classification, MAX_IMAGE, Quality, SurfaceNormals, TransparentBlocks};

/// Pixels along a facet of tessellated shells where none are asked for.
pub const FACET_PIXELS: u32 = 16;
const DIVISIONS: [(&str, Division); 2] = [("rays", Division::Ray), ("bricks", Division::Brick)];
const LENGTHS: [(&str, Lengths); 2] = [("true", Lengths::True), ("nominal", Lengths::Nominal)];
const BOXES: [(&str, Boxes); 2] = [("drawn", Boxes::Drawn), ("all", Boxes::All)];

/// A number above 0.
pub fn positive(text: &str) -> Result<f64, String> {
    text.trim()
        .parse()
        .ok()
        .filter(|v: &f64| v.is_finite() && *v > 0.0)
        .ok_or_else(|| "it must be a finite number above 0".to_owned())
}

/// A factor by which heights are exaggerated.
pub fn exaggeration(text: &str) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|v: &f64| v.abs() <= 1e6);
    number.ok_or_else(|| "it must be a number from -1000000 to 1000000".to_owned())
}

/// The width of mesh lines in pixels.
pub fn line_width(text: &str) -> Result<f64, String> {
    let most = brickfield_frame::MeshLines::MAX_WIDTH;
    let number = text.trim().parse().ok().filter(|v: &f64| *v > 0.0 && *v <= most);
    number.ok_or_else(|| format!("it must be a number above 0 and at most {most}"))
}

/// A plane of a structured grid.
pub fn plane(text: &str) -> Result<IndexPlane, String> {
    let parsed = text.split_once('=').and_then(|(axis, index)| Some((axis.trim(), index.trim().parse::<u32>().ok()?)));
    match parsed {
        Some(("i", index)) => Ok(IndexPlane::X(index)),
        Some(("j", index)) => Ok(IndexPlane::Y(index)),
        Some(("k", index)) => Ok(IndexPlane::Z(index)),
        _ => Err("a plane is i=N, j=N or k=N, N from 0, for example k=12".to_owned()),
    }
}

/// Where the normals of a surface come from.
pub fn surface_normals(text: &str) -> Result<SurfaceNormals, String> {
    match text {
        "grid" => Ok(SurfaceNormals::Grid),
        "triangles" => Ok(SurfaceNormals::Triangles),
        _ => Err("it must be grid or triangles".to_owned()),
    }
}

/// A step: a number above 0, or a fraction.
pub fn step(text: &str) -> Result<f64, String> {
    let value = match text.split_once('/') {
        Some((a, b)) => positive(a).and_then(|a| Ok(a / positive(b)?)),
        None => positive(text),
    };
    value
        .ok()
        .filter(|v| v.is_finite() && *v > 0.0)
        .ok_or_else(|| "a step is a finite number above 0, or a fraction: 0.125 or 1/8".to_owned())
}

fn numbers<const N: usize>(text: &str, separator: char) -> Option<[f64; N]> {
    let parsed: Result<Vec<f64>, _> = text.split(separator).map(|n| n.trim().parse::<f64>()).collect();
    parsed.ok()?.try_into().ok().filter(|n: &[f64; N]| n.iter().all(|x| x.is_finite()))
}

/// World units between samples along x, y and z.
pub fn spacing(text: &str) -> Result<DVec3, String> {
    let spacing = numbers::<3>(text, ':').map(DVec3::from).filter(|s| s.min_element() > 0.0);
    spacing.ok_or_else(|| "a spacing is SX:SY:SZ, numbers above 0, for example 0.5:0.5:2".to_owned())
}

/// The size of a picture.
pub fn size(text: &str) -> Result<UVec2, String> {
    let sides: Option<Vec<u32>> = text.split(['x', 'X']).map(|n| n.parse().ok()).collect();
    match sides.as_deref() {
        Some([w, h]) if (1..=MAX_IMAGE).contains(w) && (1..=MAX_IMAGE).contains(h) => Ok(UVec2::new(*w, *h)),
        _ => Err(format!("a size is WIDTHxHEIGHT in pixels, each 1 to {MAX_IMAGE}, for example 512x512")),
    }
}

/// A brick's side.
pub fn brick_side(text: &str) -> Result<BrickSide, String> {
    let n = text.parse().map_err(|_| "a number: 16, 32 or 64".to_owned())?;
    BrickSide::new(n).map_err(|e| e.to_string())
}

/// Voxels along a block's side.
pub fn block_side(text: &str) -> Result<BlockSide, String> {
    let n = text.parse().map_err(|_| "a number: 8, 16 or 32".to_owned())?;
    BlockSide::new(n).map_err(|e| e.to_string())
}

/// How values between flat blocks come about.
pub fn join(text: &str) -> Result<Join, String> {
    let scheme = || Interblock::ALL.into_iter().find(|scheme| scheme.name() == text).map(Join::Blend);
    let names = Interblock::ALL.map(Interblock::name).join(", ");
    (text == "nearest").then_some(Join::Shared).or_else(scheme).ok_or_else(|| format!("one of nearest, {names}"))
}

/// Where light comes from.
pub fn light(text: &str) -> Result<LightSource, String> {
    let source = match text.split_once('=') {
        None if text == "head" => Some(LightSource::Head),
        None => numbers::<3>(text, ',').map(|d| LightSource::Direction(d.into())),
        Some(("place", place)) => numbers::<3>(place, ',').map(|p| LightSource::Place(p.into())),
        Some(_) => None,
    };
    source.ok_or_else(|| "head, the direction X,Y,Z towards the light, or place=X,Y,Z, in the world".to_owned())
}

/// The sides of surfaces that are lit.
pub fn lit_sides(text: &str) -> Result<LitSides, String> {
    named(&[("lower", LitSides::Lower), ("both", LitSides::Both)], text)
}

/// Where normals come from.
pub fn normals(text: &str) -> Result<Normals, String> {
    named(&[Normals::Central, Normals::Stored, Normals::Surface].map(|normals| (normals.name(), normals)), text)
}

/// How the samples of a store are coded.
#[cfg(feature = "formats")]
pub fn codec(text: &str) -> Result<Codec, String> {
    named(&Codec::ALL.map(|codec| (codec.name(), codec)), text)
}

/// Draft or final.
pub fn quality(text: &str) -> Result<Quality, String> {
    match text {
        "final" => Ok(Quality::Final),
        "draft" => Ok(Quality::Draft),
        _ => Err("final or draft".to_owned()),
    }
}

/// How samples are brought to a device.
pub fn upload(text: &str) -> Result<Upload, String> {
    let packed = |max_error| Upload::Packed { max_error };
    match text.split_once('=') {
        None if text == "plain" => Some(Upload::Plain),
        None if text == "packed" => Some(packed(0)),
        Some(("packed", error)) => error.parse().map(packed).ok(),
        _ => None,
    }
    .ok_or_else(|| format!("{text:?} is not plain or packed[=ERROR] with ERROR a whole number 0 to {}", u16::MAX))
}

/// What is drawn inside transparent blocks.
pub fn transparent_blocks(text: &str) -> Result<TransparentBlocks, String> {
    match text {
        "empty" => Ok(TransparentBlocks::Empty),
        "blended" => Ok(TransparentBlocks::Blended),
        _ => Err("empty or blended".to_owned()),
    }
}

/// Which optics coarse samples have.
pub fn classification(text: &str) -> Result<Classification, String> {
    match text {
        "mean" => Ok(Classification::OfMean),
        "prefiltered" => Ok(Classification::Prefiltered),
        _ => Err("mean or prefiltered".to_owned()),
    }
}

/// The order of a polygon's fragments.
pub fn slices(text: &str) -> Result<Slices, String> {
    match text {
        "together" => Ok(Slices::Together),
        "interiors-first" => Ok(Slices::InteriorsFirst),
        _ => Err("together or interiors-first".to_owned()),
    }
}

/// How coarser levels come about.
pub fn downsampling(text: &str) -> Result<Downsampling, String> {
    match text {
        "subsample" => Ok(Downsampling::Subsample),
        "average" => Ok(Downsampling::Average),
        _ => Err("subsample or average".to_owned()),
    }
}

/// One criterion of which resolution is drawn.
pub fn criterion(text: &str) -> Result<Criterion, String> {
    let (name, value) = text.trim().split_once('=').map_or((text.trim(), None), |(name, value)| (name, Some(value)));
    let bounded = |default: Option<f64>| match (value, default) {
        (None, Some(default)) => Ok(default),
        (value, _) => positive(value.unwrap_or_default()).map_err(|_| above_0(name, value.unwrap_or_default())),
    };
    match (name, value) {
        ("full", None) => Ok(Criterion::FullResolution),
        ("distance", _) => Ok(Criterion::Distance { factor: bounded(Some(1.0))? }),
        ("poi", _) => point_of_interest(value.unwrap_or_default()),
        ("fov", _) => Ok(Criterion::FieldOfView { fraction: bounded(Some(0.5))? }),
        ("error", _) => Ok(Criterion::ScreenSpaceError { pixels: bounded(None)? }),
        _ => level(text),
    }
}

fn above_0(name: &str, value: &str) -> String {
    format!("{name}={value:?} is not a finite number above 0")
}

fn point_of_interest(text: &str) -> Result<Criterion, String> {
    let numbers = numbers::<4>(text, ':').or_else(|| numbers::<3>(text, ':').map(|[x, y, z]| [x, y, z, 1.0]));
    match numbers {
        Some([x, y, z, factor]) if factor > 0.0 => {
            Ok(Criterion::DistanceFrom { point: WorldPos(DVec3::new(x, y, z)), factor })
        }
        _ => Err(format!("poi={text:?} is not X:Y:Z in world units, or X:Y:Z:FACTOR with FACTOR above 0")),
    }
}

fn level(text: &str) -> Result<Criterion, String> {
    let level = text.trim().parse::<u8>().ok().filter(|l| *l < 32);
    level.map(|l| Criterion::Uniform(Level(l))).ok_or_else(|| {
        format!(
            "{text:?} is not full, a level 0 to 31, distance[=FACTOR], poi=X:Y:Z[:FACTOR], fov[=FRACTION] or error=PIXELS"
        )
    })
}

/// A clip box in index space.
pub fn clip(text: &str) -> Result<Aabb, String> {
    let message = || "a clip box is X0:X1,Y0:Y1,Z0:Z1 in voxels, each lower bound below the upper".to_owned();
    let spans: Option<Vec<[f64; 2]>> = text.split(',').map(|axis| numbers(axis, ':')).collect();
    let Some([x, y, z]) = spans.as_deref() else { return Err(message()) };
    let clip = Aabb { min: DVec3::new(x[0], y[0], z[0]), max: DVec3::new(x[1], y[1], z[1]) };
    if clip.is_empty() { Err(message()) } else { Ok(clip) }
}

/// A linear colour.
pub fn background(text: &str) -> Result<Background, String> {
    let grey = numbers::<1>(text, ',').map(|[g]| [g; 3]);
    let rgb = grey.or_else(|| numbers::<3>(text, ',')).filter(|c| c.iter().all(|x| (0.0..=1.0).contains(x)));
    rgb.map(Background).ok_or_else(|| "R,G,B or one number, each 0 to 1".to_owned())
}

/// A mode.
pub fn mode(text: &str) -> Result<Mode, String> {
    [Mode::Exact, Mode::FAST].into_iter().find(|m| m.name() == text).ok_or_else(|| "exact or fast".to_owned())
}

/// A quadrature rule.
pub fn rule(text: &str) -> Result<QuadratureRule, String> {
    let names = || QuadratureRule::ALL.map(|r| r.name()).join(", ");
    QuadratureRule::from_name(text).ok_or_else(|| format!("one of {}", names()))
}

/// The surfaces between which segments lie.
pub fn placement(text: &str) -> Result<Placement, String> {
    let tessellated = Placement::TessellatedShells { facet_pixels: FACET_PIXELS };
    let all = [Placement::Shells, tessellated, Placement::ViewportPlanes, Placement::ObjectPlanes];
    match text.split_once('=') {
        Some((name, pixels)) if name == tessellated.name() => facets(pixels),
        Some(_) => None,
        None => all.into_iter().find(|p| p.name() == text),
    }
    .ok_or_else(|| {
        let most = Placement::MOST_FACET_PIXELS;
        format!(
            "{text:?} is not shells, tessellated-shells[=PIXELS] with PIXELS a whole number 1 to {most}, viewport-planes or \
             object-planes"
        )
    })
}

fn facets(pixels: &str) -> Option<Placement> {
    let facet_pixels = pixels.parse().ok().filter(|n| (1..=Placement::MOST_FACET_PIXELS).contains(n))?;
    Some(Placement::TessellatedShells { facet_pixels })
}

/// Surfaces as an option names them.
pub fn placement_text(placement: Placement) -> String {
    match placement {
        Placement::TessellatedShells { facet_pixels } => format!("{}={facet_pixels}", placement.name()),
        _ => placement.name().to_owned(),
    }
}

/// What is divided into segments.
pub fn division(text: &str) -> Result<Division, String> {
    named(&DIVISIONS, text)
}

/// What is divided into segments, as an option names it.
pub fn division_text(division: Division) -> &'static str {
    name_of(&DIVISIONS, division)
}

/// For which lengths light is computed.
pub fn lengths(text: &str) -> Result<Lengths, String> {
    named(&LENGTHS, text)
}

/// For which lengths light is computed, as an option names it.
pub fn lengths_text(lengths: Lengths) -> &'static str {
    name_of(&LENGTHS, lengths)
}

/// What polygons are blended into.
pub fn target(text: &str) -> Result<Target, String> {
    named(&[Target::Float32, Target::Float16].map(|t| (t.name(), t)), text)
}

/// Which bricks are shown as boxes.
pub fn boxes(text: &str) -> Result<Boxes, String> {
    named(&BOXES, text)
}

fn named<T: Copy>(all: &[(&str, T)], text: &str) -> Result<T, String> {
    let names = || all.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(" or ");
    all.iter().find(|(name, _)| *name == text).map(|(_, value)| *value).ok_or_else(names)
}

fn name_of<T: PartialEq>(all: &[(&'static str, T)], value: T) -> &'static str {
    all.iter().find(|(_, v)| *v == value).map_or("", |(name, _)| name)
}

/// How raw voxels lie.
pub fn raw_spec(text: &str) -> Result<RawSpec, String> {
    let mut fields = text.split(',');
    let dims = fields.next().and_then(|d| {
        let n: Option<Vec<u32>> = d.split('x').map(|n| n.parse().ok().filter(|n| *n > 0)).collect();
        <[u32; 3]>::try_from(n?).ok()
    });
    let scalar = fields.next().and_then(|name| ScalarType::ALL.into_iter().find(|t| t.name() == name));
    let (Some(dims), Some(scalar)) = (dims, scalar) else {
        return Err(
            "NXxNYxNZ,TYPE with TYPE one of u8 i8 u16 i16 u32 i32 f32 f64, for example 256x256x128,u8".to_owned()
        );
    };
    let mut raw = RawSpec::new(dims.into(), scalar);
    for field in fields {
        raw_field(&mut raw, field)?;
    }
    Ok(raw)
}

fn raw_field(raw: &mut RawSpec, field: &str) -> Result<(), String> {
    match field.split_once('=') {
        None if field == "big" => raw.order = ByteOrder::Big,
        None if field == "little" => raw.order = ByteOrder::Little,
        Some(("skip", n)) => raw.skip_bytes = n.parse().map_err(|_| format!("skip={n:?} is not a number of bytes"))?,
        Some(("spacing", s)) => {
            let spacing = numbers::<3>(s, ':').ok_or_else(|| format!("spacing={s:?} is not SX:SY:SZ"))?;
            raw.spacing = DVec3::from(spacing);
        }
        _ => return Err(format!("{field:?} is not big, little, skip=BYTES or spacing=SX:SY:SZ")),
    }
    Ok(())
}
