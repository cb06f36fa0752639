//! The light of a plan.

use brickfield_core::Grid;
use brickfield_core::glam::{DAffine3, DMat3, DVec3};
use brickfield_optics::{Light, LightSource, LitSides};
use bytemuck::{Pod, Zeroable};

use crate::FramePlan;

/// A light, and how sample space lies in the world: light is a matter of angles in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lighting {
    /// The light.
    pub light: Light,
    /// From sample space to the world.
    pub sample_to_world: DAffine3,
}

impl Lighting {
    /// A light on a volume of this grid.
    pub fn new(light: Light, grid: &Grid) -> Lighting {
        let sample_to_index = DAffine3::from_translation(DVec3::splat(0.5));
        Lighting { light, sample_to_world: grid.index_to_world() * sample_to_index }
    }

    /// From a gradient in data values per voxel along the grid's axes to data values per world unit along the world's.
    pub fn gradient_to_world(&self) -> DMat3 {
        self.sample_to_world.matrix3.inverse().transpose()
    }

    /// World units between neighbouring samples of level 0 along each axis of the grid.
    pub fn spacing(&self) -> DVec3 {
        let DMat3 { x_axis, y_axis, z_axis } = self.sample_to_world.matrix3;
        DVec3::new(x_axis.length(), y_axis.length(), z_axis.length())
    }

    /// The direction of length 1 from a sample position towards the light; `to_eye` is the one towards the eye. 0 at the light.
    pub fn to_light(&self, sample_position: DVec3, to_eye: DVec3) -> DVec3 {
        match self.light.source() {
            LightSource::Head => to_eye,
            LightSource::Direction(direction) => direction,
            LightSource::Place(place) => {
                (place - self.sample_to_world.transform_point3(sample_position)).normalize_or_zero()
            }
        }
    }
}

/// A [`Lighting`] as shaders read it. Positions are relative to the frame's centre; columns of matrices have a fourth number that
/// means nothing.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct LightUniform {
    /// Column x of the matrix from numbers of the value scale per voxel to the world's gradient in units of
    /// [`Light::flat_below`].
    pub steepness_x: [f32; 4],
    /// Column y.
    pub steepness_y: [f32; 4],
    /// Column z.
    pub steepness_z: [f32; 4],
    /// Column x of the matrix from voxels to world units.
    pub world_x: [f32; 4],
    /// Column y.
    pub world_y: [f32; 4],
    /// Column z.
    pub world_z: [f32; 4],
    /// Towards the light (w: 0), or its place (w: 1), in world units; nothing of a headlight.
    pub source: [f32; 4],
    /// The part of the colour that shows from everywhere.
    pub ambient: f32,
    /// The part that shows where a surface faces the light.
    pub diffuse: f32,
    /// The brightness of highlights.
    pub specular: f32,
    /// The exponent of highlights.
    pub shininess: u32,
    /// Numbers of the value scale per voxel along each axis that the greatest stored gradient stands for; nothing of others.
    pub greatest_slope: [f32; 4],
    /// First, a factor of cosines below 0: 0, or -1 if both sides of surfaces are lit.
    pub back: [f32; 4],
}

impl LightUniform {
    /// The light of a plan, if it has one.
    pub fn of(plan: &FramePlan) -> Option<LightUniform> {
        let lighting = plan.lighting()?;
        let (light, center) = (&lighting.light, plan.rays().center);
        let steepness = lighting.gradient_to_world() * (plan.value_scale().unit() / light.flat_below());
        let (world, terms) = (lighting.sample_to_world, light.terms());
        let source = match light.source() {
            LightSource::Head => [0.0; 4],
            LightSource::Direction(direction) => row(direction, 0.0),
            LightSource::Place(place) => row(place - world.transform_point3(center), 1.0),
        };
        let column = |column: DVec3| row(column, 0.0);
        Some(LightUniform {
            steepness_x: column(steepness.x_axis),
            steepness_y: column(steepness.y_axis),
            steepness_z: column(steepness.z_axis),
            world_x: column(world.matrix3.x_axis),
            world_y: column(world.matrix3.y_axis),
            world_z: column(world.matrix3.z_axis),
            source,
            ambient: terms.ambient as f32,
            diffuse: terms.diffuse as f32,
            specular: terms.specular as f32,
            shininess: terms.shininess,
            greatest_slope: row(lighting.spacing() * (plan.greatest_gradient() / plan.value_scale().unit()), 0.0),
            back: match light.sides() {
                LitSides::Lower => [0.0; 4],
                LitSides::Both => [-1.0, 0.0, 0.0, 0.0],
            },
        })
    }
}

fn row(v: DVec3, w: f32) -> [f32; 4] {
    v.as_vec3().extend(w).to_array()
}

#[cfg(test)]
mod tests {
    use super::*;
    use brickfield_core::glam::UVec3;
    use brickfield_optics::LightTerms;

    #[test]
    fn a_gradient_has_its_direction_and_length_in_the_world() {
        let direction = DMat3::from_cols(DVec3::new(0.0, 0.6, 0.8), DVec3::X, DVec3::new(0.0, 0.8, -0.6));
        let spacing = DVec3::new(1.0, 2.0, 0.5);
        let grid = Grid::from_first_sample(UVec3::splat(9), spacing, DVec3::new(7.0, -3.0, 2.0), direction).unwrap();
        let at = |source| Lighting::new(Light::new(source, LightTerms::default(), 1.0).unwrap(), &grid);
        let lighting = at(LightSource::Head);
        // The value is the world's y.
        let value = |q: DVec3| lighting.sample_to_world.transform_point3(q).y;
        let slope = DVec3::AXES.map(|axis| value(DVec3::ONE + axis) - value(DVec3::ONE));
        let gradient = lighting.gradient_to_world() * DVec3::from(slope);
        assert!((gradient - DVec3::Y).length() < 1e-12, "{gradient}");
        assert_eq!(value(DVec3::ZERO), -3.0);
        let place = at(LightSource::Place(DVec3::new(7.0, -3.0, 12.0)));
        assert!((place.to_light(DVec3::ZERO, DVec3::X) - DVec3::Z).length() < 1e-12);
        assert_eq!(lighting.to_light(DVec3::ZERO, DVec3::X), DVec3::X);
    }
}
