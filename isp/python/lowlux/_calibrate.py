"""calibrate, and profiles of cameras."""
import json
import os

import numpy as np

from . import _lowlux
from ._frames import on_disk
from ._words import bytes_of, output_of, words_of
from .errors import ArgumentError


class Profile:
    """Measurements of a camera: black level, noise, dark current, colour.

    Profile(path) reads the file that `lowlux calibrate` writes, Profile(dict) checks its contents. `data` is that
    dict: values have units in their names. str(profile) is the text of the file. The option profile= uses the file of a
    profile: after a change of `data`, save() it first.
    Errors: those of reading; MalformedError or ArgumentError, with the key, for contents that are not a profile.
    """

    def __init__(self, source, warnings=()):
        self.path = None
        """The file it was read from or written to; None if there is none."""
        self.warnings = list(warnings)
        """Warnings of the calibration that made the profile."""
        if isinstance(source, dict):
            self._text = _lowlux.profile_text(json.dumps(source))
        else:
            path = bytes_of(source, "source")
            self.path = os.fsdecode(path)
            self._text = _lowlux.read_profile(path)
        self.data = json.loads(self._text)

    def __str__(self):
        return self._text

    def __fspath__(self):
        if self.path is None or self.data != json.loads(self._text):
            raise ArgumentError("profile: save() it first: options name the file of a profile", "profile")
        return self.path

    def save(self, path, *, overwrite=False):
        """Write the profile as JSON, completely or not at all. Errors: ExistsError, UnwritableError."""
        path = bytes_of(path, "path")
        self._text = _lowlux.profile_text(json.dumps(self.data))
        _lowlux.write_profile(self._text, path, overwrite)
        self.path = os.fsdecode(path)

    def gain(self, iso=None):
        """Return the figures of one gain setting, by its ISO; None for the only one. Error: ArgumentError."""
        gains = [gain for gain in self.data["gains"] if iso is None or gain.get("iso") == iso]
        if len(gains) != 1:
            known = ", ".join(f"{gain.get('iso') or 0:g}" for gain in self.data["gains"]) or "none"
            raise ArgumentError(f"iso: {iso} names {len(gains)} gain settings of the profile, which has: {known}", "iso")
        return gains[0]

    def variance_dn2(self, signal_dn, iso=None):
        """Return the temporal variance of a raw value [DN^2], of the signal above black [DN], a number or a sequence of
        them, whose result is an array.

        Photon transfer (EMVA 1288 release 4.0, Eq. 15): K^2 sigma_d^2 + 1/12 + K max(signal_dn, 0), with K the system
        gain [DN/e-] and sigma_d the read noise [e-]: a value below black is noise without light. Error: ArgumentError
        if the system gain is not known.
        """
        sensor = self.gain(iso).get("sensor")
        if not sensor:
            raise ArgumentError("the profile does not state the system gain", "profile")
        gain, noise_e = sensor["system_gain_dn_per_e"]["value"], sensor["read_noise_e"]["value"]
        signal = signal_dn if isinstance(signal_dn, (int, float)) else np.asarray(signal_dn, dtype=float)
        return (gain * noise_e) ** 2 + 1 / 12 + gain * np.maximum(signal, 0)


# Options of the command that print, or that this function has arguments for.
_OF_THE_COMMAND = frozenset(["force", "help", "help_all", "json", "no_config", "quiet"])


def calibrate(kind, frames=(), output=None, *, overwrite=False, **options):
    """Measure a camera, as `lowlux calibrate KIND` does with the same options.

    kind: "black" (of dark frames), "noise" (of pairs of flats with darks=, or of one image), "colour" (of a chart, or of
        the spectral sensitivities camera=), or "quoted" (frames is the name of a sensor).
    frames: a path or a RawImage, or a list of them. output: profile to write (JSON); None writes nothing.
    options: those of `lowlux calibrate KIND --help`, with _ for -: darks= (like frames), exposure_time= [s], iso=...
    Returns the Profile. Errors: ArgumentError for options and unknown sensors; InsufficientError; those of reading.
    """
    if kind not in ["black", "colour", "noise", "quoted"]:
        raise ArgumentError(f"kind: {kind!r} is none of black, colour, noise, quoted", "kind")
    for name in sorted(_OF_THE_COMMAND.intersection(options)):
        raise ArgumentError(f"{name}: it is an option of the command only", name)
    path = output_of(output)
    with on_disk({**options, "frames": frames}, ("frames", "darks")) as (options, named):
        frames = options.pop("frames")
        frames = frames if isinstance(frames, (list, tuple)) else [frames]
        words = [*words_of(options, ("darks",)), b"--output=" + (path or b"none.json")]
        words += [b"--", *(bytes_of(frame, "frames") for frame in frames)] if frames else []
        text, warnings = _lowlux.calibrate(kind, path, overwrite, words)
    profile = Profile(json.loads(text), [named(warning) for warning in warnings])
    profile.path = os.fsdecode(path) if path else None
    return profile
