//! Runs one case: prepares its plans and its reference, runs them on a backend, and judges the picture or the values.

use std::any::Any;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

use brickfield::cpu::{Discrete, discrete};
use brickfield::frame::{Capabilities, Mode, RenderError};
use brickfield_core::Image;
use brickfield_core::glam::UVec2;

use super::candidate::Candidate;
use super::case::{Case, Check, FunctionTest, Mutant, NoData, Oracle, PictureTest, Plans, Shows};
use super::cells::PreparedCells;
use super::meshes::PreparedMesh;
use super::naive::naive;
use super::record::RecordEntry;
use super::rule::{Complaint, PlanTolerance, Tolerance, Verdict, bounded};

/// A case that is ready to be run on any backend.
pub struct Prepared {
    work: CheckTask,
}

enum CheckTask {
    Picture(Box<PreparedPicture>),
    Mesh(Box<PreparedMesh>),
    Cells(Box<PreparedCells>),
    Function(Box<FunctionTest>),
}

/// A picture case's plans, its reference, and how far a picture may be from it.
struct PreparedPicture {
    subject: PictureTest,
    plans: Plans,
    reference: Discrete,
    tolerance: Result<PlanTolerance, Complaint>,
    /// By [`PreparedPicture::device_key`], as backends ask for them.
    on_devices: BTreeMap<Option<u32>, Tolerance>,
}

/// Why a case could not be prepared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[allow(missing_docs)]
pub enum Obstacle {
    #[error(transparent)]
    NoData(#[from] NoData),
    #[error("the scene is refused: {0}")]
    Refused(#[from] brickfield::PrepareError),
    #[error(transparent)]
    Wrong(#[from] Complaint),
}

/// The result of a case on a backend.
pub enum Judged {
    /// The backend is absent.
    Absent,
    /// The backend cannot do this, and says so.
    Unsupported(RenderError),
    /// The backend failed.
    Broken(RenderError),
    /// The backend panicked.
    Panicked(String),
    /// A picture, and the verdict of the rules.
    Picture(Image<f32>, Verdict),
    /// A function's outputs, held against its equation: greatest difference in units of its tolerance.
    Function(Vec<[f32; 4]>, Result<f64, String>),
}

impl Judged {
    /// The backend's answer, as an entry of a record: a picture, or a function's outputs as a picture of one row.
    pub fn answer(&self, case: &str, backend: &str) -> Option<RecordEntry> {
        let (size, values) = match self {
            Judged::Picture(image, _) => (image.size(), image.pixels()),
            Judged::Function(outputs, _) => (UVec2::new(outputs.len() as u32, 1), outputs.as_slice()),
            _ => return None,
        };
        let answer =
            || RecordEntry { case: case.to_owned(), backend: backend.to_owned(), size, values: values.to_vec() };
        (!values.is_empty()).then(answer)
    }
}

/// How far the reference may be from the volume's own sum: f64, in another order.
const ORACLE: f64 = 1e-8;

impl Prepared {
    /// Makes plans, reference and inputs of a case, and holds the reference against the volume's own sum.
    ///
    /// # Errors
    /// No data, a scene that is refused, a reference that is wrong.
    pub fn of(case: &Case) -> Result<Prepared, Obstacle> {
        let work = match &case.check {
            Check::Function(test) => CheckTask::Function(Box::new(test())),
            Check::Cells(test) => CheckTask::Cells(Box::new(PreparedCells::of(test())?)),
            Check::Mesh(test) => CheckTask::Mesh(Box::new(PreparedMesh::of(test())?)),
            Check::Picture(subject) => {
                let subject = subject()?;
                let plans = subject.plans()?;
                let reference = discrete(&plans.complete);
                check_blank(&subject, &reference)?;
                check_oracle(&subject, &reference)?;
                let tolerance = PlanTolerance::of(&plans.replayed, &reference);
                let on_devices = BTreeMap::new();
                CheckTask::Picture(Box::new(PreparedPicture { subject, plans, reference, tolerance, on_devices }))
            }
        };
        Ok(Prepared { work })
    }

    /// The reference picture, if the case has one.
    pub fn reference(&self) -> Option<&Image<f64>> {
        match &self.work {
            CheckTask::Picture(picture) => Some(&picture.reference.image),
            CheckTask::Mesh(mesh) => Some(&mesh.answer.pixels),
            CheckTask::Cells(cells) => Some(&cells.reference.image),
            CheckTask::Function(_) => None,
        }
    }

    /// Runs the case on a backend; with a mutant, on the plan that the mutant makes of it. (Shader mutants are in the
    /// backend.)
    pub fn run(&mut self, on: &mut Candidate, mutant: Option<&Mutant>) -> Judged {
        let Some(capabilities) = on.capabilities() else { return Judged::Absent };
        let run = AssertUnwindSafe(|| match &mut self.work {
            CheckTask::Function(test) => run_function(test, on, mutant),
            CheckTask::Mesh(mesh) => mesh.run(on, mutant),
            CheckTask::Cells(cells) => cells.run(on, mutant),
            CheckTask::Picture(picture) => run_picture(picture, &capabilities, on, mutant),
        });
        // A backend that panics fails its case, not the run.
        catch_unwind(run).unwrap_or_else(|payload| Judged::Panicked(words(payload.as_ref())))
    }

    /// The scene in a few words.
    pub fn describe(&self) -> String {
        match &self.work {
            CheckTask::Picture(picture) => {
                let (scene, plan) = (&picture.subject.scene, &picture.plans.replayed);
                let (n, size) = (plan.field().slots().n_filled(), scene.size);
                format!("{} x {} pixels, {n} bricks, {}, {}", size.x, size.y, scene.rule.name(), scene.mode.name())
            }
            CheckTask::Mesh(mesh) => mesh.describe(),
            CheckTask::Cells(cells) => cells.describe(),
            CheckTask::Function(test) => format!("{} inputs", test.points.len()),
        }
    }
}

/// The message of a panic.
fn words(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(|s| (*s).to_owned());
    text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_default()
}

/// A case that shows nothing by accident tests nothing.
fn check_blank(subject: &PictureTest, reference: &Discrete) -> Result<(), Complaint> {
    let found = match reference.image.pixels().iter().any(|p| p[3] > 1e-6) {
        true => Shows::Something,
        false => Shows::Nothing,
    };
    match found == subject.shows {
        true => Ok(()),
        false => Err(Complaint::Blank { found: found.name(), stated: subject.shows.name() }),
    }
}

fn check_oracle(subject: &PictureTest, reference: &Discrete) -> Result<(), Complaint> {
    let volume = match &subject.oracle {
        Oracle::Volume(volume) => volume,
        Oracle::EveryLevel(volume) => volume,
        Oracle::None => return Ok(()),
    };
    // f32 samples carry a field that is linear only to f32.
    let bound = if matches!(subject.oracle, Oracle::EveryLevel(_)) { 3e-6 } else { stored_rounding(subject) };
    let own = naive(volume, subject.tree.layout().side(), &subject.scene);
    let of_pixel = |(a, b): (&[f64; 4], &[f64; 4])| (0..4).map(|c| (a[c] - b[c]).abs()).fold(0.0, f64::max);
    let differences = own.pixels().iter().zip(reference.image.pixels()).map(of_pixel);
    let beyond = differences.zip(&reference.ambiguity).enumerate().find(|(_, (d, a))| is_beyond(*d, bound + **a));
    match beyond {
        Some((i, (difference, _))) => Err(Complaint::Oracle { pixel: super::rule::pixel(own.size(), i), difference }),
        None => Ok(()),
    }
}

/// f64, u32 and i32 are handed to backends as f32.
fn stored_rounding(subject: &PictureTest) -> f64 {
    use brickfield_core::ScalarType::{F32, F64, I32, U32};
    match subject.tree.scalar_type() {
        F64 | U32 | I32 | F32 => 5e-6,
        _ => ORACLE,
    }
}

impl PreparedPicture {
    /// The property of a device on which the tolerance depends: in fast mode the bits of its filter weights.
    fn device_key(&self, device: &Capabilities) -> Option<u32> {
        matches!(self.plans.replayed.sampling().mode(), Mode::Fast { .. }).then_some(device.sub_texel_bits)
    }

    /// Works out the tolerance on a device, unless it is known.
    fn meet(&mut self, device: &Capabilities) -> Result<(), Complaint> {
        let tolerance = self.tolerance.as_ref().map_err(Complaint::clone)?;
        let on = || tolerance.on(&self.plans.replayed, &self.reference, device.sub_texel_bits);
        self.on_devices.entry(self.device_key(device)).or_insert_with(on);
        Ok(())
    }
}

fn run_picture(
    picture: &mut PreparedPicture,
    capabilities: &Capabilities,
    on: &mut Candidate,
    mutant: Option<&Mutant>,
) -> Judged {
    if let Err(complaint) = picture.meet(capabilities) {
        return refused(complaint);
    }
    let PreparedPicture { plans, reference, on_devices, .. } = &*picture;
    let tolerance = &on_devices[&picture.device_key(capabilities)];
    let rendered = match mutant {
        Some(Mutant::Plan(mutant)) => on.render(&mutant.apply(&plans.replayed)),
        _ => on.render(&plans.replayed),
    };
    let image = match rendered {
        None => return Judged::Absent,
        Some(Err(e)) => return failed(e),
        Some(Ok(image)) => image,
    };
    let mut verdict = tolerance.judge(&image, &reference.image);
    // Rules of thumb that hold whatever the reference says; a mutant is caught by them, too.
    verdict.complaint = verdict
        .complaint
        .or_else(|| bounded(&image, &plans.replayed, reference))
        .or_else(|| tolerance.empty_promise(mutant));
    Judged::Picture(image, verdict)
}

fn refused(complaint: Complaint) -> Judged {
    let verdict = Verdict { errors: None, closest: None, used: f64::INFINITY, complaint: Some(complaint) };
    Judged::Picture(Image::transparent(UVec2::ZERO), verdict)
}

fn run_function(test: &FunctionTest, on: &mut Candidate, mutant: Option<&Mutant>) -> Judged {
    let inputs: Vec<[f32; 4]> = test.points.iter().map(|p| p.input).collect();
    let evaluated = match mutant {
        Some(Mutant::Plan(mutant)) => on.evaluate(&mutant.apply(&test.plan), test.function, &inputs),
        _ => on.evaluate(&test.plan, test.function, &inputs),
    };
    match evaluated {
        None => Judged::Absent,
        Some(Err(e)) => failed(e),
        Some(Ok(outputs)) => {
            let held = hold(test, &outputs);
            Judged::Function(outputs, held)
        }
    }
}

/// Whether a difference is above its bound; NaN is.
fn is_beyond(difference: f64, bound: f64) -> bool {
    difference.is_nan() || difference > bound
}

/// The greatest difference in units of its tolerance; or the first point that is off, in words.
fn hold(test: &FunctionTest, outputs: &[[f32; 4]]) -> Result<f64, String> {
    if outputs.len() != test.points.len() || outputs.is_empty() {
        return Err(format!("{} outputs for {} inputs", outputs.len(), test.points.len()));
    }
    let mut worst = 0.0f64;
    for (point, output) in test.points.iter().zip(outputs) {
        for (c, got) in output.iter().enumerate() {
            let (got, expected, tolerance) = (f64::from(*got), point.expected[c], point.tolerance[c]);
            let difference = (got - expected).abs();
            if is_beyond(difference, tolerance) {
                let name = test.function.name();
                return Err(format!(
                    "{name}{:?} channel {c}: {got:e}, expected {expected:e}, off by {difference:.2e}, {tolerance:.2e} allowed",
                    point.input
                ));
            }
            worst = worst.max(if tolerance > 0.0 { difference / tolerance } else { 0.0 });
        }
    }
    Ok(worst)
}

/// A backend's error: that it cannot do this, or a failure.
pub(super) fn failed(e: RenderError) -> Judged {
    match e {
        RenderError::Unsupported { .. }
        | RenderError::ImageTooLarge { .. }
        | RenderError::AtlasTooLarge { .. }
        | RenderError::BufferTooLarge { .. } => Judged::Unsupported(e),
        _ => Judged::Broken(e),
    }
}
