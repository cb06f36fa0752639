"""TIFF and PNG files by tifffile and Pillow, and what these read back.

Requires tifffile, imagecodecs, numpy and pillow.

`make(folder)` as in run.py. The voxels are those that tifffile or Pillow read, not those that were written.
"""

import os

import numpy as np
import tifffile
from PIL import Image

SHAPE = (9, 17, 21)
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def ramp(dtype, shape=SHAPE):
    """A different value in most voxels, negative ones where the type has them."""
    n = int(np.prod(shape))
    kind = np.dtype(dtype).kind
    if kind == "f":
        values = np.sin(np.arange(n) * 0.37) * 1e3
    else:
        info = np.iinfo(dtype)
        values = (np.arange(n, dtype=np.int64) * 7919) % (int(info.max) - int(info.min) + 1) + int(info.min)
    return values.reshape(shape).astype(dtype)


def luminance(rgb):
    """Rounded half away from zero, as integers of the luminance are."""
    exact = rgb[..., :3].astype(np.float64) @ LUMINANCE
    grey = (rgb[..., 0] == rgb[..., 1]) & (rgb[..., 1] == rgb[..., 2])
    if rgb.dtype.kind == "f":
        return np.where(grey, rgb[..., 0], exact).astype(rgb.dtype)
    return np.where(grey, rgb[..., 0], np.floor(exact + 0.5)).astype(rgb.dtype)


def plain(voxels, spacing=(1, 1, 1), unit=None, **select):
    expected = {"voxels": np.ascontiguousarray(voxels), "spacing": spacing, "unit": unit}
    if select:
        expected["select"] = {kind: str(entry) for kind, entry in select.items()}
    return expected


def make(folder):
    yield from layouts(folder)
    yield from compressions(folder)
    yield from colours(folder)
    yield from imagej(folder)
    yield from ome(folder)
    yield from folders(folder)


def layouts(folder):
    for dtype in ("u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8"):
        for order in "<>":
            name = f"layout-{dtype}-{'little' if order == '<' else 'big'}"
            path = os.path.join(folder, name + ".tif")
            tifffile.imwrite(path, ramp(dtype), byteorder=order, photometric="minisblack", metadata=None)
            yield name, path, plain(tifffile.imread(path))
    for dtype in ("i8", "u8", "f2"):
        for order in "<>":
            name = f"layout-{dtype}-{'little' if order == '<' else 'big'}"
            path = os.path.join(folder, name + ".tif")
            values = (ramp("i2") if dtype != "u8" else ramp("u2")).astype(dtype)
            tifffile.imwrite(path, values, byteorder=order, photometric="minisblack", metadata=None)
            yield name, path, plain(tifffile.imread(path))
    cases = {
        "bigtiff": dict(bigtiff=True),
        "strips-of-5-rows": dict(rowsperstrip=5),
        "tiles": dict(tile=(16, 16)),
        "tiles-lzw": dict(tile=(16, 16), compression="lzw"),
        "tiles-lzw-predictor": dict(tile=(16, 16), compression="lzw", predictor=2),
        "volume-tiles": dict(tile=(16, 16, 16), volumetric=True),
        "volume-tiles-flat": dict(tile=(4, 16, 16), volumetric=True, compression="zlib"),
        "miniswhite": dict(photometric="miniswhite"),
    }
    for name, settings in cases.items():
        path = os.path.join(folder, name + ".tif")
        tifffile.imwrite(path, ramp("u2"), **{"photometric": "minisblack", "metadata": None, **settings})
        yield name, path, plain(tifffile.imread(path).reshape(SHAPE))
    path = os.path.join(folder, "lzw-17.tif")
    tifffile.imwrite(path, ramp("u2", (17, 17)), tile=(16, 16), compression="lzw", photometric="minisblack")
    yield "lzw-17", path, plain(tifffile.imread(path)[None])
    path = os.path.join(folder, "bilevel.tif")
    tifffile.imwrite(path, ramp("u1") > 127, photometric="minisblack", metadata=None)
    yield "bilevel", path, plain(tifffile.imread(path).astype("u1"))
    path = os.path.join(folder, "twelve-bits.tif")
    tifffile.imwrite(path, ramp("u2") & 0xFFF, bitspersample=12, photometric="minisblack", metadata=None)
    yield "twelve-bits", path, plain(tifffile.imread(path))


def compressions(folder):
    for codec in ("lzw", "zlib", "adobe_deflate", "packbits", "zstd"):
        for dtype in ("u1", "u2", "i4", "f4", "f8"):
            predictors = [1] if codec == "packbits" else [1, 3] if dtype[0] == "f" else [1, 2]
            for predictor in predictors:
                name = f"{codec}-{dtype}-predictor-{predictor}"
                path = os.path.join(folder, name + ".tif")
                settings = dict(compression=codec, predictor=predictor, photometric="minisblack", metadata=None)
                tifffile.imwrite(path, ramp(dtype), byteorder=">" if dtype == "u2" else "<", **settings)
                yield name, path, plain(tifffile.imread(path))
    # Of blocks of one value each: decoders of JPEG may round others differently.
    blocks = np.kron(ramp("u1", (3, 6, 8)), np.ones((1, 8, 8), "u1"))
    for name, settings in {"jpeg": {}, "jpeg-tiles": dict(tile=(32, 32)), "jpeg-strips": dict(rowsperstrip=16)}.items():
        path = os.path.join(folder, name + ".tif")
        settings |= dict(compression="jpeg", compressionargs={"level": 100})
        tifffile.imwrite(path, blocks, photometric="minisblack", metadata=None, **settings)
        yield name, path, plain(tifffile.imread(path))
    path = os.path.join(folder, "jpeg-rgb.tif")
    settings = dict(compression="jpeg", compressionargs={"level": 100}, photometric="rgb", rowsperstrip=16)
    tifffile.imwrite(path, np.repeat(blocks[..., None], 3, -1), metadata=None, **settings)
    yield "jpeg-rgb", path, plain(luminance(tifffile.imread(path)))


def colours(folder):
    for dtype in ("u1", "u2", "f4"):
        for n in (3, 4):
            for planar in ("contig", "separate"):
                name = f"colours-{dtype}-{n}-{planar}"
                path = os.path.join(folder, name + ".tif")
                rgb = ramp(dtype, (3, 17, 21, n))
                stored = rgb if planar == "contig" else np.moveaxis(rgb, -1, 1)
                settings = dict(photometric="rgb", planarconfig=planar, metadata=None)
                tifffile.imwrite(path, stored, extrasamples=["unassalpha"] if n == 4 else None, **settings)
                read = np.stack([page.asarray() for page in tifffile.TiffFile(path).pages])
                read = read if planar == "contig" else np.moveaxis(read, 1, -1)
                yield name, path, plain(luminance(read))
                yield name + "-green", path, plain(read[..., 1], channel="green")
    rgb = ramp("u1", (3, 17, 21, 3))
    path = os.path.join(folder, "colours-lzw-tiles.tif")
    tifffile.imwrite(path, rgb, photometric="rgb", compression="lzw", predictor=2, tile=(16, 16), metadata=None)
    yield "colours-lzw-tiles", path, plain(luminance(tifffile.imread(path)))
    colormap = np.stack([np.arange(256) * 257, np.arange(256)[::-1] * 257, (np.arange(256) * 7 % 256) * 257]).astype("u2")
    path = os.path.join(folder, "palette.tif")
    tifffile.imwrite(path, ramp("u1", (17, 21)), photometric="palette", colormap=colormap, metadata=None)
    with tifffile.TiffFile(path) as file:
        index, colour = file.pages[0].asarray(), file.pages[0].asrgb()
    yield "palette", path, plain(luminance((colour >> 8).astype("u1"))[None])
    yield "palette-index", path, plain(index[None], channel="index")
    path = os.path.join(folder, "five-samples.tif")
    tifffile.imwrite(path, ramp("u2", (17, 21, 5)), photometric="minisblack", planarconfig="contig", metadata=None)
    yield "five-samples", path, plain(tifffile.imread(path)[None, ..., 3], channel="3")


def imagej(folder):
    path = os.path.join(folder, "imagej.tif")
    stack = ramp("u2", (2, 9, 3, 17, 21))
    metadata = {"spacing": 3.5, "unit": "um", "axes": "TZCYX"}
    tifffile.imwrite(path, stack, imagej=True, resolution=(4, 2), metadata=metadata)
    read = tifffile.imread(path)
    spacing = (0.25, 0.5, 3.5)
    yield "imagej", path, plain(read[0, :, 0], spacing, "um")
    yield "imagej-c2-t1", path, plain(read[1, :, 2], spacing, "um", channel=2, time=1)
    path = os.path.join(folder, "imagej-rgb.tif")
    tifffile.imwrite(path, ramp("u1", (5, 17, 21, 3)), imagej=True, metadata={"axes": "ZYXS"})
    yield "imagej-rgb", path, plain(luminance(tifffile.imread(path)))
    # One page and the other planes behind it, as ImageJ writes more than 4 GB.
    path = os.path.join(folder, "imagej-raw.tif")
    tifffile.imwrite(path, ramp("u2"), imagej=True, truncate=True, metadata={"axes": "ZYX"})
    yield "imagej-raw", path, plain(tifffile.imread(path))
    path = os.path.join(folder, "imagej-raw-channels.tif")
    tifffile.imwrite(path, ramp("u2", (9, 3, 17, 21)), imagej=True, truncate=True, metadata={"axes": "ZCYX"})
    yield "imagej-raw-channels", path, plain(tifffile.imread(path)[:, 1], channel=1)
    path = os.path.join(folder, "truncated.tif")
    tifffile.imwrite(path, ramp("f4"), photometric="minisblack", truncate=True)
    yield "truncated", path, plain(tifffile.imread(path))


def ome(folder):
    sizes = {"PhysicalSizeX": 0.25, "PhysicalSizeXUnit": "µm", "PhysicalSizeY": 250, "PhysicalSizeYUnit": "nm"}
    sizes |= {"PhysicalSizeZ": 1e-5, "PhysicalSizeZUnit": "dm"}
    spacing = (0.25, 0.25, 1.0)
    stack = ramp("u2", (2, 9, 3, 17, 21))
    path = os.path.join(folder, "hyper.ome.tif")
    names = {"Channel": {"Name": ["DAPI", "GFP", "RFP"]}}
    tifffile.imwrite(path, stack, metadata={"axes": "TZCYX", **sizes, **names}, photometric="minisblack")
    read = tifffile.imread(path)
    yield "ome", path, plain(read[0, :, 0], spacing, "µm")
    yield "ome-gfp-t1", path, plain(read[1, :, 1], spacing, "µm", channel="GFP", time=1)
    path = os.path.join(folder, "compressed.ome.tif")
    settings = dict(tile=(16, 16), compression="zlib", predictor=2, photometric="minisblack")
    tifffile.imwrite(path, np.moveaxis(stack, 2, 0), metadata={"axes": "CTZYX", **sizes}, **settings)
    yield "ome-compressed-c2", path, plain(tifffile.imread(path)[2, 1], spacing, "µm", channel=2, time=1)
    path = os.path.join(folder, "images.ome.tif")
    with tifffile.TiffWriter(path, ome=True) as file:
        file.write(ramp("u1"), metadata={"axes": "ZYX", "Name": "overview"}, photometric="minisblack")
        file.write(ramp("u2", (4, 8, 6)), metadata={"axes": "ZYX", "Name": "detail"}, photometric="minisblack")
    with tifffile.TiffFile(path) as file:
        overview, detail = (series.asarray() for series in file.series)
    yield "ome-overview", path, plain(overview)
    yield "ome-detail", path, plain(detail, image="detail")
    path = os.path.join(folder, "pyramid.ome.tif")
    full = ramp("u1", (3, 64, 32))
    with tifffile.TiffWriter(path, ome=True) as file:
        settings = dict(photometric="minisblack", tile=(16, 16))
        file.write(full, subifds=2, metadata={"axes": "ZYX", "PhysicalSizeX": 0.5, "PhysicalSizeY": 0.5}, **settings)
        for level in (2, 4):
            file.write(full[:, ::level, ::level], subfiletype=1, **settings)
    with tifffile.TiffFile(path) as file:
        levels = [level.asarray() for level in file.series[0].levels]
    yield "ome-pyramid", path, plain(levels[0], (0.5, 0.5, 1), "um")
    yield "ome-pyramid-2", path, plain(levels[2], (2, 2, 1), "um", level=2)
    path = os.path.join(folder, "rgb.ome.tif")
    tifffile.imwrite(path, ramp("u1", (3, 17, 21, 3)), photometric="rgb", metadata={"axes": "ZYXS"})
    yield "ome-rgb", path, plain(luminance(tifffile.imread(path)))
    yield from ome_of_files(folder)


def ome_of_files(folder):
    """An image whose planes lie in three files, in another order than their names."""
    inside = os.path.join(folder, "files")
    os.makedirs(inside, exist_ok=True)
    stack = ramp("u2", (6, 17, 21))
    data = "".join(
        f'<TiffData FirstZ="{z}" IFD="{1 - z % 2}" PlaneCount="1"><UUID FileName="f{2 - z // 2}.ome.tif">urn:uuid:{2 - z // 2}</UUID></TiffData>'
        for z in range(6)
    )
    head = '<?xml version="1.0" encoding="UTF-8"?><OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06" UUID="urn:uuid:{}">'
    pixels = '<Image ID="Image:0"><Pixels ID="Pixels:0" DimensionOrder="XYZCT" Type="uint16" SizeX="21" SizeY="17" SizeZ="6" SizeC="1" SizeT="1">'
    for i in range(3):
        planes = stack[[2 * (2 - i) + 1, 2 * (2 - i)]]
        description = head.format(i) + pixels + data + "</Pixels></Image></OME>"
        path = os.path.join(inside, f"f{i}.ome.tif")
        tifffile.imwrite(path, planes, description=description, metadata=None, photometric="minisblack")
    path = os.path.join(inside, "f1.ome.tif")
    yield "ome-files", path, plain(tifffile.imread(path))
    yield "ome-files-folder", inside, plain(tifffile.imread(path))


def folders(folder):
    pictures = {"L": ramp("u1", (12, 17, 21)), "I;16": ramp("u2", (12, 17, 21)), "RGB": ramp("u1", (12, 17, 21, 3))}
    for mode, stack in pictures.items():
        for extension in ("png", "tif"):
            name = f"folder-{extension}-{mode.replace(';', '')}"
            inside = os.path.join(folder, name)
            os.makedirs(inside, exist_ok=True)
            read = []
            for i, slice_ in enumerate(stack):
                path = os.path.join(inside, f"Slice{i + 1}.{extension}")
                Image.fromarray(slice_).save(path)
                read.append(np.asarray(Image.open(path)))
            with open(os.path.join(inside, "notes.txt"), "w") as file:
                file.write("no slice")
            read = np.stack(read)
            yield name, inside, plain(luminance(read) if mode == "RGB" else read)
    inside = os.path.join(folder, "folder-png-palette")
    os.makedirs(inside, exist_ok=True)
    read = []
    for i in range(3):
        path = os.path.join(inside, f"{i}.png")
        Image.fromarray(ramp("u1", (17, 21, 3)) ^ i).quantize(32).save(path)
        read.append(np.asarray(Image.open(path).convert("RGB")))
    yield "folder-png-palette", inside, plain(luminance(np.stack(read)))
