"""Files by independent software, read by independent software and by `brickfield`: dimensions, spacing, direction and all values
must be equal.

Requires Python 3.11 or later and the packages that the modules beside this one name (`dicom.py`, `stored.py`, `tiff.py`):

    python3 -m venv target/peers
    target/peers/bin/pip install numpy pydicom pylibjpeg pylibjpeg-openjpeg pyjpegls SimpleITK tifffile imagecodecs pillow \\
        nibabel pynrrd zarr vtk
    cargo build --bin brickfield
    target/peers/bin/python tests/peers_formats/run.py

`--only TEXT` takes the files whose name contains the text; `--keep FOLDER` keeps them there. Not a part of `cargo xtask ci`. Status 1
if a value differs, 2 if a module lacks a package.

Each module has `make(folder)`, which writes files and yields (name, path, expected); `expected` is a dict:
    voxels        array of shape (z, y, x): the values
    spacing       world units along x, y, z; may be missing
    direction     three unit vectors, of x, y and z; may be missing
    first_sample  the world position of the first sample; may be missing
    unit          the unit of world lengths; may be missing
    select        a dict from the kind of a choice to the entry that is wanted; may be missing
    options       further options of `brickfield`; may be missing
    refused       a part of the message, for a file that is to be refused; the other keys do not count then
"""

import argparse
import importlib
import json
import os
import subprocess
import sys
import tempfile

import numpy as np

MODULES = ["dicom", "tiff", "stored", "nrrd_nifti"]
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
NRRD_TYPES = {
    "uint8": "u1", "int8": "i1", "uint16": "<u2", "int16": "<i2", "uint32": "<u4", "int32": "<i4", "float": "<f4", "double": "<f8",
}


def brickfield(program, *arguments):
    return subprocess.run([program, *arguments], capture_output=True, text=True)


def read_nrrd(path):
    """The voxels of an attached raw NRRD, as `brickfield convert` writes it."""
    with open(path, "rb") as file:
        header, data = file.read().split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in header.decode().splitlines()[1:] if ": " in line)
    sizes = [int(n) for n in fields["sizes"].split()]
    return np.frombuffer(data, NRRD_TYPES[fields["type"]]).reshape(sizes[::-1])


def near(found, wanted, scale):
    return np.allclose(np.asarray(found, float), np.asarray(wanted, float), rtol=0, atol=1e-5 * scale)


def differences(program, path, expected, folder):
    """The statements of a file that differ; and its dimensions and type as brickfield has them."""
    options = [word for kind, entry in expected.get("select", {}).items() for word in (f"--{kind}", str(entry))]
    options += expected.get("options", [])
    said = brickfield(program, "info", path, "--json", *options)
    if "refused" in expected:
        is_told = said.returncode == 1 and expected["refused"] in said.stderr
        return ([] if is_told else [f"refusal: {said.stderr.strip() or 'none'}"]), "refused"
    if said.returncode != 0:
        return [said.stderr.strip()], ""
    info = json.loads(said.stdout)
    voxels = np.asarray(expected["voxels"])
    shown = " x ".join(map(str, info["dimensions"])) + " " + info["type"]
    if tuple(info["dimensions"]) != voxels.shape[::-1]:
        return [f"dimensions: {voxels.shape[::-1]}"], shown
    found = []
    spacing = np.asarray(expected.get("spacing", info["spacing"]), float)
    if not near(info["spacing"], spacing, spacing.min()):
        found.append(f"spacing: {info['spacing']}, not {spacing.tolist()}")
    if not near(info["directions"], expected.get("direction", info["directions"]), 1):
        found.append(f"direction: {info['directions']}, not {np.asarray(expected['direction']).tolist()}")
    if not near(info["first_sample"], expected.get("first_sample", info["first_sample"]), max(1.0, spacing.max())):
        found.append(f"first sample: {info['first_sample']}, not {list(expected['first_sample'])}")
    if expected.get("unit") is not None and info["unit"] != expected["unit"]:
        found.append(f"unit: {info['unit']}, not {expected['unit']}")
    copy = os.path.join(folder, "copy.nrrd")
    said = brickfield(program, "convert", path, "-o", copy, "--unpacked", *options)
    if said.returncode != 0:
        return found + [said.stderr.strip()], shown
    n_unlike = int(np.count_nonzero(read_nrrd(copy).astype(float) != voxels.astype(float)))
    if n_unlike:
        found.append(f"{n_unlike} of {voxels.size} values")
    return found, shown


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--program", default=os.path.join(ROOT, "target", "debug", "brickfield"), help="the brickfield command")
    parser.add_argument("--only", default="", help="only files whose name contains this")
    parser.add_argument("--keep", help="a folder for the files")
    arguments = parser.parse_args()
    sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
    n_files = n_unlike = n_absent = 0
    with tempfile.TemporaryDirectory() as scratch:
        for module in MODULES:
            folder = os.path.join(arguments.keep or scratch, module)
            os.makedirs(folder, exist_ok=True)
            try:
                files = list(importlib.import_module(module).make(folder))
            except ImportError as lacking:
                print(f"{module:8} {lacking}")
                n_absent += 1
                continue
            for name, path, expected in files:
                if arguments.only not in name:
                    continue
                unlike, shown = differences(arguments.program, path, expected, scratch)
                n_files, n_unlike = n_files + 1, n_unlike + bool(unlike)
                print(f"{module:8} {name:44} {shown:24} {'equal' if not unlike else 'UNLIKE ' + '; '.join(unlike)}")
    print(f"{n_files} files, {n_files - n_unlike} equal, {n_unlike} unlike" + (f"; modules left out: {n_absent}" if n_absent else ""))
    return 1 if n_unlike or n_files == 0 else 2 if n_absent else 0


if __name__ == "__main__":
    sys.exit(main())
