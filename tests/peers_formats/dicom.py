"""DICOM files by pydicom, and what pydicom, SimpleITK and nibabel find in them.

Requires pydicom >= 3.0, numpy >= 2.0, pyjpegls >= 1.5 (JPEG-LS), pylibjpeg-openjpeg >= 2.4 (JPEG 2000), SimpleITK >= 2.4 and
nibabel >= 5.3.

`make(folder)` as in run.py. The voxels are those that were written, and of lossy files those that pydicom reads. Where a second
reader knows the kind it is asked too: SimpleITK for a series or a file, nibabel for mosaics.
"""

import warnings
from functools import partial
from pathlib import Path

import numpy as np
import pydicom
import SimpleITK as sitk
from pydicom.dataset import Dataset, FileDataset, FileMetaDataset
from pydicom.encaps import encapsulate
from pydicom.sequence import Sequence
from pydicom import uid

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    import nibabel.nicom.dicomwrappers as nibabel_dicom

SHAPE = (5, 40, 37)
SPACING = (0.5, 0.75, 2.5)
FIRST = (-10.0, 20.0, 30.0)
AXIAL = np.eye(3)
CT = uid.CTImageStorage
# Turned about x by 30 degrees, then about z by 20.
_C, _S, _c, _s = np.cos(np.pi / 9), np.sin(np.pi / 9), np.cos(np.pi / 6), np.sin(np.pi / 6)
OBLIQUE = np.array([[_C, -_S, 0], [_S, _C, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, _c, -_s], [0, _s, _c]])


def ramp(dtype, shape=SHAPE, low=0, high=None):
    high = np.iinfo(dtype).max if high is None else high
    rng = np.random.default_rng(7)
    smooth = np.add.outer(np.add.outer(np.arange(shape[0]) * 3, np.arange(shape[1]) * 5), np.arange(shape[2]) * 2)
    smooth = smooth.reshape(smooth.shape + (1,) * (len(shape) - 3))
    values = low + smooth * (high - low) // 300 + rng.integers(0, max((high - low) // 50, 2), shape)
    return np.clip(values, low, high).astype(dtype)


def expected(voxels, spacing=SPACING, first=FIRST, direction=AXIAL, tolerance=0, itk="series", **select):
    """The columns of `direction` are the directions of x, y and z."""
    case = {"voxels": voxels, "spacing": spacing, "first_sample": first, "direction": direction.T, "tolerance": tolerance,
            "select": select}
    if itk is not None:
        case["second_reader"] = partial(second_reader, kind=itk, case=case)
    return case


def base(sop_class=CT, syntax=uid.ExplicitVRLittleEndian):
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID = sop_class
    meta.MediaStorageSOPInstanceUID = uid.generate_uid()
    meta.TransferSyntaxUID = syntax
    ds = FileDataset(None, {}, file_meta=meta, preamble=b"\0" * 128)
    ds.set_original_encoding(syntax.is_implicit_VR, syntax.is_little_endian)
    ds.SOPClassUID, ds.SOPInstanceUID = sop_class, meta.MediaStorageSOPInstanceUID
    ds.PatientID, ds.Modality, ds.StudyInstanceUID = "none", "CT", uid.generate_uid()
    ds.SeriesInstanceUID = "1.2.826.0.1.3680043.8.498.1"
    return ds


def set_pixels(ds, values, bits=None, photometric="MONOCHROME2"):
    n = values.dtype.itemsize * 8
    ds.Rows, ds.Columns = values.shape[-2:] if photometric != "RGB" else values.shape[-3:-1]
    ds.SamplesPerPixel, ds.PhotometricInterpretation = (1, photometric) if photometric != "RGB" else (3, "RGB")
    if photometric == "RGB":
        ds.PlanarConfiguration = 0
    ds.BitsAllocated, ds.BitsStored = n, bits or n
    ds.HighBit, ds.PixelRepresentation = ds.BitsStored - 1, int(values.dtype.kind == "i")
    order = "<" if ds.file_meta.TransferSyntaxUID.is_little_endian else ">"
    data = values.astype(values.dtype.newbyteorder(order)).tobytes()
    ds.PixelData = data + b"\0" * (len(data) % 2)
    ds["PixelData"].VR = "OB" if n == 8 and not ds.file_meta.TransferSyntaxUID.is_implicit_VR else "OW"


def place(ds, k, direction=AXIAL):
    position = np.array(FIRST) + direction[:, 2] * SPACING[2] * k
    ds.ImagePositionPatient = [f"{v:.8g}" for v in position]
    ds.ImageOrientationPatient = [f"{v:.10f}"[:16] for v in [*direction[:, 0], *direction[:, 1]]]
    ds.PixelSpacing = [SPACING[1], SPACING[0]]
    ds.SliceThickness = SPACING[2]
    ds.InstanceNumber = k + 1


def write(ds, path, **options):
    path.parent.mkdir(parents=True, exist_ok=True)
    ds.save_as(path, enforce_file_format=options.pop("enforce", True), **options)


def series(folder, values, syntax=uid.ExplicitVRLittleEndian, direction=AXIAL, edit=None, compress=None, bits=None,
           **options):
    """One file per slice; `edit(ds, k)` changes it before it is written."""
    for k in reversed(range(len(values))):
        plain = uid.ExplicitVRLittleEndian if compress else syntax
        ds = base(syntax=plain)
        set_pixels(ds, values[k], bits)
        place(ds, k, direction)
        if edit:
            edit(ds, k)
        if compress:
            ds.compress(compress, **options)
            write(ds, folder / f"im{k}.dcm")
        else:
            write(ds, folder / f"im{k}.dcm", **options)
    return folder


def item(**elements):
    ds = Dataset()
    for name, value in elements.items():
        setattr(ds, name, value)
    return ds


def functional_groups(ds, positions, per_frame=lambda i: {}, direction=AXIAL):
    shared = item(
        PixelMeasuresSequence=Sequence([item(PixelSpacing=[SPACING[1], SPACING[0]], SliceThickness=1.0)]),
        PlaneOrientationSequence=Sequence([item(ImageOrientationPatient=[f"{v:.10f}"[:16] for v in
                                                [*direction[:, 0], *direction[:, 1]]])]),
        PixelValueTransformationSequence=Sequence([item(RescaleSlope=2, RescaleIntercept=-1000, RescaleType="HU")]),
    )
    ds.SharedFunctionalGroupsSequence = Sequence([shared])
    frames = []
    for i, position in enumerate(positions):
        frame = item(PlanePositionSequence=Sequence([item(ImagePositionPatient=[f"{v:.8g}" for v in position])]))
        for name, value in per_frame(i).items():
            setattr(frame, name, value)
        frames.append(frame)
    ds.PerFrameFunctionalGroupsSequence = Sequence(frames)
    ds.NumberOfFrames = len(positions)


def at(k, direction=AXIAL):
    return np.array(FIRST) + direction[:, 2] * SPACING[2] * k


def make(folder):
    folder = Path(folder)
    i16, u16, u8 = ramp(np.int16, low=-1000, high=3000), ramp(np.uint16), ramp(np.uint8)

    plain = {"explicit": uid.ExplicitVRLittleEndian, "implicit": uid.ImplicitVRLittleEndian,
             "big endian": uid.ExplicitVRBigEndian, "deflated": uid.DeflatedExplicitVRLittleEndian}
    for name, syntax in plain.items():
        for values in (i16, u8, ramp(np.uint32, high=3_000_000_000)):
            if name == "big endian" and values.dtype == np.uint8:
                continue
            case = f"{name} {values.dtype}"
            # GDCM swaps 32-bit samples as words of 16 bits.
            itk = None if case == "big endian uint32" else "series"
            yield case, series(folder / case, values, syntax), expected(values, itk=itk)
    yield "oblique", series(folder / "oblique", i16, direction=OBLIQUE), expected(i16, direction=OBLIQUE)
    yield from packed(folder)
    yield from bare(folder)
    yield from mixed(folder)
    yield from multi_frame(folder)
    yield from colours(folder)
    yield from mosaics(folder)


def packed(folder):
    u12 = ramp(np.uint16, high=4095)
    kinds = [("u8", ramp(np.uint8), None), ("u12", u12, 12), ("u16", ramp(np.uint16), None),
             ("i16", ramp(np.int16, low=-2000, high=3000), None)]
    for name, values, bits in kinds:
        for codec, syntax in [("rle", uid.RLELossless), ("jpeg-ls", uid.JPEGLSLossless),
                              ("jpeg 2000", uid.JPEG2000Lossless)]:
            case = f"{codec} {name}"
            yield case, series(folder / case, values, compress=syntax, bits=bits), expected(values)
    flat = np.where(ramp(np.uint16) > 40_000, 1000, 7).astype(np.uint16)
    yield "jpeg-ls runs", series(folder / "jpeg-ls runs", flat, compress=uid.JPEGLSLossless), expected(flat)
    near = series(folder / "jpeg-ls near", u12, compress=uid.JPEGLSNearLossless, bits=12, jls_error=3)
    yield "jpeg-ls near", near, expected(u12, tolerance=3)
    big = ramp(np.uint16, (2, 200, 300))
    yield "jpeg-ls large", series(folder / "jpeg-ls large", big, compress=uid.JPEGLSLossless), expected(big)
    yield "jpeg 2000 large", series(folder / "jpeg 2000 large", big, compress=uid.JPEG2000Lossless), expected(big)
    lossy = series(folder / "jpeg 2000 lossy", big, compress=uid.JPEG2000, j2k_cr=[4])
    found = np.stack([pydicom.dcmread(lossy / f"im{k}.dcm").pixel_array for k in range(len(big))])
    yield "jpeg 2000 lossy", lossy, expected(found, tolerance=2)


def bare(folder):
    values = ramp(np.int16, low=-1000, high=3000)
    for name, syntax in [("explicit", uid.ExplicitVRLittleEndian), ("implicit", uid.ImplicitVRLittleEndian),
                         ("big endian", uid.ExplicitVRBigEndian)]:
        case = f"bare {name}"
        for k in range(len(values)):
            ds = base(syntax=syntax)
            set_pixels(ds, values[k])
            place(ds, k)
            ds.file_meta, ds.preamble = FileMetaDataset(), None
            path = folder / case / f"im{k}"
            path.parent.mkdir(parents=True, exist_ok=True)
            ds.save_as(path, enforce_file_format=False, implicit_vr=name == "implicit",
                       little_endian=name != "big endian")
        yield case, folder / case, expected(values, itk=None)
    case = folder / "no preamble"
    for k in range(len(values)):
        ds = base()
        set_pixels(ds, values[k])
        place(ds, k)
        ds.preamble = None
        path = case / f"im{k}"
        path.parent.mkdir(parents=True, exist_ok=True)
        ds.save_as(path, enforce_file_format=False)
        content = path.read_bytes()
        path.write_bytes(content.removeprefix(b"\0" * 128).removeprefix(b"DICM"))
    yield "no preamble", case, expected(values, itk=None)


def mixed(folder):
    """Slices that differ in sign or in rescale."""
    values = ramp(np.int16, low=0, high=2000)
    case = folder / "signed and unsigned"
    for k in range(len(values)):
        ds = base()
        set_pixels(ds, values[k].astype(np.uint16) if k % 2 else values[k] - 500, 12 if k % 2 else None)
        place(ds, k)
        write(ds, case / f"im{k}.dcm")
    mixed_values = np.stack([v if k % 2 else v - 500 for k, v in enumerate(values)])
    yield "signed and unsigned", case, expected(mixed_values, itk=None)

    def rescale(ds, k):
        ds.RescaleSlope, ds.RescaleIntercept = k + 1, -10 * k
    case = folder / "rescales"
    rescaled = np.stack([v.astype(np.int32) * (k + 1) - 10 * k for k, v in enumerate(values)])
    yield "rescales", series(case, values, edit=rescale), expected(rescaled, itk=None)


def multi_frame(folder):
    values = ramp(np.uint16, high=4000)
    n = len(values)

    def enhanced(case, order, positions, per_frame=lambda i: {}, direction=AXIAL, edit=None, compress=None):
        ds = base(uid.EnhancedCTImageStorage)
        set_pixels(ds, values[order])
        functional_groups(ds, positions, per_frame, direction)
        if edit:
            edit(ds)
        if compress:
            ds.compress(compress)
        path = folder / f"{case}.dcm"
        write(ds, path)
        return path
    backwards = list(reversed(range(n)))
    rescaled = values.astype(np.int32) * 2 - 1000
    positions = [at(k, OBLIQUE) for k in backwards]
    path = enhanced("enhanced", backwards, positions, direction=OBLIQUE)
    yield "enhanced", path, expected(rescaled, direction=OBLIQUE, itk="file")
    for name, syntax in [("rle", uid.RLELossless), ("jpeg-ls", uid.JPEGLSLossless), ("jpeg 2000", uid.JPEG2000Lossless)]:
        path = enhanced(f"enhanced {name}", backwards, positions, direction=OBLIQUE, compress=syntax)
        yield f"enhanced {name}", path, expected(rescaled, direction=OBLIQUE, itk=None)

    def own_rescale(i):
        return {"PixelValueTransformationSequence": Sequence([item(RescaleSlope=i + 1, RescaleIntercept=7)])}
    path = enhanced("enhanced own rescale", list(range(n)), [at(k) for k in range(n)], own_rescale)
    own = np.stack([v.astype(np.int32) * (k + 1) + 7 for k, v in enumerate(values)])
    yield "enhanced own rescale", path, expected(own, itk=None)

    # Two times at three positions, time running fastest.
    def content(i):
        return {"FrameContentSequence": Sequence([item(StackID="1", InStackPositionNumber=i // 2 + 1,
                                                       TemporalPositionIndex=i % 2 + 1,
                                                       DimensionIndexValues=[i // 2 + 1, i % 2 + 1])])}

    def dimensions(ds):
        ds.DimensionIndexSequence = Sequence([item(DimensionIndexPointer=0x00209057),
                                              item(DimensionIndexPointer=0x00209128)])
    order = [0, 1, 2, 3, 4, 0]
    path = enhanced("enhanced times", order, [at(i // 2) for i in range(6)], content, edit=dimensions)
    yield "enhanced times", path, expected(rescaled[[0, 2, 4]], itk=None)
    yield "enhanced second time", path, expected(rescaled[[1, 3, 0]], itk=None, time="1")

    ds = base(uid.RTDoseStorage)
    ds.Modality = "RTDOSE"
    dose = ramp(np.uint32, high=2_000_000)
    set_pixels(ds, dose)
    place(ds, 0)
    ds.NumberOfFrames, ds.FrameIncrementPointer = len(dose), 0x3004000C
    ds.GridFrameOffsetVector = [SPACING[2] * k for k in range(len(dose))]
    ds.DoseGridScaling = 0.001
    write(ds, folder / "dose.dcm")
    # SimpleITK gives the stored integers of a dose.
    yield "dose", folder / "dose.dcm", expected(dose * 0.001, tolerance=1e-9, itk=None)

    ds = base(uid.MultiFrameGrayscaleWordSecondaryCaptureImageStorage)
    set_pixels(ds, values)
    place(ds, 0)
    ds.SliceThickness, ds.SpacingBetweenSlices, ds.NumberOfFrames = 9, SPACING[2], n
    write(ds, folder / "simple.dcm")
    yield "simple", folder / "simple.dcm", expected(values, itk=None)

    # Two times in files of their own.
    case = folder / "times in files"
    for time in range(2):
        for k in range(n):
            ds = base()
            set_pixels(ds, values[k] + np.uint16(5000 * time))
            place(ds, k)
            ds.InstanceNumber, ds.TemporalPositionIdentifier = 100 - (time * n + k), time + 1
            write(ds, case / f"{time}-{k}.dcm")
    yield "times in files", case, expected(values, itk=None)
    yield "second time in files", case, expected(values + np.uint16(5000), itk=None, time="1")

    ds = base(uid.SegmentationStorage)
    masks = ramp(np.uint8) > 100
    ds.Rows, ds.Columns, ds.SamplesPerPixel, ds.PhotometricInterpretation = *masks.shape[1:], 1, "MONOCHROME2"
    ds.BitsAllocated = ds.BitsStored = 1
    ds.HighBit = ds.PixelRepresentation = 0
    flags = np.concatenate([masks, ~masks])
    data = np.packbits(flags.ravel(), bitorder="little").tobytes()
    ds.PixelData = data + b"\0" * (len(data) % 2)
    ds["PixelData"].VR = "OB"
    functional_groups(ds, [at(k) for k in [*range(n), *range(n)]],
                      lambda i: {"SegmentIdentificationSequence": Sequence([item(ReferencedSegmentNumber=i // n + 1)])})
    del ds.SharedFunctionalGroupsSequence[0].PixelValueTransformationSequence
    write(ds, folder / "segments.dcm")
    yield "segments", folder / "segments.dcm", expected(masks.astype(np.uint8), itk=None)
    yield "second segment", folder / "segments.dcm", expected((~masks).astype(np.uint8), itk=None, array="2")

    ds = base(uid.ParametricMapStorage)
    floats = ramp(np.uint16).astype(np.float32) / 7
    set_pixels(ds, ramp(np.uint16))
    del ds.PixelData, ds.PixelRepresentation, ds.BitsStored, ds.HighBit
    ds.BitsAllocated, ds.FloatPixelData = 32, floats.tobytes()
    functional_groups(ds, [at(k) for k in range(n)])
    del ds.SharedFunctionalGroupsSequence[0].PixelValueTransformationSequence
    write(ds, folder / "floats.dcm")
    yield "floats", folder / "floats.dcm", expected(floats, itk=None)


def luminance(rgb):
    grey = (rgb == rgb[..., :1]).all(axis=-1)
    mixed_value = np.floor(rgb @ np.array([0.2126, 0.7152, 0.0722]) + 0.5)
    return np.where(grey, rgb[..., 0], mixed_value)


def colours(folder):
    rgb = ramp(np.uint8, (*SHAPE, 3))

    def frames(case, store, compress=None):
        for k, frame in enumerate(rgb):
            ds = base(uid.SecondaryCaptureImageStorage)
            set_pixels(ds, frame, photometric="RGB")
            place(ds, k)
            store(ds, frame)
            if compress:
                ds.compress(compress)
            write(ds, folder / case / f"im{k}.dcm")
        return folder / case
    path = frames("rgb", lambda ds, frame: None)
    yield "rgb", path, expected(luminance(rgb), itk=None)
    for i, name in enumerate(["red", "green", "blue"]):
        yield f"rgb {name}", path, expected(rgb[..., i], itk=None, channel=name)

    def separate(ds, frame):
        ds.PlanarConfiguration = 1
        data = np.moveaxis(frame, -1, 0).tobytes()
        ds.PixelData = data + b"\0" * (len(data) % 2)
    yield "rgb planes", frames("rgb planes", separate), expected(luminance(rgb), itk=None)
    for name, syntax in [("rle", uid.RLELossless), ("jpeg-ls", uid.JPEGLSLossless), ("jpeg 2000", uid.JPEG2000Lossless)]:
        yield f"rgb {name}", frames(f"rgb {name}", lambda ds, frame: None, syntax), expected(luminance(rgb), itk=None)

    from pydicom.pixels import convert_color_space

    def ybr(ds, frame):
        ds.PhotometricInterpretation = "YBR_FULL"
        data = convert_color_space(frame, "RGB", "YBR_FULL").tobytes()
        ds.PixelData = data + b"\0" * (len(data) % 2)
    path = frames("ybr", ybr)
    back = np.stack([convert_color_space(convert_color_space(f, "RGB", "YBR_FULL"), "YBR_FULL", "RGB") for f in rgb])
    yield "ybr", path, expected(luminance(back), tolerance=1, itk=None)

    index = ramp(np.uint8, high=199)
    table = np.random.default_rng(3).integers(0, 65535, (200, 3)).astype(np.uint16)
    for k, frame in enumerate(index):
        ds = base(uid.SecondaryCaptureImageStorage)
        set_pixels(ds, frame, photometric="PALETTE COLOR")
        place(ds, k)
        for i, name in enumerate(["Red", "Green", "Blue"]):
            setattr(ds, f"{name}PaletteColorLookupTableDescriptor", [200, 0, 16])
            setattr(ds, f"{name}PaletteColorLookupTableData", table[:, i].tobytes())
        write(ds, folder / "palette" / f"im{k}.dcm")
    yield "palette", folder / "palette", expected(luminance(table[index].astype(np.uint16)), itk=None)


def csa_header(normal, n_slices):
    """A Siemens CSA header of version 2."""
    def tag(name, values):
        out = name.encode().ljust(64, b"\0")
        vr = {str: b"SH\0\0", int: b"US\0\0"}.get(type(values[0]), b"FD\0\0")
        out += np.array([len(values)], "<i4").tobytes() + vr + np.array([0, 6, 77], "<i4").tobytes()
        for i in range(6):
            text = (f"{values[i]:.8f}" if isinstance(values[i], float) else str(values[i])) if i < len(values) else ""
            text = text.encode()
            text += b"\0" * (-len(text) % 4)
            out += np.array([len(text), len(text), 77, len(text)], "<i4").tobytes() + text
        return out
    tags = [tag("EchoLinePosition", [32]), tag("AcquisitionMatrixText", ["40p*37"]), tag("NumberOfImagesInMosaic", [n_slices]), tag("SliceNormalVector", normal)]
    return b"SV10\4\3\2\1" + np.array([len(tags), 77], "<i4").tobytes() + b"".join(tags)


def mosaics(folder):
    n, (rows, columns) = SHAPE[0], SHAPE[1:]
    values = ramp(np.uint16, high=4000)
    side = int(np.ceil(np.sqrt(n)))
    for name, sign in [("mosaic", 1), ("mosaic backwards", -1)]:
        frame = np.zeros((side * rows, side * columns), np.uint16)
        for k in range(n):
            y, x = k // side * rows, k % side * columns
            frame[y:y + rows, x:x + columns] = values[k]
        ds = base(uid.MRImageStorage)
        set_pixels(ds, frame)
        place(ds, 0, OBLIQUE)
        # The stated position is that of a slice of the mosaic's size around the same centre.
        first = at(0, OBLIQUE)
        corner = first - OBLIQUE[:, 0] * SPACING[0] * (side - 1) * columns / 2
        corner = corner - OBLIQUE[:, 1] * SPACING[1] * (side - 1) * rows / 2
        ds.ImagePositionPatient = [f"{v:.10f}"[:16] for v in corner]
        ds.ImageType = ["ORIGINAL", "PRIMARY", "M", "ND", "MOSAIC"]
        ds.SpacingBetweenSlices = SPACING[2]
        ds.add_new(0x00290010, "LO", "SIEMENS CSA HEADER")
        ds.add_new(0x00291010, "OB", csa_header(sign * OBLIQUE[:, 2], n))
        write(ds, folder / f"{name}.dcm")
        ordered = values if sign == 1 else values[::-1]
        start = first if sign == 1 else first - OBLIQUE[:, 2] * SPACING[2] * (n - 1)
        yield name, folder / f"{name}.dcm", expected(ordered, first=tuple(start), direction=OBLIQUE, itk="nibabel")


def read_by_itk(path, kind):
    """Voxels z, y, x, the affine matrix."""
    if kind == "series":
        reader = sitk.ImageSeriesReader()
        reader.SetFileNames(reader.GetGDCMSeriesFileNames(str(path)))
        image = reader.Execute()
    else:
        image = sitk.ReadImage(str(path))
    affine = np.eye(4)
    affine[:3, :3] = np.array(image.GetDirection()).reshape(3, 3) * image.GetSpacing()
    affine[:3, 3] = image.GetOrigin()
    return sitk.GetArrayFromImage(image).astype(float), affine


def read_by_nibabel(path):
    image = nibabel_dicom.wrapper_from_file(str(path))
    # Its axes are rows, columns, slices.
    affine = image.affine[:, [1, 0, 2, 3]]
    return np.moveaxis(np.asarray(image.get_data(), float), [0, 1, 2], [1, 2, 0]), affine


def second_reader(path, kind, case):
    """The parts that a second reader finds otherwise; slices against the normal are turned first."""
    voxels, affine = read_by_nibabel(path) if kind == "nibabel" else read_by_itk(path, kind)
    direction = case["direction"].T
    if np.linalg.det(affine) < 0 or affine[:3, 2] @ direction[:, 2] < 0:
        affine[:3, 3] += affine[:3, 2] * (len(voxels) - 1)
        affine[:3, 2] *= -1
        voxels = voxels[::-1]
    same = {
        "dimensions": voxels.shape == case["voxels"].shape,
        "position": np.allclose(affine[:3, 3], case["first_sample"], atol=1e-4),
        "steps": np.allclose(affine[:3, :3], direction * case["spacing"], atol=1e-5),
        "values": voxels.shape == case["voxels"].shape
        and np.allclose(voxels, case["voxels"], rtol=1e-6, atol=case["tolerance"]),
    }
    return [part for part, is_same in same.items() if not is_same]
