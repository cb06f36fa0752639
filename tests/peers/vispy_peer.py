"""vispy: its ray caster through OpenGL, method `translucent`; rays end at an opacity of 0.99, which is built in."""

import math

import numpy as np
import vispy

vispy.use("egl")

from vispy import gloo, scene as graph  # noqa: E402  after the choice of the backend
from vispy.color.colormap import BaseColormap  # noqa: E402

# The types that vispy has textures of.
TEXTURES = (np.uint8, np.uint16, np.float32)


class Peer:
    def __init__(self, contestant, scene, phases):
        if max(scene.spacing) > 1.0001 * min(scene.spacing):
            raise ValueError(f"vispy's steps are counted in voxels: spacings must be equal, and are {scene.spacing}")
        self.scene, self.step_voxels = scene, None
        with phases.phase("read"):
            voxels = scene.voxels()
            if voxels.dtype not in TEXTURES:
                voxels = voxels.astype("f4")
        with phases.phase("device"):
            self.canvas = graph.SceneCanvas(size=(scene.size, scene.size), show=False, bgcolor="black", dpi=96)
        with phases.phase("scene"):
            self.view = self.canvas.central_widget.add_view(border_width=0)
            self.volume = graph.visuals.Volume(
                voxels, parent=self.view.scene, clim=scene.value_range(), method="translucent", interpolation="linear", texture_format="auto"
            )
            self.volume.transform = graph.transforms.STTransform(scale=scene.spacing)
            self.camera = graph.cameras.TurntableCamera(fov=scene.fov_degrees, up="+z")
            self.camera.depth_value = 100.0
            self.view.camera = self.camera
        self.canvas.set_current()
        device = gloo.gl.glGetParameter(gloo.gl.GL_RENDERER)
        self.info = {"version": f"vispy {vispy.__version__}", "device": device, "domain": "voxels", "view": 1.0}

    def draw(self, step_voxels, camera):
        if step_voxels != self.step_voxels:
            self.volume.cmap = Optics(self.scene, step_voxels * self.scene.least_spacing)
            self.volume.relative_step_size = step_voxels
            self.step_voxels = step_voxels
        up, towards = np.array(camera["up"]), np.subtract(camera["eye"], camera["target"])
        if np.linalg.norm(up[:2]) > 1e-9 * abs(up[2]) or up[2] <= 0:
            raise ValueError(f"vispy's turntable camera needs z upwards, and {camera['up']} is asked for")
        distance = float(np.linalg.norm(towards))
        self.camera.elevation = math.degrees(math.asin(towards[2] / distance))
        self.camera.azimuth = math.degrees(math.atan2(towards[1], towards[0])) + 90
        self.camera.center, self.camera.distance = tuple(camera["target"]), distance
        self.camera.view_changed()
        self.drawn = self.canvas.render(alpha=False)

    def picture(self):
        return self.drawn


class Optics(BaseColormap):
    """Colour and opacity of one step, as sums of ramps between the knots of the transfer function."""

    def __init__(self, scene, step_world):
        low, high = scene.value_range()
        at = (scene.values - low) / (high - low)
        color = ramps("vec3", at, scene.colors)
        extinction = ramps("float", at, scene.extinctions[:, None])
        self.glsl_map = f"vec4 optics(float t) {{ return vec4({color}, 1.0 - exp(-{step_world:.8e} * ({extinction}))); }}"
        self.of = lambda values: scene.optics(low + (high - low) * values)
        super().__init__()

    def map(self, item):
        extinction, color = self.of(np.asarray(item).ravel())
        return np.concatenate([color, -np.expm1(-extinction)[:, None]], 1).astype("f4")


def ramps(kind, at, numbers):
    """A piecewise linear function of t; pieces in a row of equal slope are one."""
    text = lambda number: f"{kind}({', '.join(f'{x:.8e}' for x in number)})"
    pieces = []
    for begin, end, first, last in zip(at, at[1:], numbers, numbers[1:]):
        slope = (last - first) / max(end - begin, 1e-7)
        if pieces and np.allclose(pieces[-1][2], slope, rtol=1e-6, atol=1e-9):
            pieces[-1][1] = end
        else:
            pieces.append([begin, end, slope])
    terms = [f"{text(slope)} * clamp(t - {begin:.8e}, 0.0, {max(end - begin, 1e-7):.8e})" for begin, end, slope in pieces if slope.any()]
    return " + ".join([text(numbers[0]), *terms])
