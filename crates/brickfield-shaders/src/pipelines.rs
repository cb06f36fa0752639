//! The pipelines of shader variants on a device, and which of them draws.

use std::collections::HashMap;
use std::sync::Arc;
use std::thread::{self, JoinHandle};

use brickfield_frame::{CellsPlan, FramePlan, MeshPlan, RenderError, ShaderChoice, Target};

use crate::trial::Trial;
use crate::{Entry, Variant};

/// What a pipeline is built for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PipelineKey {
    /// The shader.
    pub variant: Variant,
    /// The target that polygons are blended into.
    pub target: Target,
}

/// The pipelines of a device that were needed so far; there are a few hundred in all. `P` is the pipeline of a graphics interface.
///
/// ```text
/// choose(own)     Own       own is built, and draws
///                 General   the general one is built, and draws
///                 Quickest  own      general
///                           -        -          own is built, and draws; the general one is compiled on another thread
///                           built    -          own draws; the same
///                           -        built      the general one draws; own is compiled on another thread
///                           built    built      they take turns, until one is quicker
/// ```
pub struct Pipelines<P> {
    build: Build<P>,
    choice: ShaderChoice,
    built: HashMap<PipelineKey, P>,
    coming: HashMap<PipelineKey, JoinHandle<Result<P, RenderError>>>,
    failed: HashMap<PipelineKey, RenderError>,
    trials: HashMap<PipelineKey, Trial>,
}

/// Builds a pipeline, on any thread.
type Build<P> = Arc<dyn Fn(&PipelineKey) -> Result<P, RenderError> + Send + Sync>;

/// The pipeline that draws a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chosen {
    /// The pipeline; it is built.
    pub key: PipelineKey,
    /// The one that has nothing that the frame does not need.
    pub own: PipelineKey,
}

impl Chosen {
    /// Whether another shader than the frame's own draws.
    pub fn is_general(&self) -> bool {
        self.key != self.own
    }
}

impl PipelineKey {
    /// The pipeline that replays a plan, with nothing that the plan does not need.
    pub fn of(plan: &FramePlan) -> PipelineKey {
        let (entry, target) = match plan.proxy() {
            Some(proxy) => (Entry::Proxy(proxy.slices()), proxy.target()),
            None => (Entry::March, Target::default()),
        };
        PipelineKey { variant: Variant::of(plan, entry), target }
    }

    /// The pipeline of a variant that blends nothing.
    pub fn computing(variant: Variant) -> PipelineKey {
        PipelineKey { variant, target: Target::default() }
    }

    /// The pipeline that draws a mesh.
    pub fn mesh(plan: &MeshPlan) -> PipelineKey {
        PipelineKey::computing(Variant::mesh(plan.shading()))
    }

    /// The pipeline that draws cells.
    pub fn cells(plan: &CellsPlan) -> PipelineKey {
        PipelineKey::computing(Variant::cells(plan))
    }

    /// The pipeline that unpacks the slots of a plan, if any are packed.
    pub fn decoding(plan: &FramePlan) -> Option<PipelineKey> {
        let of_values = Some(plan.field().slots());
        let mut all = [of_values, plan.spreads(), plan.gradients()].into_iter().flatten();
        all.any(|slots| slots.has_packed()).then(|| PipelineKey::computing(Variant::decode()))
    }

    /// The pipeline of the general shader ([`Variant::general`]).
    #[must_use]
    pub fn general(self) -> PipelineKey {
        PipelineKey { variant: self.variant.general(), ..self }
    }
}

impl<P: Send + 'static> Pipelines<P> {
    /// No pipeline yet; `build` makes one.
    pub fn new(build: impl Fn(&PipelineKey) -> Result<P, RenderError> + Send + Sync + 'static) -> Pipelines<P> {
        Pipelines {
            build: Arc::new(build),
            choice: ShaderChoice::default(),
            built: HashMap::new(),
            coming: HashMap::new(),
            failed: HashMap::new(),
            trials: HashMap::new(),
        }
    }

    /// Which shaders draw from now on.
    pub fn set_choice(&mut self, choice: ShaderChoice) {
        self.choice = choice;
    }

    /// Which shaders draw.
    pub fn choice(&self) -> ShaderChoice {
        self.choice
    }

    /// A pipeline, built if it is new.
    ///
    /// # Errors
    /// If it cannot be built.
    pub fn of(&mut self, key: PipelineKey) -> Result<&mut P, RenderError> {
        if let Some(coming) = self.coming.remove(&key) {
            self.built.insert(key, joined(coming)?);
        }
        if !self.built.contains_key(&key) {
            self.built.insert(key, (self.build)(&key)?);
        }
        Ok(self.built.get_mut(&key).expect("it was built"))
    }

    /// The pipeline that draws the next frame, whose own one is `own`.
    ///
    /// # Errors
    /// If the frame's own pipeline cannot be built.
    pub fn choose(&mut self, own: PipelineKey) -> Result<Chosen, RenderError> {
        let general = own.general();
        let key = match self.choice {
            ShaderChoice::General => general,
            ShaderChoice::Quickest if general != own => self.quickest(own, general)?,
            ShaderChoice::Own | ShaderChoice::Quickest => own,
        };
        self.of(key)?;
        Ok(Chosen { key, own })
    }

    /// Notes how long a frame took, so that the quicker shader is known.
    pub fn note(&mut self, drawn: Chosen, ms: f64) {
        if let Some(trial) = self.trials.get_mut(&drawn.own) {
            trial.note(drawn.is_general(), ms);
        }
    }

    fn quickest(&mut self, own: PipelineKey, general: PipelineKey) -> Result<PipelineKey, RenderError> {
        self.collect();
        if let Some(error) = self.failed.remove(&own) {
            return Err(error);
        }
        let [has_own, has_general] = [own, general].map(|key| self.built.contains_key(&key));
        if has_own && has_general {
            let is_general = self.trials.entry(own).or_default().general_is_next();
            return Ok(if is_general { general } else { own });
        }
        if has_general {
            self.start(own);
            return Ok(general);
        }
        // A general shader that cannot be built is not tried again: the frame's own one draws.
        if !self.failed.contains_key(&general) {
            self.of(own)?;
            self.start(general);
        }
        Ok(own)
    }

    /// Compiles on another thread, or here if there is none to be had.
    fn start(&mut self, key: PipelineKey) {
        if self.coming.contains_key(&key) {
            return;
        }
        let build = Arc::clone(&self.build);
        let thread = thread::Builder::new().name("brickfield shader".to_owned()).spawn(move || build(&key));
        match thread {
            Ok(thread) => drop(self.coming.insert(key, thread)),
            Err(_) => self.take((self.build)(&key), key),
        }
    }

    /// Takes what other threads have built.
    fn collect(&mut self) {
        let done: Vec<_> = self.coming.iter().filter(|(_, thread)| thread.is_finished()).map(|(key, _)| *key).collect();
        for key in done {
            if let Some(thread) = self.coming.remove(&key) {
                self.take(joined(thread), key);
            }
        }
    }

    fn take(&mut self, made: Result<P, RenderError>, key: PipelineKey) {
        match made {
            Ok(pipeline) => drop(self.built.insert(key, pipeline)),
            Err(error) => drop(self.failed.insert(key, error)),
        }
    }
}

impl<P> std::ops::Index<PipelineKey> for Pipelines<P> {
    type Output = P;
    /// A pipeline that was built.
    fn index(&self, key: PipelineKey) -> &P {
        &self.built[&key]
    }
}

impl<P> Drop for Pipelines<P> {
    /// Drivers do not like to be left while they compile.
    fn drop(&mut self) {
        for (_, thread) in self.coming.drain() {
            drop(thread.join());
        }
    }
}

fn joined<P>(thread: JoinHandle<Result<P, RenderError>>) -> Result<P, RenderError> {
    let panicked = |_| RenderError::Shader { message: "the thread that compiled it panicked".to_owned() };
    thread.join().unwrap_or_else(|panic| Err(panicked(panic)))
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;
    use std::sync::mpsc::{Sender, channel};

    use brickfield_frame::{Feature, FeatureSet, QuadratureRule};

    use super::*;
    use crate::KnotSearch;

    /// Pipelines that are numbers of the builds before them; the builds on other threads wait to be let go.
    struct Stage {
        pipelines: Pipelines<usize>,
        let_go: Sender<()>,
        built: Arc<Mutex<Vec<PipelineKey>>>,
    }

    fn stage(fails: impl Fn(&PipelineKey) -> bool + Send + Sync + 'static) -> Stage {
        let (let_go, waiting) = channel();
        let (waiting, built) = (Mutex::new(waiting), Arc::new(Mutex::new(Vec::new())));
        let (here, log) = (thread::current().id(), Arc::clone(&built));
        let pipelines = Pipelines::new(move |key: &PipelineKey| {
            if thread::current().id() != here {
                waiting.lock().unwrap().recv().expect("the stage is there");
            }
            let mut log = log.lock().unwrap();
            log.push(*key);
            match fails(key) {
                true => Err(RenderError::Unsupported { what: "do it" }),
                false => Ok(log.len()),
            }
        });
        Stage { pipelines, let_go, built }
    }

    impl Stage {
        fn finish(&mut self) {
            self.let_go.send(()).unwrap();
            while !self.pipelines.coming.values().all(JoinHandle::is_finished) {
                thread::yield_now();
            }
        }
    }

    fn own(n_knots: usize) -> PipelineKey {
        let features = FeatureSet::default().with(Feature::TransferLookup);
        let mut variant = Variant::new(features, QuadratureRule::MidpointExponential, Entry::March);
        variant.search = KnotSearch::among(n_knots);
        PipelineKey::computing(variant)
    }

    #[test]
    fn a_choice_of_own_or_general_builds_that_one_once() {
        for (choice, key) in [(ShaderChoice::Own, own(4)), (ShaderChoice::General, own(4).general())] {
            let mut stage = stage(|_| false);
            stage.pipelines.set_choice(choice);
            let chosen = [(); 3].map(|()| stage.pipelines.choose(own(4)).unwrap().key);
            assert_eq!((chosen, stage.built.lock().unwrap().as_slice()), ([key; 3], [key].as_slice()));
        }
    }

    #[test]
    fn the_general_shader_draws_until_the_frames_own_is_compiled_and_the_quicker_one_stays() {
        let mut stage = stage(|_| false);
        stage.pipelines.set_choice(ShaderChoice::Quickest);
        // Nothing is there: the first frame waits for its own shader alone.
        assert!(!stage.pipelines.choose(own(4)).unwrap().is_general());
        stage.finish();
        // An edit: another search.
        let drawn = [(); 3].map(|()| stage.pipelines.choose(own(9)).unwrap().is_general());
        assert_eq!(drawn, [true; 3]);
        stage.finish();
        assert_eq!(*stage.built.lock().unwrap(), [own(4), own(4).general(), own(9)]);
        for _ in 0..20 {
            let chosen = stage.pipelines.choose(own(9)).unwrap();
            stage.pipelines.note(chosen, if chosen.is_general() { 2.0 } else { 1.0 });
        }
        assert!(!stage.pipelines.choose(own(9)).unwrap().is_general());
        // To be quicker for one frame is not to be quicker for another.
        for _ in 0..20 {
            let chosen = stage.pipelines.choose(own(4)).unwrap();
            stage.pipelines.note(chosen, if chosen.is_general() { 1.0 } else { 2.0 });
        }
        assert!(stage.pipelines.choose(own(4)).unwrap().is_general());
        assert!(!stage.pipelines.choose(own(9)).unwrap().is_general());
    }

    #[test]
    fn a_general_shader_that_fails_is_done_without_and_an_own_one_is_an_error() {
        let mut stage = stage(|key| *key == own(4).general());
        stage.pipelines.set_choice(ShaderChoice::Quickest);
        assert!(!stage.pipelines.choose(own(4)).unwrap().is_general());
        stage.finish();
        assert!(!stage.pipelines.choose(own(4)).unwrap().is_general());
        assert!(!stage.pipelines.choose(own(9)).unwrap().is_general());
        assert_eq!(*stage.built.lock().unwrap(), [own(4), own(4).general(), own(9)]);

        let mut stage = self::stage(|key| *key == own(9));
        stage.pipelines.set_choice(ShaderChoice::Quickest);
        stage.pipelines.choose(own(4)).unwrap();
        stage.finish();
        assert!(stage.pipelines.choose(own(9)).unwrap().is_general());
        stage.finish();
        assert_eq!(stage.pipelines.choose(own(9)).unwrap_err(), RenderError::Unsupported { what: "do it" });
    }
}
