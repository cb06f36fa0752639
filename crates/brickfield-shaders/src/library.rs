//! The WESL sources, and how a text is made of them.

use std::borrow::Cow;
use std::ops::Range;

use wesl::{CompileOptions, Features, ManglerKind, ModulePath, VirtualResolver, Wesl};

use crate::{ShaderError, Variant};

/// A module of WESL text.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Module {
    /// Its name in patches and messages: its file's.
    name: &'static str,
    /// The path under which others import it. Of several modules with one path a variant chooses one.
    path: &'static str,
    text: Cow<'static, str>,
}

/// A module that is imported by its own name.
const fn own(name: &'static str, text: &'static str) -> Module {
    Module { name, path: name, text: Cow::Borrowed(text) }
}

/// One of several modules of a path.
const fn one_of(path: &'static str, name: &'static str, text: &'static str) -> Module {
    Module { name, path, text: Cow::Borrowed(text) }
}

const EMBEDDED: [Module; 30] = [
    own("frame", include_str!("wesl/frame.wesl")),
    own("power", include_str!("wesl/power.wesl")),
    own("scalar", include_str!("wesl/scalar.wesl")),
    own("transfer", include_str!("wesl/transfer.wesl")),
    own("rays", include_str!("wesl/rays.wesl")),
    own("index", include_str!("wesl/index.wesl")),
    own("texels", include_str!("wesl/texels.wesl")),
    one_of("field", "field/bricks", include_str!("wesl/field/bricks.wesl")),
    one_of("field", "field/placed", include_str!("wesl/field/placed.wesl")),
    one_of("field", "field/blocks", include_str!("wesl/field/blocks.wesl")),
    one_of("field", "field/dense", include_str!("wesl/field/dense.wesl")),
    own("interblock", include_str!("wesl/interblock.wesl")),
    one_of("gradient", "gradient/central", include_str!("wesl/gradient/central.wesl")),
    one_of("gradient", "gradient/stored", include_str!("wesl/gradient/stored.wesl")),
    own("light", include_str!("wesl/light.wesl")),
    own("quadrature", include_str!("wesl/quadrature.wesl")),
    own("preintegrated", include_str!("wesl/preintegrated.wesl")),
    own("prefiltered", include_str!("wesl/prefiltered.wesl")),
    own("segments", include_str!("wesl/segments.wesl")),
    own("ending", include_str!("wesl/ending.wesl")),
    one_of("integrate", "integrate/constant", include_str!("wesl/integrate/constant.wesl")),
    one_of("integrate", "integrate/rays", include_str!("wesl/integrate/rays.wesl")),
    one_of("integrate", "integrate/bricks", include_str!("wesl/integrate/bricks.wesl")),
    own("march", include_str!("wesl/march.wesl")),
    own("proxy", include_str!("wesl/proxy.wesl")),
    own("evaluate", include_str!("wesl/evaluate.wesl")),
    own("probe", include_str!("wesl/probe.wesl")),
    own("decode", include_str!("wesl/decode.wesl")),
    own("mesh", include_str!("wesl/mesh.wesl")),
    own("cells", include_str!("wesl/cells.wesl")),
];

/// The shader sources: modules of WESL text by name.
///
/// Backends use [`embedded`](Self::embedded). A conformance run gives them a [`patched`](Self::patched) one, to see that its
/// cases notice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShaderLibrary {
    modules: Vec<Module>,
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
    #[error("shader module `{module}` declares no function or constant `{name}`")]
    NoDeclaration { module: String, name: String },
}

impl Default for ShaderLibrary {
    fn default() -> Self {
        ShaderLibrary::embedded()
    }
}

impl ShaderLibrary {
    /// The sources of this crate.
    pub fn embedded() -> ShaderLibrary {
        ShaderLibrary { modules: EMBEDDED.to_vec() }
    }

    /// The names and texts of the modules.
    pub fn modules(&self) -> impl Iterator<Item = (&'static str, &str)> {
        self.modules.iter().map(|module| (module.name, module.text.as_ref()))
    }

    /// The library with `from` replaced by `to` in one module. Texts are compared token by token: neither comments nor white
    /// space matter.
    ///
    /// # Errors
    /// If there is no such module, or if `from` does not occur exactly once in it.
    pub fn patched(&self, module: &str, from: &str, to: &str) -> Result<ShaderLibrary, PatchError> {
        self.patch(module, None, from, to)
    }

    /// As [`patched`](Self::patched), within the functions or constants of one name (conditions may choose among several).
    ///
    /// # Errors
    /// As [`patched`](Self::patched); or if the module declares nothing of this name.
    pub fn patched_in(&self, module: &str, name: &str, from: &str, to: &str) -> Result<ShaderLibrary, PatchError> {
        self.patch(module, Some(name), from, to)
    }

    fn patch(&self, module: &str, name: Option<&str>, from: &str, to: &str) -> Result<ShaderLibrary, PatchError> {
        let mut library = self.clone();
        let names = || self.modules().map(|(name, _)| name).collect::<Vec<_>>().join(", ");
        let Module { text, .. } = library
            .modules
            .iter_mut()
            .find(|m| m.name == module)
            .ok_or_else(|| PatchError::NoModule { module: module.to_owned(), modules: names() })?;
        let tokens = tokens(text);
        let scopes = match name {
            Some(name) => declarations(text, &tokens, name),
            None => std::iter::once(0..tokens.len()).collect(),
        };
        if scopes.is_empty() {
            let name = name.unwrap_or_default().to_owned();
            return Err(PatchError::NoDeclaration { module: module.to_owned(), name });
        }
        let hits: Vec<_> = scopes.into_iter().flat_map(|scope| find(text, &tokens[scope], from)).collect();
        let [hit] = hits.as_slice() else {
            return Err(PatchError::NotOnce { module: module.to_owned(), from: from.to_owned(), n: hits.len() });
        };
        text.to_mut().replace_range(hit.clone(), to);
        Ok(library)
    }

    /// The WGSL text of a variant: the declarations that it needs, and nothing else.
    pub(crate) fn wgsl(&self, variant: &Variant) -> Result<String, ShaderError> {
        let mut resolver = VirtualResolver::new();
        let chosen = variant.chosen_modules();
        let is_needed = |m: &&Module| m.name == m.path || chosen.contains(&m.name);
        for module in self.modules.iter().filter(is_needed) {
            resolver.add_module(path(module.path)?, module.text.as_ref().into());
        }
        let mut compiler = Wesl::new_barebones().set_custom_resolver(resolver);
        compiler.set_options(options(variant)).set_mangler(ManglerKind::None).use_sourcemap(true);
        let compiled = compiler.compile(&path(variant.entry.module())?).map_err(ShaderError::compile)?;
        Ok(compiled.to_string())
    }
}

/// Where the tokens of a text lie: words and numbers, and everything else one by one, without comments and white space.
fn tokens(text: &str) -> Vec<Range<usize>> {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let (mut tokens, mut at) = (Vec::new(), 0);
    while let Some(first) = text[at..].chars().next() {
        let rest = &text[at..];
        let n_bytes = match first {
            '/' if rest.starts_with("//") => rest.find('\n').unwrap_or(rest.len()),
            c if is_word(c) => rest.find(|c| !is_word(c)).unwrap_or(rest.len()),
            c => c.len_utf8(),
        };
        if !first.is_whitespace() && !rest.starts_with("//") {
            tokens.push(at..at + n_bytes);
        }
        at += n_bytes;
    }
    tokens
}

/// The tokens of all functions and constants of a name: from `fn` or `const` to the closing brace or the semicolon.
fn declarations(text: &str, tokens: &[Range<usize>], name: &str) -> Vec<Range<usize>> {
    let word = |i: usize| tokens.get(i).map_or("", |token| &text[token.clone()]);
    let end = |start: usize| {
        let mut depth = 0;
        let closes = |i: &usize| {
            depth += match word(*i) {
                "{" => 1,
                "}" => -1,
                _ => 0,
            };
            depth == 0 && matches!(word(*i), "}" | ";")
        };
        (start..tokens.len()).find(closes).map_or(tokens.len(), |last| last + 1)
    };
    let starts = (0..tokens.len()).filter(|i| matches!(word(*i), "fn" | "const") && word(i + 1) == name);
    starts.map(|start| start..end(start)).collect()
}

/// The bytes of each place where the tokens of `pattern` stand in a row.
fn find(text: &str, tokens: &[Range<usize>], pattern: &str) -> Vec<Range<usize>> {
    let pattern: Vec<&str> = self::tokens(pattern).into_iter().map(|token| &pattern[token]).collect();
    let is_hit = |window: &&[Range<usize>]| window.iter().map(|token| &text[token.clone()]).eq(pattern.iter().copied());
    let hits = tokens.windows(pattern.len().max(1)).filter(is_hit);
    hits.map(|window| window[0].start..window[window.len() - 1].end).collect()
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

    #[test]
    fn patches_ignore_comments_and_white_space_and_keep_to_a_declaration() {
        let text = "const A = 1; // two\nfn f() {\n    // a\n    if b { return x; }\n    return  x ; // y\n}\n\nfn g() { return x; }\n";
        let library = ShaderLibrary { modules: vec![own("m", text)] };
        let patched = |name, from| library.patched_in("m", name, from, "0").map(|l| l.modules[0].text.to_string());
        assert_eq!(patched("A", "1").unwrap(), text.replace("A = 1", "A = 0"));
        assert_eq!(patched("g", "return\nx").unwrap(), text.replace("g() { return x", "g() { 0"));
        assert_eq!(patched("f", "} return x;").unwrap(), text.replace("}\n    return  x ;", "0"));
        assert!(matches!(patched("f", "x"), Err(PatchError::NotOnce { n: 2, .. })));
        assert!(matches!(patched("f", "eturn x"), Err(PatchError::NotOnce { n: 0, .. })));
        assert!(matches!(patched("h", "x"), Err(PatchError::NoDeclaration { .. })));
    }
}
