from typing import Any, Union

import numpy as np
from numpy.typing import ArrayLike

from . import Motion

_Field = Union[Motion, np.ndarray]

def assert_no_folds(
    field: _Field, *, spacing: ArrayLike = ..., origin: ArrayLike = ..., direction: ArrayLike | None = ...
) -> None: ...
def assert_within(
    field: _Field, truth: _Field, mean_voxels: float, *, mask: Any = ..., spacing: ArrayLike = ..., origin: ArrayLike = ...,
    direction: ArrayLike | None = ...,
) -> None: ...
def assert_undone_by(
    field: _Field, backward: _Field, mean_voxels: float, *, spacing: ArrayLike = ..., origin: ArrayLike = ...,
    direction: ArrayLike | None = ...,
) -> None: ...
def assert_landmarks(
    field: _Field, fixed_mm: ArrayLike, moving_mm: ArrayLike, mean_mm: float, *, spacing: ArrayLike = ..., origin: ArrayLike = ...,
    direction: ArrayLike | None = ...,
) -> None: ...
def assert_agrees_with_flow(
    field: _Field, fixed: ArrayLike, moving: ArrayLike, voxels: float = ..., *, spacing: ArrayLike = ..., origin: ArrayLike = ...,
    direction: ArrayLike | None = ...,
) -> None: ...
