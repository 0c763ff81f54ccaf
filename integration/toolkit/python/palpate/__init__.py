"""palpate for Python: estimates the motion of volumes, and computes the forces of scenes.

    import palpate
    motion = palpate.register(fixed, moving)        # two volumes, or one sequence
    motion.field                                     # (z, y, x, 3) float32, mm along L, P, S
    motion.verdict                                   # ok, suspect or failed, and why

Volumes are numpy arrays of shape (z, y, x) with their spacing, origin and direction, or images of nibabel, SimpleITK, itk or VTK, which contain
these; open_sequence() reads them from files. The convention of fields is ITK's: the material at x of the fixed volume is at x + field(x) in the
moving one.

The GIL is released during long computations. Exceptions have one sentence: ValueError for bad input, OSError for a file that can not be
written, MemoryError, and RuntimeError for all else, such as a Vulkan device that is lost.
"""

import collections
import difflib
import inspect
import json as _json
import operator
import os
import sys
import tempfile
import textwrap

import numpy as np

try:
    from . import _palpate
except ImportError as error:
    if "libvulkan" not in str(error):
        raise
    raise ImportError("palpate needs the Vulkan loader, libvulkan.so.1, and a Vulkan driver: install them (Debian, Ubuntu: apt install libvulkan1 "
                      "mesa-vulkan-drivers)") from None

__version__ = _palpate.__version__
__all__ = ["Frames", "Motion", "Session", "Verdict", "open_motion", "open_sequence", "register"]

PRESETS = ("fast", "balanced", "best", "classic")

_contexts = {}


def _context(gpu=None):
    """The context of a Vulkan device, by number or part of its name; opened once per name, and again after the device was lost."""
    gpu = None if gpu is None else str(gpu)
    context = _contexts.get(gpu)
    if context is None or context.failed:
        context = _contexts[gpu] = _palpate.Context(gpu)
    return context


# spacing: mm; origin: LPS mm; direction: 9 numbers, row by row; None for a bare array. step_s: time between the frames of a 4D image; None or 0:
# not known. times: of the frames, s, instead of step_s.
_Image = collections.namedtuple("_Image", "array spacing origin direction step_s times", defaults=(None, None))


def _of_itk_kind(image, array, direction):
    """An image of itk or SimpleITK: the order of its axes is x, y, z, then time if there are four."""
    spacing, origin = tuple(image.GetSpacing()), tuple(image.GetOrigin())
    axes = len(spacing)
    direction = np.reshape(direction, (axes, axes))[:3, :3].reshape(-1)
    return _Image(array, spacing[:3], origin[:3], direction, spacing[3] if axes == 4 else None)


def _of_simple_itk(image):
    import SimpleITK

    return _of_itk_kind(image, SimpleITK.GetArrayViewFromImage(image), image.GetDirection())


def _of_itk(image):
    import itk

    return _of_itk_kind(image, itk.array_view_from_image(image), itk.array_from_matrix(image.GetDirection()))


def _time_axis(image):
    """The number of the time axis of a nibabel image of four axes: the last one but in MINC, whose axes lie as in the file."""
    names = getattr(getattr(image.dataobj, "minc_file", None), "_dim_names", ())
    return names.index("time") if "time" in names else 3


def _step_s(image, axis):
    """The time between the frames of a nibabel image, s; 0 where it is not known. A step without a unit is seconds unless it is 1, as in the
    program."""
    zooms = image.header.get_zooms()
    step = float(zooms[axis]) if len(zooms) > axis else 0.0
    unit = image.header.get_xyzt_units()[1] if hasattr(image.header, "get_xyzt_units") else "unknown"
    kind = type(image).__name__
    if kind == "MGHImage":
        unit = "msec"
    elif kind == "AFNIImage":
        unit = {77001: "msec", 77002: "sec"}.get((list(image.header.info.get("TAXIS_NUMS", ())) + [0, 0, 0])[2], "none")
    elif kind in ("Minc1Image", "Minc2Image", "PARRECImage"):
        unit = "sec"
    seconds = {"sec": 1.0, "msec": 1e-3, "usec": 1e-6, "unknown": 0.0 if step == 1.0 else 1.0}.get(unit, 0.0)
    return seconds * step if np.isfinite(step) and step > 0.0 else 0.0


def _of_nibabel(image):
    # nibabel: indices i, j, k and axes R, A, S. palpate: shapes (z, y, x) and axes L, P, S.
    samples = np.asanyarray(image.dataobj)
    while samples.ndim > 4 and samples.shape[-1] == 1:
        samples = samples[..., 0]
    step_s = None
    if samples.ndim == 4:
        axis = _time_axis(image)
        step_s = _step_s(image, axis)
        samples = np.moveaxis(samples, axis, 3)
    affine = np.diag([-1.0, -1.0, 1.0, 1.0]) @ np.asarray(image.affine, dtype=float)
    if hasattr(image.header, "get_xyzt_units"):
        affine[:3] *= {"meter": 1e3, "micron": 1e-3}.get(image.header.get_xyzt_units()[0], 1.0)
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    if not np.all(spacing > 0.0):
        raise ValueError("the affine of this image is singular: give it a sound one")
    return _Image(np.transpose(samples), tuple(spacing), tuple(affine[:3, 3]), (affine[:3, :3] / spacing).reshape(-1), step_s)


def _of_vtk(image):
    """A vtkImageData: the scalars of its points, as (z, y, x)."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    scalars, extent = image.GetPointData().GetScalars(), image.GetExtent()
    if scalars is None:
        raise ValueError("this image has no scalars at its points")
    if scalars.GetNumberOfComponents() != 1:
        raise ValueError(f"this image has {scalars.GetNumberOfComponents()} values per point: take one of them")
    origin, matrix = [0.0, 0.0, 0.0], image.GetDirectionMatrix()
    image.TransformIndexToPhysicalPoint(extent[::2], origin)
    direction = [matrix.GetElement(row, column) for row in range(3) for column in range(3)]
    return _Image(vtk_to_numpy(scalars).reshape(image.GetDimensions()[::-1]), image.GetSpacing(), origin, direction)


def _of_array(array):
    return _Image(np.asanyarray(array), None, None, None)


def _image_of(image):
    """The samples and the geometry of Frames, or of an image of nibabel, SimpleITK, itk or VTK; the geometry of a bare array is None."""
    if isinstance(image, Frames):
        return _Image(np.stack(list(image)), image.spacing, image.origin, image.direction.reshape(-1), None, image.times if image.has_times else None)
    if hasattr(image, "GetDirectionMatrix") and hasattr(image, "GetPointData"):
        return _of_vtk(image)
    if hasattr(image, "dataobj") and hasattr(image, "affine"):
        return _of_nibabel(image)
    if hasattr(image, "GetSpacing") and hasattr(image, "GetDirection"):
        module = type(image).__module__.partition(".")[0]
        return _of_simple_itk(image) if module == "SimpleITK" else _of_itk(image)
    return _of_array(image)


def _geometry(given, known, name, usual):
    """A part of the geometry: the caller's, else the image's, else the default. ValueError for a wrong number of values."""
    if given is not None:
        value = np.asarray(given, dtype=float).reshape(-1)
    elif known is not None:
        value = np.asarray(known, dtype=float).reshape(-1)
    else:
        value = np.asarray(usual, dtype=float)
    if len(value) != len(usual):
        raise ValueError(f"{name} needs {len(usual)} numbers, but {len(value)} were given")
    if not np.all(np.isfinite(value)):
        raise ValueError(f"{name} holds a number that is not finite")
    return [float(number) for number in value]


_TYPES = tuple(np.dtype(name) for name in ("float32", "float64", "int8", "uint8", "int16", "uint16", "int32", "uint32"))


def _taken(array):
    """The array itself if its type and layout can be read; else a copy. Other types of numbers become float32; TypeError for what is no number,
    ValueError for masked samples."""
    if np.ma.is_masked(array):
        raise ValueError("this volume has masked samples, which have no value: fill them first (numpy.ma.filled)")
    array = np.asarray(array)
    if array.dtype not in _TYPES:
        if array.dtype.kind not in "fiub":
            raise TypeError(f"samples of type {array.dtype} are no numbers that a volume can have")
        array = array.astype(np.float32)
    return np.ascontiguousarray(array)


def _volume_of(image):
    """One volume; of an image of four axes its only frame."""
    image = _image_of(image)
    return image._replace(array=image.array[0]) if image.array.ndim == 4 and len(image.array) == 1 else image


def _unmasked(frames, mask):
    """The frames without masked samples (numpy.ma), which get the mean of the others, and a mask that leaves them out too; None: no mask."""
    unmasked = []
    for image in frames:
        if np.ma.is_masked(image.array):
            hidden = np.ma.getmaskarray(image.array)
            if hidden.all():
                raise ValueError("all samples of a volume are masked: there is nothing to compare")
            mask = ~hidden if mask is None else mask & ~hidden
            image = image._replace(array=np.ma.filled(image.array, image.array.dtype.type(image.array.mean())))
        unmasked.append(image)
    return unmasked, mask


def _frames_of(fixed, moving):
    """All frames as images of three dimensions: of two volumes, of a list, or of a 4D array. ValueError for one 3D volume."""
    if moving is not None:
        return [_volume_of(fixed), _volume_of(moving)]
    if isinstance(fixed, (list, tuple)):
        return [_volume_of(frame) for frame in fixed]
    image = _image_of(fixed)
    if image.array.ndim != 4:
        raise ValueError(f"one volume of shape {image.array.shape} has no motion: give two, a list, or a 4D array (t, z, y, x)")
    return [image._replace(array=frame) for frame in image.array]


def _times_of(frames):
    """The times of the frames of one 4D image, s; None if they are not known."""
    first = frames[0]
    if first.times is not None or not first.step_s:
        return first.times
    return [k * first.step_s for k in range(len(frames))]


def _grid_of(frames, spacing=None, origin=None, direction=None):
    """The size (x, y, z), spacing, origin and direction of all frames. ValueError if they differ."""
    first = frames[0]
    for image in frames:
        if image.array.ndim != 3:
            raise ValueError(f"a volume has three dimensions (z, y, x), but one has the shape {image.array.shape}")
        if image.array.shape != first.array.shape:
            raise ValueError(f"the volumes have different shapes, {first.array.shape} and {image.array.shape}: resample them to one grid")
        for name in ("spacing", "origin", "direction"):
            a, b = getattr(image, name), getattr(first, name)
            if a is not None and b is not None and not np.allclose(a, b, rtol=1e-4, atol=1e-3):
                raise ValueError(f"the volumes differ in {name}, {list(b)} and {list(a)}: resample them to one grid")
    if 0 in first.array.shape:
        raise ValueError(f"the volumes have no samples, their shape is {first.array.shape}")
    spacing = _geometry(spacing, first.spacing, "spacing", (1.0, 1.0, 1.0))
    if min(spacing) <= 0.0:
        raise ValueError(f"the spacing {spacing} is not positive")
    direction = _geometry(direction, first.direction, "direction", (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0))
    axes = np.reshape(direction, (3, 3))
    if not np.allclose(axes.T @ axes, np.eye(3), atol=1e-3):
        raise ValueError("the columns of direction are not perpendicular, or not of length 1: resample the volumes to a straight grid")
    return list(first.array.shape[::-1]), spacing, _geometry(origin, first.origin, "origin", (0.0, 0.0, 0.0)), direction


def _text(value, name):
    """A text, or None. TypeError for anything else."""
    if value is None or isinstance(value, str):
        return value
    raise TypeError(f"{name} must be a text, not {type(value).__name__}")


def _any_number(value, name):
    """A number, which the library checks. TypeError for what is none."""
    try:
        return float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{name} must be a number, not {type(value).__name__}") from None


def _number(value, name):
    """A finite number. TypeError for what is none, ValueError for NaN and infinity."""
    number = _any_number(value, name)
    if not np.isfinite(number):
        raise ValueError(f"{name} must be a finite number")
    return number


def _numbers(values, name, count):
    """A list of so many finite numbers. TypeError and ValueError as _number()."""
    try:
        values = list(values)
    except TypeError:
        raise TypeError(f"{name} must be {count} numbers, not {type(values).__name__}") from None
    if len(values) != count:
        raise ValueError(f"{name} must be {count} numbers, not {len(values)}")
    return [_number(value, name) for value in values]


def _path(path):
    return None if path is None else os.fspath(path)


def _paths(paths):
    return [os.fspath(paths)] if isinstance(paths, (str, os.PathLike)) else [os.fspath(path) for path in paths]


# The table of options, made by the library: one row is one keyword of Session.
_OPTIONS = {row["key"]: row for row in _json.loads(_palpate.options()) if "python" in row["doors"]}
# 0 has meant the scene's own value, or none, since these keywords exist.
_NONE_AT_ZERO = ("max_force_n", "stiffness_n_per_m", "serve")


def _option_value(key, value):
    """A value as JSON has it. TypeError for a wrong type; the library checks the rest."""
    kind = _OPTIONS[key]["type"]
    if kind == "flag":
        return bool(value)
    if kind == "whole number":
        if not hasattr(value, "__index__"):
            raise TypeError(f"{key} must be a whole number, not {type(value).__name__}")
        return operator.index(value)
    if kind == "number":
        if value in _OPTIONS[key].get("words", ()):
            return value
        number = _any_number(value, key)
        return number if np.isfinite(number) else str(number)
    if kind in ("paths", "texts"):
        try:
            return _paths(value)
        except TypeError:
            raise TypeError(f"{key} must be a text or a list of texts") from None
    return _text(_path(value) if isinstance(value, os.PathLike) else value, key)


def _option_texts(options):
    """The options of the scene and those of the session, as two texts in JSON."""
    texts = {"scene": {}, "session": {}}
    for key, value in options.items():
        if key not in _OPTIONS:
            near = difflib.get_close_matches(key, _OPTIONS, 1)
            raise TypeError(f"Session has no option '{key}'" + (f": did you mean '{near[0]}'?" if near else ""))
        if value is None or value in ((), []) or (key in _NONE_AT_ZERO and value == 0):
            continue
        texts[_OPTIONS[key]["stage"]][key] = _option_value(key, value)
    return _json.dumps(texts["scene"]), _json.dumps(texts["session"])


def _option_lines():
    """What the documentation of Session says of each option."""
    lines = []
    for key, row in _OPTIONS.items():
        low, high = row.get("low"), row.get("high")
        span = (f"{low:g} to {high:g}" if low is not None and high is not None else
                f"{'above' if row.get('above_low') else 'from'} {low:g}" if low is not None else "")
        about = [text for text in (span + (" " + row["unit"] if row["unit"] and span else ""), ", ".join(row.get("words", ())),
                                   "default: " + row["default"] if row["default"] else "") if text]
        lines += textwrap.wrap(f"{key}: {row['help']}" + (f" ({'; '.join(about)})" if about else "") + ".", 130,
                               initial_indent=8 * " ", subsequent_indent=12 * " ")
    return "\n".join(lines)


class Verdict(collections.namedtuple("Verdict", "trust reasons measured")):
    """Whether a motion may be used, and why.

    trust: "ok", "suspect" (have a person check the motion before you use it), "failed" (do not use it), or "" if nothing was measured.
    reasons: why it is not ok, a list of sentences.
    measured: a dict of numbers with their units in the names; NaN: not measured.
    bool(verdict) is True if trust is "ok".
    """

    __slots__ = ()

    def __bool__(self):
        return self.trust == "ok"


class _Copied:
    """What _palpate.Motion is to a Motion, for one that was copied through pickle: opened again from the bytes of files, of the whole motion or
    of each step."""

    def __init__(self, files, summary, confidences, deviations, geometry, begin_s):
        self._kept = (files, summary, confidences, deviations, geometry, begin_s)
        context = _palpate.Context(None, False)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "motion.nrrd")
            self._motions = []
            for content in files:
                with open(path, "wb") as file:
                    file.write(content)
                self._motions.append(_palpate.open_motion(context, path))

    def __reduce__(self):
        return _Copied, self._kept

    def _at(self, step, time_s):
        """The motion that has a step, and what it calls the step and the time."""
        if self._kept[1]["is_whole"]:
            return self._motions[0], step, None if time_s is None else time_s - self._kept[5]
        if time_s is not None:
            raise ValueError("only one motion for all frames has a field to any time: ask for a step")
        return self._motions[step], 0, 1.0  # the time of the second frame, see _motion_file()

    def field(self, step, time_s, inverse):
        motion, step, time_s = self._at(step, time_s)
        return motion.field(step, time_s, inverse)

    def warp(self, frame, step, time_s, inverse):
        motion, step, time_s = self._at(step, time_s)
        return motion.warp(frame, step, time_s, inverse)

    def save(self, path, step):
        if step is None and not self._kept[1]["is_whole"]:
            raise ValueError("these are fields from frame to frame: save them one by one")
        if step is None:
            return self._motions[0].save(path, None)
        motion, step, _ = self._at(step, None)
        return motion.save(path, step)

    def confidence(self, step):
        if step >= len(self._kept[2]):
            raise ValueError("there is no confidence of such a step")
        return self._kept[2][step].copy()

    def deviation(self, step):
        if step >= len(self._kept[3]):
            raise ValueError("there is no deviation of such a step")
        return self._kept[3][step].copy()

    def summary(self):
        return dict(self._kept[1])

    def geometry(self):
        return self._kept[4]

    def size(self):
        return self._motions[0].size()


def _motion_file(field, spacing, origin, direction):
    """The bytes of a file (integration/files/sequence_motion_file.h) with the motion from one frame to the next."""
    axes = np.reshape(direction, (3, 3)) * spacing
    vector = "({!r},{!r},{!r})".format
    header = (f"NRRD0005\ntype: float\ndimension: 5\nspace: left-posterior-superior\n"
              f"sizes: 3 {field.shape[2]} {field.shape[1]} {field.shape[0]} 2\nspace directions: none "
              + " ".join(vector(*map(float, column)) for column in axes.T)
              + f" none\nkinds: vector domain domain domain list\nendian: little\nencoding: raw\n"
              f"space origin: {vector(*map(float, origin))}\nSequenceMotion.Version:=1\nSequenceMotion.ReferenceFrame:=0\n"
              "SequenceMotion.FrameTimes_s:=0 1\nSequenceMotion.Cycle_s:=0\nSequenceMotion.Harmonics:=0\n\n")
    field = np.ascontiguousarray(field, dtype="<f4")
    return header.encode() + bytes(field.nbytes) + field.tobytes()


def _determinant(u, spacing, direction):
    """det(I + grad u) of a field (z, y, x, 3), by central differences, one-sided at the border."""
    along = np.zeros(u.shape + (3,))  # column a: du per mm along the index axis a
    for a in range(3):
        if u.shape[2 - a] > 1:
            along[..., a] = np.gradient(u, spacing[a], axis=2 - a)
    return np.linalg.det(np.eye(3) + along @ np.reshape(direction, (3, 3)).T).astype(np.float32)


class Motion:
    """The motion of the material from one volume to the next, or through a sequence. Returned by register() and open_motion(). It can be
    pickled, and so passed between processes."""

    def __init__(self, found, spacing, origin, direction, begin_s=0.0):
        self._found = found
        self._begin_s = begin_s
        self._summary = found.summary()
        self.spacing = tuple(spacing)  #: mm along x, y, z of the index
        self.origin = tuple(origin)  #: LPS mm of the first sample
        self.direction = np.reshape(direction, (3, 3))  #: columns: directions of the index axes x, y, z in LPS

    def __getstate__(self):
        found = self._found
        if not isinstance(found, _Copied):
            if self.is_whole:
                with tempfile.TemporaryDirectory() as folder:
                    path = os.path.join(folder, "motion.nrrd")
                    found.save(path, None)
                    with open(path, "rb") as file:
                        files = [file.read()]
            else:
                files = [_motion_file(self.step(k), self.spacing, self.origin, self.direction) for k in range(self.steps)]
            count = self._summary["frame_count"] if self.is_whole else self.steps
            confidences, deviations = [], []
            try:
                confidences = [found.confidence(k) for k in range(count)]
                deviations = [found.deviation(k) for k in range(count)]
            except ValueError:
                pass  # a motion that was read from a file has none
            found = _Copied(files, self._summary, confidences, deviations, found.geometry(), self._begin_s)
        return {**self.__dict__, "_found": found}

    @property
    def steps(self):
        """The number of fields from a frame to the next."""
        return self._summary["step_count"]

    @property
    def is_whole(self):
        """True: one motion for all frames, from the frame `reference`. False: fields from frame to frame."""
        return self._summary["is_whole"]

    @property
    def reference(self):
        """The number of the reference frame, from which the motion leads to all others; None for fields from frame to frame."""
        return self._summary["reference_frame"] if self.is_whole else None

    @property
    def field(self):
        """The field of a pair, shape (z, y, x, 3), float32: mm along L, P, S. For a sequence the fields from each frame to the next, shape
        (steps, z, y, x, 3); step() gives one of them."""
        return self.step(0) if self.steps == 1 else np.stack([self.step(k) for k in range(self.steps)])

    def step(self, k):
        """The field from frame k to the next, shape (z, y, x, 3), float32, mm along L, P, S. A negative k counts from the end; IndexError
        if there is no such step."""
        return self._found.field(self._checked(k), None, False)

    def at(self, time_s):
        """The field from the reference frame to a time of the sequence (s), shape (z, y, x, 3), float32, mm along L, P, S. ValueError unless
        is_whole."""
        return self._found.field(0, _number(time_s, "time_s"), False)

    def inverse(self, k=0, *, time_s=None):
        """The inverse field: of step k, or from a time (s) to the reference frame. Shape (z, y, x, 3), float32, mm along L, P, S."""
        return self._found.field(self._checked(k), None if time_s is None else _number(time_s, "time_s"), True)

    @property
    def confidence(self):
        """The confidence of each vector, 0 to 1: the share of similar vectors that are right within half a voxel. Shape (z, y, x); for a
        sequence (n, z, y, x), with one array for each frame (is_whole) or step."""
        if self.steps == 1 and not self.is_whole:
            return self._found.confidence(0)
        count = self._summary["frame_count"] if self.is_whole else self.steps
        return np.stack([self._found.confidence(k) for k in range(count)])

    @property
    def deviation(self):
        """The standard deviation of the error of each vector, mm: along the image gradient, where the images show motion best, and across it, in
        each of the two other directions. Shape (z, y, x, 2), float32; for a sequence (n, z, y, x, 2), as `confidence`."""
        if self.steps == 1 and not self.is_whole:
            return self._found.deviation(0)
        count = self._summary["frame_count"] if self.is_whole else self.steps
        return np.stack([self._found.deviation(k) for k in range(count)])

    @property
    def verdict(self):
        """Whether the motion may be used, and why: see Verdict."""
        measured = {name: value for name, value in self._summary.items() if isinstance(value, float)}
        reasons = self._summary["reasons"]
        return Verdict(self._summary["trust"], reasons.split("\n") if reasons else [], measured)

    def move_points(self, points_mm, k=0, *, time_s=None):
        """Where the material at places goes, such as landmarks or the vertices of a mesh: x + u(x), the field linear between samples and clamped to the
        border. points_mm: (n, 3), LPS mm, in the frame from which the field of step k, or with time_s the one to this time (s), leads. Shape (n, 3)."""
        from .testing import _at

        points_mm = np.asarray(points_mm, dtype=float)
        if points_mm.ndim != 2 or points_mm.shape[1] != 3:
            raise ValueError(f"points have the shape (n, 3), but these have {points_mm.shape}")
        index = ((points_mm - self.origin) @ self.direction) / self.spacing
        return points_mm + _at(self.step(k) if time_s is None else self.at(time_s), index)

    def determinant(self, k=0, *, time_s=None):
        """The change of volume of the material, det(I + grad u): of step k, or with time_s from the reference frame to this time (s). Below 1 it
        shrinks; at 0 or below the field folds. Central differences, one-sided at the border. Shape (z, y, x), float32."""
        return _determinant(self.step(k) if time_s is None else self.at(time_s), self.spacing, self.direction)

    def warp(self, image, k=0, *, time_s=None, inverse=False):
        """Warps a volume: at each sample x the value of `image` at x + field(x), linear between samples. The field is that of step k, or with
        time_s that from the reference frame to this time (s). With step k, frame k + 1 is warped onto frame k; with inverse=True frame k onto
        frame k + 1. Shape (z, y, x), float32. ValueError if the volume is not on the grid of the frames."""
        image = _volume_of(image)
        size = tuple(self._found.size())
        if image.array.shape != size:
            raise ValueError(f"the volume has the shape {image.array.shape}, but the motion is that of frames of {size}")
        for name in ("spacing", "origin", "direction"):
            known = getattr(image, name)
            if known is not None and not np.allclose(known, np.reshape(getattr(self, name), -1), rtol=1e-4, atol=1e-3):
                raise ValueError(f"the volume has another {name} than the frames of this motion: resample it to their grid")
        return self._found.warp(_taken(image.array), self._checked(k), None if time_s is None else _number(time_s, "time_s"), bool(inverse))

    def save(self, path, k=None):
        """Writes the field of step k as an ITK displacement field (.mha, .nrrd, .nii, .nii.gz). For a sequence, without k: writes the one
        motion for all frames, as a .nrrd that open_motion() and the program read. No incomplete file is left. OSError if it can not be
        written."""
        if k is None and self.steps == 1 and not self.is_whole:
            k = 0
        self._found.save(os.fspath(path), None if k is None else self._checked(k))

    def __repr__(self):
        what = "one motion for all frames" if self.is_whole else f"{self.steps} field{'s' if self.steps > 1 else ''}"
        trust = self._summary["trust"]
        return (f"<palpate.Motion: {what}, {self._summary['motion_mean_mm']:.2f} mm on average"
                f"{', ' + trust if trust else ''}>")

    def _checked(self, k):
        try:
            k = operator.index(k)
        except TypeError:
            raise TypeError(f"a step must be a whole number, not {type(k).__name__}") from None
        if not -self.steps <= k < self.steps:
            raise IndexError(f"there is no step {k}: the motion has {self.steps}")
        return k % self.steps


def register(fixed, moving=None, *, spacing=None, origin=None, direction=None, mask=None, preset="balanced", times=None,
             cyclic=False, pairwise=False, verdict=True, progress=None, gpu=None):
    """Estimates the motion of the material from `fixed` to `moving`, or through a sequence.

    fixed, moving: two volumes on the same grid. Without `moving`, `fixed` is a sequence: a list of volumes, a 4D array (t, z, y, x), or Frames.
        Volumes are numpy arrays (z, y, x), or images of nibabel, SimpleITK, itk or VTK (vtkImageData). Contiguous arrays of integers of 8, 16 or
        32 bits, float32 or float64 are read without a copy. Masked samples (numpy.ma) are ignored in all frames, as where the mask is 0.
    spacing, origin: mm along x, y, z of the index, and LPS mm of the first sample; direction: 3 x 3, its columns the directions of the
        index axes x, y, z in LPS. They override those of an image; without both they are 1 mm, 0 and the unit matrix.
    mask: (z, y, x); samples where it is 0 are ignored.
    preset: "fast", "balanced", "best" or "classic".
    times: s, one per frame, 0 or more and rising. None: those of a 4D image, else one second apart.
    cyclic: the last frame leads back to the first. pairwise: for a sequence, only the fields from frame to frame.
    verdict: False: no verdict is measured, which saves time.
    progress: called with the present step (str) and the share of the work that is done, 0 to 1. An exception from it ends the estimation.
    gpu: the Vulkan device, by number or part of its name. None: the first GPU, else the CPU.

    Returns a Motion. ValueError and TypeError for input that can not be used. KeyboardInterrupt (Ctrl-C) ends the estimation. RuntimeError
    if the Vulkan device fails or is lost; the next call opens it again.
    """
    frames = _frames_of(fixed, moving)
    if len(frames) < 2:
        raise ValueError("motion is between volumes: give at least two")
    first = frames[0]
    grid = _grid_of(frames, spacing, origin, direction)
    spacing, origin, direction = grid[1:]
    if times is None:
        times = _times_of(frames)
    times = [] if times is None else [_number(time, "a time") for time in times]
    if any(not time >= 0.0 for time in times):
        raise ValueError("the times of volumes must be 0 or more")
    if times and len(times) != len(frames):
        raise ValueError(f"there are {len(frames)} volumes, but {len(times)} times")
    if mask is not None:
        mask = np.ma.filled(_volume_of(mask).array, 0) != 0
        if mask.shape != first.array.shape:
            raise ValueError(f"the mask has the shape {mask.shape}, but the volumes have {first.array.shape}: resample it to their grid")
    frames, mask = _unmasked(frames, mask)
    if mask is not None:
        mask = np.ascontiguousarray(mask, dtype=np.uint8)
    if progress is not None and not callable(progress):
        raise TypeError(f"progress must be a function, not {type(progress).__name__}")
    flags = ((_palpate.CYCLIC if cyclic else 0) | (_palpate.PAIRWISE if pairwise else 0)
             | (0 if verdict else _palpate.NO_VERDICT))
    found = _palpate.estimate(_context(gpu), [_taken(image.array) for image in frames], *grid, _text(preset, "preset") or "balanced", times, mask, flags, progress)
    return Motion(found, spacing, origin, direction, times[0] if times else 0.0)


class Frames:
    """The frames of a sequence in files. Returned by open_sequence(). len() is their number, sequence[k] reads frame k: shape (z, y, x), float32,
    rescaled as the file says, and a loop reads one after the other (which is the fastest order). Any thread; one at a time reads."""

    def __init__(self, found):
        self._found = found
        spacing, origin, direction = found.geometry()
        self.spacing = tuple(spacing)  #: mm along x, y, z of the index
        self.origin = tuple(origin)  #: LPS mm of the first sample
        self.direction = np.reshape(direction, (3, 3))  #: columns: directions of the index axes x, y, z in LPS
        self.shape = (found.count(), *found.size())  #: (t, z, y, x)
        self.times = [found.time_s(k) for k in range(found.count())]  #: s, one per frame; 0, 1, 2, ... if has_times is False
        self.has_times = found.has_times()  #: whether the files say when the frames were taken
        self.notes = found.notes().splitlines()  #: what a person should know of the files, sentences

    def __len__(self):
        return self.shape[0]

    def __getitem__(self, k):
        k = operator.index(k)
        if not -len(self) <= k < len(self):
            raise IndexError(f"there is no frame {k}: the sequence has {len(self)}")
        return self._found.frame(k % len(self))

    def __repr__(self):
        return f"<palpate.Frames: {len(self)} frames of {' x '.join(map(str, self.shape[:0:-1]))}>"


def open_sequence(paths, *, nan_as=None):
    """Opens the frames of a sequence in any form that the program reads: a 4D file, a folder of DICOM or of 3D files ("FOLDER#4": its DICOM series
    4, by number or name), a list of 3D files in order, or a list of DICOM folders with one frame each. Returns Frames, which register()
    takes. Reads headers only. nan_as: what samples become that are NaN; None: they are refused. ValueError if the files can not be read."""
    return Frames(_palpate.Sequence(_paths(paths), None if nan_as is None else _number(nan_as, "nan_as")))


def open_motion(path, *, gpu=None):
    """Reads one motion for all frames of a sequence from the file that Motion.save() and `palpate motion` write (sequence_motion.nrrd).
    Returns a Motion, whose fields are on the grid of the file. ValueError if the file can not be read. gpu: as in register()."""
    found = _palpate.open_motion(_context(gpu), os.fspath(path))
    return Motion(found, *found.geometry())


class Session:
    """A scene that is felt. Two ways: Python has the loop and calls tick() about 1,000 times a second; or, with device=, palpate has the loop
    on a thread of its own. Lengths are m, forces N, in the device's space: x right, y up, z towards the user.

    scene: a path (a scene file, a sequence, a folder), a list of paths, "heart", "shell", "molecule", or "igtl://HOST:PORT": the images of
        an OpenIGTLink server, felt as they arrive. Or json: the text of a scene file (docs/scene-file.md), whose paths are relative to folder.
    frames: a volume, a list of volumes or a 4D array as in register(), instead of a scene, or for the file "frames" of a scene.
        spacing, origin, direction: as in register(); times: s, one per frame. live=True: there is one frame, the first of a live source;
        give the others to push_frame() as they arrive.
    device: see below. None: Python calls tick(), with a device of the workspace radius workspace_radius_m (m) and the largest force
        device_force_n (N).
    gpu: the Vulkan device, by number or part of its name.
    options: of the scene and of the session, each as the option of `palpate feel` of that name; None: left out.
{options}

    Functions may be called on any thread; tick() on one at a time. A with statement closes the session. ValueError for input that can not be
    used, TypeError for an option that does not exist; OSError for files that can not be written; RuntimeError if no device answers.
    """

    def __init__(self, scene=(), *, json=None, frames=None, spacing=None, origin=None, direction=None, times=None, live=False,
                 workspace_radius_m=0.1, device_force_n=8.0, gpu=None, **options):
        of_scene, of_session = _option_texts(options)
        paths = _paths(scene)
        arrays = grid = None
        if frames is not None:
            images = ([_volume_of(frame) for frame in frames] if isinstance(frames, (list, tuple)) else
                      [_volume_of(frames)] if _volume_of(frames).array.ndim == 3 else _frames_of(frames, None))
            if not images:
                raise ValueError("there are no frames")
            grid = _grid_of(images, spacing, origin, direction)
            arrays = [_taken(frame.array) for frame in images]
            if times is None and len(images) > 1:
                times = _times_of(images)
            if times is not None and len(times) != len(images):
                raise ValueError(f"there are {len(images)} volumes, but {len(times)} times")
            if json is None and not paths:
                paths = ["frames"]
        scene_fields = {
            "flags": _palpate.LIVE if live else 0, "paths": paths, "json": _text(json, "json"), "frames": arrays, "grid": grid,
            "times": [] if times is None else [_number(time, "a time") for time in times], "options": of_scene}
        session_fields = {
            "host_ticks": int(options.get("device") is None), "options": of_session,
            "workspace_radius_m": _any_number(workspace_radius_m, "workspace_radius_m"),
            "device_force_n": _any_number(device_force_n, "device_force_n")}
        context = _context(gpu) if options.get("estimate", True) else _palpate.Context(None, False)
        self._session = _palpate.Session(context, scene_fields, session_fields)

    def tick(self, position_m, time_ns=0, buttons=0):
        """Computes one haptic frame: returns the force (x, y, z), N, for a hand at `position_m` (m). time_ns: when the position was taken, by
        a clock that never jumps; 0: now. buttons: bit k is 1 while button k is down. ValueError with device=, where palpate has the loop."""
        try:
            return self._session.tick(position_m, time_ns, buttons)
        except TypeError:
            raise TypeError("tick() takes the hand's position as three numbers (m), and whole numbers for time_ns and buttons") from None

    @property
    def torque_n_m(self):
        """The torque (x, y, z) that belongs to the force of the last tick(), N m, about the hand's position; zero unless the tool has several
        points. ValueError with device=."""
        return self._session.torque()

    def hold(self, rotation=None, *, angular_velocity_rad_per_s=(0.0, 0.0, 0.0), opening_rad=None):
        """Says how the grip is held, from the next tick() on: `rotation`, a unit quaternion (w, x, y, z) from the grip's axes to the device's
        (the grip's own z goes along its shaft, away from the tip); the angular velocity along the device's axes; the opening of a gripper (0:
        closed). None: not sensed. The points of a finger pad (tool_points=) and the pen in pictures turn with it, recordings keep it, "shaft" of
        the state says it; nothing else is felt by it. On the thread that ticks. ValueError with device=. What is not finite, or a rotation of another length than 1, counts as not sensed."""
        try:
            self._session.hold(rotation, angular_velocity_rad_per_s, opening_rad)
        except TypeError:
            raise TypeError("hold() takes the rotation as four numbers (w, x, y, z), the angular velocity as three (rad/s) and the opening as "
                            "one (rad)") from None

    def push_frame(self, frame, *, spacing=None, origin=None, direction=None, time_ns=0):
        """Gives the next frame of a live source (frames=, live=True): an array (z, y, x) or an image. Without a geometry it has that of the
        first frame. The motion to it is estimated, and the material follows. Of the frames that arrive during an estimation only the last one
        is used. time_ns: time.monotonic_ns() when it was taken; 0: now. Call it from one thread."""
        image = _volume_of(frame)
        grid = None
        if any(known is not None for known in (spacing, origin, direction, image.spacing)):
            grid = _grid_of([image], spacing, origin, direction)
        self._session.push_frame(_taken(image.array), grid, operator.index(time_ns))

    def replay(self, recording, *, tubes=None):
        """Replays a recording of this scene (record=, `palpate feel --record`), and compares every bit. tubes: a file for the stream tubes of
        the recording. Returns a dict: "ticks"; "different", the number of ticks that differ; "first_different", the first of them or None;
        "is_cut_off", True if the recording ends before its session did. ValueError for a recording of another scene or a damaged one."""
        return self._session.replay(os.fspath(recording), _path(tubes))

    @property
    def state(self):
        """The newest haptic frame, a dict: "hand_m", "proxy_m" and "force_n" in the world, "in_contact"; "cause", "cause_sentence": why the
        force is not the scene's, "" if it is; "volumes": dicts with "world_from_volume" (3 x 4), "time_s", "rate"; "can_play", "steps",
        "steps_known" of the motion; "ticks", "late_ticks"; of a live source "frames_received", "frames_felt", "frame_delay_s",
        "frame_cycle_s"; "asked_n", the spring's force had nothing limited it, minus all of "held_n", a dict of limiters by their word, is
        "force_n"; "hand_work_j", the work that all forces so far did on the hand; "shaft", the unit vector from the hand along the grip's
        shaft, zero if it is not sensed; "torque_n_m" on a tool of several points. palpate.h (PalState) explains each."""
        return self._session.state()

    @property
    def plan(self):
        """A text: what each haptic frame does, what it leaves out, and why."""
        return self._session.text(1)

    @property
    def notes(self):
        """A text: what palpate has chosen for the user, one sentence per line."""
        return self._session.text(0)

    def events(self):
        """The events since the last call, a list of sentences."""
        return self._session.events()

    def play(self, on=True):
        """Plays or pauses, by a ramp. False while the motion is not known."""
        return self._session.play(bool(on))

    def scrub(self, share):
        """Sets the time of every moving volume to a share of its sequence, 0 to 1, and pauses. False while the motion is not known."""
        return self._session.scrub(_number(share, "share"))

    def rearm(self):
        """Lets the force come back after an oscillation that went on although the force was reduced; after other causes it comes back without
        this call. False, and nothing is done, while too many changes wait for the next tick."""
        return self._session.rearm()

    def place(self, volume, world_from_volume):
        """Sets the place of a movable volume (its number, from 0): a matrix of 3 x 4 or 4 x 4, m. The volume moves there on a smooth path.
        False, and nothing is done, while too many changes wait for the next tick. ValueError for another shape."""
        matrix = np.asarray(world_from_volume, dtype=float)
        if matrix.shape not in ((3, 4), (4, 4)):
            raise ValueError("a place is a matrix of 3 x 4 or 4 x 4")
        return self._session.place(operator.index(volume), [float(number) for number in matrix[:3].reshape(-1)])

    def set_mode(self, index, on=True, gain=1.0):
        """Switches mode `index` of the scene on or off and sets a factor on its strengths (0 to 100), by a ramp. False, and nothing is changed, while
        too many changes wait for the next tick: call it again."""
        return self._session.set_mode(operator.index(index), bool(on), _number(gain, "gain"))

    def release_tube(self):
        """Lays a stream tube through the proxy at the next tick: the field line there, of vectors, of the gradient that guides, or of the
        material's velocity. From then on it moves with the material, and picture() draws it. False, and nothing is done, while too many
        changes wait for the next tick."""
        return self._session.ask_tubes(0)

    def keep_tubes(self):
        """Marks the present tubes as kept: clear_tubes() leaves them. False as for release_tube()."""
        return self._session.ask_tubes(1)

    def clear_tubes(self):
        """Removes the tubes that are not kept; if all are kept, removes all. False as for release_tube()."""
        return self._session.ask_tubes(2)

    @property
    def tubes(self):
        """The stream tubes at the newest tick, the oldest first. A requested tube appears some hundredths of a second after its tick. A list
        of dicts: "points_m" (n, 3), world, m; "lengths" (n), of the field's vectors when it was laid, in "unit"; "field", "volume" (its
        number), "seed" (the index of the point that was at the proxy), "kept", "closed"."""
        return self._session.tubes()

    def save_tubes(self, path):
        """Writes all tubes as lines for ParaView and 3D Slicer (.vtk, mm, LPS), at the places where they were laid. OSError if the file can
        not be written."""
        self._session.save_tubes(os.fspath(path))

    def picture(self, position_m=(0.13, 0.09, 0.34), look_at_m=(0.0, 0.0, 0.0), *, width=640, height=480, height_angle=0.55):
        """Draws the scene, seen from position_m towards look_at_m (world, m), with height_angle radians from bottom to top. Returns RGBA,
        shape (height, width, 4), uint8. ValueError before the first tick, and if position_m is at look_at_m. Any thread; one picture is
        drawn at a time."""
        eye, at = np.array(_numbers(position_m, "position_m", 3)), np.array(_numbers(look_at_m, "look_at_m", 3))
        height_angle = _number(height_angle, "height_angle")
        if not 0.0 < height_angle < np.pi:
            raise ValueError("height_angle must be between 0 and pi")
        width, height = operator.index(width), operator.index(height)
        if min(width, height) < 1:
            raise ValueError("a picture has at least one pixel in each direction")
        back = eye - at
        if not np.linalg.norm(back) > 0.0:
            raise ValueError("position_m and look_at_m are the same place: look at another one")
        back /= np.linalg.norm(back)
        # Straight up or down there is no direction to the right: that of the world is taken.
        right = np.cross((0.0, 1.0, 0.0), back)
        right = right / np.linalg.norm(right) if np.linalg.norm(right) > 1e-9 else np.array((1.0, 0.0, 0.0))
        up = np.cross(back, right)
        tan_y = float(np.tan(0.5 * height_angle))
        return self._session.picture(list(eye), _quaternion(np.column_stack((right, up, back))), tan_y * width / height, tan_y,
                                     width, height)

    def stop(self):
        """Ramps the force to zero; it does not come back. If Python has the loop, continue to call tick() until at_rest. With device= it
        waits for the end of the ramp."""
        self._session.stop()

    @property
    def at_rest(self):
        """True: the session was stopped, and the force has reached zero."""
        return self._session.at_rest()

    def close(self):
        """Ends the session. Further calls raise ValueError. OSError if a recording, a table or a black box could not be written or lacks
        ticks; the session is closed even then."""
        self._session.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def _quaternion(matrix):
    """x, y, z, w of a rotation matrix."""
    values, vectors = np.linalg.eigh(np.array([
        [matrix[0, 0] - matrix[1, 1] - matrix[2, 2], 0, 0, 0],
        [matrix[0, 1] + matrix[1, 0], matrix[1, 1] - matrix[0, 0] - matrix[2, 2], 0, 0],
        [matrix[0, 2] + matrix[2, 0], matrix[1, 2] + matrix[2, 1], matrix[2, 2] - matrix[0, 0] - matrix[1, 1], 0],
        [matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1],
         matrix[0, 0] + matrix[1, 1] + matrix[2, 2]]]) / 3.0)
    return [float(number) for number in vectors[:, np.argmax(values)]]


def _signature():
    """Of Session(): with a keyword for each option, as editors and help() show it."""
    parameters = list(inspect.signature(Session.__init__).parameters.values())
    options = [inspect.Parameter(key, inspect.Parameter.KEYWORD_ONLY, default=None) for key in _OPTIONS]
    return inspect.Signature(parameters[1:-1] + options)


Session.__signature__ = _signature()
Session.__doc__ = Session.__doc__.replace("{options}", _option_lines())
