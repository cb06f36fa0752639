//! Options of light.

use brickfield_core::{Grid, ValueRange};
use brickfield_optics::{Light, LightError, LightSource, LightTerms, LitSides, Normals, flat_below};
use clap::Args;

use super::{OptionError, values};
use crate::Scene;

/// A light, and how surfaces throw it back.
#[derive(Args, Clone, Debug)]
pub struct LightSourceOptions {
    /// Light on surfaces from: head (the eye), X,Y,Z (the direction towards it, in the world) or place=X,Y,Z (its place in the world)
    #[arg(long, value_name = "FROM", value_parser = values::light, allow_hyphen_values = true)]
    pub light: Option<LightSource>,
    /// The part of colours that shows from everywhere, 0 to 16
    #[arg(long, value_name = "PART", requires = "light", default_value_t = LightTerms::default().ambient, allow_hyphen_values = true)]
    pub ambient: f64,
    /// The part of colours that shows where a surface faces the light, 0 to 16
    #[arg(long, value_name = "PART", requires = "light", default_value_t = LightTerms::default().diffuse, allow_hyphen_values = true)]
    pub diffuse: f64,
    /// The brightness of highlights, 0 to 16
    #[arg(long, value_name = "PART", requires = "light", default_value_t = LightTerms::default().specular, allow_hyphen_values = true)]
    pub specular: f64,
    /// The exponent of highlights, 1 to 255: the greater, the smaller they are
    #[arg(long, value_name = "N", requires = "light", default_value_t = LightTerms::default().shininess)]
    pub shininess: u32,
}

/// Light on the surfaces in a volume.
#[derive(Args, Clone, Debug)]
pub struct LightOptions {
    /// Where it comes from.
    #[command(flatten)]
    pub source: LightSourceOptions,
    /// The gradient of a surface, in data values per world unit: where it is far lower there is no surface to be lit; a 64th of the
    /// volume's range of values in its least spacing unless stated
    #[arg(long, value_name = "GRADIENT", requires = "light", allow_hyphen_values = true)]
    pub flat_below: Option<f64>,
    /// The sides of surfaces that are lit: lower (of lower values) or both
    #[arg(long, value_name = "WHICH", requires = "light", default_value = "lower", value_parser = values::lit_sides)]
    pub lit_sides: LitSides,
    /// Normals of surfaces: central (differences of values), stored (gradients computed before) or surface (of voxels that are seen beside
    /// transparent ones; all else is as without light). The last two take four bytes a sample more, and --blocks
    #[arg(long, value_name = "WHICH", requires = "light", requires_ifs([("stored", "blocks"), ("surface", "blocks")]),
          default_value = "central", value_parser = values::normals)]
    pub normals: Normals,
}

impl LightSourceOptions {
    /// The light that is asked for; a gradient of `flat_below` is a surface's.
    ///
    /// # Errors
    /// Numbers that make no light.
    pub fn light(&self, flat_below: f64) -> Result<Option<Light>, LightError> {
        let LightSourceOptions { light, ambient, diffuse, specular, shininess } = *self;
        let terms = LightTerms { ambient, diffuse, specular, shininess };
        light.map(|source| Light::new(source, terms, flat_below)).transpose()
    }
}

impl LightOptions {
    /// Refuses what is wrong for any volume.
    ///
    /// # Errors
    /// Numbers that make no light.
    pub fn check(&self) -> Result<(), OptionError> {
        self.light(1.0)?;
        Ok(())
    }

    /// The scene of a volume of these values, in the light that is asked for.
    ///
    /// # Errors
    /// Numbers that make no light.
    pub fn of(&self, scene: Scene, range: ValueRange, grid: &Grid) -> Result<Scene, OptionError> {
        Ok(Scene { light: self.light(flat_below(range, grid.spacing().min_element()))?, ..scene })
    }

    fn light(&self, flat_below: f64) -> Result<Option<Light>, LightError> {
        let light = self.source.light(self.flat_below.unwrap_or(flat_below))?;
        Ok(light.map(|light| light.on_sides(self.lit_sides).on_normals(self.normals)))
    }
}
