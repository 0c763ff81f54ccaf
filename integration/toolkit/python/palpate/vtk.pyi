from typing import Any, Callable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import Motion

class Cancelled(Exception): ...

def estimate(
    frames: Any,
    *,
    on_progress: Callable[[str, float], object] | None = None,
    is_cancelled: Callable[[], object] | None = None,
    **options: Any,
) -> Motion: ...

class MovingImage:
    motion: Motion
    reference: int
    def __init__(self, frames: Sequence[Any], times: Sequence[float], *, reference: int | None = None, **options: Any) -> None: ...
    def displacement(self, time: float) -> NDArray[np.float32]: ...
    def determinant(self, time: float) -> NDArray[np.float32]: ...
    def confidence(self, time: float) -> NDArray[np.float32]: ...
    def values(self, time: float) -> NDArray[np.float32]: ...

def image(like: Any, arrays: Mapping[str, ArrayLike]) -> Any: ...
