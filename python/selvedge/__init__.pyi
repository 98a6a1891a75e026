# Types of the module; tests/python/test_stubs.py compares them with it.
import os
from collections.abc import Callable, Iterable, MutableSequence, Sequence
from typing import Any, Literal, overload

import numpy
from numpy.typing import ArrayLike, NDArray

_Path = str | os.PathLike[str]
_Floats = NDArray[numpy.float64]
_Ints = NDArray[numpy.int32]
_Image = NDArray[numpy.uint8]
_Values = dict[str, float] | Sequence[float] | _Floats
_Progress = None | bool | Callable[[float, str], object]
_Table = dict[str, NDArray[Any]]
_Drag = Literal["nonlinear_drag", "linear_drag", "no_drag"]
_Experiment = Literal["static", "waving", "robot", "cantilever", "cusick", "tensile"]

__version__: str

class BadInput(ValueError): ...

class Fabric:
    name: str
    width_m: float
    height_m: float
    mass_kg: float
    mass_known: bool
    def __init__(self, **attributes: Any) -> None: ...

class Projection:
    matrix: _Floats  # (3, 4)
    distortion: Sequence[float]  # 5
    width_px: int
    height_px: int
    def __init__(self, **attributes: Any) -> None: ...

class StripePattern:
    orientation: str
    period_px: float
    duty: float
    first_bright_row_px: float
    def __init__(self, **attributes: Any) -> None: ...

class Corners:
    time_s: _Floats  # (T,)
    left: _Floats  # (T, 3)
    right: _Floats  # (T, 3)
    def __init__(self, **attributes: Any) -> None: ...

class Markers:
    time_s: _Floats  # (N,)
    marker: _Ints  # (N,)
    uv: _Floats  # (N, 2)
    position: _Floats  # (N, 3)
    def __init__(self, **attributes: Any) -> None: ...

class Surface:
    time_s: _Floats  # (N,)
    position: _Floats  # (N, 3)
    seen_from_m: _Floats | None  # (3,)
    def __init__(self, **attributes: Any) -> None: ...

class Robot:
    time_s: _Floats  # (T,)
    commanded: _Floats  # (T, 3)
    measured: _Floats  # (T, 3)
    def __init__(self, **attributes: Any) -> None: ...

class Frames:
    number: _Ints  # (F,)
    time_s: _Floats  # (F,)
    path: list[os.PathLike[str]]
    def __init__(self, **attributes: Any) -> None: ...

class Trial:
    folder: os.PathLike[str]
    name: str
    experiment: _Experiment
    held: Literal["corners", "top_edge", "top_edge_clamped"]
    clamp_direction: _Floats  # (3,)
    fabric: Fabric
    starts_at_rest: bool
    gravity_m_s2: _Floats  # (3,)
    camera: Projection | None
    projector: Projection | None
    pattern: StripePattern | None
    frame_rate_hz: float
    exposure_s: float
    mocap_rate_hz: float
    mocap_noise_m: float | None
    noise_grey_levels: float | None
    corners: Corners
    frames: Frames | None
    markers: Markers | None
    surface: Surface | None
    robot: Robot | None
    @property
    def state(self) -> Literal["complete", "cut", "recording"]: ...
    @property
    def damaged(self) -> list[str]: ...
    def __init__(self, **attributes: Any) -> None: ...
    def read_frame(self, index: int) -> _Image: ...

class Trials(MutableSequence[Trial]): ...

class Campaign:
    folder: os.PathLike[str]
    fabric: str
    trials: Trials
    replicates: list[list[str]]
    def __init__(self, **attributes: Any) -> None: ...

class Material:
    density: float
    stretch: float
    shear: float
    bend: float
    stretch_damping: float
    shear_damping: float
    bend_damping: float
    drag_normal: float
    drag_linear: float
    drag_tangent: float
    drag_fade: float
    stretch_anisotropy: float
    bend_anisotropy: float
    coupling: float
    stretch_stiffening: float
    bend_stiffening: float
    rest_curvature_u: float
    rest_curvature_v: float
    bend_friction: float
    bend_friction_curvature: float
    stretch_friction: float
    stretch_friction_strain: float
    creep: float
    creep_time_s: float
    added_mass: float
    hem_stiffness: float
    hem_density: float
    hem_width_m: float
    local_mass_kg: float
    local_u_m: float
    local_v_m: float
    def __init__(self, **attributes: Any) -> None: ...
    def __copy__(self) -> Material: ...

class Motion:
    @property
    def time_s(self) -> _Floats: ...  # (T,)
    @property
    def rest_uv(self) -> _Floats: ...  # (V, 2)
    @property
    def triangles(self) -> _Ints: ...  # (F, 3)
    @property
    def position(self) -> _Floats: ...  # (T, V, 3)
    @property
    def at_rest(self) -> bool: ...
    @property
    def finite(self) -> bool: ...
    @property
    def cells(self) -> int: ...
    def points(self, uv: ArrayLike) -> _Floats: ...  # (T, N, 3)

class Parameter:
    @property
    def name(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def start(self) -> float: ...
    @property
    def lower(self) -> float: ...
    @property
    def upper(self) -> float: ...

class State: ...

class Simulation:
    def __init__(
        self,
        campaign: Campaign,
        *,
        drag: _Drag = ...,
        cells: int = ...,
        rate_hz: float = ...,
        image_rate_hz: float = ...,
        progress: _Progress = ...,
    ) -> None: ...
    @property
    def parameters(self) -> list[Parameter]: ...
    @property
    def usual(self) -> dict[str, float]: ...
    @property
    def trials(self) -> list[str]: ...
    @property
    def cells(self) -> int: ...
    def state(self, values: _Values, *, nudging_per_s: float = ..., progress: _Progress = ...) -> State: ...
    def residuals(
        self, values: _Values, *, state: State | None = ..., progress: _Progress = ...
    ) -> dict[str, _Floats]: ...
    def derivatives(
        self, values: _Values, *, state: State | None = ..., step: float = ..., progress: _Progress = ...
    ) -> dict[str, _Floats]: ...
    def rms_mm(self, values: _Values, *, state: State | None = ..., progress: _Progress = ...) -> dict[str, float]: ...
    def sd_mm(self) -> dict[str, _Floats]: ...
    def time_s(self) -> dict[str, _Floats]: ...
    def motion(
        self, trial: str, values: _Values, *, state: State | None = ..., progress: _Progress = ...
    ) -> Motion: ...

class Fit:
    json: dict[str, Any]
    values: dict[str, float]
    held_out_mm: float
    remarks: list[str]
    simulation: Simulation | None
    state: State | None
    residuals_mm: dict[str, _Floats] | None
    @property
    def parameters(self) -> _Table: ...
    @property
    def trials(self) -> _Table: ...
    def material(self, trial: Trial) -> Material: ...

class Diagnosis:
    json: dict[str, Any]
    cause: str
    side: str
    probability: dict[str, float]
    gap_mm: float
    gap_interval_mm: tuple[float | None, float | None]
    next_experiment: str
    remarks: list[str]
    @property
    def effects(self) -> _Table: ...
    @property
    def sizes(self) -> _Table: ...
    @property
    def budget(self) -> _Table: ...
    @property
    def where(self) -> _Table: ...

def read_trial(folder: _Path) -> Trial: ...
def read_campaign(folder: _Path) -> Campaign: ...
def write_trial(trial: Trial, folder: _Path, images: Sequence[_Image] = ...) -> None: ...
def write_campaign(campaign: Campaign, folder: _Path) -> None: ...
def record(
    motion: Motion,
    *,
    name: str,
    fabric: Fabric,
    left: ArrayLike,
    right: ArrayLike,
    uv: ArrayLike,
    noise_m: float = ...,
    seed: int = ...,
    experiment: Literal["static", "waving", "robot"] = ...,
) -> Trial: ...
@overload
def simulate(
    material: Material,
    *,
    width_m: float,
    height_m: float,
    time_s: ArrayLike,
    left: ArrayLike,
    right: ArrayLike,
    held: Literal["corners", "top_edge", "top_edge_clamped", "side_edges"] = ...,
    clamp_direction: ArrayLike = ...,
    gravity_m_s2: ArrayLike = ...,
    air_velocity_m_s: ArrayLike = ...,
    sample_s: ArrayLike | None = ...,
    side: Literal[1, -1] = ...,
    cells: int = ...,
    progress: _Progress = ...,
) -> Motion: ...
@overload
def simulate(
    material: Sequence[Material],
    *,
    width_m: float,
    height_m: float,
    time_s: ArrayLike,
    left: ArrayLike,
    right: ArrayLike,
    held: Literal["corners", "top_edge", "top_edge_clamped", "side_edges"] = ...,
    clamp_direction: ArrayLike = ...,
    gravity_m_s2: ArrayLike = ...,
    air_velocity_m_s: ArrayLike = ...,
    sample_s: ArrayLike | None = ...,
    side: Literal[1, -1] = ...,
    cells: int = ...,
    progress: _Progress = ...,
) -> list[Motion]: ...
def fit(
    campaign: Campaign | _Path,
    *,
    drag: _Drag = ...,
    cells: int = ...,
    hold_out: Literal["automatic", "frames", "trials", "none"] = ...,
    max_iterations: int = ...,
    out: _Path | None = ...,
    progress: _Progress = ...,
) -> Fit: ...
def diagnose(
    campaign: Campaign | _Path,
    *,
    fit: Fit | None = ...,
    effects: Iterable[str] = ...,
    without: Iterable[str] = ...,
    drag: _Drag = ...,
    cells: int = ...,
    out: _Path | None = ...,
    progress: _Progress = ...,
) -> Diagnosis: ...
def effects() -> dict[str, str]: ...
def read_fit(path: _Path) -> Fit: ...
def read_diagnosis(path: _Path) -> Diagnosis: ...
