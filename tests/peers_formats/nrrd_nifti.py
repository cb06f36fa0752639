"""NRRD, MetaImage, NIfTI and MGH files by pynrrd, SimpleITK and nibabel, and what one of them, but not the writer, reads back.

Requires numpy, pynrrd, SimpleITK and nibabel.

`make(folder)` as in run.py. Where only the writer can read a file, the voxels are those that were written.
"""

import os

import nibabel
import nrrd
import numpy as np
import SimpleITK as sitk

SHAPE = (9, 11, 13)
SPACING = (0.75, 1.5, 2.5)
ORIGIN = (4.0, -7.0, 9.0)
DIRECTION = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def ramp(dtype, shape=SHAPE):
    """A different value in most voxels, negative ones where the type has them; of wide integers within 2^53."""
    n = int(np.prod(shape))
    if np.dtype(dtype).kind == "f":
        values = np.sin(np.arange(n) * 0.37) * 1e3
    else:
        info = np.iinfo(dtype)
        low, high = max(int(info.min), -(1 << 53)), min(int(info.max), 1 << 53)
        values = np.array([low + i * 7919 * 104729 % (high - low + 1) for i in range(n)], dtype=object)
    return values.reshape(shape).astype(dtype)


def luminance(rgb):
    """Rounded half away from zero, as integers of the luminance are."""
    exact = rgb[..., :3].astype(np.float64) @ LUMINANCE
    grey = (rgb[..., 0] == rgb[..., 1]) & (rgb[..., 1] == rgb[..., 2])
    return np.where(grey, rgb[..., 0], np.floor(exact + 0.5)).astype(rgb.dtype)


def selected(expected, **entries):
    return {**expected, "select": {kind: str(entry) for kind, entry in entries.items()}} if entries else expected


def placed(image, voxels, **entries):
    """The place of an image as SimpleITK has it."""
    matrix = np.reshape(image.GetDirection(), (image.GetDimension(),) * 2)[:3, :3]
    expected = {"voxels": voxels, "spacing": image.GetSpacing()[:3], "direction": matrix.T, "first_sample": image.GetOrigin()[:3]}
    return selected(expected, **entries)


def of_affine(image, voxels, **entries):
    """The place of an image as nibabel has it, brought to left-posterior-superior."""
    affine = np.diag([-1.0, -1.0, 1.0, 1.0]) @ image.affine
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    expected = {"voxels": voxels, "spacing": spacing, "direction": (affine[:3, :3] / spacing).T, "first_sample": affine[:3, 3]}
    return selected(expected, **entries)


def itk_image(array, is_vector=False):
    image = sitk.GetImageFromArray(array, isVector=is_vector)
    if image.GetDimension() == 3:
        image.SetSpacing(SPACING)
        image.SetOrigin(ORIGIN)
        image.SetDirection(DIRECTION.ravel())
    return image


def make(folder):
    yield from by_itk(folder)
    yield from colours_by_itk(folder)
    yield from by_pynrrd(folder)
    yield from by_nibabel(folder)
    yield from by_nibabel_with_axes(folder)


def by_itk(folder):
    for dtype in ("u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8"):
        for end, packed in (("nrrd", False), ("nrrd", True), ("mha", False), ("mha", True), ("mhd", False), ("nii", False), ("nii.gz", True)):
            name = f"itk-{dtype}{'-packed' if packed else ''}.{end}"
            path = os.path.join(folder, name)
            sitk.WriteImage(itk_image(ramp(dtype)), path, packed)
            if end == "nrrd":
                voxels = nrrd.read(path)[0].T
            elif end.startswith("nii"):
                voxels = np.asanyarray(nibabel.load(path).dataobj).T
            else:
                voxels = ramp(dtype)
            yield name, path, placed(sitk.ReadImage(path), voxels)
    pair = os.path.join(folder, "itk-pair.hdr")
    sitk.WriteImage(itk_image(ramp("i2")), pair)
    yield "itk-pair.img", pair.replace(".hdr", ".img"), placed(sitk.ReadImage(pair), ramp("i2"))


def colours_by_itk(folder):
    for n in (3, 4):
        array = ramp("u1", (*SHAPE, n))
        for end in ("nrrd", "mha", "nii"):
            name = f"itk-colours-{n}.{end}"
            path = os.path.join(folder, name)
            sitk.WriteImage(itk_image(array, True), path)
            back = sitk.ReadImage(path)
            voxels = sitk.GetArrayFromImage(back)
            yield name, path, placed(back, voxels[..., n - 1], channel=n - 1)
            if end == "mha":
                yield f"{name}, luminance", path, placed(back, luminance(voxels))
    for end in ("nrrd", "mha", "nii"):
        name = f"itk-vectors.{end}"
        path = os.path.join(folder, name)
        sitk.WriteImage(itk_image(ramp("f4", (*SHAPE, 3)), True), path)
        back = sitk.ReadImage(path)
        yield name, path, placed(back, sitk.GetArrayFromImage(back)[..., 1], channel=1)
    series = ramp("i2", (4, *SHAPE))
    for end in ("nrrd", "mha", "nii"):
        name = f"itk-series.{end}"
        path = os.path.join(folder, name)
        sitk.WriteImage(sitk.GetImageFromArray(series, isVector=False), path)
        back = sitk.ReadImage(path)
        yield name, path, placed(back, sitk.GetArrayFromImage(back)[2], time=2)


def by_pynrrd(folder):
    space = {"space": "left-posterior-superior", "space origin": ORIGIN}
    steps = DIRECTION.T * np.array(SPACING)[:, None]
    none = [np.nan] * 3
    for dtype in ("i8", "u8", ">i2", "f4"):
        for encoding in ("raw", "gzip", "ascii"):
            name = f"pynrrd-{dtype.replace('>', 'big-')}-{encoding}.nrrd"
            path = os.path.join(folder, name)
            array = ramp(dtype) if encoding != "ascii" or dtype != "f4" else ramp("i2").astype("f4")
            nrrd.write(path, array.T, {**space, "space directions": steps, "encoding": encoding})
            yield name, path, placed(sitk.ReadImage(path), array)
    kinds = ["domain"] * 3
    lists = (
        ("list-first", (*SHAPE, 5), ["list", *kinds], [none, *steps], lambda a: a[..., 3], {"channel": 3}),
        ("vector-first", (*SHAPE, 3), ["vector", *kinds], [none, *steps], lambda a: a[..., 2], {"channel": 2}),
        ("rgb-first", (*SHAPE, 3), ["RGB-color", *kinds], [none, *steps], luminance, {}),
        ("list-last", (4, *SHAPE), [*kinds, "list"], [*steps, none], lambda a: a[3], {"time": 3}),
        ("time-last", (4, *SHAPE), [*kinds, "time"], [*steps, none], lambda a: a[1], {"time": 1}),
    )
    for kind, shape, axes, directions, part, entries in lists:
        for encoding in ("raw", "gzip"):
            name = f"pynrrd-{kind}-{encoding}.nrrd"
            path = os.path.join(folder, name)
            array = ramp("u1", shape)
            nrrd.write(path, array.T, {**space, "space directions": np.array(directions), "kinds": axes, "encoding": encoding})
            expected = {"voxels": part(array), "spacing": SPACING, "direction": DIRECTION.T, "first_sample": ORIGIN}
            yield name, path, selected(expected, **entries)


def nibabel_affine():
    affine = np.eye(4)
    affine[:3, :3] = DIRECTION * np.array(SPACING)
    affine[:3, 3] = ORIGIN
    return affine


def by_nibabel(folder):
    kinds = (
        ("nifti-1", nibabel.Nifti1Image, "nii.gz", "u1 i1 u2 i2 u4 i4 u8 i8 f4 f8"),
        ("nifti-2", nibabel.Nifti2Image, "nii", "u1 i1 u2 i2 u4 i4 u8 i8 f4 f8"),
        ("pair-1", nibabel.Nifti1Pair, "img", "i2 f4"),
        ("pair-2", nibabel.Nifti2Pair, "img.gz", "i2 f4"),
        ("mgh", nibabel.MGHImage, "mgh", "u1 i2 i4 f4"),
        ("mgz", nibabel.MGHImage, "mgz", "u1 i2 i4 f4"),
    )
    for kind, image_type, end, dtypes in kinds:
        for dtype in dtypes.split():
            for order in "<>" if kind.startswith("nifti") else "=":
                name = f"nibabel-{kind}-{dtype}{'-big' if order == '>' else ''}.{end}"
                path = os.path.join(folder, name)
                header = image_type.header_class(endianness=order) if order != "=" else None
                data = ramp(dtype).T
                image = image_type(data, nibabel_affine(), header=header, **({} if kind.startswith("mg") else {"dtype": data.dtype}))
                nibabel.save(image, path)
                voxels = ramp(dtype)
                if kind == "nifti-1" and order == "<" and dtype not in ("u8", "i8"):
                    voxels = sitk.GetArrayFromImage(sitk.ReadImage(path))
                yield name, path, of_affine(nibabel.load(path), voxels)


def by_nibabel_with_axes(folder):
    affine = nibabel_affine()
    series = ramp("i2", (4, *SHAPE))
    for name, image_type in (
        ("series-1.nii.gz", nibabel.Nifti1Image), ("series-2.nii", nibabel.Nifti2Image), ("series.mgz", nibabel.MGHImage),
    ):
        path = os.path.join(folder, "nibabel-" + name)
        nibabel.save(image_type(series.T, affine), path)
        yield "nibabel-" + name, path, of_affine(nibabel.load(path), series[3], time=3)
    path = os.path.join(folder, "nibabel-vectors.nii")
    vectors = ramp("f4", (3, 1, *SHAPE))
    nibabel.save(nibabel.Nifti1Image(vectors.T, affine), path)
    yield "nibabel-vectors.nii", path, of_affine(nibabel.load(path), vectors[2, 0], channel=2)
    for n, names in ((3, "RGB"), (4, "RGBA")):
        colours = ramp("u1", (*SHAPE, n))
        stored = np.ascontiguousarray(colours).view([(letter, "u1") for letter in names]).reshape(SHAPE)
        for version, image_type in ((1, nibabel.Nifti1Image), (2, nibabel.Nifti2Image)):
            name = f"nibabel-{names.lower()}-{version}.nii"
            path = os.path.join(folder, name)
            nibabel.save(image_type(stored.T, affine), path)
            yield name, path, of_affine(nibabel.load(path), luminance(colours))
    path = os.path.join(folder, "nibabel-scaled.nii")
    scaled = nibabel.Nifti1Image(ramp("i2").T, affine)
    scaled.header.set_slope_inter(0.5, -3.0)
    nibabel.save(scaled, path)
    yield "nibabel-scaled.nii", path, of_affine(nibabel.load(path), np.asanyarray(nibabel.load(path).dataobj).T)
