//! The WESL sources, and how a text is made of them.

use std::borrow::Cow;

use wesl::{CompileOptions, Features, ManglerKind, ModulePath, VirtualResolver, Wesl};

use crate::{ShaderError, Variant};

const EMBEDDED: [(&str, &str); 12] = [
    ("frame", include_str!("wesl/frame.wesl")),
    ("scalar", include_str!("wesl/scalar.wesl")),
    ("transfer", include_str!("wesl/transfer.wesl")),
    ("rays", include_str!("wesl/rays.wesl")),
    ("bricks", include_str!("wesl/bricks.wesl")),
    ("quadrature", include_str!("wesl/quadrature.wesl")),
    ("preintegrated", include_str!("wesl/preintegrated.wesl")),
    ("segments", include_str!("wesl/segments.wesl")),
    ("march", include_str!("wesl/march.wesl")),
    ("proxy", include_str!("wesl/proxy.wesl")),
    ("evaluate", include_str!("wesl/evaluate.wesl")),
    ("probe", include_str!("wesl/probe.wesl")),
];

/// The shader sources: modules of WESL text by name.
///
/// Backends use [`embedded`](Self::embedded). A conformance run gives them a [`patched`](Self::patched) one, to see that its
/// cases notice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShaderLibrary {
    modules: Vec<(&'static str, Cow<'static, str>)>,
}

/// Why a source was not patched.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum PatchError {
    #[error("no shader module `{module}`; there are {modules}")]
    NoModule { module: String, modules: String },
    #[error("`{from}` occurs {n} times in shader module `{module}`; it must occur once")]
    NotOnce { module: String, from: String, n: usize },
}

impl Default for ShaderLibrary {
    fn default() -> Self {
        ShaderLibrary::embedded()
    }
}

impl ShaderLibrary {
    /// The sources of this crate.
    pub fn embedded() -> ShaderLibrary {
        ShaderLibrary { modules: EMBEDDED.map(|(name, text)| (name, Cow::Borrowed(text))).to_vec() }
    }

    /// The names and texts of the modules.
    pub fn modules(&self) -> impl Iterator<Item = (&'static str, &str)> {
        self.modules.iter().map(|(name, text)| (*name, text.as_ref()))
    }

    /// The library with `from` replaced by `to` in one module.
    ///
    /// # Errors
    /// If there is no such module, or if `from` does not occur exactly once in it.
    pub fn patched(&self, module: &str, from: &str, to: &str) -> Result<ShaderLibrary, PatchError> {
        let mut library = self.clone();
        let names = || self.modules().map(|(name, _)| name).collect::<Vec<_>>().join(", ");
        let (_, text) = library
            .modules
            .iter_mut()
            .find(|(name, _)| *name == module)
            .ok_or_else(|| PatchError::NoModule { module: module.to_owned(), modules: names() })?;
        let n = text.matches(from).count();
        if n != 1 {
            return Err(PatchError::NotOnce { module: module.to_owned(), from: from.to_owned(), n });
        }
        *text = Cow::Owned(text.replace(from, to));
        Ok(library)
    }

    /// The WGSL text of a variant: what it needs, and nothing else.
    pub(crate) fn wgsl(&self, variant: &Variant) -> Result<String, ShaderError> {
        let mut resolver = VirtualResolver::new();
        for (name, text) in self.modules() {
            resolver.add_module(path(name)?, text.into());
        }
        let mut compiler = Wesl::new_barebones().set_custom_resolver(resolver);
        compiler.set_options(options(variant)).set_mangler(ManglerKind::None).use_sourcemap(true);
        let compiled = compiler.compile(&path(variant.entry.module())?).map_err(ShaderError::compile)?;
        Ok(compiled.to_string())
    }
}

fn path(module: &str) -> Result<ModulePath, ShaderError> {
    format!("package::{module}").parse().map_err(ShaderError::compile)
}

fn options(variant: &Variant) -> CompileOptions {
    let flags = variant.conditions().into_iter().map(|(name, holds)| (name, holds.into())).collect();
    CompileOptions {
        imports: true,
        condcomp: true,
        strip: true,
        lazy: true,
        features: Features { default: wesl::Feature::Error, flags },
        keep: Some(variant.entry.entry_points().iter().map(|name| (*name).to_owned()).collect()),
        ..CompileOptions::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_hit_exactly_one_place() {
        let library = ShaderLibrary::embedded();
        let patched = library.patched("scalar", "x < 0.25", "x < 0.5").unwrap();
        assert_ne!(patched, library);
        assert!(matches!(library.patched("scalar", "return", ""), Err(PatchError::NotOnce { n: 3, .. })));
        assert!(matches!(library.patched("scalar", "no such text", ""), Err(PatchError::NotOnce { n: 0, .. })));
        assert!(library.patched("nothing", "", "").unwrap_err().to_string().contains("march"));
    }
}
