"""The plugin for ParaView, in pvpython. Oracles: palpate itself on numpy arrays, places computed by hand, a ball whose path is known.

    paraview_test.py MODULES DEBIAN_ROOT     # the folder of palpate's modules; tests/support/debian_root.sh, for where there is no ParaView

Exits with 77 where ParaView can not be had.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path


def run_in_pvpython(modules, debian_root):
    """This file in pvpython, which does not use the Python that runs it here."""
    environment, program, paths = dict(os.environ), shutil.which("pvpython"), [modules]
    if not program or subprocess.run([program, "-c", "import paraview.simple"], capture_output=True).returncode != 0:
        fetched = subprocess.run(["bash", debian_root, "paraview"], stdout=subprocess.PIPE, text=True)
        if fetched.returncode != 0:
            sys.exit(fetched.returncode)
        root = Path(fetched.stdout.strip())
        program = root / "usr/bin/pvpython"
        paths.insert(0, root / "usr/lib/python3/dist-packages")
        environment["LD_LIBRARY_PATH"] = str(next(root.glob("usr/lib/*-linux-gnu")))
    environment["PYTHONPATH"] = os.pathsep.join(map(str, paths))
    sys.exit(subprocess.run([program, __file__], env=environment).returncode)


if len(sys.argv) == 3:
    run_in_pvpython(*sys.argv[1:])

import numpy as np  # noqa: E402
import palpate  # noqa: E402
import palpate_paraview  # noqa: E402
from paraview import simple  # noqa: E402
from vtkmodules.util.numpy_support import vtk_to_numpy  # noqa: E402
from vtkmodules.vtkCommonCore import vtkFileOutputWindow, vtkOutputWindow  # noqa: E402

palpate_paraview.load()

# The index axis x points along P, y along S, z along L; every axis differs.
SHAPE, SPACING, ORIGIN = (16, 20, 24), (1.0, 1.25, 1.5), (-10.0, 20.0, 300.0)
DIRECTION = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
PATH = [(0.0, 0.0, 0.0), (0.5, 1.0, 0.0), (1.0, 1.5, -0.5), (0.5, 0.5, -0.5)]  # of the ball, LPS mm
FAST = {"preset": "fast", "spacing": SPACING, "origin": ORIGIN, "direction": DIRECTION}


def ball_at(centre_mm):
    index = np.stack(np.meshgrid(*(np.arange(n) for n in SHAPE), indexing="ij"), axis=-1)[..., ::-1] - (np.array(SHAPE[::-1]) - 1) / 2
    l, p, s = np.moveaxis((index * SPACING) @ DIRECTION.T - centre_mm, -1, 0)
    texture = 60 * np.sin(0.9 * l) * np.sin(0.7 * p) * np.sin(0.8 * s)
    return ((1000 + texture) / (1 + np.exp(np.sqrt(l**2 + p**2 + s**2) - 7))).astype(np.float32)


def write(folder, frames):
    for k, frame in enumerate(frames):
        matrix = " ".join(str(number) for number in DIRECTION.T.reshape(-1))
        head = (f"ObjectType = Image\nNDims = 3\nBinaryData = True\nTransformMatrix = {matrix}\nOffset = {' '.join(map(str, ORIGIN))}\n"
                f"ElementSpacing = {' '.join(map(str, SPACING))}\nDimSize = {' '.join(map(str, SHAPE[::-1]))}\nElementType = MET_FLOAT\n"
                "ElementDataFile = LOCAL\n")
        (Path(folder) / f"frame_{k}.mha").write_bytes(head.encode() + frame.astype("<f4").tobytes())


def output(proxy, port=0):
    return proxy.GetClientSideObject().GetOutputDataObject(port)


def array(proxy, name, port=0):
    image = output(proxy, port)
    values = vtk_to_numpy(image.GetPointData().GetArray(name))
    return values.reshape(image.GetDimensions()[::-1] + values.shape[1:])


def said_by(work):
    """What ParaView shows as messages meanwhile."""
    with tempfile.TemporaryDirectory() as folder:
        window, before = vtkFileOutputWindow(), vtkOutputWindow.GetInstance()
        window.SetFileName(os.path.join(folder, "said"))
        window.FlushOn()
        vtkOutputWindow.SetInstance(window)
        work()
        vtkOutputWindow.SetInstance(before)
        del window
        said = Path(folder) / "said"
        return said.read_text() if said.exists() else ""


def check_the_reader(frames, folder):
    reader = simple.PalpateFolder(Folder=folder)
    reader.UpdatePipelineInformation()
    assert list(reader.TimestepValues) == [0.0, 1000.0, 2000.0, 3000.0]
    reader.UpdatePipeline(2000.0)
    assert np.array_equal(array(reader, "values"), frames[2])
    image, (k, j, i) = output(reader), (5, 7, 11)
    # By hand: x is P, y is S, z is L.
    at = i + SHAPE[2] * (j + SHAPE[1] * k)
    assert np.allclose(image.GetPoint(at), (-10.0 + 1.5 * k, 20.0 + 1.0 * i, 300.0 + 1.25 * j))
    # And so for what ParaView itself computes from it: the value at that place.
    probe = simple.ProbeLocation(Input=reader, ProbeType="Fixed Radius Point Source")
    probe.ProbeType.Center = image.GetPoint(at)
    probe.UpdatePipeline(2000.0)
    assert np.isclose(vtk_to_numpy(output(probe).GetPointData().GetArray("values"))[0], frames[2][k, j, i], rtol=1e-4)
    one = simple.PalpateFile(FileName=str(Path(folder) / "frame_1.mha"))
    one.UpdatePipeline()
    assert np.array_equal(array(one, "values"), frames[1])
    said = said_by(lambda: simple.PalpateFolder(Folder="/nowhere").UpdatePipeline())
    assert "palpate: " in said and "/nowhere" in said and "Traceback" not in said, said
    return reader


def check_the_motion(frames, reader, calls):
    known = palpate.register(frames, times=[0.0, 1000.0, 2000.0, 3000.0], **FAST)
    calls.clear()
    motion = simple.PalpateMotion(Input=reader, Preset="fast")
    shares = []
    motion.GetClientSideObject().AddObserver("ProgressEvent", lambda filter, event: shares.append(filter.GetProgress()))
    for time in (0.0, 1000.0, 1444.0, 3000.0):
        motion.UpdatePipeline(time)
        assert np.array_equal(array(motion, "displacement"), known.at(time))
        assert np.array_equal(array(motion, "determinant"), known.determinant(time_s=time))
        assert np.array_equal(array(motion, "values", 1), known.warp(frames[known.reference], time_s=time, inverse=True))
        for port in (0, 1):
            assert output(motion, port).GetPoint(1234) == output(reader).GetPoint(1234)
        reader.UpdatePipeline(2000.0)  # as a picture of the frames beside it would
    assert np.array_equal(array(motion, "confidence"), known.confidence[3])
    assert np.array_equal(array(motion, "deviation"), known.deviation[3])
    assert output(motion).GetFieldData().GetAbstractArray("verdict").GetValue(0) == known.verdict.trust
    motion.GetClientSideObject().Modified()  # by nothing that the motion depends on
    motion.UpdatePipeline(1000.0)
    assert len(calls) == 1, f"the motion was estimated {len(calls)} times"
    assert any(0.0 < share < 1.0 for share in shares) and all(0.0 <= share <= 1.0 for share in shares), shares
    # The displacement at the ball's own places.
    motion.ReferenceFrame = 0
    for k, time in enumerate((0.0, 1000.0, 2000.0)):
        motion.UpdatePipeline(time)
        u = array(motion, "displacement")[frames[0] > 500].mean(axis=0)
        assert np.allclose(u, np.subtract(PATH[k], PATH[0]), atol=0.2), (time, u)
    assert len(calls) == 2
    # Other frames: another motion.
    with tempfile.TemporaryDirectory() as other:
        write(other, frames[::-1])
        folder, reader.Folder = str(reader.Folder), other
        motion.UpdatePipeline(3000.0)
        assert np.allclose(array(motion, "displacement")[frames[3] > 500].mean(axis=0), np.subtract(PATH[0], PATH[3]), atol=0.2)
        reader.Folder = folder
    # ParaView's Contour leaves out the direction of an image, not the places of points.
    points = simple.ImageDatatoPointSet(Input=simple.OutputPort(motion, 1))
    contour = simple.Contour(Input=points, ContourBy=["POINTS", "values"], Isosurfaces=[500.0])
    contour.UpdatePipeline(2000.0)
    middle = np.array(ORIGIN) + DIRECTION @ ((np.array(SHAPE[::-1]) - 1) / 2 * SPACING)
    centre = vtk_to_numpy(output(contour).GetPoints().GetData()).mean(axis=0)
    assert np.allclose(centre, middle + PATH[2], atol=0.4), (centre, middle + PATH[2])


def check_what_goes_wrong(reader, calls):
    one = simple.PalpateFile(FileName=str(Path(reader.Folder) / "frame_1.mha"))
    said = said_by(lambda: simple.PalpateMotion(Input=one).UpdatePipeline())
    assert "palpate: the motion is that of a time series" in said and "Traceback" not in said, said
    wrong = simple.PalpateMotion(Input=reader, Preset="fast", ReferenceFrame=4)
    said = said_by(wrong.UpdatePipeline)
    assert said.count("palpate: ") == 1 and "palpate: there is no frame 4: the sequence has 4" in said and "Traceback" not in said, said
    assert output(wrong).GetNumberOfPoints() == 0
    calls.clear()
    stopped = simple.PalpateMotion(Input=reader, Preset="best")
    stopped.GetClientSideObject().AddObserver("ProgressEvent", lambda filter, event: filter.AbortExecuteOn())
    stopped.UpdatePipeline(0.0)
    assert len(calls) == 1 and output(stopped).GetNumberOfPoints() == 0


def check_real_files():
    data = next((parent / "shared/data" for parent in Path(__file__).resolve().parents if (parent / "shared/data").is_dir()), None)
    if data is None:
        print("Not checked with real files: shared/data is not beside this checkout")
        return
    lung = simple.PalpateFile(FileName=str(data / "lung/breathing.seq.nrrd"))
    lung.UpdatePipelineInformation()
    assert list(lung.TimestepValues) == [500.0 * k for k in range(8)]
    path = data / "heart_cine/frame_03.mha"
    head = dict(line.split(b" = ", 1) for line in path.read_bytes()[:2000].split(b"\nElementDataFile")[0].split(b"\n"))
    matrix, offset, spacing = (np.array(head[key].split(), dtype=float) for key in (b"TransformMatrix", b"Offset", b"ElementSpacing"))
    heart = simple.PalpateFile(FileName=str(path))
    heart.UpdatePipeline()
    nx, ny = output(heart).GetDimensions()[:2]
    at = 100 + nx * (30 + ny * 7)
    assert np.allclose(output(heart).GetPoint(at), offset + matrix.reshape(3, 3).T @ (spacing * (100, 30, 7)), atol=1e-3)


def main():
    register, calls = palpate.register, []

    def counted(*given, **options):
        calls.append(options)
        return register(*given, **options)

    palpate.register = counted
    frames = [ball_at(centre) for centre in PATH]
    with tempfile.TemporaryDirectory() as folder:
        write(folder, frames)
        reader = check_the_reader(frames, folder)
        check_the_motion(frames, reader, calls)
        check_what_goes_wrong(reader, calls)
    check_real_files()
    print("The plugin does in ParaView what palpate does")


main()
