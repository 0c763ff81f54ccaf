"""palpate.testing: each check passes once and fails once, at a place that is known. Oracles: fields given by formulas, and a real chest CT in known
motion."""

import zlib
from pathlib import Path

import numpy as np
import pytest

from palpate import testing

# Every axis differs, so that an exchange of two shows.
SHAPE = (20, 24, 28)
GRID = {"spacing": (1.0, 1.5, 2.0), "origin": (-10.0, 20.0, 300.0), "direction": [[0, 0, 1], [1, 0, 0], [0, 1, 0]]}
# x (3), y (4), z (5) of the index in LPS mm: x runs along P, y along S, z along L.
PLACE = r"voxel \(3, 4, 5\), \(0\.0, 23\.0, 306\.0\) mm"


def shift(mm=(0.0, 0.0, 0.0)):
    return np.broadcast_to(np.array(mm, dtype=np.float32), SHAPE + (3,)).copy()


def test_a_fold_is_found_where_it_is():
    field = shift()
    testing.assert_no_folds(field, **GRID)
    # Along the index axis x, which is P: the next sample comes to lie behind the one before.
    field[5, 4, 3:, 1] = -1.2
    with pytest.raises(AssertionError, match=r"folds at 2 of 13440 samples; the smallest determinant is -0\.2 \(limit: above 0\) at voxel \([23], 4, 5\)"):
        testing.assert_no_folds(field, **GRID)
    # The same numbers along L shear the material, and change no volume.
    testing.assert_no_folds(field[..., [1, 0, 2]], **GRID)
    # A left-handed grid: the same material.
    testing.assert_no_folds(shift(), direction=np.diag([1, 1, -1]))


def test_a_sample_that_is_not_finite_is_found():
    field = shift()
    field[5, 4, 3, 2] = np.nan
    for check in (testing.assert_no_folds, lambda field, **grid: testing.assert_within(field, shift(), 1.0, **grid)):
        with pytest.raises(AssertionError, match="not finite at 1 of 13440 samples, first at " + PLACE):
            check(field, **GRID)


def test_the_distance_to_a_truth_is_in_voxels_of_the_finest_edge():
    grid = {**GRID, "spacing": (2.0, 3.0, 4.0)}
    field = shift((0.0, 0.4, 0.0))
    testing.assert_within(field, shift(), 0.2001, **grid)
    field[5, 4, 3, 1] = 6.0
    with pytest.raises(AssertionError, match=r"differs from the truth by 0\.2 voxels on average, which is more than 0\.1 .*at most 3 voxels, at voxel \(3, 4, 5\)"):
        testing.assert_within(field, shift(), 0.1, **grid)
    mask = np.zeros(SHAPE)
    mask[5, 4, 3] = 1
    with pytest.raises(AssertionError, match=r"by 3 voxels on average.* 1 samples"):
        testing.assert_within(field, shift(), 1.0, mask=mask, **grid)
    with pytest.raises(ValueError, match="mask is empty"):
        testing.assert_within(field, shift(), 1.0, mask=0 * mask, **grid)
    with pytest.raises(ValueError, match="the truth has .* resample"):
        testing.assert_within(field, shift()[1:], 1.0, **grid)


def test_a_field_is_undone_by_its_inverse():
    # u = a x along P (index axis x, 1 mm a voxel), from the first sample on: its inverse is w = -a / (1 + a) x.
    x_mm = np.arange(SHAPE[2], dtype=np.float32)
    forward, backward = shift(), shift()
    forward[..., 1] = 0.1 * x_mm
    backward[..., 1] = -0.1 / 1.1 * x_mm
    # 0.0455 voxel at one of 26 samples: half a voxel beyond the last one the border of w goes on.
    testing.assert_undone_by(forward, backward, 0.00176, **GRID)
    backward[5, 4, 0, 1] += 2.0  # u is 0 there
    with pytest.raises(AssertionError, match=r"misses its start by .* at most 2 voxels, at voxel \(0, 4, 5\)"):
        testing.assert_undone_by(forward, backward, 0.00176, **GRID)
    with pytest.raises(AssertionError, match="misses its start"):
        testing.assert_undone_by(forward, forward, 0.1, **GRID)


def test_landmarks_are_followed():
    field = shift((0.5, -1.0, 2.0))
    fixed = np.array([[0.0, 23.0, 306.0], [-5.0, 25.5, 310.2]])
    moving = fixed + (0.5, -1.0, 2.0)
    testing.assert_landmarks(field, fixed, moving, 1e-4, **GRID)
    moving[0, 1] += 3.0
    with pytest.raises(AssertionError, match=r"the 2 landmarks are missed by 1\.5 mm on average, .* 1 mm .*; landmark 0 by 3 mm, at " + PLACE):
        testing.assert_landmarks(field, fixed, moving, 1.0, **GRID)
    field[...] = np.nan
    with pytest.raises(AssertionError, match="missed by nan mm"):
        testing.assert_landmarks(field, fixed, moving, 1.0, **GRID)
    with pytest.raises(ValueError, match="1 landmarks lie outside of the field, first number 1"):
        testing.assert_landmarks(field, [fixed[0], (0.0, 0.0, 0.0)], moving, 1.0, **GRID)


def test_optical_flow_agrees_with_the_right_field_only():
    pytest.importorskip("cv2")
    random = np.random.default_rng(7)
    waves = random.normal(size=(40, 3)) * 0.5
    phases = random.uniform(0, 2 * np.pi, 40)

    def material(centre):
        z, y, x = (np.arange(48) - c for c in centre)
        return sum(np.sin(w[0] * x[None, None, :] + w[1] * y[None, :, None] + w[2] * z[:, None, None] + p) for w, p in zip(waves, phases))

    fixed, moving = material((0.0, 0.0, 0.0)), material((0.0, 0.4, 1.5))
    field = np.broadcast_to(np.array((1.5, 0.4, 0.0)), (48, 48, 48, 3)).copy()
    testing.assert_agrees_with_flow(field, fixed, moving)
    with pytest.raises(AssertionError, match=r"optical flow disagrees: across axis [xyz] the difference at \d+ pixels is .*limit 0\.5.*at voxel \("):
        testing.assert_agrees_with_flow(0.0 * field, fixed, moving)
    with pytest.raises(AssertionError, match="can not tell"):
        testing.assert_agrees_with_flow(field, 0.0 * fixed, 0.0 * moving)
    # Where one of the volumes shows little more than noise, flow is no witness against the field.
    for faint in (0, 1):
        pair = [fixed.copy(), moving.copy()]
        pair[faint][24:] *= 0.1
        pair[faint] += random.normal(size=fixed.shape)
        other = field.copy()
        other[24:] = (-1.5, 3.0, 0.0)
        testing.assert_agrees_with_flow(other, *pair)


def read_field(path):
    """A field (z, y, x, 3) in a compressed MetaImage of float, and its geometry."""
    head, _, samples = path.read_bytes().partition(b"ElementDataFile = LOCAL\n")
    keys = dict(line.split(" = ", 1) for line in head.decode().splitlines())
    size, spacing, origin = ([float(number) for number in keys[key].split()] for key in ("DimSize", "ElementSpacing", "Offset"))
    assert keys["ElementType"] == "MET_FLOAT" and keys["TransformMatrix"] == "1 0 0 0 1 0 0 0 1"
    shape = [int(n) for n in reversed(size)] + [3]
    return np.frombuffer(zlib.decompress(samples), dtype="<f4").reshape(shape), {"spacing": spacing, "origin": origin}


def test_a_real_chest():
    lung = next((folder / "shared/data/lung" for folder in Path(__file__).resolve().parents if (folder / "shared/data/lung").is_dir()), None)
    if lung is None:
        pytest.skip("shared/data/lung is not beside this checkout")
    truth, grid = read_field(lung / "pair_truth.mha")
    testing.assert_no_folds(truth, **grid)
    fixed = np.loadtxt(lung / "breathing_points.csv", delimiter=",", skiprows=2)
    at = slice(1, 4), slice(13, 16)  # frames 0 and 4: the whole motion
    testing.assert_landmarks(truth, fixed[:, at[0]], fixed[:, at[1]], 0.05, **grid)
    with pytest.raises(AssertionError, match="the 400 landmarks are missed by"):
        testing.assert_landmarks(0.0 * truth, fixed[:, at[0]], fixed[:, at[1]], 0.05, **grid)
