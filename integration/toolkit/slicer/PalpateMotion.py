"""palpate in 3D Slicer: the motion of a sequence of volumes, as a sequence of transforms. See README.md beside this file."""

import ctk
import numpy as np
import qt
import slicer
import vtk
from slicer.ScriptedLoadableModule import ScriptedLoadableModule, ScriptedLoadableModuleLogic, ScriptedLoadableModuleWidget

PRESETS = ("fast", "balanced", "best", "classic")


class PalpateMotion(ScriptedLoadableModule):
    def __init__(self, parent):
        ScriptedLoadableModule.__init__(self, parent)
        parent.title = "palpate motion"
        parent.categories = ["Registration", "Sequences"]
        parent.contributors = ["The authors of palpate"]
        parent.helpText = ("Estimates the motion of a sequence of volumes on a GPU. The result is a sequence of transforms that carry one frame, and "
                           "what is drawn on it, through all others, and a volume that says how far to trust each vector.")


class PalpateMotionWidget(ScriptedLoadableModuleWidget):
    def setup(self):
        ScriptedLoadableModuleWidget.setup(self)
        self._is_cancelled = False

        form = self._section("Motion")
        self._sequence = slicer.qMRMLNodeComboBox()
        self._sequence.nodeTypes = ["vtkMRMLSequenceNode"]
        self._sequence.addEnabled = self._sequence.removeEnabled = False
        self._sequence.setMRMLScene(slicer.mrmlScene)
        form.addRow("Sequence of volumes", self._sequence)
        self._preset = qt.QComboBox()
        self._preset.addItems(PRESETS)
        self._preset.currentText = "balanced"
        form.addRow("Effort", self._preset)
        self._reference = qt.QSpinBox()
        self._reference.minimum, self._reference.maximum, self._reference.value = -1, 9999, -1
        self._reference.toolTip = "The frame whose material is followed, counted from 0. -1: palpate chooses."
        form.addRow("Reference frame", self._reference)
        self._cyclic = qt.QCheckBox("The last frame leads back to the first")
        form.addRow("", self._cyclic)
        self._apply = qt.QPushButton("Estimate the motion")
        self._apply.connect("clicked()", self._on_apply)
        self._cancel = qt.QPushButton("Cancel")
        self._cancel.enabled = False
        self._cancel.connect("clicked()", self._on_cancel)
        form.addRow(self._apply, self._cancel)
        self._progress = qt.QProgressBar()
        self._progress.maximum = 1000
        form.addRow(self._progress)
        self._verdict = qt.QLabel()
        self._verdict.wordWrap = True
        form.addRow(self._verdict)

        form = self._section("A hand that palpate feels, by OpenIGTLink")
        self._host = qt.QLineEdit("localhost")
        form.addRow("Host", self._host)
        self._port = qt.QSpinBox()
        self._port.minimum, self._port.maximum, self._port.value = 1, 65535, 18945
        self._port.toolTip = "The port of: palpate feel INPUT --serve 18945"
        form.addRow("Port", self._port)
        connect = qt.QPushButton("Connect")
        connect.connect("clicked()", self._on_connect)
        form.addRow(connect)

        form = self._section("Installation")
        self._wheel = ctk.ctkPathLineEdit()
        self._wheel.nameFilters = ["palpate-*.whl"]
        form.addRow("Wheel", self._wheel)
        install = qt.QPushButton("Install palpate into Slicer's Python")
        install.connect("clicked()", self._on_install)
        form.addRow(install)
        self.layout.addStretch(1)

    def _section(self, title):
        section = ctk.ctkCollapsibleButton()
        section.text = title
        self.layout.addWidget(section)
        return qt.QFormLayout(section)

    def _on_apply(self):
        self._is_cancelled = False
        self._apply.enabled, self._cancel.enabled = False, True
        with slicer.util.tryWithErrorDisplay("The motion was not found", waitCursor=False):
            try:
                verdict = PalpateMotionLogic().run(
                    self._sequence.currentNode(), preset=self._preset.currentText, cyclic=self._cyclic.checked,
                    reference=None if self._reference.value < 0 else self._reference.value, on_progress=self._on_progress,
                    is_cancelled=lambda: self._is_cancelled)
                self._verdict.text = "Cancelled" if verdict is None else " ".join([f"Verdict: {verdict.trust}.", *verdict.reasons])
            finally:
                self._apply.enabled, self._cancel.enabled = True, False
                self._progress.value = 0

    def _on_cancel(self):
        self._is_cancelled = True

    def _on_progress(self, doing, share):
        self._progress.value = int(1000 * share)
        self._verdict.text = doing
        slicer.app.processEvents()

    def _on_connect(self):
        with slicer.util.tryWithErrorDisplay("There is no connection"):
            PalpateMotionLogic().connect(self._host.text, self._port.value)

    def _on_install(self):
        with slicer.util.tryWithErrorDisplay("palpate was not installed", waitCursor=True):
            slicer.util.pip_install([self._wheel.currentPath])


class PalpateMotionLogic(ScriptedLoadableModuleLogic):
    def run(self, sequence, *, preset="balanced", reference=None, cyclic=False, on_progress=None, is_cancelled=None):
        """Estimates the motion of a sequence of volumes (vtkMRMLSequenceNode). Adds a sequence of transforms, with a browser that plays it, the
        reference frame under them, and a volume with the least confidence of each vector in all frames. Returns palpate's Verdict; None if it was
        cancelled. ValueError for what can not be used. on_progress, is_cancelled: as in palpate.vtk.estimate()."""
        try:
            import palpate.vtk
        except ImportError as error:
            raise RuntimeError(f"palpate can not be used in Slicer's Python yet: install its wheel below ({error})") from None
        import PalpateMotionLib as lib

        if sequence is None:
            raise ValueError("Choose a sequence of volumes")
        nodes = [sequence.GetNthDataNode(k) for k in range(sequence.GetNumberOfDataNodes())]
        if len(nodes) < 2 or not all(node.IsA("vtkMRMLScalarVolumeNode") for node in nodes):
            raise ValueError("The motion is that of a sequence of two or more scalar volumes: this one has other data")
        frames = []
        for node in nodes:
            matrix = vtk.vtkMatrix4x4()
            node.GetIJKToRASMatrix(matrix)
            frames.append(lib.lps_image(node.GetImageData(), matrix))
        try:
            moving = palpate.vtk.MovingImage(frames, self._times(sequence), preset=preset, reference=reference, cyclic=cyclic,
                                             on_progress=on_progress, is_cancelled=is_cancelled)
        except palpate.vtk.Cancelled:
            return None
        self._show(sequence, nodes[moving.reference], frames[moving.reference], moving)
        return moving.motion.verdict

    @staticmethod
    def _times(sequence):
        """The sequence's own index where that is rising numbers, as a time is; else the number of the frame."""
        values = [sequence.GetNthIndexValue(k) for k in range(sequence.GetNumberOfDataNodes())]
        try:
            times = [float(value) for value in values]
        except ValueError:
            times = []
        return times if len(times) > 1 and np.all(np.diff(times) > 0.0) else list(range(len(values)))

    def _show(self, sequence, node, frame, moving):
        import PalpateMotionLib as lib
        import palpate.vtk

        name, scene = sequence.GetName(), slicer.mrmlScene
        transforms = scene.AddNewNodeByClass("vtkMRMLSequenceNode", f"{name} motion")
        transforms.SetIndexName(sequence.GetIndexName())
        transforms.SetIndexUnit(sequence.GetIndexUnit())
        for k, time in enumerate(self._times(sequence)):
            grid, direction = lib.displacement_grid(moving.displacement(time), frame)
            transform = slicer.vtkOrientedGridTransform()
            transform.SetDisplacementGridData(grid)
            transform.SetGridDirectionMatrix(direction)
            one = scene.AddNewNodeByClass("vtkMRMLGridTransformNode", f"{name} motion")
            one.SetAndObserveTransformToParent(transform)
            transforms.SetDataNodeAtValue(one, sequence.GetNthIndexValue(k))  # a copy
            scene.RemoveNode(one)

        browser = scene.AddNewNodeByClass("vtkMRMLSequenceBrowserNode", f"{name} motion browser")
        browser.SetAndObserveMasterSequenceNodeID(transforms.GetID())
        slicer.modules.sequences.logic().UpdateProxyNodesFromSequences(browser)
        proxy = browser.GetProxyNode(transforms)

        still = self._volume(f"{name} reference frame", node, node.GetImageData())
        still.SetAndObserveTransformNodeID(proxy.GetID())
        least = np.min([moving.confidence(time) for time in self._times(sequence)], axis=0)
        self._volume(f"{name} confidence", node, palpate.vtk.image(node.GetImageData(), {"confidence": least}))

    @staticmethod
    def _volume(name, like, image):
        """A new volume with the samples of an image, where another node is."""
        matrix = vtk.vtkMatrix4x4()
        like.GetIJKToRASMatrix(matrix)
        volume = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLScalarVolumeNode", name)
        copy = vtk.vtkImageData()
        copy.DeepCopy(image)
        volume.SetAndObserveImageData(copy)
        volume.SetIJKToRASMatrix(matrix)
        volume.CreateDefaultDisplayNodes()
        return volume

    def connect(self, host, port):
        """Receives what a palpate with --serve sends: the pose of the proxy, the force, the moving volume and its motion. Returns the connector."""
        if not hasattr(slicer, "vtkMRMLIGTLConnectorNode"):
            raise RuntimeError("Install the extension SlicerOpenIGTLink, which receives it")
        connector = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLIGTLConnectorNode", f"palpate at {host}:{port}")
        connector.SetTypeClient(host, port)
        connector.Start()
        return connector
