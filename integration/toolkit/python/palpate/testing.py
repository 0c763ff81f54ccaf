"""Checks of motion fields for the tests of any project, with pytest or without:

    from palpate import testing
    testing.assert_no_folds(field)
    testing.assert_agrees_with_flow(field, fixed, moving)

A field has the shape (z, y, x, 3): mm along L, P, S (ITK's convention; for data without a patient along the index axes x, y, z). The material at x of
the fixed volume is at x + field(x) in the moving one. A palpate.Motion brings its own spacing, origin and direction; for an array they are keywords:
mm along x, y, z of the index; LPS mm of the first sample; columns that are the directions of the index axes. A Motion of more than one step: pass
motion.step(k). "Voxel" as a unit is the finest edge of the grid.

A check that fails raises AssertionError: what was measured, the limit, and the worst place as an index (x, y, z) and in mm. Input that can not be
checked raises ValueError. All functions may be called from any thread; they copy nothing into the engine and need no GPU.
"""

import itertools

import numpy as np

__all__ = ["assert_agrees_with_flow", "assert_landmarks", "assert_no_folds", "assert_undone_by", "assert_within"]


class _Grid:
    """Where the samples of a field are."""

    def __init__(self, shape, spacing, origin, direction):
        self.size = np.array(shape[2::-1])
        self.spacing, self.origin, self.direction = (np.asarray(part, dtype=float) for part in (spacing, origin, direction))
        if self.spacing.shape != (3,) or self.origin.shape != (3,) or self.direction.size != 9:
            raise ValueError("spacing and origin need 3 numbers each, direction 9")
        self.direction = self.direction.reshape(3, 3)
        if not (np.all(self.spacing > 0.0) and np.allclose(self.direction.T @ self.direction, np.eye(3), atol=1e-3)):
            raise ValueError("the spacing is not positive, or the columns of direction are not perpendicular and of length 1")
        self.voxel_mm = self.spacing.min()

    def mm(self, index):
        """LPS mm of an index (x, y, z); shapes (..., 3)."""
        return self.origin + (np.asarray(index) * self.spacing) @ self.direction.T

    def index(self, mm):
        """The index (x, y, z) of a place in LPS mm; shapes (..., 3)."""
        return ((np.asarray(mm) - self.origin) @ self.direction) / self.spacing

    def place(self, index):
        """The words for a place."""
        return (f"at voxel ({', '.join(f'{number:.4g}' for number in index)}), "
                f"({', '.join(f'{number:.1f}' for number in self.mm(index))}) mm")


def _field_and_grid(field, spacing, origin, direction):
    if hasattr(field, "field") and hasattr(field, "spacing"):
        if getattr(field, "steps", 1) != 1:
            raise ValueError(f"this motion has {field.steps} steps: pass the field of one of them, motion.step(k), with its geometry")
        field, spacing, origin, direction = field.field, field.spacing, field.origin, field.direction
    field = np.asarray(field, dtype=np.float64)
    if field.ndim != 4 or field.shape[3] != 3 or 0 in field.shape:
        raise ValueError(f"a field has the shape (z, y, x, 3), but this one has {field.shape}")
    return field, _Grid(field.shape, spacing, origin, np.eye(3) if direction is None else direction)


def _vectors_on(field, grid, name):
    """The vectors of another field, or motion, which must lie on the same grid."""
    motion = hasattr(field, "field") and hasattr(field, "spacing")
    vectors, own = _field_and_grid(field, grid.spacing, grid.origin, grid.direction)
    if not np.array_equal(own.size, grid.size):
        raise ValueError(f"{name} has {tuple(own.size)} samples along x, y, z, the field {tuple(grid.size)}: resample it to the field's grid")
    if motion and not all(np.allclose(getattr(own, part), getattr(grid, part), rtol=1e-4, atol=1e-3) for part in ("spacing", "origin", "direction")):
        raise ValueError(f"{name} and the field have different spacings, origins or directions: resample it to the field's grid")
    return vectors


def _first_not_finite(field, grid):
    bad = np.argwhere(~np.isfinite(field).all(axis=-1))
    if len(bad):
        raise AssertionError(f"the field is not finite at {len(bad)} of {field[..., 0].size} samples, first {grid.place(bad[0][::-1])}")


def _at(values, index):
    """Trilinear interpolation of values (z, y, x, ...) at an index (..., 3: x, y, z); outside of the grid its border goes on."""
    last = np.array(values.shape[2::-1]) - 1
    index = np.clip(index, 0, last)
    low = np.minimum(np.floor(index).astype(int), np.maximum(last - 1, 0))
    share = index - low
    result = 0.0
    for corner in itertools.product((0, 1), repeat=3):
        at = np.minimum(low + corner, last)
        weight = np.prod(np.where(corner, share, 1.0 - share), axis=-1)
        part = values[at[..., 2], at[..., 1], at[..., 0]]
        result = result + weight.reshape(weight.shape + (1,) * (part.ndim - weight.ndim)) * part
    return result


def _assert_mean(errors_mm, indices, grid, mean_voxels, subject):
    """errors_mm: shape (n,); indices: (n, 3), x, y, z."""
    voxels = errors_mm / grid.voxel_mm
    worst = int(np.argmax(voxels))
    if not voxels.mean() <= mean_voxels:  # NaN too
        raise AssertionError(f"{subject} by {voxels.mean():.3g} voxels on average, which is more than {mean_voxels:g} (median "
                             f"{np.median(voxels):.3g}, 95th percentile {np.percentile(voxels, 95):.3g}, {len(voxels)} samples); at most "
                             f"{voxels[worst]:.3g} voxels, {grid.place(indices[worst])}")


def _one_sided(field, axis, forward):
    """The difference to the next sample along a numpy axis, or to the previous one; at the border, where there is none, the other."""
    if field.shape[axis] == 1:
        return np.zeros_like(field)
    step = np.diff(field, axis=axis)
    edge = np.take(step, [-1 if forward else 0], axis=axis)
    return np.concatenate((step, edge) if forward else (edge, step), axis=axis)


def assert_no_folds(field, *, spacing=(1.0, 1.0, 1.0), origin=(0.0, 0.0, 0.0), direction=None):
    """The field folds nowhere: det(I + grad u) > 0 at the eight corners of every sample, where each derivative is the difference to the next or to
    the previous sample. The determinant is the change of volume of the material.

    field: (z, y, x, 3), mm along LPS, or a palpate.Motion. AssertionError: the smallest determinant and its place, or where the field is not finite."""
    field, grid = _field_and_grid(field, spacing, origin, direction)
    _first_not_finite(field, grid)
    # Columns of (I + grad u) D, D the direction, whose own determinant is 1 or -1. Component first: (3, z, y, x).
    columns = [[np.moveaxis(grid.direction[:, a] + _one_sided(field, 2 - a, forward) / grid.spacing[a], 3, 0) for forward in (False, True)]
               for a in range(3)]
    sign = np.sign(np.linalg.det(grid.direction))
    smallest = np.full(field.shape[:3], np.inf)
    for y, z in itertools.product(*columns[1:]):
        cross = y[1] * z[2] - y[2] * z[1], y[2] * z[0] - y[0] * z[2], y[0] * z[1] - y[1] * z[0]
        for x in columns[0]:
            np.minimum(smallest, sign * (x[0] * cross[0] + x[1] * cross[1] + x[2] * cross[2]), out=smallest)
    folded = int((smallest <= 0.0).sum())
    if folded:
        worst = np.unravel_index(int(smallest.argmin()), smallest.shape)
        raise AssertionError(f"the field folds at {folded} of {smallest.size} samples; the smallest determinant is {smallest[worst]:.3g} (limit: above "
                             f"0) {grid.place(worst[::-1])}")


def assert_within(field, truth, mean_voxels, *, mask=None, spacing=(1.0, 1.0, 1.0), origin=(0.0, 0.0, 0.0), direction=None):
    """The mean endpoint error |field - truth| is at most mean_voxels.

    field, truth: (z, y, x, 3), mm along LPS, on one grid, or palpate.Motion. mask: (z, y, x), not 0 where it counts. AssertionError: mean, median,
    95th percentile, and the worst place."""
    field, grid = _field_and_grid(field, spacing, origin, direction)
    truth = _vectors_on(truth, grid, "the truth")
    _first_not_finite(field, grid)
    if mask is not None and np.shape(mask) != field.shape[:3]:
        raise ValueError(f"the mask has the shape {np.shape(mask)}, the field's samples {field.shape[:3]}")
    counts = np.argwhere(np.ones(field.shape[:3]) if mask is None else np.asarray(mask) != 0)
    if len(counts) == 0:
        raise ValueError("the mask is empty, so there is nothing to compare")
    errors = np.linalg.norm(field - truth, axis=-1)[tuple(counts.T)]
    if not np.isfinite(errors).all():
        raise ValueError("the truth is not finite where it counts")
    _assert_mean(errors, counts[:, ::-1], grid, mean_voxels, "the field differs from the truth")


def assert_undone_by(field, backward, mean_voxels, *, spacing=(1.0, 1.0, 1.0), origin=(0.0, 0.0, 0.0), direction=None):
    """Inverse consistency: the field followed by the backward one, u(x) + w(x + u(x)), ends within mean_voxels of the start on average. Samples
    that leave the grid are not counted.

    field, backward: (z, y, x, 3), mm along LPS, on one grid, or palpate.Motion. AssertionError: the mean, and the worst place."""
    field, grid = _field_and_grid(field, spacing, origin, direction)
    backward = _vectors_on(backward, grid, "the backward field")
    _first_not_finite(field, grid)
    _first_not_finite(backward, grid)
    start = np.stack(np.meshgrid(*(np.arange(n) for n in field.shape[:3]), indexing="ij"), axis=-1)[..., ::-1]
    there = start + (field @ grid.direction) / grid.spacing
    kept = np.all((there >= -0.5) & (there <= grid.size - 0.5), axis=-1)
    if not kept.any():
        raise ValueError("no sample stays inside the backward field: check that the two belong to the same pair")
    misses = field[kept] + _at(backward, there[kept])
    _assert_mean(np.linalg.norm(misses, axis=-1), start[kept], grid, mean_voxels, "the way there and back misses its start")


def assert_landmarks(field, fixed_mm, moving_mm, mean_mm, *, spacing=(1.0, 1.0, 1.0), origin=(0.0, 0.0, 0.0), direction=None):
    """The mean target registration error |x + u(x) - y| of landmarks is at most mean_mm.

    field: (z, y, x, 3), mm along LPS, or a palpate.Motion. fixed_mm, moving_mm: (n, 3), LPS mm, the same landmarks in the same order.
    AssertionError: the mean, and the landmark with the largest error."""
    field, grid = _field_and_grid(field, spacing, origin, direction)
    fixed_mm, moving_mm = np.asarray(fixed_mm, dtype=float), np.asarray(moving_mm, dtype=float)
    if fixed_mm.ndim != 2 or fixed_mm.shape[1] != 3 or fixed_mm.shape != moving_mm.shape or len(fixed_mm) == 0:
        raise ValueError(f"landmarks are two lists of shape (n, 3), but these have {fixed_mm.shape} and {moving_mm.shape}")
    index = grid.index(fixed_mm)
    outside = np.flatnonzero(~np.all((index >= -0.5) & (index <= grid.size - 0.5), axis=-1))
    if len(outside):
        raise ValueError(f"{len(outside)} landmarks lie outside of the field, first number {outside[0]} {grid.place(index[outside[0]])}")
    errors = np.linalg.norm(fixed_mm + _at(field, index) - moving_mm, axis=-1)
    if not errors.mean() <= mean_mm:  # NaN too
        worst = int(np.argmax(errors))
        raise AssertionError(f"the {len(errors)} landmarks are missed by {errors.mean():.3g} mm on average, which is more than {mean_mm:g} mm (median "
                             f"{np.median(errors):.3g}); landmark {worst} by {errors[worst]:.3g} mm, {grid.place(index[worst])}")


def assert_agrees_with_flow(field, fixed, moving, voxels=0.5, *, spacing=(1.0, 1.0, 1.0), origin=(0.0, 0.0, 0.0), direction=None):
    """OpenCV's optical flow (DIS) on slices of three orientations differs from the field's in-plane part by at most `voxels` in the median and four
    times that at the 95th percentile, in the worst orientation. Compared are pixels with structure in both directions, with at most half a voxel of
    motion through the slice, and with a flow that returns to within 0.3 voxel. Needs cv2 (ImportError).

    field: (z, y, x, 3), mm along LPS, or a palpate.Motion. fixed, moving: (z, y, x), on the field's grid. AssertionError: the numbers of the
    orientation, and the worst place; or that nothing can be compared."""
    import cv2

    field, grid = _field_and_grid(field, spacing, origin, direction)
    _first_not_finite(field, grid)
    frames = [np.asarray(frame, dtype=np.float32) for frame in (fixed, moving)]
    for frame in frames:
        if frame.shape != field.shape[:3]:
            raise ValueError(f"a volume has the shape {frame.shape}, the field's samples {field.shape[:3]}")
        if not np.isfinite(frame).all():
            raise ValueError("a volume has samples that are not finite")
    own_mm = field @ grid.direction  # along the index axes
    ranges = [np.percentile(frame, (1, 99)) for frame in frames]
    noises = [_noise_sd(frame) for frame in frames]
    found = []
    for normal in range(3):
        differences, places = [], []
        size = grid.size[normal]
        for n in sorted({int((k + 0.5) * size / min(12, size)) for k in range(min(12, size))}):
            slices = [np.take(frame, n, axis=2 - normal) for frame in frames]
            off, at = _slice_differences(cv2, slices, ranges, noises, np.take(own_mm, n, axis=2 - normal), normal, grid)
            differences.append(off)
            places.append(np.insert(at, normal, n, axis=1))
        off, at = np.concatenate(differences), np.concatenate(places)
        if len(off) >= 500:  # fewer say nothing
            found.append((np.median(off), np.percentile(off, 95), np.argmax(off), normal, off, at))
    if not found:
        raise AssertionError("optical flow can not tell: nowhere enough pixels with structure and little enough motion through their slice")
    for median, p95, worst, normal, off, at in found:
        if median > voxels or p95 > 4.0 * voxels:
            raise AssertionError(f"optical flow disagrees: across axis {'xyz'[normal]} the difference at {len(off)} pixels is {median:.3g} voxels in the "
                                 f"median (limit {voxels:g}) and {p95:.3g} at the 95th percentile (limit {4.0 * voxels:g}); at most {off[worst]:.3g} "
                                 f"voxels, {grid.place(at[worst])}")


def _noise_sd(frame):
    """The SD of white noise, by second differences along all axes (Immerkaer 1996), whose median is not moved by edges."""
    gain = 1.0
    for axis in range(3):
        if frame.shape[axis] >= 3:
            frame, gain = np.diff(frame, n=2, axis=axis), gain * np.sqrt(6.0)
    there = np.abs(frame[frame != 0.0])
    return float(np.median(there)) / (0.6745 * gain) if there.size else 0.0


def _slice_differences(cv2, slices, ranges, noises, own_mm, normal, grid):
    """|flow - field| in voxels at the pixels of one slice that can be compared, (n,), and their index along the slice's axes, (n, 2)."""
    a, b = [axis for axis in range(3) if axis != normal]
    pixel_mm = min(grid.spacing[a], grid.spacing[b])
    width, height = (int((grid.size[axis] - 1) * grid.spacing[axis] / pixel_mm + 1e-9) + 1 for axis in (a, b))
    if min(width, height) < 32:
        return np.empty(0), np.empty((0, 2))
    # Square pixels: the index along a and b of every pixel.
    y, x = (axis.astype(np.float32) for axis in np.mgrid[:height, :width])
    index = np.stack((x * (pixel_mm / grid.spacing[a]), y * (pixel_mm / grid.spacing[b])), axis=-1).astype(np.float32)

    def square(image):
        return cv2.remap(np.ascontiguousarray(image, dtype=np.float32), index[..., 0], index[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)

    def grey(image, limits):
        return np.clip((image - limits[0]) * (255.0 / max(limits[1] - limits[0], 1e-6)), 0, 255).round().astype(np.uint8)

    def structure(image):
        gx, gy = (cv2.Sobel(image, cv2.CV_32F, dx, 1 - dx, ksize=3, scale=1 / 8) for dx in (1, 0))
        xx, yy, xy = (cv2.boxFilter(product, cv2.CV_32F, (7, 7)) for product in (gx * gx, gy * gy, gx * gy))
        return np.sqrt(np.maximum(0.0, 0.5 * (xx + yy - np.sqrt((xx - yy) ** 2 + 4.0 * xy * xy))))

    def followed(image, flow):
        return cv2.remap(image, x + flow[..., 0], y + flow[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)

    squares = [square(image) for image in slices]
    method = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
    method.setFinestScale(0)
    first, second = (grey(image, limits) for image, limits in zip(squares, ranges))
    forward, backward = method.calc(first, second, None), method.calc(second, first, None)
    moved_mm = np.stack([square(own_mm[..., axis]) for axis in (a, b, normal)], axis=-1)

    # Flow is poor near the border, where its patches are cut. The factors of noise: two, and 0.433 for the gradient of noise of SD 1.
    def well_inside(there):
        return np.all((there >= 8) & (there <= (width - 9, height - 9)), axis=-1)

    here = np.stack((x, y), axis=-1)
    counts = well_inside(here) & well_inside(here + moved_mm[..., :2] / pixel_mm)
    counts &= np.abs(moved_mm[..., 2]) <= 0.5 * grid.voxel_mm
    counts &= np.linalg.norm(forward + followed(backward, forward), axis=-1) * pixel_mm <= 0.3 * grid.voxel_mm
    counts &= structure(squares[0]) > 2.0 * 0.433 * noises[0]
    counts &= followed(structure(squares[1]), forward) > 2.0 * 0.433 * noises[1]
    off = np.linalg.norm(forward * pixel_mm - moved_mm[..., :2], axis=-1) / grid.voxel_mm
    return off[counts], index[counts]
