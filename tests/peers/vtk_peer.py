"""VTK: `vtkFixedPointVolumeRayCastMapper` on the processor, `vtkGPUVolumeRayCastMapper` through OpenGL."""

import vtk
from vtk.util import numpy_support


class Peer:
    def __init__(self, contestant, scene, phases):
        self.scene = scene
        with phases.phase("read"):
            reader = vtk.vtkNrrdReader()
            reader.SetFileName(scene.path)
            reader.Update()
            image = reader.GetOutput()
        if list(image.GetDimensions()) != scene.dims:
            raise ValueError(f"{scene.path}: vtkNrrdReader found {image.GetDimensions()} voxels, not {scene.dims}")
        if image.GetScalarType() == vtk.VTK_CHAR:
            image = signed(image)
        image.SetOrigin(0, 0, 0)
        image.SetSpacing(*scene.spacing)
        with phases.phase("device"):
            self.window, view = window(scene)
        with phases.phase("scene"):
            fixed = contestant == "vtk-fixed"
            self.mapper = fixed_mapper() if fixed else gpu_mapper()
            self.complaints = complaints(self.mapper)
            self.mapper.SetInputData(image)
            view.AddViewProp(volume(scene, self.mapper))
            self.camera = view.GetActiveCamera()
            self.camera.SetViewAngle(scene.fov_degrees)
        version = vtk.vtkVersion.GetVTKVersion()
        device = f"{self.mapper.GetNumberOfThreads()} threads" if fixed else renderer(self.window)
        # Both end the volume at the outer sample centres. The pixels of the fixed-point mapper's picture lie on a grid of size - 1.
        view = (scene.size - 1) / scene.size if fixed else 1.0
        self.info = {"version": f"VTK {version}", "device": device, "domain": "centres", "view": view}

    def draw(self, step_voxels, camera):
        step = step_voxels * self.scene.least_spacing
        self.mapper.SetSampleDistance(step)
        if hasattr(self.mapper, "SetInteractiveSampleDistance"):
            self.mapper.SetInteractiveSampleDistance(step)
        self.camera.SetPosition(*camera["eye"])
        self.camera.SetFocalPoint(*camera["target"])
        self.camera.SetViewUp(*camera["up"])
        distance, extent = self.camera.GetDistance(), max(n * s for n, s in zip(self.scene.dims, self.scene.spacing))
        self.camera.SetClippingRange(1e-3 * distance, distance + 4 * extent)
        self.window.Render()
        self.window.WaitForCompletion()
        if self.complaints:
            raise RuntimeError(self.complaints[0])

    def picture(self):
        grab = vtk.vtkWindowToImageFilter()
        grab.SetInput(self.window)
        grab.ReadFrontBufferOff()
        grab.ShouldRerenderOff()
        grab.SetInputBufferTypeToRGB()
        grab.Update()
        image = grab.GetOutput()
        width, height, _ = image.GetDimensions()
        return numpy_support.vtk_to_numpy(image.GetPointData().GetScalars()).reshape(height, width, 3)[::-1]


def signed(image):
    """`char` may be signed or not; the mappers refuse it, and NRRD's `int8` is read as that."""
    cast = vtk.vtkImageCast()
    cast.SetInputData(image)
    cast.SetOutputScalarType(vtk.VTK_SIGNED_CHAR)
    cast.Update()
    return cast.GetOutput()


def complaints(mapper):
    """A list that receives what a mapper complains of: it goes on with a picture that shows nothing."""
    heard = []

    def hear(_, __, text):
        heard.append(text.strip())

    hear.CallDataType = "string0"
    mapper.AddObserver("ErrorEvent", hear)
    return heard


def fixed_mapper():
    mapper = vtk.vtkFixedPointVolumeRayCastMapper()
    mapper.AutoAdjustSampleDistancesOff()
    mapper.SetImageSampleDistance(1.0)
    return mapper


def gpu_mapper():
    mapper = vtk.vtkGPUVolumeRayCastMapper()
    mapper.AutoAdjustSampleDistancesOff()
    mapper.SetImageSampleDistance(1.0)
    mapper.UseJitteringOff()
    mapper.SetMaxMemoryInBytes(8 << 30)
    mapper.SetMaxMemoryFraction(1.0)
    return mapper


def window(scene):
    """A window that is not shown, with its context."""
    view = vtk.vtkRenderer()
    view.SetBackground(0, 0, 0)
    made = vtk.vtkRenderWindow()
    made.SetOffScreenRendering(1)
    made.SetMultiSamples(0)
    made.SetSize(scene.size, scene.size)
    made.AddRenderer(view)
    made.Render()
    return made, view


def volume(scene, mapper):
    unit = scene.least_spacing
    opacity = vtk.vtkPiecewiseFunction()
    for value, alpha in zip(*scene.opacity_points(unit)):
        opacity.AddPoint(value, alpha)
    color = vtk.vtkColorTransferFunction()
    for value, rgb in zip(scene.values, scene.colors):
        color.AddRGBPoint(value, *rgb)
    look = vtk.vtkVolumeProperty()
    look.SetColor(color)
    look.SetScalarOpacity(opacity)
    look.SetScalarOpacityUnitDistance(unit)
    look.SetInterpolationTypeToLinear()
    made = vtk.vtkVolume()
    made.SetMapper(mapper)
    made.SetProperty(look)
    return made


def renderer(window):
    lines = window.ReportCapabilities().splitlines()
    named = [line.split(":", 1)[1].strip() for line in lines if line.startswith("OpenGL renderer string")]
    return named[0] if named else window.GetClassName()
