"""A store of `brickfield pack` by zarr-python: every level is the average of the voxels, and the summaries are those of the blocks.

    target/peers/bin/python tests/peers_formats/packed.py STORE [RAW]

Requires zarr 3 and numpy, and about 64 slices of memory. RAW: the voxels as they lie in a file without header, x fastest, to be compared with level 0.
Integers only. Status 1 if a value differs.
"""

import sys

import numpy as np
import zarr


def sums(slab, step):
    """Sums over cubes of `step` voxels; cubes at the upper ends are cut. And the voxels of each."""
    counts = np.ones(1)
    for axis, n in enumerate(slab.shape):
        starts = np.arange(0, n, step)
        slab = np.add.reduceat(slab, starts, axis=axis)
        counts = np.multiply.outer(counts, np.diff(np.append(starts, n))).reshape(counts.shape + (len(starts),))
    return slab, counts[0].astype(np.int64)


def report(what, n_different, n):
    print(f"{what}: {n_different} of {n} differ")
    return n_different


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    group = zarr.open_group(sys.argv[1], mode="r")
    levels = [group[entry["path"]] for entry in group.attrs["ome"]["multiscales"][0]["datasets"]]
    finest, n_different = levels[0], 0
    print(f"zarr {zarr.__version__}: {finest.shape} of {finest.dtype}, {len(levels)} levels")
    if len(sys.argv) == 3:
        raw = np.memmap(sys.argv[2], finest.dtype, "r", shape=finest.shape)
        different = sum(int((finest[z : z + 64] != raw[z : z + 64]).sum()) for z in range(0, finest.shape[0], 64))
        n_different += report("level 0", different, raw.size)
    for level, array in enumerate(levels[1:], 1):
        step, different, n = 2**level, 0, 0
        height = max(64, step)
        for z in range(0, finest.shape[0], height):
            total, counts = sums(finest[z : z + height].astype(np.int64), step)
            # The nearest integer; halves go away from 0.
            mean = np.sign(total) * ((2 * np.abs(total) + counts) // (2 * counts))
            stored = array[z // step : z // step + mean.shape[0]]
            different, n = different + int((stored != mean).sum()), n + mean.size
        n_different += report(f"level {level}", different, n)
    for side in (8, 16, 32):
        summaries, different, n = group[f"brickfield_blocks/{side}"], 0, 0
        for z in range(0, finest.shape[0], 64):
            slab = finest[z : z + 64]
            least, greatest = slab, slab
            for axis, length in enumerate(slab.shape):
                starts = np.arange(0, length, side)
                least = np.minimum.reduceat(least, starts, axis=axis)
                greatest = np.maximum.reduceat(greatest, starts, axis=axis)
            stored = summaries[z // side : z // side + least.shape[0]]
            different += int((stored[..., 0] != least).sum() + (stored[..., 1] != greatest).sum())
            n += 2 * least.size
        n_different += report(f"ranges of blocks of {side}", different, n)
    sys.exit(1 if n_different else 0)


if __name__ == "__main__":
    main()
