"""palpate in ParaView: moving volumes from files, and the motion of a time series of images.

A plugin, for Tools > Manage Plugins > Load New. Debian 12's ParaView 5.11 can load no Python plugin that way, since it asks for a function that Python
3.11 has no more: start it with paraview --script=FILE, this file. In pvpython: import palpate_paraview; palpate_paraview.load().

Times of the readers are ms. Places and displacements are mm along L, P, S of the patient, as in DICOM.
"""

import inspect

if not hasattr(inspect, "getargspec"):
    inspect.getargspec = inspect.getfullargspec  # for paraview.detail.pythonalgorithm of ParaView 5.11

import numpy as np
from paraview.util.vtkAlgorithm import VTKPythonAlgorithmBase, smdomain, smhint, smproperty, smproxy
from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringArray
from vtkmodules.vtkCommonDataModel import vtkDataObject, vtkImageData
from vtkmodules.vtkCommonExecutionModel import vtkExecutive
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline

import palpate
import palpate.vtk

paraview_plugin_name = "palpate"
paraview_plugin_version = palpate.__version__

EXTENSIONS = "mha mhd nrrd nhdr nii gz dcm"


def load():
    """Loads this file as a plugin: paraview.simple then has PalpateFile, PalpateFolder and PalpateMotion."""
    from paraview import simple

    simple.LoadPlugin(inspect.getsourcefile(load))


def _or_sentence(work):
    """A request that shows an exception as one sentence and leaves the output empty, until a property or the input changes. It returns 1 even then:
    VTK would add three messages of its own."""

    def guarded(self, request, inputs, outputs):
        is_first = work.__name__ == "RequestInformation"
        if is_first:
            self._is_wrong = False
        try:
            if not self._is_wrong:
                work(self, request, inputs, outputs)
                return 1
        except (ValueError, TypeError, OSError, RuntimeError, MemoryError) as error:
            vtkOutputWindow.GetInstance().DisplayErrorText(f"palpate: {error}\n")
        except palpate.vtk.Cancelled:
            pass  # the person knows
        self._is_wrong = True
        request.Remove(Pipeline.CONTINUE_EXECUTING())
        for port in range(self.GetNumberOfOutputPorts()):
            info = outputs.GetInformationObject(port)
            if is_first:
                info.Set(Pipeline.WHOLE_EXTENT(), (0, -1, 0, -1, 0, -1), 6)
                info.Remove(Pipeline.TIME_STEPS())
                info.Remove(Pipeline.TIME_RANGE())
            else:
                vtkImageData.GetData(info).Initialize()
        return 1

    return guarded


@smproperty.doublevector(name="TimestepValues", information_only="1", si_class="vtkSITimeStepsProperty")
def GetTimestepValues(self):
    """The times of the frames, ms."""
    return None if self._frames is None else [1000.0 * time for time in self._frames.times]


class _Reader(VTKPythonAlgorithmBase):
    """The frames of palpate.open_sequence() as a time series."""

    def __init__(self):
        super().__init__(nInputPorts=0, nOutputPorts=1, outputType="vtkImageData")
        self._frames = self._opened = None

    def _open(self, path):
        if not path:
            raise ValueError("choose a file or a folder")
        if self._opened != path:
            self._frames = palpate.open_sequence(path)
            self._opened = path
            for note in self._frames.notes:
                vtkOutputWindow.GetInstance().DisplayText(f"palpate: {note}\n")

    def _set(self, name, value):
        if getattr(self, name) != value:
            setattr(self, name, value)
            self.Modified()

    @_or_sentence
    def RequestInformation(self, request, inputs, outputs):
        self._open(self._path())
        frames, info = self._frames, outputs.GetInformationObject(0)
        z, y, x = frames.shape[1:]
        info.Set(Pipeline.WHOLE_EXTENT(), (0, x - 1, 0, y - 1, 0, z - 1), 6)
        info.Set(vtkDataObject.SPACING(), frames.spacing, 3)
        info.Set(vtkDataObject.ORIGIN(), frames.origin, 3)
        info.Set(vtkDataObject.DIRECTION(), frames.direction.reshape(-1).tolist(), 9)
        times = self.GetTimestepValues()
        info.Remove(Pipeline.TIME_STEPS())
        info.Remove(Pipeline.TIME_RANGE())
        if len(times) > 1:
            info.Set(Pipeline.TIME_STEPS(), times, len(times))
            info.Set(Pipeline.TIME_RANGE(), (times[0], times[-1]), 2)

    @_or_sentence
    def RequestData(self, request, inputs, outputs):
        frames, info = self._frames, outputs.GetInformationObject(0)
        time = info.Get(Pipeline.UPDATE_TIME_STEP()) if info.Has(Pipeline.UPDATE_TIME_STEP()) else 0.0
        k = int(np.argmin(np.abs(1000.0 * np.array(frames.times) - time)))
        shape = vtkImageData()
        shape.SetDimensions(frames.shape[:0:-1])
        shape.SetSpacing(frames.spacing)
        shape.SetOrigin(frames.origin)
        shape.SetDirectionMatrix(frames.direction.reshape(-1).tolist())
        output = vtkImageData.GetData(outputs, 0)
        output.ShallowCopy(palpate.vtk.image(shape, {"values": frames[k]}))
        output.GetInformation().Set(vtkDataObject.DATA_TIME_STEP(), 1000.0 * frames.times[k])


@smproxy.reader(name="PalpateFile", label="Palpate File", extensions=EXTENSIONS, file_description="Moving volume, read by palpate")
class PalpateFile(_Reader):
    """A file with one or several frames; times in ms."""

    _file = ""

    def _path(self):
        return self._file

    @smproperty.stringvector(name="FileName")
    @smdomain.filelist()
    @smhint.filechooser(extensions=EXTENSIONS, file_description="Moving volume, read by palpate")
    def SetFileName(self, name):
        self._set("_file", "" if name in (None, "None") else name)

    GetTimestepValues = GetTimestepValues


@smproxy.source(name="PalpateFolder", label="Palpate Folder")
class PalpateFolder(_Reader):
    """A folder of DICOM files, or of files with a frame each; times in ms."""

    _folder = _series = ""

    def _path(self):
        return self._folder + (f"#{self._series}" if self._folder and self._series else "")

    @smproperty.xml("""<StringVectorProperty name="Folder" command="SetFolder" number_of_elements="1" default_values="">
        <FileListDomain name="files"/><Hints><UseDirectoryName/></Hints>
        <Documentation>A folder of DICOM files, with folders below, or of files with a frame each, in the order of their names.</Documentation>
        </StringVectorProperty>""")
    def SetFolder(self, folder):
        self._set("_folder", folder or "")

    @smproperty.xml("""<StringVectorProperty name="Series" command="SetSeries" number_of_elements="1" default_values="">
        <Documentation>The series of a folder with several DICOM images, by number or name. Empty: there is one.</Documentation>
        </StringVectorProperty>""")
    def SetSeries(self, series):
        self._set("_series", series or "")

    GetTimestepValues = GetTimestepValues


@smproxy.filter(name="PalpateMotion", label="Palpate Motion")
@smproperty.xml("""<OutputPort name="Motion" index="0"/><OutputPort name="Moved volume" index="1"/>""")
@smproperty.input(name="Input")
@smdomain.datatype(dataTypes=["vtkImageData"], composite_data_supported=False)
class PalpateMotion(VTKPythonAlgorithmBase):
    """Estimates the motion of a time series of images, once for all times.

    Output 0, on the reference frame: "displacement" (mm), where its material is at the time; "confidence", 0 to 1;
    "deviation" (mm), that of its error along the image gradient and across it; "determinant", the change of volume.
    Output 1: the values of the reference frame, moved to where its material is at the time. The time may be between frames.
    Both have the verdict and its reasons as field data.
    """

    def __init__(self):
        super().__init__(nInputPorts=1, nOutputPorts=2, inputType="vtkImageData", outputType="vtkImageData")
        self._preset, self._reference, self._is_cyclic, self._device = "balanced", -1, False, ""
        self._moving = self._known = None  # the motion, and what it was estimated from
        self._collected = []

    def _set(self, name, value):
        if getattr(self, name) != value:
            setattr(self, name, value)
            self.Modified()

    @smproperty.xml("""<StringVectorProperty name="Preset" command="SetPreset" number_of_elements="1" default_values="balanced">
        <StringListDomain name="presets"><String value="fast"/><String value="balanced"/><String value="best"/><String value="classic"/></StringListDomain>
        <Documentation>The effort: how long the estimation may take.</Documentation></StringVectorProperty>""")
    def SetPreset(self, preset):
        self._set("_preset", preset)

    @smproperty.xml("""<IntVectorProperty name="ReferenceFrame" command="SetReferenceFrame" number_of_elements="1" default_values="-1">
        <IntRangeDomain name="range" min="-1"/>
        <Documentation>The frame whose material is followed, counted from 0. -1: palpate chooses.</Documentation></IntVectorProperty>""")
    def SetReferenceFrame(self, frame):
        self._set("_reference", frame)

    @smproperty.xml("""<IntVectorProperty name="Cyclic" command="SetCyclic" number_of_elements="1" default_values="0"><BooleanDomain name="bool"/>
        <Documentation>The last frame leads back to the first.</Documentation></IntVectorProperty>""")
    def SetCyclic(self, on):
        self._set("_is_cyclic", bool(on))

    @smproperty.xml("""<StringVectorProperty name="Device" command="SetDevice" number_of_elements="1" default_values="" panel_visibility="advanced">
        <Documentation>The Vulkan device, by number or part of its name. Empty: the first GPU, else the CPU.</Documentation></StringVectorProperty>""")
    def SetDevice(self, device):
        self._set("_device", device or "")

    @smproperty.stringvector(name="Verdict", information_only="1")
    def GetVerdict(self):
        return "" if self._moving is None else " ".join([self._moving.motion.verdict.trust, *self._moving.motion.verdict.reasons])

    def _wanted(self):
        """What the motion depends on; it is estimated again when this changes."""
        return (self._preset, self._reference, self._is_cyclic, self._device, self._times, self.GetInputAlgorithm(0, 0).GetExecutive().GetPipelineMTime())

    @_or_sentence
    def RequestInformation(self, request, inputs, outputs):
        info = inputs[0].GetInformationObject(0)
        self._times = tuple(info.Get(Pipeline.TIME_STEPS()) or ()) if info.Has(Pipeline.TIME_STEPS()) else ()
        if len(self._times) < 2:
            raise ValueError("the motion is that of a time series, but this input has no times: connect a series of images")
        self._collected = []
        if self._known != self._wanted():
            self._moving = None

    @_or_sentence
    def RequestUpdateExtent(self, request, inputs, outputs):
        # While the motion is not known, the frames one by one; later always the last one, which the input still has.
        k = len(self._collected) if self._moving is None else len(self._times) - 1
        info = inputs[0].GetInformationObject(0)
        info.Set(Pipeline.UPDATE_TIME_STEP(), self._times[k])
        info.Set(Pipeline.UPDATE_EXTENT(), info.Get(Pipeline.WHOLE_EXTENT()), 6)

    @_or_sentence
    def RequestData(self, request, inputs, outputs):
        image = self._one_value(vtkImageData.GetData(inputs[0], 0))
        if self._moving is None:
            # A copy, which stays when the input goes on to the next time.
            frame = vtkImageData()
            frame.DeepCopy(image)
            self._collected.append(frame)
            if len(self._collected) < len(self._times):
                request.Set(Pipeline.CONTINUE_EXECUTING(), 1)
                return
            request.Remove(Pipeline.CONTINUE_EXECUTING())
            frames, self._collected = self._collected, []
            self._moving = palpate.vtk.MovingImage(
                frames, self._times, reference=None if self._reference < 0 else self._reference, cyclic=self._is_cyclic, preset=self._preset,
                gpu=self._device or None, on_progress=lambda doing, share: self.UpdateProgress(share), is_cancelled=self.GetAbortExecute)
            self._known = self._wanted()
        info = outputs.GetInformationObject(max(0, request.Get(vtkExecutive.FROM_OUTPUT_PORT())))
        time = info.Get(Pipeline.UPDATE_TIME_STEP()) if info.Has(Pipeline.UPDATE_TIME_STEP()) else self._times[0]
        moving, name = self._moving, image.GetPointData().GetScalars().GetName() or "values"
        found = ({"displacement": moving.displacement(time), "confidence": moving.confidence(time), "deviation": moving.deviation(time),
                  "determinant": moving.determinant(time)}, {name: moving.values(time)})
        for port, arrays in enumerate(found):
            output = vtkImageData.GetData(outputs, port)
            output.ShallowCopy(palpate.vtk.image(image, arrays))
            output.GetInformation().Set(vtkDataObject.DATA_TIME_STEP(), time)
            for key, texts in (("verdict", [moving.motion.verdict.trust]), ("reasons", moving.motion.verdict.reasons),
                               ("reference frame", [str(moving.reference)])):
                array = vtkStringArray()
                array.SetName(key)
                for text in texts:
                    array.InsertNextValue(text)
                output.GetFieldData().AddArray(array)

    @staticmethod
    def _one_value(image):
        """The image with its values as scalars: some readers name no array, even if it is the only one."""
        if image.GetPointData().GetScalars() is None and image.GetPointData().GetNumberOfArrays() == 1:
            image.GetPointData().SetActiveScalars(image.GetPointData().GetArrayName(0))
        return image


# ParaView runs a script as a text without a file name, so the module is loaded by its name.
if __name__ == "__main__":
    import palpate_paraview

    palpate_paraview.load()
