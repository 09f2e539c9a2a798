"""simulate and compare: raw files with a known noise-free reference, and differences between two images."""
import dataclasses
import json
from typing import List, Optional

import numpy as np

from . import _lowlux
from ._words import bytes_of, output_of, words_of
from .errors import ArgumentError


@dataclasses.dataclass(frozen=True)
class Simulated:
    """Simulated frames and their truth."""

    frames: List[_lowlux.RawImage]
    truth: Optional[np.ndarray]
    """height x width x 3, float32: linear sRGB of the scene with its white at 1; None with no_truth or in the dark."""
    truth_e: Optional[np.ndarray]
    """height x width x 3, float32: mean electrons of R, G and B at each pixel, without noise."""
    motion: Optional[dict]
    """Motion and exposure time of each frame of a burst; None for single frames."""
    report: dict
    """Sensor, plan of noise sources and assumptions, as `lowlux simulate --json` prints them."""
    warnings: List[str]


def simulate(scene, output=None, *, overwrite=False, size=None, light=None, luminance=None, stars=None,
             star_luminance=None, lamp=None, truth=None, no_truth=False, truth_electrons=None, sensor=None, gain=None,
             camera=None, exposure=None, f_number=None, lens_blur=None, temperature=None, cfa=None, masked_columns=None,
             effects=None, sampling=None, seed=None, sensor_seed=None, frames=None, tolerance=None, shake=None,
             roll=None, dither=None, field_rotation=None, field_centre=None, drift=None, horizon=None, movers=None,
             mover_size=None, mover_speed=None, bracket=None, reduce=None, system_gain=None, read_noise=None,
             full_well=None, bits=None, black_level=None, white_level=None, dark_current=None, dark_temperature=None,
             dark_doubling=None, dark_activation=None, dark_floor=None, prnu=None, dsnu=None, hot_pixels=None,
             hot_current=None, telegraph_pixels=None, telegraph_noise=None, crosstalk=None, glow=None,
             glow_position=None, glow_length=None, row_noise=None, column_noise=None, pixel_pitch=None, peak_qe=None,
             iso=None, white_luminance=None, quantise=None):
    """Simulate raw frames of a scene, as `lowlux simulate` does with the same options.

    scene: a path of an image, or "dark", "flat", "chart", "chart:macbeth", "chart:munsell", "chart:FILE.csv", or an array
        of (height, width, 3): uint8 or uint16 codes of sRGB, or floats of linear sRGB, whose white (1) is at luminance.
    output: DNG to write, with the truth next to it as the command names it; None writes nothing.
    size: (width, height) [px]. luminance: of white in the scene [cd/m2]. exposure: time [s]. temperature: [C].
    lens_blur: standard deviation of the blur of the lens [px]; the truth is blurred too.
    sensor: a name that `lowlux simulate --list` prints. seed: of the random numbers; sensor_seed: of the fixed pattern.
    frames: number of frames. shake [px], roll [degrees], drift (x, y) [px]: motion from frame to frame.
    system_gain [DN/e-], read_noise, full_well [e-], dark_current [e-/s], black_level, white_level [DN]: figures that
    replace those of the sensor. All other options are described by `lowlux simulate --help`.
    Returns Simulated. Errors: ArgumentError for options and unknown sensors; those of reading and writing; TooLargeError
    if frames and truth take more memory than is available.
    """
    options = {name: value for name, value in locals().items() if name not in ("scene", "output", "overwrite")}
    if isinstance(size, (tuple, list, np.ndarray)):
        sides = size.ravel().tolist() if isinstance(size, np.ndarray) else size
        options["size"] = "x".join(str(side) for side in sides)
    if isinstance(cfa, str):
        options["cfa"] = cfa.lower()  # RawImage.cfa and raw_from_array have capitals
    path = output_of(output)
    if not path and (truth is not None or truth_electrons is not None):
        raise ArgumentError("truth: a file of the truth requires an output", "truth")
    name = b"scene" if isinstance(scene, np.ndarray) else bytes_of(scene, "scene")
    words = [*words_of(options, ("lamp",)), b"--output=" + (path or b"none.dng"), b"--", name]
    source = scene if isinstance(scene, np.ndarray) else name
    made, report, found, found_e, motion, warnings = _lowlux.simulate(source, path, overwrite, words)
    return Simulated(made, found, found_e, json.loads(motion) if motion else None, json.loads(report), warnings)


def compare(reference, test):
    """Compare two images of one size, as `lowlux compare` does.

    reference, test: paths of images, or arrays of (height, width, 3): uint8 or uint16 codes of sRGB, or floats of linear
        sRGB with white at 1.
    Returns a dict as `lowlux compare --json` prints it: CIEDE2000 and other colour differences, psnr_db, ssim, gamut.
    Errors: those of reading; ArgumentError for different sizes, UnsupportedError or MalformedError for NaN.
    """
    images = [image if isinstance(image, np.ndarray) else bytes_of(image, name)
              for name, image in (("reference", reference), ("test", test))]
    return json.loads(_lowlux.compare(*images))
