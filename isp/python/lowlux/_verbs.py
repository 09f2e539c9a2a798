"""The verbs that process raw frames: develop, denoise, merge."""
import dataclasses
import json
import os
from typing import Optional

import numpy as np

from . import _lowlux
from ._frames import on_disk
from ._words import input_of, inputs_of, output_of, words_of
from .errors import ArgumentError

_FILES = ("dark_frame", "bias_frame", "flat_frame")


@dataclasses.dataclass(frozen=True)
class Developed:
    """A developed image and how it was made."""

    image: np.ndarray
    """height x width x 3, upright: display codes (uint8, uint16), or float32 of the requested space, white at 1."""
    plan: dict
    """Decisions and their reasons, as `lowlux develop --json` prints them: values with units in their names."""
    noise_map: Optional[np.ndarray]
    """With maps=True: variance of the residual noise in each 2x2 cell [e-^2]."""
    confidence_map: Optional[np.ndarray]
    """With maps=True: confidence of the colour of each 2x2 cell, 0 to 1."""
    seeing_map: Optional[np.ndarray]
    """With seeing_map=True: probability of seeing each 4x4 pixels, 0 to 1."""

    @property
    def warnings(self):
        """Warnings that the command prints, one line each."""
        return self.plan["warnings"]


@dataclasses.dataclass(frozen=True)
class Denoised:
    """A denoised raw frame and how it was made."""

    raw: _lowlux.RawImage
    plan: dict
    """Decisions and their reasons, as `lowlux denoise --json` prints them."""
    noise_map: Optional[np.ndarray]
    """With maps=True: variance of the residual noise in each 2x2 cell [e-^2]."""
    confidence_map: Optional[np.ndarray]
    """With maps=True: confidence of the colour of each 2x2 cell, 0 to 1."""

    @property
    def warnings(self):
        """Warnings that the command prints, one line each."""
        return self.plan["warnings"]


@dataclasses.dataclass(frozen=True)
class Merged:
    """One raw frame made of several, and how it was made."""

    raw: _lowlux.RawImage
    plan: dict
    """The used fraction of each frame and the reason, as `lowlux merge --json` prints them."""
    warnings: list
    """Warnings that the command prints, one line each."""


def _call(verb, inputs, output, overwrite, words):
    """Call a verb, whose parser requires names of output and inputs."""
    path = output_of(output)
    if path.endswith(b"/") or path and os.path.isdir(path):
        raise ArgumentError(f"{os.fsdecode(path)}: the output is one file, not a folder", os.fsdecode(path))
    words = [*words, b"--output=" + (path or b"none"), b"--", *(name for name, _ in inputs)]
    return verb(inputs, path, overwrite, words)


def _reference(reference, inputs):
    """Return the name of a reference that is a RawImage among the inputs; anything else unchanged."""
    return next((name for name, frame in inputs if frame is not None and frame is reference), reference)


def develop(raw, output=None, *, overwrite=False, bits=None, quality=None, exposure=None, wb=None, tone=None,
            brightness=None, contrast=None, saturation=None, space=None, demosaic=None, half=False,
            highlights=None, local_tone=None, sharpen=None, crop=None, max_size=None, baseline_exposure=None,
            camera_profile=None, look=None, scene_luminance=None, field_of_view=None, light=None,
            adaptation_degree=None, effects=None, tolerance=None, dimming=None, noise_limit=None, coefficients=None,
            display_luminance=None, seeing_map=False, black=None, profile=None, gain_setting=None, noise=None,
            dark_estimate=None, repair=None, denoise=None, line_noise=None, chroma_bias=None, dark_frame=None,
            bias_frame=None, dark_frame_count=None, dark_noise=None, dark_doubling=None, flat_frame=None,
            budget_ms=None, budget_mpps=None, align=None, foreground=None, drizzle=None, pixfrac=None, mean=None,
            reference=None, false_alarm=None, saturation_level=None, maps=False):
    """Develop a raw frame to an image, as `lowlux develop` does with the same options.

    raw: a path or a RawImage, which is not changed; or a list of them, frames of one scene that are merged first.
    output: image to write (.png .jpg .tif .exr .pfm), with its maps next to it; None writes nothing.
    bits: 8 (default), 16 or 32 bits per sample of the image; with an output the default is that of its format.
    exposure: gain [EV], "auto", or a change of it ("auto+1"). wb: as --wb, or a temperature [K], or gains (r, g, b). tone: "standard" or "none".
    brightness: [EV] of mid-tones. contrast, saturation: factors. highlights: "clip" or "reconstruct".
    local_tone: 0 to 1, shadows brighter and highlights darker. sharpen: blur to sharpen for [px], or "off".
    crop: (x, y, width, height) of the upright image [px], or "10%,10%,80%,80%". max_size: longer side [px].
    space: "srgb", "p3", "rec2020", "linear-srgb", "linear-rec2020", "xyz" or "camera"; 32 bits are linear.
    black: "auto", "metadata", "masked", one level or four of the 2x2 cell [DN], or a profile.
    noise: (system gain [DN/e-], read noise [e-]). baseline_exposure: "on" or "off".
    denoise: "auto", "off", "draft", "standard", "high" or "best".
    dark_frame, bias_frame, flat_frame: a path or a RawImage, or a list of them.
    scene_luminance, display_luminance: [cd/m2].
    budget_ms: time for the frame [ms]. drizzle: width of the result over that of a frame, 1 to 3.
    All other options are described by `lowlux develop --help`: the option --field-of-view is field_of_view.
    Returns Developed. Errors: ArgumentError for options; those of read_raw, and of writing.
    """
    options = {name: value for name, value in locals().items() if name not in ("raw", "output", "overwrite")}
    several = isinstance(raw, (list, tuple))
    inputs = inputs_of(raw) if several else [input_of(raw)]
    options.update(merge=several, reference=_reference(reference, inputs))
    with on_disk(options, _FILES) as (options, named):
        image, plan, found = _call(_lowlux.develop, inputs, output, overwrite, words_of(options, _FILES))
    return Developed(image, json.loads(named(plan)), found.get("noise"), found.get("confidence"), found.get("seeing"))


def denoise(raw, output=None, *, overwrite=False, compression=None, black=None, profile=None, gain_setting=None,
            noise=None, dark_estimate=None, repair=None, denoise=None, line_noise=None, chroma_bias=None,
            dark_frame=None, bias_frame=None, dark_frame_count=None, dark_noise=None, dark_doubling=None,
            saturation_level=None, maps=False):
    """Subtract noise, dark charge and defects from a raw frame, as `lowlux denoise` does with the same options.

    raw: a path or a RawImage, which is not changed.
    output: DNG to write, with its maps next to it; None writes nothing. compression: "none" (default) or "lossless".
    denoise: "auto", "draft", "standard", "high" or "best".
    All other options are those of develop.
    Returns Denoised, whose noise property states the residual noise. Errors: those of develop; noise that is not known.
    """
    options = {name: value for name, value in locals().items() if name not in ("raw", "output", "overwrite")}
    _check_dng(output)
    with on_disk(options, _FILES) as (options, named):
        clean, plan, found = _call(_lowlux.denoise, [input_of(raw)], output, overwrite, words_of(options, _FILES))
    return Denoised(clean, json.loads(named(plan)), found.get("noise"), found.get("confidence"))


def merge(raws, output=None, *, overwrite=False, compression=None, align=None, foreground=None, drizzle=None,
          pixfrac=None, mean=None, reference=None, false_alarm=None, black=None, profile=None, gain_setting=None,
          noise=None, dark_estimate=None, repair=None, line_noise=None, dark_frame=None, bias_frame=None,
          dark_frame_count=None, dark_noise=None, dark_doubling=None, flat_frame=None, saturation_level=None,
          budget_ms=None):
    """Merge frames of one scene to one with less noise, as `lowlux merge` does with the same options.

    raws: paths or RawImages, which are not changed.
    output: DNG to write; None writes nothing. compression: "none" (default) or "lossless".
    align: "auto", "none", "cells", "subpixel" or "stars". mean: "robust" or "plain".
    reference: the path or the RawImage among raws to which the others are aligned.
    All other options are described by `lowlux merge --help`.
    Returns Merged. Errors: those of develop; frames that do not belong together; a frame that is given twice.
    """
    options = {name: value for name, value in locals().items() if name not in ("raws", "output", "overwrite")}
    _check_dng(output)
    inputs = inputs_of(raws)
    options["reference"] = _reference(reference, inputs)
    with on_disk(options, _FILES) as (options, named):
        raw, plan, warnings = _call(_lowlux.merge, inputs, output, overwrite, words_of(options, _FILES))
    return Merged(raw, json.loads(named(plan)), [named(warning) for warning in warnings])


def _check_dng(output):
    path = output_of(output)
    if path and not path.lower().endswith(b".dng"):
        name = os.fsdecode(path)
        raise ArgumentError(f"{name}: raw files are written as DNG: the name must end with .dng", name)
