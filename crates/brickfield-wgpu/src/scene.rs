//! What stays on the device: what a plan brings, and where its picture goes.

use brickfield_core::glam::{UVec2, UVec3};
use brickfield_frame::{AtlasShape, FramePlan, FrameUniforms, Held, KnotUniform, Occupancy, RenderError};
use wgpu::BufferUsages;

use crate::atlas::{self, Atlas};
use crate::buffer::Reused;
use crate::device::Device;
use crate::picture::{Maker, Picture};
use crate::pipeline::Pipeline;

/// What a shader reads and writes.
pub(crate) struct Scene {
    pub(crate) uniforms: Reused,
    index: Reused,
    knots: Reused,
    pub(crate) seen_before: Reused,
    /// And the map that is in it.
    occupancy: (Reused, Held<Occupancy>),
    beams: Reused,
    facets: Reused,
    drawn: Reused,
    pub(crate) inputs: Reused,
    pub(crate) results: Reused,
    sampler: wgpu::Sampler,
    atlas: Option<Atlas>,
    pub(crate) picture: Option<Picture>,
}

impl Scene {
    pub(crate) fn new(device: &Device) -> Scene {
        let storage = BufferUsages::STORAGE | BufferUsages::COPY_DST;
        let linear = wgpu::FilterMode::Linear;
        Scene {
            uniforms: Reused::new("the frame's uniforms", BufferUsages::UNIFORM | BufferUsages::COPY_DST),
            index: Reused::new("the brick index", storage),
            knots: Reused::new("the transfer function", storage),
            seen_before: Reused::new("rays between passes", storage),
            occupancy: (Reused::new("the occupancy of bricks", storage), Held::nothing()),
            beams: Reused::new("the beams", storage),
            facets: Reused::new("the facets", storage),
            drawn: Reused::new("the bricks of polygons", storage),
            inputs: Reused::new("the inputs", storage),
            results: Reused::new("the results", BufferUsages::STORAGE | BufferUsages::COPY_SRC),
            sampler: device.device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("atlas"),
                mag_filter: linear,
                min_filter: linear,
                ..wgpu::SamplerDescriptor::default()
            }),
            atlas: None,
            picture: None,
        }
    }

    /// Brings to the device what `pipeline` reads of `plan`; returns the uniforms, as they are for a single pass.
    pub(crate) fn update(
        &mut self,
        device: &Device,
        plan: &FramePlan,
        pipeline: &Pipeline,
    ) -> Result<FrameUniforms, RenderError> {
        let shape = if pipeline.binds(1) {
            self.hold_atlas(device, plan)?
        } else {
            AtlasShape { bricks: UVec3::ONE, side: plan.bricks.side() }
        };
        let uniforms = FrameUniforms::of(plan, shape);
        if pipeline.binds(0) {
            self.uniforms.write(device, bytemuck::bytes_of(&uniforms))?;
        }
        if pipeline.binds(3) {
            self.index.write(device, bytemuck::cast_slice(plan.index.words()))?;
        }
        if pipeline.binds(4) {
            self.knots.write(device, bytemuck::cast_slice(&KnotUniform::of(plan)))?;
        }
        if pipeline.binds(9) {
            self.hold_occupancy(device, plan)?;
        }
        if pipeline.binds(10) {
            let beams = plan.beams.as_ref().ok_or_else(unbound)?;
            self.beams.write(device, bytemuck::cast_slice(&beams.spans()))?;
        }
        if pipeline.binds(11) {
            let proxy = plan.proxy.as_ref().ok_or_else(unbound)?;
            self.drawn.write(device, bytemuck::cast_slice(proxy.bricks()))?;
        }
        if pipeline.binds(12) {
            self.facets.write(device, bytemuck::cast_slice(&plan.rays.facet_planes()))?;
        }
        Ok(uniforms)
    }

    fn hold_occupancy(&mut self, device: &Device, plan: &FramePlan) -> Result<(), RenderError> {
        let Some(occupancy) = &plan.occupancy else { return Err(unbound()) };
        let (buffer, held) = &mut self.occupancy;
        if !held.is(occupancy) {
            *held = Held::nothing();
            buffer.write(device, bytemuck::cast_slice(occupancy.distances()))?;
            *held = Held::of(occupancy);
        }
        Ok(())
    }

    fn hold_atlas(&mut self, device: &Device, plan: &FramePlan) -> Result<AtlasShape, RenderError> {
        let shape = atlas::shape(device, &plan.bricks)?;
        if !self.atlas.as_ref().is_some_and(|a| a.holds(&plan.bricks)) {
            // The old one goes first: both may not fit.
            self.atlas = None;
            self.atlas = Some(Atlas::upload(device, &plan.bricks, shape)?);
        }
        Ok(shape)
    }

    pub(crate) fn resize(&mut self, device: &Device, size: UVec2, maker: Maker) -> Result<(), RenderError> {
        if !self.picture.as_ref().is_some_and(|p| p.fits(size, maker)) {
            self.picture = None;
            self.picture = Some(Picture::new(device, size, maker)?);
        }
        Ok(())
    }

    /// What goes with a binding number of the shaders.
    fn resource(&self, index: u32) -> Option<wgpu::BindingResource<'_>> {
        match index {
            0 => self.uniforms.binding(),
            1 => self.atlas.as_ref().map(|a| wgpu::BindingResource::TextureView(&a.view)),
            2 => Some(wgpu::BindingResource::Sampler(&self.sampler)),
            3 => self.index.binding(),
            4 => self.knots.binding(),
            5 => self.picture.as_ref().map(|p| wgpu::BindingResource::TextureView(&p.view)),
            6 => self.inputs.binding(),
            7 => self.results.binding(),
            8 => self.seen_before.binding(),
            9 => self.occupancy.0.binding(),
            10 => self.beams.binding(),
            11 => self.drawn.binding(),
            12 => self.facets.binding(),
            _ => None,
        }
    }

    pub(crate) fn bind(&self, device: &Device, pipeline: &Pipeline) -> Result<wgpu::BindGroup, RenderError> {
        let entry = |binding: u32| Some(wgpu::BindGroupEntry { binding, resource: self.resource(binding)? });
        let entries = pipeline.bindings.iter().map(|b| entry(b.index)).collect::<Option<Vec<_>>>();
        let entries = entries.ok_or_else(unbound)?;
        device.checked("binding the scene", 0, || {
            device.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("scene"),
                layout: &pipeline.layout,
                entries: &entries,
            })
        })
    }
}

/// A shader asks for something that no plan holds: a defect of a patched library.
pub(crate) fn unbound() -> RenderError {
    RenderError::Shader { message: "it binds what the backend does not have".to_owned() }
}
