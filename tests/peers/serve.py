"""Serves frames of another renderer: one line of JSON in, one line of JSON out, until the input ends.

    {"ask": "open", "contestant": "vtk-fixed", "scene": {...}}                  -> {"answer": "opened", ...}
    {"ask": "frame", "step_voxels": 0.5, "camera": {"eye", "target", "up"}}     -> {"answer": "frame", "wall_ms", "cpu_ms", "parts": []}
    {"ask": "picture", "frame": {as of "frame"}, "path": "FILE"}                -> the same, and FILE holds the picture
    anything that fails                                                         -> {"answer": "failed", "reason": "..."}

A picture is rows from the top, RGBA, f32, little-endian, linear, over black. A peer's module has `Peer(contestant, scene, phases)` with
`info`, `draw(step_voxels, camera)`, which ends when the picture is complete, and `picture()`. What it prints goes to standard error.
"""

import importlib
import json
import os
import sys
import time
from contextlib import contextmanager

MODULES = {"vtk-fixed": "vtk_peer", "vtk-gpu": "vtk_peer", "pygfx": "pygfx_peer", "vispy": "vispy_peer"}


class Clock:
    """Wall time and the CPU time of all threads of this process, in milliseconds."""

    def __init__(self):
        self.wall, self.cpu = time.perf_counter_ns(), time.process_time_ns()

    def taken(self):
        return {"wall_ms": (time.perf_counter_ns() - self.wall) * 1e-6, "cpu_ms": (time.process_time_ns() - self.cpu) * 1e-6}


class Phases(list):
    """What is done once, in its order."""

    @contextmanager
    def phase(self, name):
        clock = Clock()
        yield
        self.append({"name": name, **clock.taken()})


def opened(ask):
    from scene import Scene

    phases = Phases()
    with phases.phase("import"):
        module = importlib.import_module(MODULES[ask["contestant"]])
    peer = module.Peer(ask["contestant"], Scene(ask["scene"]), phases)
    return peer, {"answer": "opened", **peer.info, "phases": phases}


def frame(peer, ask):
    clock = Clock()
    peer.draw(ask["step_voxels"], ask["camera"])
    return {"answer": "frame", **clock.taken(), "parts": []}


def picture(peer, ask):
    import numpy as np

    drawn = frame(peer, ask["frame"])
    picture = np.asarray(peer.picture())
    if picture.dtype == np.uint8:
        picture = picture / 255
    rgba = np.ones((*picture.shape[:2], 4), "<f4")
    rgba[..., :3] = picture[..., :3]
    rgba.tofile(ask["path"])
    return drawn


def main():
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    peer = None
    for line in sys.stdin:
        ask = json.loads(line)
        try:
            if ask["ask"] == "open":
                peer, answer = opened(ask)
            else:
                answer = {"frame": frame, "picture": picture}[ask["ask"]](peer, ask)
        except Exception as e:
            answer = {"answer": "failed", "reason": f"{type(e).__name__}: {e}"}
        print(json.dumps(answer), file=answers, flush=True)


main()
