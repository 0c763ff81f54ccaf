"""palpate in Python. Oracles: phantoms whose motion is known, conventions worked out by hand."""

import inspect
import os
import pickle
import signal
import socket
import subprocess
import sys
import threading
import time
import types
from pathlib import Path

import numpy as np
import pytest

import palpate


def ball(radius, n=40, centre=(0.0, 0.0, 0.0)):
    """1000 inside a ball of voxels, 0 outside, an edge of two voxels: shape (z, y, x)."""
    z, y, x = (axis - (n - 1) / 2 for axis in np.mgrid[:n, :n, :n])
    r = np.sqrt((x - centre[0]) ** 2 + (y - centre[1]) ** 2 + (z - centre[2]) ** 2)
    texture = 60 * np.sin(0.9 * x) * np.sin(0.7 * y) * np.sin(0.8 * z)
    return ((1000 + texture) / (1 + np.exp(r - radius))).astype(np.float32)


# A ball by a formula, with a wall: it is there at once, where the built-in heart takes seconds.
BALL = """{"volumes": [{"name": "ball", "source": "charges", "box_m": [0.128, 0.128, 0.128],
                        "charges": [{"strength_v_m": 1, "softness_m": 0.02}]}],
           "modes": [{"name": "wall", "kind": "surface", "volume": "ball", "strength": {"window": {"level": 25, "width": 4, "full": 5}}}]}"""


@pytest.fixture(scope="module")
def pair():
    fixed, moving = ball(11), ball(11, centre=(1.5, 0.0, 0.0))
    return fixed, moving, palpate.register(fixed, moving, preset="fast")


def test_a_shift_along_x_is_found_along_x(pair):
    fixed, moving, motion = pair
    assert motion.field.shape == (40, 40, 40, 3) and motion.field.dtype == np.float32
    inside = fixed > 500
    mean = motion.field[inside].mean(axis=0)
    assert mean == pytest.approx([1.5, 0.0, 0.0], abs=0.15)
    assert motion.steps == 1 and not motion.is_whole and motion.reference is None
    assert motion.confidence.shape == fixed.shape
    assert 0.0 <= motion.confidence.min() and motion.confidence.max() <= 1.0


def test_the_moving_volume_is_brought_onto_the_fixed_one_and_back(pair):
    fixed, moving, motion = pair
    apart = np.abs(fixed - moving).mean()
    assert np.abs(motion.warp(moving) - fixed).mean() < 0.4 * apart
    assert np.abs(motion.warp(fixed, inverse=True) - moving).mean() < 0.4 * apart
    assert motion.inverse()[fixed > 500].mean(axis=0) == pytest.approx([-1.5, 0.0, 0.0], abs=0.3)


def test_the_verdict_says_what_was_measured(pair):
    verdict = pair[2].verdict
    assert verdict.trust in ("ok", "suspect", "failed")
    assert bool(verdict) == (verdict.trust == "ok") == (not verdict.reasons)
    assert verdict.measured["correlation_after"] > verdict.measured["correlation_before"]
    unmeasured = palpate.register(pair[0], pair[1], preset="fast", verdict=False)
    assert unmeasured.verdict.trust == "" and np.isnan(unmeasured.verdict.measured["correlation_after"])


def test_spacing_makes_millimetres_and_direction_turns_the_field(pair):
    fixed, moving, _ = pair
    # Twice the spacing gives twice the displacement in mm.
    motion = palpate.register(fixed, moving, spacing=(2.0, 2.0, 2.0), preset="fast")
    assert motion.field[fixed > 500].mean(axis=0) == pytest.approx([3.0, 0.0, 0.0], abs=0.3)
    # The index axis x points along P (y of LPS), y along S, z along L.
    turned = palpate.register(fixed, moving, direction=[[0, 0, 1], [1, 0, 0], [0, 1, 0]], preset="fast")
    assert turned.field[fixed > 500].mean(axis=0) == pytest.approx([0.0, 1.5, 0.0], abs=0.15)


@pytest.mark.parametrize("dtype", ["float32", "float64", "int16", "uint16", "int32", "uint32"])
def test_every_type_gives_the_same_motion(pair, dtype):
    fixed, moving = (np.round(volume) for volume in pair[:2])
    exact = palpate.register(fixed, moving, preset="fast", verdict=False).field
    assert np.array_equal(palpate.register(fixed.astype(dtype), moving.astype(dtype), preset="fast", verdict=False).field, exact)


def test_arrays_are_read_where_they_are():
    contiguous = ball(9, 32)
    assert palpate._taken(contiguous) is contiguous
    for dtype in ("int16", "uint8", "float64"):
        array = contiguous.astype(dtype)
        assert palpate._taken(array) is array
    assert not np.shares_memory(palpate._taken(contiguous[::2]), contiguous)
    assert palpate._taken(contiguous.T).flags.c_contiguous


def test_a_sequence_is_one_motion(tmp_path):
    radii = [10 + 1.2 * np.sin(2 * np.pi * k / 5) for k in range(5)]
    frames = np.stack([ball(radius, 36) for radius in radii])
    shares = []
    motion = palpate.register(frames, cyclic=True, preset="fast", progress=lambda doing, share: shares.append((doing, share)))
    assert motion.is_whole and motion.steps == 5 and 0 <= motion.reference < 5
    assert motion.field.shape == (5, 36, 36, 36, 3) and motion.confidence.shape == (5, 36, 36, 36)
    assert np.abs(motion.at(motion.reference)).max() < 0.1
    assert all(0.0 <= share <= 1.0 and doing for doing, share in shares) and shares
    # As a list, and in pairs.
    listed = palpate.register([frame for frame in frames], cyclic=True, preset="fast")
    assert np.array_equal(listed.at(0.5), motion.at(0.5))
    pairs = palpate.register(frames, pairwise=True, preset="fast")
    assert pairs.steps == 4 and not pairs.is_whole
    with pytest.raises(ValueError):
        pairs.at(0.5)
    with pytest.raises(IndexError):
        pairs.step(4)
    assert np.array_equal(pairs.step(-1), pairs.step(3))
    # Written and read again.
    motion.save(tmp_path / "motion.nrrd")
    with pytest.raises(OSError, match="nowhere"):
        motion.save(tmp_path / "nowhere" / "motion.nrrd")
    again = palpate.open_motion(tmp_path / "motion.nrrd")
    assert again.is_whole and again.steps == 5 and again.reference == motion.reference
    # On the grid of the frames, which the file names beside the coarser one that was solved on.
    assert again.spacing == motion.spacing and again.origin == motion.origin
    for k in (0, 4):
        assert np.array_equal(again.step(k), motion.step(k))
        assert np.array_equal(again.warp(frames[k], k), motion.warp(frames[k], k))
    with pytest.raises(ValueError, match=r"shape \(18, 36, 36\), but the motion is that of frames of \(36, 36, 36\)"):
        again.warp(frames[0][::2])
    # Copied as multiprocessing copies it.
    copied = pickle.loads(pickle.dumps(pickle.loads(pickle.dumps(motion))))
    assert np.array_equal(copied.field, motion.field) and np.array_equal(copied.confidence, motion.confidence)
    assert np.array_equal(copied.at(1.3), motion.at(1.3)) and np.array_equal(copied.inverse(time_s=1.3), motion.inverse(time_s=1.3))
    assert np.array_equal(copied.warp(frames[1], 1, inverse=True), motion.warp(frames[1], 1, inverse=True))
    assert repr(copied) == repr(motion) and repr(copied.verdict) == repr(motion.verdict)
    copied.save(tmp_path / "copied.nrrd")
    assert (tmp_path / "copied.nrrd").read_bytes() == (tmp_path / "motion.nrrd").read_bytes()
    assert pickle.loads(pickle.dumps(again)).is_whole
    several = pickle.loads(pickle.dumps(pairs))
    assert several.steps == 4 and np.array_equal(several.field, pairs.field)
    with pytest.raises(ValueError, match="one by one"):
        several.save(tmp_path / "several.nrrd")


def test_times_count_as_the_caller_counts_them():
    frames = np.stack([ball(11, centre=(1.5 * k, 0.0, 0.0)) for k in range(3)])
    known = palpate.register(frames, times=(0.0, 0.5, 1.0), preset="fast", verdict=False)
    later = palpate.register(frames, times=(7.0, 7.5, 8.0), preset="fast", verdict=False)
    copied = pickle.loads(pickle.dumps(later))
    for time_s in (0.0, 0.25, 0.5, 1.0):
        assert np.array_equal(later.at(7.0 + time_s), known.at(time_s))
        assert np.array_equal(copied.at(7.0 + time_s), known.at(time_s))
    assert not np.array_equal(known.at(0.0), known.at(1.0))
    with pytest.raises(ValueError, match="0 or more"):
        palpate.register(frames, times=(-1.0, 0.0, 1.0), preset="fast")
    with pytest.raises(ValueError, match="rise"):
        palpate.register(frames, times=(0.0, 1.0, 1.0), preset="fast")


def test_images_of_four_axes_bring_their_times(monkeypatch):
    nibabel = pytest.importorskip("nibabel")
    frames = np.stack([ball(11, centre=(1.5 * k, 0.0, 0.0)) for k in range(3)])
    known = palpate.register(frames, spacing=(2.0, 2.0, 2.0), direction=np.diag((-1.0, -1.0, 1.0)), times=(0.0, 0.25, 0.5),
                             preset="fast", verdict=False)
    image = nibabel.Nifti1Image(frames.T, np.diag((2.0, 2.0, 2.0, 1.0)))
    image.header.set_zooms((2.0, 2.0, 2.0, 250.0))
    image.header.set_xyzt_units("mm", "msec")
    told = palpate.register(image, preset="fast", verdict=False)
    assert told.at(0.4) == pytest.approx(known.at(0.4), abs=1e-4)

    module = types.ModuleType("SimpleITK")
    module.GetArrayViewFromImage = lambda image: frames
    monkeypatch.setitem(sys.modules, "SimpleITK", module)
    functions = {"GetSpacing": lambda self: (2.0, 2.0, 2.0, 0.25), "GetOrigin": lambda self: (0.0, 0.0, 0.0, 0.0),
                 "GetDirection": lambda self: tuple(np.diag((-1.0, -1.0, 1.0, 1.0)).reshape(-1))}
    simple = type("Image", (), {"__module__": "SimpleITK.SimpleITK", **functions})()
    told = palpate.register(simple, preset="fast", verdict=False)
    assert told.at(0.4) == pytest.approx(known.at(0.4), abs=1e-4)


def write_frames(folder, frames, lines="TransformMatrix = 0 1 0 0 0 1 1 0 0\nOffset = -10 20 300\nElementSpacing = 1 1.5 2\n"):
    """A folder of MetaImages: the index axis x points along P, y along S, z along L."""
    for k, frame in enumerate(frames):
        size = " ".join(map(str, frame.shape[::-1]))
        head = f"ObjectType = Image\nNDims = 3\nBinaryData = True\n{lines}DimSize = {size}\nElementType = MET_FLOAT\nElementDataFile = LOCAL\n"
        (folder / f"frame_{k}.mha").write_bytes(head.encode() + frame.astype("<f4").tobytes())


def test_frames_are_read_from_files(tmp_path):
    frames = np.stack([ball(6, 20, centre=(k, 0.0, 0.0)) for k in range(3)])
    write_frames(tmp_path, frames)
    sequence = palpate.open_sequence(tmp_path)
    assert repr(sequence) == "<palpate.Frames: 3 frames of 20 x 20 x 20>" and sequence.shape == frames.shape
    assert sequence.spacing == (1.0, 1.5, 2.0) and sequence.origin == (-10.0, 20.0, 300.0)
    assert sequence.direction.tolist() == [[0, 0, 1], [1, 0, 0], [0, 1, 0]]
    assert sequence.times == [0.0, 1.0, 2.0] and not sequence.has_times and sequence.notes == []
    assert np.array_equal(np.stack(list(sequence)), frames) and np.array_equal(sequence[-1], frames[2])
    with pytest.raises(IndexError, match="no frame 3: the sequence has 3"):
        sequence[3]
    geometry = {"spacing": sequence.spacing, "origin": sequence.origin, "direction": sequence.direction}
    assert np.array_equal(palpate.register(sequence, preset="fast", verdict=False).field,
                          palpate.register(frames, preset="fast", verdict=False, **geometry).field)
    with pytest.raises(ValueError, match="nowhere"):
        palpate.open_sequence("/nowhere")
    with pytest.raises(TypeError, match="nan_as must be a number"):
        palpate.open_sequence(tmp_path, nan_as="zero")


def test_times_are_read_from_files(tmp_path):
    frames = np.stack([ball(6, 20, centre=(k, 0.0, 0.0)) for k in range(3)])
    nibabel = pytest.importorskip("nibabel")
    image = nibabel.Nifti1Image(frames.T, np.diag((-1.0, -1.0, 1.0, 1.0)))
    image.header.set_xyzt_units("mm", "msec")
    image.header.set_zooms((1.0, 1.0, 1.0, 250.0))
    nibabel.save(image, tmp_path / "frames.nii")
    sequence = palpate.open_sequence(tmp_path / "frames.nii")
    assert sequence.has_times and sequence.times == pytest.approx([0.0, 0.25, 0.5])
    assert np.array_equal(palpate.register(sequence, preset="fast", verdict=False).at(0.4),
                          palpate.register(frames, times=sequence.times, preset="fast", verdict=False).at(0.4))


def test_points_go_where_their_material_goes():
    fixed, moving = ball(11), ball(11, centre=(1.5, 0.0, 0.0))
    grid = {"spacing": (1.0, 1.5, 2.0), "origin": (-10.0, 20.0, 300.0), "direction": [[0, 0, 1], [1, 0, 0], [0, 1, 0]]}
    motion = palpate.register(fixed, moving, preset="fast", verdict=False, **grid)
    k, j, i = 17, 21, 24
    # By hand: x is P, y is S, z is L. The middle between two samples along y gets the mean of their vectors.
    at = (-10.0 + 2.0 * k, 20.0 + 1.0 * i, 300.0 + 1.5 * (j + 0.5))
    moved = motion.move_points([at])
    assert moved[0] - at == pytest.approx(0.5 * (motion.field[k, j, i] + motion.field[k, j + 1, i]), abs=1e-5)
    assert moved[0][1] - at[1] > 0.5
    with pytest.raises(ValueError, match=r"shape \(n, 3\)"):
        motion.move_points(at)


def test_determinants_are_the_change_of_volume():
    fixed, moving = ball(11), ball(9.9)
    grid = {"spacing": (1.0, 1.5, 2.0), "direction": [[0, 0, 1], [1, 0, 0], [0, 1, 0]]}
    motion = palpate.register(fixed, moving, preset="fast", **grid)
    # A field that shrinks to 0.9 along P and 0.8 along L.
    z, y, x = np.mgrid[:4, :5, :6].astype(float)
    u = np.stack((-0.2 * 2.0 * z, -0.1 * x, 0 * y), axis=-1)
    assert palpate._determinant(u, **grid) == pytest.approx(np.full(z.shape, 0.72), abs=1e-6)
    inside = motion.determinant()[ball(8) > 500]
    assert motion.determinant().dtype == np.float32 and 0.5 < inside.mean() < 0.95


def test_nibabel_images_bring_their_geometry():
    nibabel = pytest.importorskip("nibabel")
    fixed, moving = ball(11), ball(11, centre=(1.5, 0.0, 0.0))
    # RAS axes: i points to R, so the shift along i is one along -L.
    affine = np.diag([2.0, 2.0, 2.0, 1.0])
    images = [nibabel.Nifti1Image(volume.T, affine) for volume in (fixed, moving)]
    motion = palpate.register(*images, preset="fast")
    assert motion.field[fixed > 500].mean(axis=0) == pytest.approx([-3.0, 0.0, 0.0], abs=0.3)
    assert motion.spacing == pytest.approx((2.0, 2.0, 2.0))
    sequence = nibabel.Nifti1Image(np.stack([fixed.T, moving.T, fixed.T], axis=-1), affine)
    assert palpate.register(sequence, pairwise=True, preset="fast").steps == 2


def test_nibabel_images_are_read_from_files(tmp_path):
    """Their samples have a type object of their own, equal to numpy's."""
    nibabel = pytest.importorskip("nibabel")
    affine = np.diag([2.0, 2.0, 2.0, 1.0])
    paths = []
    for name, x in (("fixed", 0.0), ("moving", 1.5)):
        paths.append(tmp_path / f"{name}.nii.gz")
        nibabel.save(nibabel.Nifti1Image(ball(11, centre=(x, 0.0, 0.0)).astype(np.int16).T, affine), paths[-1])
    motion = palpate.register(*(nibabel.load(path) for path in paths), preset="fast", verdict=False)
    assert motion.field[ball(11) > 500].mean(axis=0) == pytest.approx([-3.0, 0.0, 0.0], abs=0.3)


def test_images_of_other_formats_are_frames_too():
    """Each of nibabel's kinds of four axes, from its own test data where there are some: shape, and the time between frames."""
    nibabel = pytest.importorskip("nibabel")
    data = os.path.join(os.path.dirname(nibabel.__file__), "tests", "data")
    frames = np.stack([ball(6, 20, centre=(k, 0.0, 0.0)) for k in range(3)])
    affine = np.diag((-1.0, -1.0, 1.0, 1.0))
    known = palpate.register(frames, preset="fast", verdict=False).field
    for kind in (nibabel.MGHImage, nibabel.AnalyzeImage, nibabel.Spm99AnalyzeImage, nibabel.Spm2AnalyzeImage, nibabel.Nifti2Image):
        found = palpate._image_of(kind(frames.T, affine))
        assert found.array.shape == frames.shape and not found.step_s
    assert np.array_equal(palpate.register(nibabel.MGHImage(frames.T, affine), preset="fast", verdict=False).field, known)
    image = nibabel.MGHImage(frames.T, affine)
    image.header["tr"] = 250.0  # ms
    assert palpate._image_of(image).step_s == pytest.approx(0.25)
    for name, shape, step_s in (("example4d+orig.HEAD", (3, 25, 41, 33), 3.0), ("minc1_4d.mnc", (2, 20, 20, 10), 2.0),
                                ("phantom_EPI_asc_CLEAR_2_1.PAR", (3, 9, 64, 64), 2.0), ("functional.nii", (20, 3, 21, 17), 2.0)):
        if not os.path.exists(os.path.join(data, name)):
            continue
        found = palpate._image_of(nibabel.load(os.path.join(data, name)))
        assert found.array.shape == shape and found.step_s == pytest.approx(step_s)
    # A fifth axis of one, a single frame of four axes, and a step without a unit, as in the program.
    image = nibabel.Nifti1Image(frames.T[..., None], affine)
    assert palpate._image_of(image).array.shape == frames.shape and not palpate._image_of(image).step_s
    image.header.set_zooms((1.0, 1.0, 1.0, 0.8, 1.0))
    assert palpate._image_of(image).step_s == pytest.approx(0.8)
    image.header.set_xyzt_units("micron", "hz")
    assert palpate._image_of(image).step_s == 0.0 and palpate._image_of(image).spacing == pytest.approx((0.001,) * 3)
    first, second = (nibabel.Nifti1Image(frame.T[..., None], affine) for frame in frames[:2])
    assert np.array_equal(palpate.register(first, second, preset="fast", verdict=False).field,
                          palpate.register(frames[0], frames[1], preset="fast", verdict=False).field)


def test_masked_samples_count_for_nothing(pair):
    fixed, moving, _ = pair
    hidden = np.zeros(fixed.shape, dtype=bool)
    hidden[:, :, :9] = True
    junk = np.where(hidden, np.random.default_rng(3).uniform(-5000, 5000, fixed.shape), fixed).astype(np.float32)
    masked = palpate.register(np.ma.array(junk, mask=hidden), moving, preset="fast", verdict=False).field
    filled = np.where(hidden, fixed[~hidden].mean(), fixed).astype(np.float32)
    assert masked == pytest.approx(palpate.register(filled, moving, mask=~hidden, preset="fast", verdict=False).field, abs=1e-3)
    with pytest.raises(ValueError, match="all samples"):
        palpate.register(np.ma.array(fixed, mask=True), moving)
    with pytest.raises(ValueError, match="masked samples"):
        pair[2].warp(np.ma.array(junk, mask=hidden))
    with pytest.raises(ValueError, match="masked samples"):
        palpate.Session(frames=np.ma.array(junk, mask=hidden), gpu=None, estimate=False)
    assert np.array_equal(pair[2].warp(np.ma.array(fixed)), pair[2].warp(fixed))


def test_a_motion_can_be_copied_to_another_process(pair):
    fixed, moving, motion = pair
    copied = pickle.loads(pickle.dumps(motion))
    assert np.array_equal(copied.field, motion.field)
    # The copy's field has the frames' samples, of which the inverse is taken; the motion's own has the coarser ones that were solved for.
    assert copied.inverse() == pytest.approx(motion.inverse(), abs=0.02)
    assert np.array_equal(copied.warp(moving), motion.warp(moving)) and np.array_equal(copied.confidence, motion.confidence)
    assert not copied.is_whole and copied.steps == 1 and repr(copied.verdict) == repr(motion.verdict)
    turned = palpate.register(fixed, moving, direction=[[0, 0, 1], [1, 0, 0], [0, 1, 0]], origin=(0.1, -7.0, 3.3), preset="fast",
                              verdict=False)
    left = palpate.register(fixed, moving, direction=np.diag((1.0, -1.0, 1.0)), preset="fast", verdict=False)
    for one in (turned, left):
        again = pickle.loads(pickle.dumps(one))
        assert again.origin == one.origin and np.array_equal(again.field, one.field) and np.array_equal(again.warp(moving), one.warp(moving))


@pytest.mark.parametrize("wrong, kind, words", [
    (lambda fixed, moving, motion: palpate.register(fixed, moving, preset=3), TypeError, "preset must be a text, not int"),
    (lambda fixed, moving, motion: palpate.register(fixed, moving, progress=3), TypeError, "progress must be a function"),
    (lambda fixed, moving, motion: palpate.register(fixed, moving, times=["a", "b"]), TypeError, "a time must be a number, not str"),
    (lambda fixed, moving, motion: palpate.register(fixed, moving, spacing=(1, 0, 1)), ValueError, "not positive"),
    (lambda fixed, moving, motion: palpate.register(fixed, moving, origin=(1, np.nan, 1)), ValueError, "not finite"),
    (lambda fixed, moving, motion: palpate.register(fixed, moving, direction=np.ones((3, 3))), ValueError, "not perpendicular"),
    (lambda fixed, moving, motion: palpate.register(fixed, moving, mask=fixed[1:]), ValueError, "the mask has the shape"),
    (lambda fixed, moving, motion: palpate.register(fixed[:0], moving[:0]), ValueError, "no samples"),
    (lambda fixed, moving, motion: motion.step("0"), TypeError, "a step must be a whole number, not str"),
    (lambda fixed, moving, motion: motion.at(None), TypeError, "time_s must be a number"),
    (lambda fixed, moving, motion: motion.warp(moving, time_s="x"), TypeError, "time_s must be a number"),
    (lambda fixed, moving, motion: palpate.Session("heart", strength_n=np.nan), ValueError, "strength_n is nan, but a number from 0.01 to 1000 N is expected"),
    (lambda fixed, moving, motion: palpate.Session("heart", friction="much"), TypeError, "friction must be a number, not str"),
    (lambda fixed, moving, motion: palpate.Session("heart", wall=7), TypeError, "wall must be a text, not int")])
def test_wrong_arguments_are_said_in_one_short_sentence(pair, wrong, kind, words):
    with pytest.raises(kind, match=words) as refused:
        wrong(*pair)
    assert len(str(refused.value)) < 160 and "\n" not in str(refused.value) and "PalGrid" not in str(refused.value)


def test_simple_itk_images_bring_their_geometry(monkeypatch):
    """Debian has no SimpleITK: a module with the four functions that are asked of it stands for it."""
    module = types.ModuleType("SimpleITK")

    class Image:
        def __init__(self, array):
            self.array = array

        def GetSpacing(self):
            return (2.0, 2.0, 2.0)

        def GetOrigin(self):
            return (1.0, 2.0, 3.0)

        def GetDirection(self):
            return (0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0)

    Image.__module__ = "SimpleITK"
    module.GetArrayViewFromImage = lambda image: image.array
    monkeypatch.setitem(sys.modules, "SimpleITK", module)
    fixed, moving = ball(11), ball(11, centre=(1.5, 0.0, 0.0))
    motion = palpate.register(Image(fixed), Image(moving), preset="fast")
    assert motion.field[fixed > 500].mean(axis=0) == pytest.approx([0.0, 3.0, 0.0], abs=0.3)
    assert motion.origin == (1.0, 2.0, 3.0)


def test_a_mask_is_honoured(pair):
    fixed, moving, _ = pair
    mask = np.zeros(fixed.shape, dtype=bool)
    with pytest.raises(ValueError, match="mask"):
        palpate.register(fixed, moving, mask=mask, preset="fast")
    mask[:20] = True
    masked = palpate.register(fixed, moving, mask=mask, preset="fast", verdict=False)
    assert not np.array_equal(masked.field, palpate.register(fixed, moving, preset="fast", verdict=False).field)


@pytest.mark.parametrize("wrong, kind, words", [
    (lambda f, m: palpate.register(f), ValueError, "one volume"),
    (lambda f, m: palpate.register([f]), ValueError, "at least two"),
    (lambda f, m: palpate.register(f, m[:-1]), ValueError, "different shapes"),
    (lambda f, m: palpate.register(f, m, spacing=(1, 1)), ValueError, "spacing needs 3"),
    (lambda f, m: palpate.register(f, m, spacing=(1, 1, -1)), ValueError, "not positive"),
    (lambda f, m: palpate.register(f, m, preset="quickest"), ValueError, "preset"),
    (lambda f, m: palpate.register(f * np.nan, m), ValueError, "not finite"),
    (lambda f, m: palpate.register(f.astype(complex), m), TypeError, "complex"),
    (lambda f, m: palpate.register(f, m, times=[0.0]), ValueError, "1 times"),
    (lambda f, m: palpate.register(f, m, times=[1.0, 0.5]), ValueError, "rise"),
    (lambda f, m: palpate.register(f, m, gpu="no such device"), RuntimeError, "no such device"),
])
def test_what_can_not_be_is_said(pair, wrong, kind, words):
    with pytest.raises(kind, match=words):
        wrong(*pair[:2])


def test_what_progress_raises_ends_the_estimation(pair):
    def fail(doing, share):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        palpate.register(pair[0], pair[1], progress=fail)
    # The callback of the first of many pairs ends it, while further frames wait.
    with pytest.raises(RuntimeError, match="enough"):
        palpate.register([ball(9 + 0.2 * k) for k in range(8)], pairwise=True, progress=fail)


def test_ctrl_c_is_heard_between_the_frames_of_pairs():
    heard = []

    def interrupt(doing, share):
        if not heard:
            os.kill(os.getpid(), signal.SIGINT)
        heard.append(doing)

    with pytest.raises(KeyboardInterrupt):
        palpate.register([ball(9 + 0.2 * k) for k in range(10)], pairwise=True, preset="fast", verdict=False, progress=interrupt)
    assert heard and "frame 8 to 9" not in heard


def test_a_lost_device_is_opened_anew():
    """With the library of lost_device.h in front of Vulkan's loader, whose device is lost when it is told so."""
    library = os.environ.get("PALPATE_LOST_DEVICE")
    if not library:
        pytest.skip("PALPATE_LOST_DEVICE does not say where the library is that loses devices")
    program = """
import ctypes, sys
sys.path.insert(0, {folder!r})
import numpy as np, palpate
from test_palpate import BALL, ball
lose = ctypes.CDLL(None).lose_vulkan_device
pair = ball(9, 32), ball(9, 32, centre=(1.0, 0.0, 0.0))
find = lambda: palpate.register(*pair, preset="fast", verdict=False).field
def is_refused(work):
    try:
        work()
    except RuntimeError as error:
        return "lost" in str(error)
    return False
sound = find()
lose()
assert is_refused(find)
assert np.array_equal(find(), sound)
with palpate.Session(json=BALL) as session:
    session.tick((0.0, 0.0, 0.09), 5_000_000_000)
    session.picture(width=32, height=32)
    lose()
    for _ in range(2):
        assert is_refused(lambda: session.picture(width=32, height=32))
with palpate.Session(json=BALL) as session:
    session.tick((0.0, 0.0, 0.09), 5_000_000_000)
    session.picture(width=32, height=32)
assert np.array_equal(find(), sound)
""".format(folder=os.path.dirname(os.path.abspath(__file__)))
    done = subprocess.run([sys.executable, "-c", program], env={**os.environ, "LD_PRELOAD": library}, capture_output=True, text=True,
                          check=False)
    assert done.returncode == 0, done.stderr


def test_other_threads_run_meanwhile():
    count = [0]
    end = threading.Event()

    def work():
        while not end.is_set():
            count[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=work)
    thread.start()
    palpate.register(ball(20, 72), ball(20, 72, centre=(1.0, 0.0, 0.0)), preset="best")
    end.set()
    thread.join()
    assert count[0] > 20


def test_ctrl_c_ends_it():
    program = """
import sys, threading, numpy as np, palpate
sys.path.insert(0, {folder!r})
from test_palpate import ball
frames = [ball(22 + k, 96) for k in range(6)]
print("begin", flush=True)
palpate.register(frames, preset="best")
""".format(folder=os.path.dirname(os.path.abspath(__file__)))
    process = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "begin\n"
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode != 0 and "KeyboardInterrupt" in said


def test_a_scene_is_felt_and_seen():
    with palpate.Session("heart", preset="fast") as session:
        assert "wall" in session.plan
        with pytest.raises(ValueError):
            session.picture()
        force, at_ns = (0.0, 0.0, 0.0), 5_000_000_000
        for k in range(3000):
            at_ns += 1_000_000
            force = session.tick((0.0, 0.0, max(0.03, 0.09 - 3e-5 * k)), at_ns)
        assert session.state["in_contact"] and np.linalg.norm(force) > 0.05
        assert session.state["ticks"] == 3000
        state = session.state
        assert len(state["held_n"]) == 14 and np.linalg.norm(state["asked_n"]) > 0.05
        left_n = np.array(state["asked_n"]) - sum(np.array(held) for held in state["held_n"].values())
        assert np.allclose(left_n, state["force_n"], rtol=0.0, atol=1e-9)
        picture = session.picture(width=160, height=120)
        assert picture.shape == (120, 160, 4) and picture.dtype == np.uint8
        assert picture[..., 3].max() == 255 and picture[..., 3].min() == 0
        # From straight above there is no direction to the right, and at the camera itself nothing to look at.
        assert session.picture((0.0, 0.4, 0.0), width=64, height=48)[..., 3].max() == 255
        with pytest.raises(ValueError, match="same place"):
            session.picture((0.1, 0.2, 0.3), (0.1, 0.2, 0.3))
        with pytest.raises(ValueError, match="position_m must be 3 numbers"):
            session.picture((0.1, 0.2))
        with pytest.raises(TypeError, match="three numbers"):
            session.tick("here")
        assert session.state["shaft"] == (0.0, 0.0, 0.0)
        # A quarter turn about x: the shaft goes from z to -y.
        session.hold((0.5 ** 0.5, 0.5 ** 0.5, 0.0, 0.0), angular_velocity_rad_per_s=(0.1, 0.0, 0.0), opening_rad=0.2)
        session.tick((0.0, 0.0, 0.03), at_ns := at_ns + 1_000_000)
        assert np.allclose(session.state["shaft"], (0.0, -1.0, 0.0), atol=1e-12)
        with pytest.raises(TypeError, match="four numbers"):
            session.hold("upright")
        session.stop()
        for k in range(700):
            at_ns += 1_000_000
            force = session.tick((0.0, 0.0, 0.03), at_ns)
        assert session.at_rest and np.linalg.norm(force) == 0.0
    with pytest.raises(ValueError, match="closed"):
        session.tick((0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="nowhere"):
        palpate.Session("/nowhere.mha")


def test_threads_may_ask_for_pictures_at_once():
    with palpate.Session(json=BALL) as session:
        session.tick((0.0, 0.0, 0.09), 5_000_000_000)
        wrong = []

        def ask(width, height):
            try:
                for _ in range(5):
                    picture = session.picture(width=width, height=height)
                    assert picture.shape == (height, width, 4)
                    assert picture[..., 3].max() == 255 and picture[..., 3].min() == 0
            except Exception as error:
                wrong.append(error)

        threads = [threading.Thread(target=ask, args=size) for size in ((64, 48), (48, 64), (40, 40))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert not wrong


def test_changes_that_can_not_be_taken_are_said():
    with palpate.Session(json=BALL, movable=True) as session:
        for change in (lambda: session.place(0, np.eye(4)), lambda: session.set_mode(0, True, 0.5), session.rearm, session.release_tube,
                       session.keep_tubes, session.clear_tubes):
            session.tick((0.0, 0.0, 0.09))
            assert change() is True
            # Without a tick they are buffered; there is room for some.
            assert any(change() is False for _ in range(10000))


def test_a_scene_goes_with_a_session_that_can_not_be_opened():
    def resident_mib():
        with open("/proc/self/statm", encoding="ascii") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20

    scene = """{"volumes": [{"name": "thing", "files": ["frames"]}],
                "modes": [{"name": "wall", "kind": "surface", "volume": "thing", "strength": {"pairs": [[0, 0], [500, 0], [500, 3]]}}]}"""
    frames = np.tile(np.linspace(0.0, 1000.0, 128, dtype=np.float32), (12, 128, 128, 1))

    def fail():
        with pytest.raises(ValueError, match="preset"):
            palpate.Session(json=scene, frames=frames, estimate=False, preset="quickest")

    fail()
    before = resident_mib()
    for _ in range(4):
        fail()
    # Four scenes that are not freed would take 800 MiB.
    assert resident_mib() - before < 100.0


def comes(question, seconds=60.0):
    """Asks again and again until it is so, for as long as a busy machine may need."""
    end = time.monotonic() + seconds
    while not question():
        if time.monotonic() > end:
            return False
        time.sleep(0.005)
    return True


class Ticking:
    """A thread that ticks a session, its hand at rest along z. On a busy machine it ticks late: take watchdog_s=1.0."""

    def __init__(self, session, z_m):
        self.force, self.z_m = (0.0, 0.0, 0.0), 0.06
        self._session, self._wanted_m, self._over = session, z_m, threading.Event()
        self._thread = threading.Thread(target=self._run)

    def _run(self):
        while not self._over.is_set():
            self.z_m += min(max(self._wanted_m - self.z_m, -3e-5), 3e-5)
            self.force = self._session.tick((0.0, 0.0, self.z_m))
            time.sleep(0.001)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._over.set()
        self._thread.join()


def test_frames_that_are_pushed_are_felt():
    middle = dict(origin=(-19.5, -19.5, -19.5), spacing=(1.0, 1.0, 1.0))
    with palpate.Session(frames=ball(11), live=True, follow=True, preset="fast", true_size=True, watchdog_s=1.0, **middle) as session:
        with Ticking(session, 0.0095):
            assert comes(lambda: session.state["in_contact"]), session.state["cause"]
            for frame, radius in enumerate((12, 13), 1):
                session.push_frame(ball(radius), time_ns=time.monotonic_ns())
                assert comes(lambda: session.state["frames_felt"] == frame), session.events()
                assert comes(lambda: abs(session.state["proxy_m"][2] - 1e-3 * radius) < 5e-4), session.state["proxy_m"]
            session.push_frame(ball(13)[:, :, 1:], origin=(-18.5, -19.5, -19.5))
            with pytest.raises(ValueError, match="another shape"):
                session.push_frame(ball(13)[1:])
            assert comes(lambda: session.state["frames_received"] == 3)
    with pytest.raises(ValueError, match="one frame"):
        palpate.Session(frames=[ball(11), ball(12)], live=True)
    with palpate.Session("shell", estimate=False) as session, pytest.raises(ValueError, match="takes no frames"):
        session.push_frame(ball(11))


def test_frames_in_memory_are_those_of_a_scene():
    scene = """{"volumes": [{"name": "thing", "files": ["frames"]}],
                "modes": [{"name": "wall", "kind": "surface", "volume": "thing", "strength": {"pairs": [[0, 0], [500, 0], [500, 3]]}}]}"""
    with palpate.Session(json=scene, frames=ball(11), origin=(-19.5, -19.5, -19.5), estimate=False, watchdog_s=1.0) as session:
        with Ticking(session, 0.0095):
            assert comes(lambda: session.state["in_contact"])
            assert comes(lambda: abs(session.state["proxy_m"][2] - 0.011) < 5e-4), session.state["proxy_m"]
    with palpate.Session(frames=np.stack([ball(11), ball(12)]), motion=False, wall="values", values="own", estimate=False) as session:
        assert len(session.state["volumes"]) <= 1 and "values" in session.plan


def test_a_simulated_hand_is_tabled_recorded_and_replayed(tmp_path):
    record, csv, tubes = tmp_path / "ticks.bin", tmp_path / "ticks.csv", tmp_path / "tubes.vtk"
    with palpate.Session("shell", estimate=False, device="simulated", path="tap", hand="firm", real_time=False, record=record,
                         csv=csv) as session:
        with pytest.raises(ValueError, match="thread of its own"):
            session.tick((0.0, 0.0, 0.0))
        assert comes(lambda: np.linalg.norm(session.state["force_n"]) > 0.3)
        session.release_tube()
        assert comes(lambda: len(session.tubes) == 1)
        session.stop()
        ticks = session.state["ticks"]
    with palpate.Session("shell", estimate=False) as session:
        assert session.replay(record, tubes=tubes) == {"ticks": ticks, "different": 0, "first_different": None, "is_cut_off": False}
        with pytest.raises(ValueError):
            session.replay(csv)
    assert tubes.read_text().startswith("# vtk DataFile")
    rows = csv.read_text().splitlines()
    assert rows[0].startswith("t_s,dt_s,force_x_n") and len(rows) == ticks + 1


def test_what_is_felt_is_served():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with palpate.Session("shell", estimate=False, serve=port) as session, Ticking(session, 0.06):
        with socket.create_connection(("127.0.0.1", port), timeout=60.0) as client:
            heard = b""
            while b"palpate_proxy" not in heard or b"palpate_force" not in heard:
                got = client.recv(65536)
                assert got
                heard += got
        with pytest.raises(ValueError, match="can not be had"):
            palpate.Session("shell", estimate=False, serve=port)


@pytest.mark.parametrize("wrong, kind, words", [
    (dict(wall="brick"), ValueError, "'brick'"),
    (dict(values="all"), ValueError, "'all'"),
    (dict(device="simulated", path="sideways"), ValueError, "sideways"),
    (dict(device="simulated", hand="strong"), ValueError, "'strong'"),
    (dict(csv="/nowhere/ticks.csv"), OSError, "/nowhere"),
    (dict(serve=70000), ValueError, "serve is 70000"),
    (dict(watchdog=0.01), TypeError, "no option 'watchdog': did you mean 'watchdog_s'"),
    (dict(core=1.5), TypeError, "core must be a whole number"),
    (dict(scene="igtl://127.0.0.1:1", wait_s=0.2), RuntimeError, "does not answer within 0.2 s"),
])
def test_sessions_that_can_not_be_are_said(wrong, kind, words):
    given = dict(frames=ball(11), estimate=False) | wrong
    if "scene" in wrong:
        del given["frames"]
    with pytest.raises(kind, match=words):
        palpate.Session(**given)


def test_the_stub_and_the_documentation_have_every_option():
    text = {"flag": "bool", "number": "float", "whole number": "int", "word": "str", "text": "str | PathLike[str]", "path": "str | PathLike[str]",
            "paths": "str | PathLike[str] | Sequence[str | PathLike[str]]", "texts": "str | Sequence[str]"}
    rows = palpate._OPTIONS.values()
    wanted = [f"        {row['key']}: {'float | str' if row['type'] == 'number' and row.get('words') else text[row['type']]} | None = None,"
              for row in rows]
    stub = (Path(palpate.__file__).parent / "__init__.pyi").read_text().splitlines()
    first = stub.index(wanted[0])
    assert stub[first:first + len(wanted)] == wanted, "\n".join(wanted)
    assert stub[first + len(wanted)] == "    ) -> None: ..."
    keywords = inspect.signature(palpate.Session).parameters
    for row in rows:
        assert row["key"] in keywords
        assert f"        {row['key']}: " in palpate.Session.__doc__


def test_a_session_lays_stream_tubes(tmp_path):
    with palpate.Session("shell", estimate=False) as session:
        assert session.tubes == []
        at_ns = 5_000_000_000

        def tick_until(condition):
            nonlocal at_ns
            for _ in range(10000):
                at_ns += 1_000_000
                session.tick((0.0, 0.0, 0.03), at_ns)
                if condition():
                    return True
                time.sleep(0.001)
            return False

        assert tick_until(lambda: session.state["can_play"])
        session.release_tube()
        assert tick_until(lambda: len(session.tubes) == 1), session.events()
        tube = session.tubes[0]
        assert tube["field"] == "velocity" and tube["unit"] == "m/s" and not tube["kept"]
        assert tube["points_m"].shape == (len(tube["lengths"]), 3) and len(tube["lengths"]) > 3
        assert np.isfinite(tube["points_m"]).all() and tube["lengths"].min() >= 0.0
        # The shell's wall moves along its radius, and so does the tube.
        ends = tube["points_m"][[0, -1]]
        assert abs(np.linalg.norm(ends[0]) - np.linalg.norm(ends[1])) > 0.001
        session.keep_tubes()
        session.release_tube()
        assert tick_until(lambda: [one["kept"] for one in session.tubes] == [True, False])
        session.save_tubes(tmp_path / "tubes.vtk")
        assert "LINES 2 " in (tmp_path / "tubes.vtk").read_text()
        with pytest.raises(OSError, match="vtk"):
            session.save_tubes(tmp_path / "tubes.csv")
        session.clear_tubes()
        assert tick_until(lambda: len(session.tubes) == 1)
