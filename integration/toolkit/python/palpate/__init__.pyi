from os import PathLike
from typing import Any, Callable, NamedTuple, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

__version__: str
PRESETS: tuple[str, ...]

class Verdict(NamedTuple):
    trust: str
    reasons: list[str]
    measured: dict[str, float]
    def __bool__(self) -> bool: ...

class Motion:
    spacing: tuple[float, float, float]
    origin: tuple[float, float, float]
    direction: NDArray[np.float64]
    @property
    def steps(self) -> int: ...
    @property
    def is_whole(self) -> bool: ...
    @property
    def reference(self) -> int | None: ...
    @property
    def field(self) -> NDArray[np.float32]: ...
    @property
    def confidence(self) -> NDArray[np.float32]: ...
    @property
    def deviation(self) -> NDArray[np.float32]: ...
    @property
    def verdict(self) -> Verdict: ...
    def step(self, k: int) -> NDArray[np.float32]: ...
    def at(self, time_s: float) -> NDArray[np.float32]: ...
    def inverse(self, k: int = 0, *, time_s: float | None = None) -> NDArray[np.float32]: ...
    def move_points(self, points_mm: ArrayLike, k: int = 0, *, time_s: float | None = None) -> NDArray[np.float64]: ...
    def determinant(self, k: int = 0, *, time_s: float | None = None) -> NDArray[np.float32]: ...
    def warp(self, image: Any, k: int = 0, *, time_s: float | None = None, inverse: bool = False) -> NDArray[np.float32]: ...
    def save(self, path: str | PathLike[str], k: int | None = None) -> None: ...

class Frames:
    spacing: tuple[float, float, float]
    origin: tuple[float, float, float]
    direction: NDArray[np.float64]
    shape: tuple[int, int, int, int]
    times: list[float]
    has_times: bool
    notes: list[str]
    def __len__(self) -> int: ...
    def __getitem__(self, k: int) -> NDArray[np.float32]: ...

def register(
    fixed: Any,
    moving: Any = None,
    *,
    spacing: Sequence[float] | None = None,
    origin: Sequence[float] | None = None,
    direction: ArrayLike | None = None,
    mask: Any = None,
    preset: str = "balanced",
    times: Sequence[float] | None = None,
    cyclic: bool = False,
    pairwise: bool = False,
    verdict: bool = True,
    progress: Callable[[str, float], None] | None = None,
    gpu: str | None = None,
) -> Motion: ...
def open_sequence(
    paths: str | PathLike[str] | Sequence[str | PathLike[str]],
    *,
    nan_as: float | None = None,
) -> Frames: ...
def open_motion(path: str | PathLike[str], *, gpu: str | None = None) -> Motion: ...

class Session:
    def __init__(
        self,
        scene: str | PathLike[str] | Sequence[str | PathLike[str]] = (),
        *,
        json: str | None = None,
        frames: Any = None,
        spacing: Sequence[float] | None = None,
        origin: Sequence[float] | None = None,
        direction: ArrayLike | None = None,
        times: Sequence[float] | None = None,
        live: bool = False,
        workspace_radius_m: float = 0.1,
        device_force_n: float = 8.0,
        gpu: str | None = None,
        # The table of options (docs/using/options.md); a test compares.
        iso_value: float | None = None,
        width: float | None = None,
        strength_n: float | None = None,
        friction: float | None = None,
        frames_per_second: float | None = None,
        fields: str | PathLike[str] | None = None,
        values: str | None = None,
        nan_as: float | None = None,
        modes: str | PathLike[str] | Sequence[str | PathLike[str]] | None = None,
        folder: str | PathLike[str] | None = None,
        segments: str | PathLike[str] | Sequence[str | PathLike[str]] | None = None,
        segments_frame: int | None = None,
        segment_names: str | Sequence[str] | None = None,
        wall: str | None = None,
        scale: float | str | None = None,
        true_size: bool | None = None,
        movable: bool | None = None,
        forget_motion: bool | None = None,
        motion: bool | None = None,
        cyclic: bool | None = None,
        image: str | PathLike[str] | None = None,
        transform: str | PathLike[str] | None = None,
        wait_s: float | None = None,
        crc: bool | None = None,
        device: str | PathLike[str] | None = None,
        falcon_firmware: str | PathLike[str] | None = None,
        path: str | PathLike[str] | None = None,
        hand: str | None = None,
        lets_go_s: float | None = None,
        tool: str | PathLike[str] | None = None,
        stiffness_n_per_m: float | None = None,
        max_force_n: float | None = None,
        tool_radius_mm: float | None = None,
        tool_points: int | None = None,
        dead_man: bool | None = None,
        watchdog_s: float | None = None,
        max_hand_speed_m_per_s: float | None = None,
        real_time: bool | None = None,
        core: int | None = None,
        tube_buttons: int | None = None,
        preset: str | None = None,
        estimate: bool | None = None,
        follow: bool | None = None,
        serve: int | None = None,
        csv: str | PathLike[str] | None = None,
        record: str | PathLike[str] | None = None,
        black_box: str | PathLike[str] | None = None,
    ) -> None: ...
    def tick(self, position_m: Sequence[float], time_ns: int = 0, buttons: int = 0) -> list[float]: ...
    @property
    def torque_n_m(self) -> list[float]: ...
    def hold(
        self,
        rotation: Sequence[float] | None = None,
        *,
        angular_velocity_rad_per_s: Sequence[float] = ...,
        opening_rad: float | None = None,
    ) -> None: ...
    def push_frame(
        self,
        frame: Any,
        *,
        spacing: Sequence[float] | None = None,
        origin: Sequence[float] | None = None,
        direction: ArrayLike | None = None,
        time_ns: int = 0,
    ) -> None: ...
    def replay(self, recording: str | PathLike[str], *, tubes: str | PathLike[str] | None = None) -> dict[str, Any]: ...
    @property
    def state(self) -> dict[str, Any]: ...
    @property
    def plan(self) -> str: ...
    @property
    def notes(self) -> str: ...
    def events(self) -> list[str]: ...
    def play(self, on: bool = True) -> bool: ...
    def scrub(self, share: float) -> bool: ...
    def rearm(self) -> bool: ...
    def place(self, volume: int, world_from_volume: ArrayLike) -> bool: ...
    def set_mode(self, index: int, on: bool = True, gain: float = 1.0) -> bool: ...
    def release_tube(self) -> bool: ...
    def keep_tubes(self) -> bool: ...
    def clear_tubes(self) -> bool: ...
    @property
    def tubes(self) -> list[dict[str, Any]]: ...
    def save_tubes(self, path: str | PathLike[str]) -> None: ...
    def picture(
        self,
        position_m: Sequence[float] = ...,
        look_at_m: Sequence[float] = ...,
        *,
        width: int = 640,
        height: int = 480,
        height_angle: float = 0.55,
    ) -> NDArray[np.uint8]: ...
    def stop(self) -> None: ...
    @property
    def at_rest(self) -> bool: ...
    def close(self) -> None: ...
    def __enter__(self) -> Session: ...
    def __exit__(self, *_: object) -> None: ...
