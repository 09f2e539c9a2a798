"""Types of lowlux. Units, shapes and errors are in the docstrings of the functions."""
import os
from typing import Any, Callable, Dict, List, Literal, Mapping, NamedTuple, Optional, Sequence, Union

import numpy as np
import numpy.typing as npt

from .errors import ArgumentError as ArgumentError
from .errors import Error as Error
from .errors import ExistsError as ExistsError
from .errors import InsufficientError as InsufficientError
from .errors import MalformedError as MalformedError
from .errors import NotFoundError as NotFoundError
from .errors import TooLargeError as TooLargeError
from .errors import UnreadableError as UnreadableError
from .errors import UnsupportedError as UnsupportedError
from .errors import UnwritableError as UnwritableError

__version__: str
__all__: List[str]

_Path = Union[str, bytes, os.PathLike[str], os.PathLike[bytes]]
_Raw = Union[_Path, RawImage]
_Numbers = Union[Sequence[float], npt.NDArray[Any]]


class ImageSizes(NamedTuple):
    raw_height: int
    raw_width: int
    height: int
    width: int
    top_margin: int
    left_margin: int


class RawImage:
    @property
    def raw_image(self) -> npt.NDArray[Any]: ...
    @property
    def raw_image_visible(self) -> npt.NDArray[Any]: ...
    @property
    def raw_pattern(self) -> Optional[npt.NDArray[np.uint8]]: ...
    @property
    def raw_colors(self) -> Optional[npt.NDArray[np.uint8]]: ...
    @property
    def raw_colors_visible(self) -> Optional[npt.NDArray[np.uint8]]: ...
    @property
    def color_desc(self) -> bytes: ...
    @property
    def num_colors(self) -> int: ...
    @property
    def sizes(self) -> ImageSizes: ...
    @property
    def black_level_per_channel(self) -> Optional[List[float]]: ...
    @property
    def white_level(self) -> float: ...
    @property
    def cfa(self) -> Literal["RGGB", "GRBG", "GBRG", "BGGR", "MONO", "RGB"]: ...
    @property
    def black_dn(self) -> Optional[npt.NDArray[np.float64]]: ...
    @property
    def white_dn(self) -> npt.NDArray[np.float64]: ...
    @property
    def noise(self) -> Optional[npt.NDArray[np.float64]]: ...
    @property
    def matrices(self) -> List[npt.NDArray[np.float64]]: ...
    @property
    def as_shot_neutral(self) -> Optional[List[float]]: ...
    @property
    def orientation(self) -> int: ...
    @property
    def make(self) -> str: ...
    @property
    def model(self) -> str: ...
    @property
    def exposure_s(self) -> Optional[float]: ...
    @property
    def iso(self) -> Optional[float]: ...
    @property
    def f_number(self) -> Optional[float]: ...
    @property
    def temperature_c(self) -> Optional[float]: ...
    @property
    def warnings(self) -> List[str]: ...
    def raw_value(self, row: int, column: int) -> Any: ...
    def raw_color(self, row: int, column: int) -> int: ...


class Developed:
    image: npt.NDArray[Any]
    plan: Dict[str, Any]
    noise_map: Optional[npt.NDArray[np.float32]]
    confidence_map: Optional[npt.NDArray[np.float32]]
    seeing_map: Optional[npt.NDArray[np.float32]]
    @property
    def warnings(self) -> List[str]: ...


class Denoised:
    raw: RawImage
    plan: Dict[str, Any]
    noise_map: Optional[npt.NDArray[np.float32]]
    confidence_map: Optional[npt.NDArray[np.float32]]
    @property
    def warnings(self) -> List[str]: ...


class Merged:
    raw: RawImage
    plan: Dict[str, Any]
    warnings: List[str]


class Simulated:
    frames: List[RawImage]
    truth: Optional[npt.NDArray[np.float32]]
    truth_e: Optional[npt.NDArray[np.float32]]
    motion: Optional[Dict[str, Any]]
    report: Dict[str, Any]
    warnings: List[str]


class Leaderboard:
    rows: List[Dict[str, Any]]
    settings: Dict[str, str]
    machine: Dict[str, Any]
    failures: List[str]


class Profile:
    data: Dict[str, Any]
    path: Optional[str]
    warnings: List[str]
    def __init__(self, source: Union[_Path, Dict[str, Any]], warnings: Sequence[str] = ...) -> None: ...
    def __fspath__(self) -> str: ...
    def save(self, path: _Path, *, overwrite: bool = ...) -> None: ...
    def gain(self, iso: Optional[float] = ...) -> Dict[str, Any]: ...
    def variance_dn2(self, signal_dn: Any, iso: Optional[float] = ...) -> Any: ...

def read_raw(path: _Path) -> RawImage: ...

def raw_from_array(
    mosaic: npt.ArrayLike,
    *,
    black: Optional[npt.ArrayLike] = ...,
    white: Optional[npt.ArrayLike] = ...,
    cfa: Optional[Literal["RGGB", "GRBG", "GBRG", "BGGR", "MONO", "rggb", "grbg", "gbrg", "bggr", "mono"]] = ...,
    noise: Optional[npt.ArrayLike] = ...,
    matrix: Optional[npt.ArrayLike] = ...,
    exposure_s: Optional[float] = ...,
    iso: Optional[float] = ...,
    like: Optional[RawImage] = ...,
) -> RawImage: ...

def write_dng(
    path: _Path,
    mosaic: Union[npt.ArrayLike, RawImage],
    *,
    black: Optional[npt.ArrayLike] = ...,
    white: Optional[npt.ArrayLike] = ...,
    cfa: Optional[Literal["RGGB", "GRBG", "GBRG", "BGGR", "MONO", "rggb", "grbg", "gbrg", "bggr", "mono"]] = ...,
    noise: Optional[npt.ArrayLike] = ...,
    matrix: Optional[npt.ArrayLike] = ...,
    exposure_s: Optional[float] = ...,
    iso: Optional[float] = ...,
    like: Optional[RawImage] = ...,
    overwrite: bool = ...,
    compression: Optional[Literal["none", "lossless"]] = ...,
) -> None: ...

def develop(
    raw: Union[_Raw, Sequence[_Raw]],
    output: Optional[_Path] = ...,
    *,
    overwrite: bool = ...,
    bits: Optional[int] = ...,
    quality: Optional[int] = ...,
    exposure: Union[str, float, None] = ...,
    wb: Union[str, float, _Numbers, None] = ...,
    tone: Optional[Literal["standard", "none"]] = ...,
    brightness: Union[str, float, None] = ...,
    contrast: Optional[float] = ...,
    saturation: Optional[float] = ...,
    space: Optional[Literal["srgb", "p3", "rec2020", "linear-srgb", "linear-rec2020", "xyz", "camera"]] = ...,
    demosaic: Optional[str] = ...,
    half: bool = ...,
    highlights: Optional[Literal["clip", "reconstruct"]] = ...,
    local_tone: Optional[float] = ...,
    sharpen: Union[str, float, None] = ...,
    crop: Union[str, _Numbers, None] = ...,
    max_size: Optional[int] = ...,
    baseline_exposure: Optional[Literal["on", "off"]] = ...,
    camera_profile: Optional[Literal["embedded", "none"]] = ...,
    look: Optional[str] = ...,
    scene_luminance: Union[str, float, None] = ...,
    field_of_view: Optional[float] = ...,
    light: Union[str, float, None] = ...,
    adaptation_degree: Union[str, float, None] = ...,
    effects: Optional[str] = ...,
    tolerance: Optional[float] = ...,
    dimming: Optional[float] = ...,
    noise_limit: Union[str, float, None] = ...,
    coefficients: Optional[_Path] = ...,
    display_luminance: Optional[float] = ...,
    seeing_map: bool = ...,
    black: Union[str, float, _Numbers, _Path, None] = ...,
    profile: Optional[_Path] = ...,
    gain_setting: Optional[str] = ...,
    noise: Optional[_Numbers] = ...,
    dark_estimate: Optional[Literal["auto", "off"]] = ...,
    repair: Optional[Literal["auto", "off"]] = ...,
    denoise: Optional[Literal["auto", "off", "draft", "standard", "high", "best"]] = ...,
    line_noise: Optional[Literal["auto", "off"]] = ...,
    chroma_bias: Optional[Literal["least-error", "none"]] = ...,
    dark_frame: Union[_Raw, Sequence[_Raw], None] = ...,
    bias_frame: Union[_Raw, Sequence[_Raw], None] = ...,
    dark_frame_count: Optional[int] = ...,
    dark_noise: Optional[float] = ...,
    dark_doubling: Union[float, _Path, None] = ...,
    flat_frame: Union[_Raw, Sequence[_Raw], None] = ...,
    budget_ms: Optional[float] = ...,
    budget_mpps: Optional[float] = ...,
    align: Optional[Literal["auto", "none", "cells", "subpixel", "stars"]] = ...,
    foreground: Optional[Literal["move", "keep"]] = ...,
    drizzle: Optional[float] = ...,
    pixfrac: Optional[float] = ...,
    mean: Optional[Literal["robust", "plain"]] = ...,
    reference: Optional[_Raw] = ...,
    false_alarm: Optional[float] = ...,
    saturation_level: Optional[Literal["auto", "white"]] = ...,
    maps: bool = ...,
) -> Developed: ...

def denoise(
    raw: _Raw,
    output: Optional[_Path] = ...,
    *,
    overwrite: bool = ...,
    compression: Optional[Literal["none", "lossless"]] = ...,
    black: Union[str, float, _Numbers, _Path, None] = ...,
    profile: Optional[_Path] = ...,
    gain_setting: Optional[str] = ...,
    noise: Optional[_Numbers] = ...,
    dark_estimate: Optional[Literal["auto", "off"]] = ...,
    repair: Optional[Literal["auto", "off"]] = ...,
    denoise: Optional[Literal["auto", "draft", "standard", "high", "best"]] = ...,
    line_noise: Optional[Literal["auto", "off"]] = ...,
    chroma_bias: Optional[Literal["least-error", "none"]] = ...,
    dark_frame: Union[_Raw, Sequence[_Raw], None] = ...,
    bias_frame: Union[_Raw, Sequence[_Raw], None] = ...,
    dark_frame_count: Optional[int] = ...,
    dark_noise: Optional[float] = ...,
    dark_doubling: Union[float, _Path, None] = ...,
    saturation_level: Optional[Literal["auto", "white"]] = ...,
    maps: bool = ...,
) -> Denoised: ...

def merge(
    raws: Sequence[_Raw],
    output: Optional[_Path] = ...,
    *,
    overwrite: bool = ...,
    compression: Optional[Literal["none", "lossless"]] = ...,
    align: Optional[Literal["auto", "none", "cells", "subpixel", "stars"]] = ...,
    foreground: Optional[Literal["move", "keep"]] = ...,
    drizzle: Optional[float] = ...,
    pixfrac: Optional[float] = ...,
    mean: Optional[Literal["robust", "plain"]] = ...,
    reference: Optional[_Raw] = ...,
    false_alarm: Optional[float] = ...,
    black: Union[str, float, _Numbers, _Path, None] = ...,
    profile: Optional[_Path] = ...,
    gain_setting: Optional[str] = ...,
    noise: Optional[_Numbers] = ...,
    dark_estimate: Optional[Literal["auto", "off"]] = ...,
    repair: Optional[Literal["auto", "off"]] = ...,
    line_noise: Optional[Literal["auto", "off"]] = ...,
    dark_frame: Union[_Raw, Sequence[_Raw], None] = ...,
    bias_frame: Union[_Raw, Sequence[_Raw], None] = ...,
    dark_frame_count: Optional[int] = ...,
    dark_noise: Optional[float] = ...,
    dark_doubling: Union[float, _Path, None] = ...,
    flat_frame: Union[_Raw, Sequence[_Raw], None] = ...,
    saturation_level: Optional[Literal["auto", "white"]] = ...,
    budget_ms: Optional[float] = ...,
) -> Merged: ...

def simulate(
    scene: Union[_Path, npt.NDArray[Any]],
    output: Optional[_Path] = ...,
    *,
    overwrite: bool = ...,
    size: Union[str, _Numbers, None] = ...,
    light: Optional[_Path] = ...,
    luminance: Optional[float] = ...,
    stars: Optional[int] = ...,
    star_luminance: Optional[float] = ...,
    lamp: Union[str, Sequence[str], None] = ...,
    truth: Optional[_Path] = ...,
    no_truth: bool = ...,
    truth_electrons: Optional[_Path] = ...,
    sensor: Optional[str] = ...,
    gain: Optional[str] = ...,
    camera: Optional[str] = ...,
    exposure: Optional[float] = ...,
    f_number: Optional[float] = ...,
    lens_blur: Optional[float] = ...,
    temperature: Optional[float] = ...,
    cfa: Optional[Literal["RGGB", "GRBG", "GBRG", "BGGR", "rggb", "grbg", "gbrg", "bggr"]] = ...,
    masked_columns: Optional[int] = ...,
    effects: Optional[str] = ...,
    sampling: Optional[str] = ...,
    seed: Optional[int] = ...,
    sensor_seed: Optional[int] = ...,
    frames: Optional[int] = ...,
    tolerance: Union[float, _Numbers, None] = ...,
    shake: Optional[float] = ...,
    roll: Optional[float] = ...,
    dither: Optional[float] = ...,
    field_rotation: Optional[float] = ...,
    field_centre: Union[str, _Numbers, None] = ...,
    drift: Union[str, _Numbers, None] = ...,
    horizon: Optional[int] = ...,
    movers: Optional[int] = ...,
    mover_size: Optional[float] = ...,
    mover_speed: Optional[float] = ...,
    bracket: Union[str, float, _Numbers, None] = ...,
    reduce: Optional[int] = ...,
    system_gain: Optional[float] = ...,
    read_noise: Optional[float] = ...,
    full_well: Optional[float] = ...,
    bits: Optional[int] = ...,
    black_level: Optional[float] = ...,
    white_level: Optional[float] = ...,
    dark_current: Union[str, float, _Numbers, None] = ...,
    dark_temperature: Optional[float] = ...,
    dark_doubling: Optional[float] = ...,
    dark_activation: Optional[float] = ...,
    dark_floor: Optional[float] = ...,
    prnu: Optional[float] = ...,
    dsnu: Optional[float] = ...,
    hot_pixels: Optional[float] = ...,
    hot_current: Optional[float] = ...,
    telegraph_pixels: Optional[float] = ...,
    telegraph_noise: Optional[float] = ...,
    crosstalk: Optional[float] = ...,
    glow: Optional[float] = ...,
    glow_position: Union[str, _Numbers, None] = ...,
    glow_length: Optional[float] = ...,
    row_noise: Optional[float] = ...,
    column_noise: Optional[float] = ...,
    pixel_pitch: Optional[float] = ...,
    peak_qe: Optional[float] = ...,
    iso: Optional[float] = ...,
    white_luminance: Optional[float] = ...,
    quantise: Optional[Literal["round", "floor"]] = ...,
) -> Simulated: ...

def compare(reference: Union[_Path, npt.NDArray[Any]], test: Union[_Path, npt.NDArray[Any]]) -> Dict[str, Any]: ...

def bench(
    methods: Optional[Mapping[str, Union[str, Callable[[RawImage], Any], None]]] = ...,
    output: Optional[_Path] = ...,
    *,
    overwrite: bool = ...,
    levels: Sequence[Literal["draft", "standard", "high", "best"]] = ...,
    seed: Optional[int] = ...,
    quick: bool = ...,
    pictures: Optional[Literal["held-out", "tuning", "all"]] = ...,
    pictures_folder: Optional[_Path] = ...,
    threads: Optional[int] = ...,
    time_limit: Optional[float] = ...,
    shard: Optional[str] = ...,
) -> Leaderboard: ...

def calibrate(
    kind: Literal["black", "colour", "noise", "quoted"],
    frames: Union[_Raw, Sequence[_Raw]] = ...,
    output: Optional[_Path] = ...,
    *,
    overwrite: bool = ...,
    **options: Any,
) -> Profile: ...
