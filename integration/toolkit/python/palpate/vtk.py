"""palpate for programs with VTK and an event loop of their own, such as ParaView and 3D Slicer.

    from palpate import vtk
    moving = vtk.MovingImage(frames, times, is_cancelled=lambda: window.cancelled)   # a list of vtkImageData
    image = vtk.image(frames[0], {"displacement": moving.displacement(0.3), "values": moving.values(0.3)})

palpate.register() takes images of type vtkImageData, too: one value per point. Their axes are called L, P, S, as ITK and DICOM do; VTK gives them no
names. Displacements are mm along the axes of the image's own world, not of its rows.
"""

import os
import tempfile
import threading

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkImageData

import palpate

__all__ = ["Cancelled", "MovingImage", "estimate", "image"]


class Cancelled(Exception):
    """is_cancelled() was true: there is no motion."""


def estimate(frames, *, on_progress=None, is_cancelled=None, **options):
    """palpate.register() for a program that must go on meanwhile: returns the Motion.

    The estimation runs on a thread of its own. On the calling thread, about 20 times a second: on_progress(doing, share), with the present step (str)
    and the share of the work that is done, 0 to 1; and is_cancelled(), which ends the estimation if it is true. Both may run the program's event loop.
    options: those of palpate.register(). Raises Cancelled; what the two functions raise, after the estimation has ended; and what register() raises."""
    now, found, end = ["", 0.0], [], threading.Event()

    def progress(doing, share):
        now[:] = doing, share
        if end.is_set():
            raise Cancelled("the estimation was cancelled")

    def work():
        try:
            found.append(palpate.register(frames, progress=progress, **options))
        except BaseException as error:
            found.append(error)

    worker = threading.Thread(target=work, name="palpate")
    worker.start()
    try:
        while worker.is_alive():
            worker.join(0.05)
            if on_progress is not None:
                on_progress(*now)
            if is_cancelled is not None and is_cancelled():
                raise Cancelled("the estimation was cancelled")
    finally:
        end.set()
        worker.join()
    if isinstance(found[0], BaseException):
        raise found[0]
    return found[0]


class MovingImage:
    """A frame of a sequence at any time of it: the material of one frame, its places and values at a time, also between frames.

    frames: images of one grid (vtkImageData or what palpate.register() takes); times: rising, one per frame, in any unit. reference: the number of
    the frame whose material is followed; None: the one that palpate chooses, which needs one interpolation less. options: those of estimate(), whose
    errors it has, too. Of the frames only the reference is kept.

    `motion` is the palpate.Motion, `reference` the number of the frame. All results have the shape (z, y, x), float32. A time outside of the sequence
    counts as its nearer end unless the sequence is cyclic.
    """

    def __init__(self, frames, times, *, reference=None, **options):
        if len(frames) < 2:
            raise ValueError("motion is between frames: give at least two")
        if reference is not None and not 0 <= reference < len(frames):
            raise ValueError(f"there is no frame {reference}: the sequence has {len(frames)}, counted from 0")
        self._begin, self._times = times[0], [time - times[0] for time in times]
        self.motion = estimate(frames, times=self._times, **options)
        self._whole = self.motion if self.motion.is_whole else _one_motion(self.motion)
        self.reference = self._whole.reference if reference is None else reference
        # The time of the chosen reference; None where it is the motion's own.
        self._at = None if self.reference == self._whole.reference else self._times[self.reference]
        self._frame = palpate._volume_of(frames[self.reference]).array.copy()
        self._back = None if self._at is None else self._whole.inverse(time_s=self._at)

    def _from_reference(self, values):
        """Values on the motion's reference frame, brought to the chosen one."""
        return values if self._at is None else self._whole.warp(values, time_s=self._at, inverse=True)

    def displacement(self, time):
        """Where the material goes: that at x of the reference frame is at x + u(x) at the time. Shape (z, y, x, 3), mm along L, P, S."""
        u = self._whole.at(time - self._begin)
        if self._at is None:
            return u
        # From the chosen frame back to the motion's own, and from there to the time.
        return self._back + np.stack([self._from_reference(np.ascontiguousarray(u[..., c])) for c in range(3)], axis=-1)

    def determinant(self, time):
        """The change of volume of the material, see palpate.Motion.determinant()."""
        return palpate._determinant(self.displacement(time), self._whole.spacing, self._whole.direction)

    def confidence(self, time):
        """The confidence of the vectors, 0 to 1, of the frame next to the time."""
        return self._from_reference(self.motion.confidence if not self.motion.is_whole else self.motion._found.confidence(self._nearest(time)))

    def deviation(self, time):
        """The standard deviation of the error of the vectors, mm, of the frame next to the time: see palpate.Motion.deviation. Shape (z, y, x, 2)."""
        of = self.motion.deviation if not self.motion.is_whole else self.motion._found.deviation(self._nearest(time))
        return np.stack([self._from_reference(np.ascontiguousarray(of[..., c])) for c in range(2)], axis=-1)

    def _nearest(self, time):
        return min(range(len(self._times)), key=lambda k: abs(self._times[k] + self._begin - time))

    def values(self, time):
        """The values of the reference frame, moved to where the material is at the time."""
        values = self._frame if self._at is None else self._whole.warp(self._frame, time_s=self._at)
        return self._whole.warp(values, time_s=time - self._begin, inverse=True)


def _one_motion(motion):
    """The motion of a pair as one motion for all times between."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "motion.nrrd")
        motion._found.save(path, None)
        return palpate.open_motion(path)


def image(like, arrays):
    """A vtkImageData with the geometry of `like` and the arrays as point data. arrays: a dict of names and arrays of shape (z, y, x) or (z, y, x, n).
    The first one of a single component becomes the scalars, the first one of three the vectors. ValueError for another shape."""
    made = vtkImageData()
    made.CopyStructure(like)
    data = made.GetPointData()
    shape = made.GetDimensions()[::-1]
    for name, array in arrays.items():
        array = np.asarray(array)
        if array.shape[:3] != shape or array.ndim > 4:
            raise ValueError(f"{name} has the shape {array.shape}, but the image has {shape}")
        components = array.shape[3] if array.ndim == 4 else 1
        values = numpy_to_vtk(np.ascontiguousarray(array).reshape(-1, components), deep=True)
        values.SetName(name)
        data.AddArray(values)
        if components == 1 and data.GetScalars() is None:
            data.SetScalars(values)
        if components == 3 and data.GetVectors() is None:
            data.SetVectors(values)
    return made
