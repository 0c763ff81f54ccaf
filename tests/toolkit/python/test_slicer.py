"""The module for 3D Slicer. Slicer is not there: what is apart from MRML is tested with VTK's own grid transform and with places computed by hand; the
rest runs with stand-ins for the few MRML nodes that it uses, which shows that it runs, not that Slicer agrees."""

import importlib
import sys
import types
from pathlib import Path
from unittest import mock

import numpy as np
import pytest

pytest.importorskip("vtkmodules.vtkFiltersHybrid")
import vtk as all_of_vtk  # noqa: E402
from vtkmodules.util.numpy_support import vtk_to_numpy  # noqa: E402
from vtkmodules.vtkCommonDataModel import vtkImageData  # noqa: E402
from vtkmodules.vtkCommonMath import vtkMatrix4x4  # noqa: E402
from vtkmodules.vtkFiltersHybrid import vtkGridTransform  # noqa: E402

import palpate.vtk  # noqa: E402

FOLDER = Path(__file__).resolve().parents[3] / "integration/toolkit/slicer"
SHAPE = (20, 24, 28)
SPACING = (1.0, 1.25, 1.5)
PATH = [(0.0, 0.0, 0.0), (-0.5, 1.0, 0.5), (-1.0, 1.5, 1.0)]  # of a ball, RAS mm
# Columns: where i, j, k go in RAS. The first is that of VTK's own transform, which knows no directions.
DIRECTIONS = {"along R, A, S": np.eye(3), "permuted": np.array([[0, 0, -1], [-1, 0, 0], [0, 1, 0]]),
              "oblique": np.array([[0.8, 0, -0.6], [0, -1, 0], [-0.6, 0, -0.8]])}


@pytest.fixture(scope="module")
def lib():
    sys.path.insert(0, str(FOLDER))
    yield importlib.import_module("PalpateMotionLib")
    sys.path.remove(str(FOLDER))


def matrix_of(direction):
    matrix = vtkMatrix4x4()
    for row in range(3):
        for column in range(3):
            matrix.SetElement(row, column, direction[row, column] * SPACING[column])
        matrix.SetElement(row, 3, (10.0, -20.0, 300.0)[row])
    return matrix


def ras_of(index, matrix):
    return np.array(matrix.MultiplyPoint((*index, 1.0))[:3])


def slicer_image(array):
    """Samples without a geometry, as in a volume node."""
    image = vtkImageData()
    image.SetDimensions(array.shape[::-1])
    return palpate.vtk.image(image, {"values": array})


def ball(centre_ras, matrix):
    middle = ras_of((np.array(SHAPE[::-1]) - 1) / 2, matrix)
    index = np.stack(np.meshgrid(*(np.arange(n) for n in SHAPE), indexing="ij"), axis=-1)[..., ::-1]
    axes = np.array([[matrix.GetElement(row, column) for column in range(4)] for row in range(3)])
    r, a, s = np.moveaxis(index @ axes[:, :3].T + axes[:, 3] - middle - centre_ras, -1, 0)
    texture = 60 * np.sin(0.9 * r) * np.sin(0.7 * a) * np.sin(0.8 * s)
    # Noise of its own in each frame: far from the ball nothing else is seen, so nothing is known there.
    noise = np.random.default_rng([int(10 * abs(x)) for x in centre_ras]).normal(0, 5, SHAPE)
    return ((1000 + texture) / (1 + np.exp(np.sqrt(r**2 + a**2 + s**2) - 7)) + noise).astype(np.float32)


def transformed(point_ras, grid, direction):
    """What a vtkOrientedGridTransform does to a point: VTK's transform, on the grid's own axes."""
    turned = np.array([[direction.GetElement(row, column) for column in range(3)] for row in range(3)])
    own = vtkImageData()
    own.DeepCopy(grid)
    own.SetOrigin(turned.T @ grid.GetOrigin())
    vectors = vtk_to_numpy(own.GetPointData().GetScalars())
    vectors[:] = vectors @ turned
    transform = vtkGridTransform()
    transform.SetDisplacementGridData(own)
    return turned @ transform.TransformPoint(turned.T @ point_ras)


@pytest.mark.parametrize("name", ("along R, A, S", "oblique"))
def test_a_point_goes_where_its_material_goes(lib, name):
    matrix = matrix_of(DIRECTIONS[name])
    frames = [lib.lps_image(slicer_image(ball(centre, matrix)), matrix) for centre in PATH]
    # A sample of the image is where Slicer has it, with R and A counted to the other side.
    k, j, i = 5, 7, 11
    at = frames[0].ComputePointId((i, j, k))
    assert np.array(frames[0].GetPoint(at)) * (-1, -1, 1) == pytest.approx(ras_of((i, j, k), matrix))
    moving = palpate.vtk.MovingImage(frames, (0.0, 1.0, 2.0), reference=0, preset="fast", verdict=False)
    middle = ras_of((np.array(SHAPE[::-1]) - 1) / 2, matrix)
    for time, centre in enumerate(PATH):
        grid, direction = lib.displacement_grid(moving.displacement(time), frames[0])
        turned = np.array([[direction.GetElement(row, column) for column in range(3)] for row in range(3)])
        assert grid.GetOrigin() + turned @ (np.array((i, j, k)) * grid.GetSpacing()) == pytest.approx(ras_of((i, j, k), matrix))
        assert transformed(middle, grid, direction) - middle == pytest.approx(np.array(centre), abs=0.25)
        if name == "along R, A, S":  # VTK's own class, as it is
            transform = vtkGridTransform()
            transform.SetDisplacementGridData(grid)
            assert np.array(transform.TransformPoint(middle)) - middle == pytest.approx(np.array(centre), abs=0.25)


class Node:
    """A stand-in for a node of MRML: set_x() is remembered for get_x()."""

    def __init__(self, kind, name=""):
        self.kind, self.name, self.items, self.set = kind, name, [], {}

    def IsA(self, kind):
        return kind == self.kind

    def GetName(self):
        return self.name

    GetID = GetName

    def GetIJKToRASMatrix(self, matrix):
        matrix.DeepCopy(self.set["IJKToRASMatrix"])

    def SetIJKToRASMatrix(self, matrix):
        self.set["IJKToRASMatrix"] = matrix

    def GetImageData(self):
        return self.set["AndObserveImageData"]

    def SetDataNodeAtValue(self, node, value):
        self.items.append((node, value))

    def GetNumberOfDataNodes(self):
        return len(self.items)

    def GetNthDataNode(self, k):
        return self.items[k][0]

    def GetNthIndexValue(self, k):
        return self.items[k][1]

    def GetIndexName(self):
        return "time"

    def GetIndexUnit(self):
        return "s"

    def GetProxyNode(self, sequence):
        return sequence.items[0][0]

    def CreateDefaultDisplayNodes(self):
        pass

    def Start(self):
        self.set["started"] = True

    def __getattr__(self, call):
        if not call.startswith("Set"):
            raise AttributeError(call)
        return lambda *given: self.set.update({call[3:]: given[0] if len(given) == 1 else given})


class Scene:
    def __init__(self):
        self.nodes = []

    def AddNewNodeByClass(self, kind, name):
        self.nodes.append(Node(kind, name))
        return self.nodes[-1]

    def RemoveNode(self, node):
        self.nodes.remove(node)


@pytest.fixture
def slicer(lib, monkeypatch):
    class Transform:
        def SetDisplacementGridData(self, grid):
            self.grid = grid

        def SetGridDirectionMatrix(self, direction):
            self.direction = direction

    base = types.ModuleType("slicer.ScriptedLoadableModule")
    for name in ("ScriptedLoadableModule", "ScriptedLoadableModuleLogic", "ScriptedLoadableModuleWidget"):
        setattr(base, name, type(name, (), {}))
    made = types.ModuleType("slicer")
    made.mrmlScene, made.vtkOrientedGridTransform, made.ScriptedLoadableModule = Scene(), Transform, base
    sequences = types.SimpleNamespace(UpdateProxyNodesFromSequences=lambda browser: None)
    made.modules = types.SimpleNamespace(sequences=types.SimpleNamespace(logic=lambda: sequences))
    for name, module in (("slicer", made), ("slicer.ScriptedLoadableModule", base), ("qt", types.ModuleType("qt")), ("ctk", types.ModuleType("ctk")),
                         ("vtk", all_of_vtk)):
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.delitem(sys.modules, "PalpateMotion", raising=False)
    made.module = importlib.import_module("PalpateMotion")
    made.logic = made.module.PalpateMotionLogic()
    return made


def sequence_of(matrix, values):
    sequence = Node("vtkMRMLSequenceNode", "heart")
    for centre, value in zip(PATH, values):
        volume = Node("vtkMRMLScalarVolumeNode")
        volume.SetAndObserveImageData(slicer_image(ball(centre, matrix)))
        volume.SetIJKToRASMatrix(matrix)
        sequence.SetDataNodeAtValue(volume, value)
    return sequence


def test_a_sequence_becomes_transforms_and_confidence(slicer):
    matrix = matrix_of(DIRECTIONS["permuted"])
    sequence, told = sequence_of(matrix, ("0.1", "0.4", "0.7")), []
    verdict = slicer.logic.run(sequence, preset="fast", reference=0, on_progress=lambda *now: told.append(now))
    assert verdict.trust in ("ok", "suspect", "failed") and told
    nodes = {node.name: node for node in slicer.mrmlScene.nodes}
    assert list(nodes) == ["heart motion", "heart motion browser", "heart reference frame", "heart confidence"]
    motion = nodes["heart motion"]
    assert motion.kind == "vtkMRMLSequenceNode" and [value for _, value in motion.items] == ["0.1", "0.4", "0.7"]
    middle = ras_of((np.array(SHAPE[::-1]) - 1) / 2, matrix)
    for (node, _), centre in zip(motion.items, PATH):
        transform = node.set["AndObserveTransformToParent"]
        assert transformed(middle, transform.grid, transform.direction) - middle == pytest.approx(np.array(centre), abs=0.25)
    still = nodes["heart reference frame"]
    assert still.set["AndObserveTransformNodeID"] == motion.items[0][0].GetID()
    assert np.array_equal(vtk_to_numpy(still.GetImageData().GetPointData().GetScalars()), ball(PATH[0], matrix).reshape(-1))
    confidence = vtk_to_numpy(nodes["heart confidence"].GetImageData().GetPointData().GetScalars())
    assert 0.0 <= confidence.min() < 0.5 < confidence.max() <= 1.0


def test_what_can_not_be_is_said_and_adds_nothing(slicer):
    matrix = matrix_of(DIRECTIONS["permuted"])
    sequence = sequence_of(matrix, ("a", "b", "c"))
    assert slicer.logic._times(sequence) == [0, 1, 2]
    assert slicer.logic.run(sequence, preset="best", is_cancelled=lambda: True) is None
    sequence.items[1][0].kind = "vtkMRMLModelNode"
    for wrong, words in ((None, "Choose a sequence"), (sequence, "scalar volumes")):
        with pytest.raises(ValueError, match=words):
            slicer.logic.run(wrong)
    with pytest.raises(RuntimeError, match="SlicerOpenIGTLink"):
        slicer.logic.connect("localhost", 18945)
    assert slicer.mrmlScene.nodes == []
    slicer.vtkMRMLIGTLConnectorNode = object
    connector = slicer.logic.connect("localhost", 18945)
    assert connector.set == {"TypeClient": ("localhost", 18945), "started": True}


def test_the_panel_runs_and_can_be_cancelled(slicer, monkeypatch):
    """Its widgets are of mock: only what it does with them is tested."""
    for name in ("qt", "ctk"):
        monkeypatch.setattr(slicer.module, name, mock.MagicMock())
    slicer.module.qt.QPushButton.side_effect = slicer.module.qt.QLabel.side_effect = lambda *given: mock.MagicMock()
    slicer.qMRMLNodeComboBox, slicer.app, slicer.util = mock.MagicMock(), mock.MagicMock(), mock.MagicMock()
    slicer.util.tryWithErrorDisplay.return_value.__exit__.return_value = False
    panel = slicer.module.PalpateMotionWidget()
    monkeypatch.setattr(slicer.module.ScriptedLoadableModuleWidget, "setup", lambda self: None, raising=False)
    panel.layout = mock.MagicMock()
    panel.setup()
    panel._sequence.currentNode.return_value = sequence_of(matrix_of(DIRECTIONS["permuted"]), ("0", "1", "2"))
    panel._preset.currentText, panel._cyclic.checked, panel._reference.value = "fast", False, -1
    panel._on_apply()
    assert panel._verdict.text.startswith("Verdict: ") and len(slicer.mrmlScene.nodes) == 4
    assert panel._apply.enabled and not panel._cancel.enabled and panel._progress.value == 0
    # The button is pressed while events are processed.
    slicer.app.processEvents.side_effect = panel._on_cancel
    panel._on_apply()
    assert panel._verdict.text == "Cancelled" and len(slicer.mrmlScene.nodes) == 4
    panel._wheel.currentPath = "palpate.whl"
    panel._on_install()
    slicer.util.pip_install.assert_called_once_with(["palpate.whl"])
