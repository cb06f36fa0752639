"""Sizes and speeds of standard codecs of pictures, slice by slice, on one core.

Arguments: a file of samples (little-endian, x fastest), their numbers along x, y, z, and a type of numpy. Prints JSON: for each codec the
bytes of each slice, and millions of bytes a second. Needs numpy and imagecodecs.
"""

import json
import os
import sys
import time

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[variable] = "1"

import imagecodecs
import numpy

CODECS = {
    "HTJ2K": (
        lambda s: imagecodecs.htj2k_encode(s, reversible=True),
        imagecodecs.htj2k_decode,
    ),
    "JPEG-LS": (imagecodecs.jpegls_encode, imagecodecs.jpegls_decode),
    "JPEG XL e3": (
        lambda s: imagecodecs.jpegxl_encode(s, lossless=True, effort=3, numthreads=1),
        lambda b: imagecodecs.jpegxl_decode(b, numthreads=1),
    ),
}


def main():
    path, nx, ny, nz, kind = sys.argv[1:6]
    volume = numpy.fromfile(path, dtype=kind).reshape(int(nz), int(ny), int(nx))
    if volume.dtype.kind == "i":
        # Codecs of pictures have numbers from 0 on.
        unsigned = numpy.dtype(f"u{volume.dtype.itemsize}")
        volume = volume.view(unsigned) ^ unsigned.type(1 << (8 * volume.dtype.itemsize - 1))
    wanted = sys.argv[6:] or list(CODECS)
    found = {}
    for name in wanted:
        encode, decode = CODECS[name]
        begin = time.process_time()
        slices = [bytes(encode(numpy.ascontiguousarray(s))) for s in volume]
        encoded = time.process_time()
        back = [numpy.asarray(decode(s)).reshape(volume.shape[1:]) for s in slices]
        decoded = time.process_time()
        if not all(numpy.array_equal(a, b) for a, b in zip(back, volume)):
            raise SystemExit(f"{name} does not return its slices")
        found[name] = {
            "n_bytes": [len(s) for s in slices],
            "encode_mb_s": volume.nbytes / 1e6 / (encoded - begin),
            "decode_mb_s": volume.nbytes / 1e6 / (decoded - encoded),
        }
    json.dump(found, sys.stdout)


main()
