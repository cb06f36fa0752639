"""What a peer is asked to draw."""

from types import SimpleNamespace

import numpy as np

# Opacities and colours between two knots of a transfer function, for peers that interpolate opacities.
SUBDIVISIONS = 16


class Scene(SimpleNamespace):
    """`path`: an NRRD file whose voxels begin at byte `offset`, x fastest; sample (0, 0, 0) lies at the world's origin.
    `dims`, `spacing`: x, y, z. `dtype`: numpy's name. `size`: the picture's side in pixels. `fov_degrees`: of its height.
    `knots`: value, extinction per world unit, linear colour; linear between them, constant beyond."""

    def __init__(self, fields):
        super().__init__(**fields)
        self.values = np.array([k["value"] for k in self.knots])
        # Two knots at one value are a jump: a very steep piece.
        self.values += 1e-6 * np.ptp(self.values) * (np.diff(self.values, prepend=-np.inf) == 0)
        self.extinctions = np.array([k["extinction"] for k in self.knots])
        self.colors = np.array([k["color"] for k in self.knots])

    @property
    def least_spacing(self):
        return min(self.spacing)

    def voxels(self):
        """Shape z, y, x."""
        return np.fromfile(self.path, self.dtype, offset=self.offset).reshape(self.dims[::-1])

    def value_range(self):
        """The first and the last knot: optics are constant beyond."""
        return float(self.values[0]), float(self.values[-1])

    def optics(self, values):
        """Extinction and colour."""
        color = np.stack([np.interp(values, self.values, self.colors[:, c]) for c in range(3)], -1)
        return np.interp(values, self.values, self.extinctions), color

    def opacity_points(self, length):
        """Values, and opacities of a length in world units, close enough for lines between them."""
        parts = [np.linspace(a, b, SUBDIVISIONS, endpoint=False) for a, b in zip(self.values, self.values[1:])]
        values = np.concatenate([*parts, self.values[-1:]])
        return values, -np.expm1(-self.optics(values)[0] * length)
