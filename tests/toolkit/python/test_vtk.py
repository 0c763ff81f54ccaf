"""palpate.vtk, with the Python modules of VTK. Oracles: palpate itself on numpy arrays, places computed by hand."""

import numpy as np
import pytest

import palpate

pytest.importorskip("vtkmodules.vtkCommonDataModel")
from vtkmodules.util.numpy_support import vtk_to_numpy  # noqa: E402
from vtkmodules.vtkCommonDataModel import vtkImageData  # noqa: E402

from palpate import vtk  # noqa: E402

# The index axis x points along P, y along S, z along L; every axis differs.
GRID = {"spacing": (1.0, 1.25, 1.5), "origin": (-10.0, 20.0, 300.0), "direction": [[0, 0, 1], [1, 0, 0], [0, 1, 0]]}
SHAPE = (20, 24, 28)


def ball_at(centre_mm):
    """A textured ball of radius 7 mm round a place, LPS mm from the middle of the grid."""
    index = np.stack(np.meshgrid(*(np.arange(n) for n in SHAPE), indexing="ij"), axis=-1)[..., ::-1] - (np.array(SHAPE[::-1]) - 1) / 2
    l, p, s = np.moveaxis((index * GRID["spacing"]) @ np.array(GRID["direction"]).T - centre_mm, -1, 0)
    texture = 60 * np.sin(0.9 * l) * np.sin(0.7 * p) * np.sin(0.8 * s)
    return ((1000 + texture) / (1 + np.exp(np.sqrt(l**2 + p**2 + s**2) - 7))).astype(np.float32)


# Where the ball is, LPS mm.
PATH = [(0.0, 0.0, 0.0), (0.5, 1.0, 0.0), (1.0, 1.5, -0.5), (0.5, 0.5, -0.5)]
TIMES = [100.0, 350.0, 600.0, 850.0]


@pytest.fixture(scope="module")
def frames():
    return [ball_at(centre) for centre in PATH]


def vtk_image(array, extent=(3, 0, 0)):
    """With an extent that does not begin at 0."""
    image = vtkImageData()
    image.SetExtent(*(n for first, size in zip(extent, SHAPE[::-1]) for n in (first, first + size - 1)))
    image.SetSpacing(GRID["spacing"])
    direction = np.array(GRID["direction"], dtype=float)
    image.SetOrigin(np.array(GRID["origin"]) - direction @ (np.array(extent) * GRID["spacing"]))
    image.SetDirectionMatrix(direction.reshape(-1).tolist())
    array = np.asarray(array)
    image.DeepCopy(vtk.image(image, {"values": array}))
    return image


@pytest.fixture(scope="module")
def moving(frames):
    return vtk.MovingImage([vtk_image(frame) for frame in frames], TIMES, preset="fast")


def test_images_of_vtk_bring_their_geometry(frames):
    found = palpate._image_of(vtk_image(frames[0].astype(np.int16)))
    assert found.array.dtype == np.int16 and np.array_equal(found.array, frames[0].astype(np.int16))
    assert tuple(found.spacing) == GRID["spacing"] and found.origin == pytest.approx(GRID["origin"])
    assert np.reshape(found.direction, (3, 3)).tolist() == GRID["direction"]
    with pytest.raises(ValueError, match="no scalars"):
        palpate.register(vtkImageData(), vtkImageData())
    with pytest.raises(ValueError, match="3 values per point"):
        three = vtk.image(vtk_image(frames[0]), {"field": np.zeros(SHAPE + (3,))})
        three.GetPointData().SetActiveScalars("field")
        palpate.register(three, three)


def test_arrays_lie_at_their_places(frames):
    image = vtk_image(frames[0])
    k, j, i = 5, 7, 11
    marked = np.zeros(SHAPE)
    marked[k, j, i] = 1
    made = vtk.image(image, {"marked": marked, "field": np.stack([marked] * 3, axis=-1), "more": marked})
    at = int(np.argmax(vtk_to_numpy(made.GetPointData().GetScalars())))
    # By hand: x is P, y is S, z is L.
    assert made.GetPoint(at) == pytest.approx((-10.0 + 1.5 * k, 20.0 + 1.0 * i, 300.0 + 1.25 * j))
    assert made.GetPointData().GetScalars().GetName() == "marked" and made.GetPointData().GetVectors().GetName() == "field"
    with pytest.raises(ValueError, match=r"marked has the shape \(24, 20, 28\)"):
        vtk.image(image, {"marked": marked.swapaxes(0, 1)})


def test_a_moving_image_is_the_motion_of_its_frames(frames, moving):
    known = palpate.register(frames, times=[time - 100.0 for time in TIMES], preset="fast", **GRID)
    assert moving.reference == known.reference and moving.motion.verdict.trust == known.verdict.trust
    for time in (100.0, 350.0, 444.0):
        assert np.array_equal(moving.displacement(time), known.at(time - 100.0))
        assert np.array_equal(moving.values(time), known.warp(frames[known.reference], time_s=time - 100.0, inverse=True))
        assert np.array_equal(moving.determinant(time), known.determinant(time_s=time - 100.0))
    assert np.array_equal(moving.confidence(444.0), known.confidence[1])
    assert np.array_equal(moving.deviation(444.0), known.deviation[1])
    assert np.array_equal(moving.displacement(0.0), known.at(0.0)) and np.array_equal(moving.displacement(5000.0), known.at(750.0))


@pytest.mark.parametrize("reference", (0, 2))
def test_a_chosen_frame_is_followed(frames, reference):
    moving = vtk.MovingImage([vtk_image(frame) for frame in frames], TIMES, reference=reference, preset="fast", verdict=False)
    inside = frames[reference] > 500
    assert moving.reference == reference and np.linalg.norm(moving.displacement(TIMES[reference])[inside], axis=-1).mean() < 0.05
    for time, centre in zip(TIMES, PATH):
        wanted = np.subtract(centre, PATH[reference])
        assert moving.displacement(time)[inside].mean(axis=0) == pytest.approx(wanted, abs=0.2)
        k = TIMES.index(time)
        assert np.abs(moving.values(time) - frames[k]).mean() < 0.35 * max(np.abs(frames[reference] - frames[k]).mean(), 60.0)
    assert moving.confidence(TIMES[0]).shape == SHAPE
    assert moving.deviation(TIMES[0]).shape == SHAPE + (2,) and np.median(moving.deviation(TIMES[0])[inside]) > 0.0


def test_a_pair_has_all_times_between(frames):
    moving = vtk.MovingImage([vtk_image(frame) for frame in frames[1:3]], (0.0, 2.0), preset="fast", verdict=False)
    inside = frames[1] > 500
    for time in (0.0, 1.0, 2.0):
        u = moving.displacement(time)[inside].mean(axis=0) - moving.displacement(0.0)[inside].mean(axis=0)
        assert u == pytest.approx(0.5 * time * np.subtract(PATH[2], PATH[1]), abs=0.15)
    assert moving.confidence(1.0).max() > 0.5 and moving.deviation(1.0).min() >= 0.0


def test_the_caller_goes_on_and_can_cancel(frames):
    told = []

    def stop_later():
        return len(told) >= 2

    with pytest.raises(vtk.Cancelled):
        vtk.estimate(frames, on_progress=lambda doing, share: told.append((doing, share)), is_cancelled=stop_later, preset="best", **GRID)
    assert all(0.0 <= share <= 1.0 for _, share in told)
    with pytest.raises(ZeroDivisionError):
        vtk.estimate(frames, on_progress=lambda doing, share: 1 / 0, preset="best", **GRID)
    with pytest.raises(ValueError, match="preset"):
        vtk.estimate(frames, preset="quick", **GRID)
    for wrong, words in (({"reference": 4}, "no frame 4: the sequence has 4"), ({"reference": -1}, "no frame -1")):
        with pytest.raises(ValueError, match=words):
            vtk.MovingImage(frames, TIMES, **wrong)
    with pytest.raises(ValueError, match="at least two"):
        vtk.MovingImage(frames[:1], TIMES[:1])
