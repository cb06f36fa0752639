//! The backends that are held to account, and their mutants.

use brickfield::frame::{
    Backend, Capabilities, CellsPlan, FramePlan, MeshFrame, MeshPlan, RenderError, ShaderFunction,
};
use brickfield::{BackendKind, BackendStatus, Validation, backends, open_backend};
use brickfield_core::Image;
use brickfield_shaders::ShaderLibrary;

use super::case::Mutant;

/// A backend on an adapter, or the reason of its absence.
pub struct Candidate {
    kind: BackendKind,
    adapter: Option<String>,
    validation: Validation,
    opened: Result<Box<dyn Backend>, String>,
}

impl Candidate {
    /// Opens a backend on the adapter that `adapter` is a part of the name of, or on its first.
    pub fn open(kind: BackendKind, adapter: Option<&str>, validation: Validation) -> Candidate {
        let adapter = adapter.filter(|_| kind != BackendKind::Cpu);
        let opened = open_backend(kind, adapter, validation).map_err(|e| e.to_string());
        Candidate { kind, adapter: adapter.map(str::to_owned), validation, opened }
    }

    /// All backends of a kind: one on each adapter, or one absent.
    pub fn all(kind: BackendKind, adapter: Option<&str>, validation: Validation) -> Vec<Candidate> {
        let status = backends().into_iter().find(|s| s.kind == kind);
        match (adapter, status) {
            (None, Some(BackendStatus { adapters: Ok(adapters), .. })) if adapters.len() > 1 => {
                adapters.iter().map(|a| Candidate::open(kind, Some(&a.index.to_string()), validation)).collect()
            }
            _ => vec![Candidate::open(kind, adapter, validation)],
        }
    }

    /// Which backend.
    pub fn kind(&self) -> BackendKind {
        self.kind
    }

    /// Why it is absent, if it is.
    pub fn absence(&self) -> Option<&str> {
        self.opened.as_ref().err().map(String::as_str)
    }

    /// backend@adapter.
    pub fn name(&self) -> String {
        format!("{}@{}", self.kind, self.adapter_name().unwrap_or("none"))
    }

    /// The adapter's name, as its driver states it.
    pub fn adapter_name(&self) -> Option<&str> {
        self.opened.as_ref().ok().map(|b| b.describe().adapter.as_str())
    }

    /// Its capabilities; `None` if it is absent.
    pub fn capabilities(&self) -> Option<Capabilities> {
        self.opened.as_ref().ok().map(|b| b.describe().capabilities)
    }

    /// Renders; `None` if the backend is absent.
    pub fn render(&mut self, plan: &FramePlan) -> Option<Result<Image<f32>, RenderError>> {
        self.opened.as_mut().ok().map(|b| b.render(plan).map(|f| f.image))
    }

    /// Draws a mesh; `None` if the backend is absent.
    pub fn render_mesh(&mut self, plan: &MeshPlan) -> Option<Result<MeshFrame, RenderError>> {
        self.opened.as_mut().ok().map(|b| b.render_mesh(plan))
    }

    /// Draws curvilinear cells; `None` if the backend is absent.
    pub fn render_cells(&mut self, plan: &CellsPlan) -> Option<Result<Image<f32>, RenderError>> {
        self.opened.as_mut().ok().map(|b| b.render_cells(plan).map(|frame| frame.image))
    }

    /// Evaluates a function; `None` if the backend is absent.
    pub fn evaluate(
        &mut self,
        plan: &FramePlan,
        function: ShaderFunction,
        inputs: &[[f32; 4]],
    ) -> Option<Result<Vec<[f32; 4]>, RenderError>> {
        let backend = self.opened.as_mut().ok()?;
        Some(match backend.as_evaluate() {
            Some(evaluates) => evaluates.evaluate(plan, function, inputs),
            None => Err(RenderError::Unsupported { what: "evaluate single functions" }),
        })
    }

    /// Whether the backend compiles shaders, so that shader mutants reach it.
    pub fn has_shaders(&self) -> bool {
        self.kind != BackendKind::Cpu
    }

    /// The same backend with other shader sources; `None` for one without shaders.
    pub fn with_library(&self, library: ShaderLibrary) -> Option<Candidate> {
        let opened = open_patched(self.kind, self.adapter.as_deref(), self.validation, library)?;
        Some(Candidate { kind: self.kind, adapter: self.adapter.clone(), validation: self.validation, opened })
    }

    /// Whether a mutant can be run on this backend.
    pub fn can_run(&self, mutant: &Mutant) -> bool {
        let needs_shaders = match mutant {
            Mutant::Plan(plan) => plan.is_of_polygons(),
            Mutant::Mesh(_) | Mutant::Cells(_) => false,
            Mutant::Shader(_) => true,
        };
        self.opened.is_ok() && (self.has_shaders() || !needs_shaders)
    }
}

type OpenedBackend = Result<Box<dyn Backend>, String>;

fn open_patched(
    kind: BackendKind,
    adapter: Option<&str>,
    validation: Validation,
    library: ShaderLibrary,
) -> Option<OpenedBackend> {
    match kind {
        BackendKind::Cpu => None,
        BackendKind::Wgpu => Some(open_wgpu(adapter, library)),
        BackendKind::Ash => Some(open_ash(adapter, validation, library)),
    }
}

#[cfg(feature = "wgpu")]
fn open_wgpu(adapter: Option<&str>, library: ShaderLibrary) -> OpenedBackend {
    use brickfield_wgpu::{AdapterChoice, WgpuBackend};
    let choice = match adapter.map(|a| (a, a.parse())) {
        None => AdapterChoice::Default,
        Some((_, Ok(index))) => AdapterChoice::Index(index),
        Some((name, Err(_))) => AdapterChoice::Name(name.to_owned()),
    };
    let mut backend = WgpuBackend::new(&choice).map_err(|e| e.to_string())?;
    backend.set_library(library);
    Ok(Box::new(backend))
}

#[cfg(not(feature = "wgpu"))]
fn open_wgpu(_: Option<&str>, _: ShaderLibrary) -> OpenedBackend {
    Err("wgpu is not in this build".to_owned())
}

#[cfg(feature = "ash")]
fn open_ash(adapter: Option<&str>, validation: Validation, library: ShaderLibrary) -> OpenedBackend {
    use brickfield_ash::{AdapterChoice, AshBackend, Options};
    let adapter = match adapter.map(|a| (a, a.parse())) {
        None => AdapterChoice::Default,
        Some((_, Ok(index))) => AdapterChoice::Index(index),
        Some((name, Err(_))) => AdapterChoice::Name(name.to_owned()),
    };
    let validation = match validation {
        Validation::Off => brickfield_ash::Validation::Off,
        Validation::On => brickfield_ash::Validation::On,
    };
    let mut backend =
        AshBackend::new(&Options { adapter, validation, ..Options::default() }).map_err(|e| e.to_string())?;
    backend.set_library(library);
    Ok(Box::new(backend))
}

#[cfg(not(feature = "ash"))]
fn open_ash(_: Option<&str>, _: Validation, _: ShaderLibrary) -> OpenedBackend {
    Err("ash is not in this build".to_owned())
}
