"""pygfx: its ray caster through wgpu. It ships no emission and absorption; the loop below is put into its own shader."""

import re

import numpy as np
import pygfx
import pygfx.renderers.wgpu.shaders.volumeshader as volumeshader
import wgpu
from pygfx.renderers.wgpu import load_wgsl, register_wgpu_render_function
from rendercanvas.offscreen import RenderCanvas

# Rays end as those of this project's fast mode do.
TRANSMITTANCE_FLOOR = 1 / 255
KNOTS = 1024
INVALID = "$$ else\n    fn raycast("
LOOP = """$$ elif mode.startswith('emission')
    fn raycast(sizef: vec3<f32>, nsteps: i32, start_coord: vec3<f32>, step_coord: vec3<f32>) -> RenderOutput {
        let length_world = length(step_coord * sizef * vec3<f32>(SPACING));
        var transmittance = 1.0;
        var emitted = vec3<f32>(0.0);
        for (var i = 0.5; i < f32(nsteps); i = i + 1.0) {
            let optics = sampled_value_to_color(sample_vol(start_coord + i * step_coord, sizef));
            if (optics.a <= 0.0) { continue; }
            let opacity = 1.0 - exp(-optics.a * length_world);
            emitted += transmittance * opacity * optics.rgb;
            transmittance *= 1.0 - opacity;
            if (transmittance < FLOOR) { break; }
        }
        var out: RenderOutput;
        // The renderer's last pass turns linear colours into sRGB: here they are to stay what they are.
        out.color = vec4<f32>(srgb2physical(emitted), 1.0);
        out.coord = start_coord;
        out.depth = 0.5;
        return out;
    }
"""


class Peer:
    def __init__(self, contestant, scene, phases):
        self.scene, self.step_voxels, self.shown = scene, None, None
        with phases.phase("read"):
            voxels = scene.voxels()
        with phases.phase("device"):
            canvas = RenderCanvas(size=(scene.size, scene.size), pixel_ratio=1)
            self.renderer = pygfx.renderers.WgpuRenderer(canvas, pixel_scale=1, pixel_filter="nearest", ppaa="none")
        with phases.phase("scene"):
            low, high = map_range(scene)
            if voxels.dtype != np.uint8:
                voxels, low, high = ((voxels.astype("f4") - low) / (high - low)), 0.0, 1.0
            self.grid = pygfx.Geometry(grid=pygfx.Texture(voxels, dim=3))
            self.look = {"clim": (low, high), "interpolation": "linear", "map": optics_map(scene)}
            self.world = pygfx.Scene()
            self.world.add(pygfx.Background.from_color("#000"))
            extent = max(n * s for n, s in zip(scene.dims, scene.spacing))
            self.camera = pygfx.PerspectiveCamera(scene.fov_degrees, 1.0, depth_range=(1e-3 * extent, 100 * extent))
        canvas.request_draw(lambda: self.renderer.render(self.world, self.camera))
        self.canvas = canvas
        adapter = self.renderer.device.adapter.info
        version = f"pygfx {pygfx.__version__}, wgpu {wgpu.__version__}"
        self.info = {"version": version, "device": f"{adapter['device']}, {adapter['backend_type']}", "domain": "voxels", "view": 1.0}

    def draw(self, step_voxels, camera):
        if step_voxels != self.step_voxels:
            self.set_step(step_voxels)
        self.camera.local.position = camera["eye"]
        self.camera.world.reference_up = camera["up"]
        self.camera.look_at(camera["target"])
        self.drawn = self.canvas.draw()

    def picture(self):
        return np.asarray(self.drawn)[..., :3]

    def set_step(self, step_voxels):
        """The step is a constant of the shader, as in pygfx's own."""
        volumeshader.load_wgsl = lambda name, *rest, **named: patched(name, load_wgsl(name, *rest, **named), step_voxels, self.scene)
        if self.shown is not None:
            self.world.remove(self.shown)
        # A mode of its own for each step: pygfx keeps one shader for each mode.
        mode = {"render_mode": f"emission{step_voxels}"}
        material = type("EmissionMaterial", (pygfx.VolumeRayMaterial,), mode)
        register_wgpu_render_function(pygfx.Volume, material)(volumeshader.VolumeRayShader)
        self.shown = pygfx.Volume(self.grid, material(**self.look))
        self.shown.local.scale = self.scene.spacing
        self.world.add(self.shown)
        self.step_voxels = step_voxels


def patched(name, code, step_voxels, scene):
    if name != "volume_ray.wgsl":
        return code
    code, found = re.subn(r"let relative_step_size = clamp\(.*\);", f"let relative_step_size = {float(step_voxels)};", code)
    if found != 1 or INVALID not in code:
        raise ValueError("volume_ray.wgsl of this pygfx is another than the one that is patched")
    loop = LOOP.replace("SPACING", ", ".join(repr(float(s)) for s in scene.spacing)).replace("FLOOR", repr(TRANSMITTANCE_FLOOR))
    at = code.rindex(INVALID)
    return code[:at] + loop + code[at:]


def map_range(scene):
    """The values at the outer faces of the map, whose outer texels' centres are the first and the last knot: beyond, it is constant."""
    low, high = scene.value_range()
    half_texel = 0.5 * (high - low) / (KNOTS - 1)
    return low - half_texel, high + half_texel


def optics_map(scene):
    """Colours, and extinctions as their alpha."""
    extinction, color = scene.optics(np.linspace(*scene.value_range(), KNOTS))
    texels = np.concatenate([color, extinction[:, None]], 1).astype("f4")
    return pygfx.TextureMap(pygfx.Texture(texels, dim=1, colorspace="srgb"), filter="linear", wrap="clamp")
