"""Zarr by zarr-python, and VTK images by VTK.

Requires zarr 3, numcodecs, numpy and vtk.

`make(folder)` as in run.py. The voxels are those that were written, of text those that VTK reads back; HDF5 and NetCDF are a few bytes by hand.
"""

import os

import numpy as np
import vtk
import zarr
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

SHAPE = (9, 17, 21)
EXTENT = (2, 22, -3, 13, 0, 8)
ORIGIN = (10.0, -4.0, 3.0)
SPACING = (0.5, 0.75, 2.0)
FLIPPED = (0, 1, 0, 1, 0, 0, 0, 0, -1)


def ramp(dtype, shape=SHAPE):
    """A different value in most voxels, negative ones where the type has them; 64-bit integers need 32 bits."""
    n = int(np.prod(shape))
    dtype = np.dtype(dtype)
    if dtype.kind == "b":
        values = np.arange(n) % 3 == 0
    elif dtype.kind == "f":
        values = np.sin(np.arange(n) * 0.37) * 1e3
    else:
        info = np.iinfo(dtype if dtype.itemsize < 8 else dtype.kind + "4")
        values = (np.arange(n, dtype=np.int64) * 7919) % (int(info.max) - int(info.min) + 1) + int(info.min)
    return values.reshape(shape).astype(dtype)


def expect(voxels, spacing=(1, 1, 1), first_sample=None, unit=None, **select):
    expected = {"voxels": np.ascontiguousarray(voxels), "spacing": spacing, "unit": unit}
    if first_sample is not None:
        expected["first_sample"] = first_sample
    if select:
        expected["select"] = {kind: str(entry) for kind, entry in select.items()}
    return expected


def make(folder):
    yield from zarr_arrays(folder)
    yield from zarr_packing(folder)
    yield from zarr_groups(folder)
    yield from zarr_images(folder)
    yield from vti(folder)
    yield from vti_arrays(folder)
    yield from vti_pieces(folder)
    yield from legacy(folder)
    yield from refusals(folder)


def saved(folder, name, voxels, **how):
    path = os.path.join(folder, name + ".zarr")
    array = zarr.create_array(path, shape=voxels.shape, dtype=voxels.dtype, overwrite=True, **how)
    array[...] = voxels
    return path


def zarr_arrays(folder):
    for zarr_format in (2, 3):
        for dtype in ("u1", "i1", "<u2", ">u2", "<i2", "<u4", ">i4", "<f4", ">f8", "?", "<f2", ">i8", "<u8"):
            name = f"array-v{zarr_format}-{dtype.translate(str.maketrans('<>?', 'lbB'))}"
            voxels = ramp(dtype)
            path = saved(folder, name, voxels, zarr_format=zarr_format, chunks=(4, 8, 10))
            yield name, path, expect(voxels, first_sample=(0.5, 0.5, 0.5))
        for order in "CF":
            if zarr_format == 2:
                voxels = ramp("<i2")
                name = f"array-v2-order-{order}"
                path = saved(folder, name, voxels, zarr_format=2, chunks=(4, 8, 10), order=order)
                yield name, path, expect(voxels)
        name = f"array-v{zarr_format}-flat"
        yield name, saved(folder, name, ramp("u2", (17, 21)), zarr_format=zarr_format), expect(ramp("u2", (1, 17, 21)))
    voxels = ramp("u2", (2, 3) + SHAPE)
    names = ("time", "channel", "depth", "row", "column")
    path = saved(folder, "array-v3-5d", voxels, zarr_format=3, chunks=(1, 2, 4, 8, 10), dimension_names=names)
    yield "array-v3-5d", path, expect(voxels[1, 2], time=1, channel=2)
    path = saved(folder, "array-v2-5d", voxels, zarr_format=2, chunks=(2, 2, 4, 8, 10))
    zarr.open(path).attrs["_ARRAY_DIMENSIONS"] = list(names)
    yield "array-v2-5d", path, expect(voxels[1, 2], time=1, channel=2)


def zarr_packing(folder):
    from zarr.codecs import BloscCodec, Crc32cCodec, GzipCodec, ShardingCodec, TransposeCodec, ZstdCodec
    import numcodecs

    voxels = ramp("<i2")
    packers = {
        "gzip": [GzipCodec()],
        "zstd": [ZstdCodec(level=3)],
        "zstd-sum": [ZstdCodec(level=3, checksum=True)],
        "zstd-crc32c": [ZstdCodec(), Crc32cCodec()],
        "crc32c": [Crc32cCodec()],
    }
    for cname in ("lz4", "zstd", "zlib", "blosclz", "lz4hc"):
        for shuffle in ("noshuffle", "shuffle", "bitshuffle"):
            packers[f"blosc-{cname}-{shuffle}"] = [BloscCodec(cname=cname, shuffle=shuffle, typesize=2)]
    for packer, compressors in packers.items():
        name = f"packed-v3-{packer}"
        yield name, saved(folder, name, voxels, chunks=(4, 8, 10), compressors=compressors), expect(voxels)
        name = f"shards-v3-{packer}"
        path = saved(folder, name, voxels, chunks=(2, 4, 5), shards=(4, 8, 10), compressors=compressors)
        yield name, path, expect(voxels)
    path = saved(folder, "shards-v3-transposed", voxels, chunks=(2, 4, 5), shards=(4, 8, 10), filters=[TransposeCodec(order=(2, 0, 1))])
    yield "shards-v3-transposed", path, expect(voxels)
    for packer, compressor in {
        "gzip": numcodecs.GZip(),
        "zlib": numcodecs.Zlib(),
        "zstd": numcodecs.Zstd(),
        "blosc": numcodecs.Blosc(cname="lz4", shuffle=1),
        "blosc-bits": numcodecs.Blosc(cname="zstd", shuffle=2),
    }.items():
        name = f"packed-v2-{packer}"
        yield name, saved(folder, name, voxels, zarr_format=2, chunks=(4, 8, 10), compressors=compressor), expect(voxels)
    path = saved(folder, "packed-v2-lz4", voxels, zarr_format=2, chunks=(4, 8, 10), compressors=numcodecs.LZ4())
    yield "packed-v2-lz4", path, {"refused": 'compressor "lz4" is not supported'}


def zarr_groups(folder):
    for zarr_format in (2, 3):
        path = os.path.join(folder, f"group-v{zarr_format}.zarr")
        group = zarr.open_group(path, mode="w", zarr_format=zarr_format)
        group["lat"] = np.arange(17.0)
        inner = group.create_group("fields")
        inner["heat"] = ramp("f4")
        inner["salt"] = ramp("i2")
        yield f"group-v{zarr_format}", path, expect(ramp("f4"))
        yield f"group-v{zarr_format}-named", path, expect(ramp("i2"), array="fields/salt")


def axes(names):
    kinds = {"t": "time", "c": "channel"}
    units = {"z": "nanometer", "y": "micrometer", "x": "micrometer"}
    return [{"name": n, "type": kinds.get(n, "space")} | ({"unit": units[n]} if n in units else {}) for n in names]


def write_image(group, name, levels, names="tczyx"):
    """The levels with z in nanometers, and the metadata of an image about them."""
    datasets = []
    for i, level in enumerate(levels):
        group[str(i)] = level
        scale = [{"z": 2000.0, "y": 0.75, "x": 0.5}.get(n, 1.0) * (2**i if n in "zyx" else 1) for n in names]
        shift = [{"z": 500.0, "y": -4.0, "x": 10.0}.get(n, 0.0) + i for n in names]
        steps = [{"type": "scale", "scale": scale}, {"type": "translation", "translation": shift}]
        datasets.append({"path": str(i), "coordinateTransformations": steps})
    multiscale = {"name": name, "axes": axes(names), "datasets": datasets}
    omero = {"channels": [{"label": label, "color": "FFFFFF"} for label in ("DAPI", "GFP", "RFP")]}
    if group.metadata.zarr_format == 3:
        group.attrs["ome"] = {"version": "0.5", "multiscales": [multiscale], "omero": omero}
    else:
        group.attrs["multiscales"] = [multiscale | {"version": "0.4"}]
        group.attrs["omero"] = omero


def zarr_images(folder):
    first = ramp("u2", (2, 3) + SHAPE)
    second = first[:, :, ::2, ::2, ::2]
    placed = {"spacing": (0.5, 0.75, 2.0), "first_sample": (10.0, -4.0, 0.5), "unit": "micrometer"}
    coarse = {"spacing": (1.0, 1.5, 4.0), "first_sample": (11.0, -3.0, 0.501), "unit": "micrometer"}
    for zarr_format in (2, 3):
        name = f"ome-v{zarr_format}"
        path = os.path.join(folder, name + ".zarr")
        write_image(zarr.open_group(path, mode="w", zarr_format=zarr_format), "brain", [first, second])
        yield name, path, expect(first[0, 0], **placed)
        yield name + "-channel", path, expect(first[1, 2], **placed, time=1, channel="RFP")
        yield name + "-level", path, expect(second[1, 1], **coarse, time=1, channel="GFP", level=1)
        name = f"series-v{zarr_format}"
        path = os.path.join(folder, name + ".zarr")
        group = zarr.open_group(path, mode="w", zarr_format=zarr_format)
        layout = {"bioformats2raw.layout": 3}
        group.attrs.update({"ome": layout | {"version": "0.5"}} if zarr_format == 3 else layout)
        write_image(group.create_group("0"), "a", [first])
        write_image(group.create_group("1"), "b", [first[:, ::-1]])
        yield name, path, expect(first[0, 0], **placed)
        yield name + "-second", path, expect(first[0, 2], **placed, image="b")


def image_of(arrays, cells=(), extent=EXTENT, direction=None):
    """A VTK image with arrays as (name, values of shape (z, y, x) or (z, y, x, components))."""
    image = vtk.vtkImageData()
    image.SetExtent(*extent)
    image.SetOrigin(*ORIGIN)
    image.SetSpacing(*SPACING)
    if direction:
        image.SetDirectionMatrix(*direction)
    for data, named in ((image.GetPointData(), arrays), (image.GetCellData(), cells)):
        for name, values in named:
            flat = values.reshape(-1, values.shape[3]) if values.ndim == 4 else values.reshape(-1)
            array = numpy_to_vtk(np.ascontiguousarray(flat), deep=True)
            array.SetName(name)
            data.AddArray(array)
    return image


def vtk_written(writer, image, path, **settings):
    writer.SetInputData(image)
    writer.SetFileName(path)
    for setting, value in settings.items():
        getattr(writer, setting)(*value)
    writer.Write()
    return path


FIRST = tuple(o + s * e for o, s, e in zip(ORIGIN, SPACING, EXTENT[::2]))


def vti(folder):
    modes = ("Ascii", "Binary", "Appended")
    for compressor in ("None", "ZLib", "LZ4", "LZMA"):
        for mode in modes:
            for bits in (32, 64):
                for raw in (True, False) if mode == "Appended" else (False,):
                    for order in ("Little", "Big"):
                        name = f"vti-{compressor}-{mode}-{bits}{'-raw' if raw else ''}-{order}".lower()
                        path = os.path.join(folder, name + ".vti")
                        settings = {
                            f"SetCompressorTypeTo{compressor}": (),
                            f"SetDataModeTo{mode}": (),
                            f"SetHeaderTypeToUInt{bits}": (),
                            f"SetByteOrderTo{order}Endian": (),
                            "SetEncodeAppendedData": (not raw,),
                            "SetBlockSize": (1024,),
                        }
                        image = image_of([("a", ramp("i2"))])
                        vtk_written(vtk.vtkXMLImageDataWriter(), image, path, **settings)
                        yield name, path, expect(ramp("i2"), SPACING, FIRST)
    for dtype in ("u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8", "i8", "u8"):
        path = os.path.join(folder, f"vti-{dtype}.vti")
        vtk_written(vtk.vtkXMLImageDataWriter(), image_of([("a", ramp(dtype))]), path)
        yield f"vti-{dtype}", path, expect(ramp(dtype), SPACING, FIRST)


def many():
    cells = tuple(n - 1 for n in SHAPE)
    arrays = [("a", ramp("i2")), ("rgb colours", ramp("u1", SHAPE + (3,))), ("v", ramp("f4", SHAPE + (3,))), ("l", ramp("i8"))]
    image = image_of(arrays, [("inside", ramp("f8", cells))])
    bits = vtk.vtkBitArray()
    bits.SetName("b")
    for value in ramp("?").reshape(-1):
        bits.InsertNextValue(int(value))
    image.GetPointData().AddArray(bits)
    image.GetPointData().SetActiveScalars("l")
    return image, dict(arrays), ramp("f8", cells)


def vti_arrays(folder):
    image, arrays, cells = many()
    for mode in ("Ascii", "Binary", "Appended"):
        name = f"vti-many-{mode.lower()}"
        path = os.path.join(folder, name + ".vti")
        vtk_written(vtk.vtkXMLImageDataWriter(), image, path, **{f"SetDataModeTo{mode}": ()})
        yield name, path, expect(arrays["l"], SPACING, FIRST)
        yield name + "-bits", path, expect(ramp("?"), SPACING, FIRST, array="b")
        yield name + "-vector", path, expect(arrays["v"][..., 1], SPACING, FIRST, array="v", channel=1)
        yield name + "-blue", path, expect(arrays["rgb colours"][..., 2], SPACING, FIRST, array="rgb colours", channel="blue")
        middle = tuple(f + s / 2 for f, s in zip(FIRST, SPACING))
        yield name + "-cells", path, expect(cells, SPACING, middle, array="inside")
    path = os.path.join(folder, "vti-direction.vti")
    vtk_written(vtk.vtkXMLImageDataWriter(), image_of([("a", ramp("i2"))], direction=FLIPPED), path)
    columns = np.reshape(FLIPPED, (3, 3)).T
    first = np.array(ORIGIN) + sum(columns[i] * SPACING[i] * EXTENT[2 * i] for i in range(3))
    yield "vti-direction", path, expect(ramp("i2"), SPACING, first) | {"direction": columns}


def vti_pieces(folder):
    """Pieces by a source that makes only what is asked for: VTK writes each with an extent of its own."""
    for n_pieces in (1, 4, 7):
        source = vtk.vtkRTAnalyticSource()
        source.SetWholeExtent(*EXTENT)
        source.Update()
        values = vtk_to_numpy(source.GetOutput().GetPointData().GetScalars()).reshape(SHAPE)
        for mode in ("Ascii", "Appended"):
            name = f"pieces-{n_pieces}-{mode.lower()}"
            path = os.path.join(folder, name + ".vti")
            writer = vtk.vtkXMLImageDataWriter()
            writer.SetInputConnection(source.GetOutputPort())
            writer.SetFileName(path)
            writer.SetNumberOfPieces(n_pieces)
            getattr(writer, f"SetDataModeTo{mode}")()
            writer.Write()
            yield name, path, expect(values)
        for ghosts in (0, 1):
            name = f"pvti-{n_pieces}-ghosts-{ghosts}"
            path = os.path.join(folder, name + ".pvti")
            writer = vtk.vtkXMLPImageDataWriter()
            writer.SetInputConnection(source.GetOutputPort())
            writer.SetFileName(path)
            writer.SetNumberOfPieces(n_pieces)
            writer.SetStartPiece(0)
            writer.SetEndPiece(n_pieces - 1)
            writer.SetGhostLevel(ghosts)
            writer.Write()
            yield name, path, expect(values)
    lacking = os.path.join(folder, "pvti-missing.pvti")
    with open(path) as whole, open(lacking, "w") as file:
        file.write(whole.read().replace("ghosts-1_3", "ghosts-1_elsewhere"))
    yield "pvti-missing", lacking, {"refused": "pvti-7-ghosts-1_elsewhere.vti"}


def read_back(path, name, is_of_cells=False):
    """An array as VTK reads it: text has fewer digits than the numbers that were written."""
    reader = vtk.vtkStructuredPointsReader()
    reader.SetFileName(path)
    reader.ReadAllScalarsOn()
    reader.ReadAllVectorsOn()
    reader.ReadAllFieldsOn()
    reader.Update()
    image = reader.GetOutput()
    data = image.GetCellData() if is_of_cells else image.GetPointData()
    values = vtk_to_numpy(data.GetArray(name))
    shape = [max(1, n - is_of_cells) for n in image.GetDimensions()[::-1]]
    return values.reshape(shape + list(values.shape[1:]))


def legacy(folder):
    for dtype in ("u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8", "i8", "u8"):
        for text in (True, False):
            name = f"legacy-{dtype}-{'ascii' if text else 'binary'}"
            path = os.path.join(folder, name + ".vtk")
            image = image_of([("a", ramp(dtype))], extent=(0, 20, 0, 16, 0, 8))
            image.GetPointData().SetActiveScalars("a")
            settings = {"SetFileTypeToASCII" if text else "SetFileTypeToBinary": ()}
            vtk_written(vtk.vtkStructuredPointsWriter(), image, path, **settings)
            yield name, path, expect(read_back(path, "a"), SPACING, ORIGIN)
    image, arrays, _ = many()
    image.SetExtent(0, 20, 0, 16, 0, 8)
    for version in (42, 51):
        for text in (True, False):
            name = f"legacy-many-{version}-{'ascii' if text else 'binary'}"
            path = os.path.join(folder, name + ".vtk")
            settings = {"SetFileTypeToASCII" if text else "SetFileTypeToBinary": (), "SetFileVersion": (version,)}
            vtk_written(vtk.vtkStructuredPointsWriter(), image, path, **settings)
            yield name, path, expect(arrays["l"], SPACING, ORIGIN)
            yield name + "-short", path, expect(arrays["a"], SPACING, ORIGIN, array="a")
            yield name + "-bits", path, expect(ramp("?"), SPACING, ORIGIN, array="b")
            yield name + "-vector", path, expect(read_back(path, "v")[..., 1], SPACING, ORIGIN, array="v", channel=1)
            yield name + "-blue", path, expect(arrays["rgb colours"][..., 2], SPACING, ORIGIN, array="rgb colours", channel="blue")
            middle = tuple(o + s / 2 for o, s in zip(ORIGIN, SPACING))
            yield name + "-cells", path, expect(read_back(path, "inside", True), SPACING, middle, array="inside")
    grid = vtk.vtkRectilinearGrid()
    path = vtk_written(vtk.vtkRectilinearGridWriter(), grid, os.path.join(folder, "legacy-rectilinear.vtk"))
    yield "legacy-rectilinear", path, {"refused": 'DATASET "RECTILINEAR_GRID" is not supported'}


def refusals(folder):
    hdf5 = b"\x89HDF\r\n\x1a\n" + bytes(100)
    for name, data, refused in (
        ("hdf5.h5", hdf5, 'format "HDF5" is not supported'),
        ("hdf5.mnc", hdf5, 'format "MINC 2 (HDF5)" is not supported'),
        ("user-block.mat", bytes(512) + hdf5, 'format "HDF5" is not supported'),
        ("netcdf.mnc", b"CDF\x01" + bytes(100), 'format "MINC 1 (NetCDF)" is not supported'),
    ):
        path = os.path.join(folder, name)
        with open(path, "wb") as file:
            file.write(data)
        yield name, path, {"refused": refused}
