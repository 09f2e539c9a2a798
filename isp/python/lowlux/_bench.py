"""bench: methods of noise reduction, scored on the same raw frames."""
import collections.abc
import dataclasses
import json
import pathlib
from typing import List

from . import _lowlux
from ._verbs import denoise
from ._words import bytes_of, output_of, words_of
from .errors import ArgumentError


@dataclasses.dataclass(frozen=True)
class Leaderboard:
    """Scores of methods, and what is needed to repeat them."""

    rows: List[dict]
    """A row for each light and method, the best PSNR first: the columns of `lowlux bench --method` as keys."""
    settings: dict
    """Seed, scenes, sensor, lights, limits and commands."""
    machine: dict
    """Processor, system, and the version of lowlux."""
    failures: List[str]
    """A line for each method that is not installed or failed, and is not in rows."""


def _pictures():
    """Return the clean pictures next to a package that was not installed, where the build puts them."""
    folder = pathlib.Path(_lowlux.__file__).resolve().parents[2] / "pictures"
    return folder if folder.is_dir() else None


def _level(name):
    def run(raw):
        return denoise(raw, denoise=name).raw

    return run


def bench(methods=None, output=None, *, overwrite=False, levels=("draft", "standard", "high", "best"), seed=None,
          quick=False, pictures=None, pictures_folder=None, threads=None, time_limit=None, shard=None):
    """Score methods of noise reduction next to lowlux's levels, as `lowlux bench --method` does.

    methods: {name: method}. A method is a function of a RawImage that returns a RawImage, or an image of (height,
        width, 3): uint8 or uint16 sRGB codes, or floats of linear sRGB; or a command line with {in} and {out}, or
        {out.png}, {out.tif}, {out.ppm}; or None for a known program of that name (dcraw, libraw, rawtherapee, darktable,
        opencv).
    output: folder for the page bench.html, methods.csv, methods.json and images; None writes nothing.
    levels: levels of lowlux.denoise to score as well. seed: of scenes and noise. pictures_folder: testdata/pictures of
    lowlux's sources, which a package that is not installed finds by itself. time_limit: of a command [s]; functions have none.
    shard: "2/3" measures in every third light from the second on, for tasks that share the work.
    All methods are given the same frames. The truth is never passed to them.
    Returns Leaderboard. A method that fails is left out, and a line in failures says why.
    Errors: ArgumentError; NotFoundError without pictures; ExistsError, UnwritableError.
    """
    if isinstance(levels, (str, bytes)) or not hasattr(levels, "__iter__"):
        raise ArgumentError(f"levels: {levels!r} is not a list of names", "levels")
    methods = {} if methods is None else methods
    if not isinstance(methods, collections.abc.Mapping):
        raise ArgumentError(f"methods: a {type(methods).__name__} is not a dict of names and methods", "methods")
    entries = [(bytes_of(f"lowlux-{level}", "levels"), b"", _level(level)) for level in levels]
    for name, method in methods.items():
        title = bytes_of(name, "methods") if isinstance(name, str) else None
        if title is None:
            raise ArgumentError(f"methods: {name!r} is not a name", "methods")
        if method is None:
            entries.append((title, title, None))
        elif callable(method):
            entries.append((title, b"", method))
        elif isinstance(method, str):
            entries.append((title, title + b"=" + bytes_of(method, name), None))
        else:
            raise ArgumentError(f"methods: {name} is a {type(method).__name__}, not a function, a command or None",
                                "methods")
    options = {"seed": seed, "quick": quick, "pictures": pictures, "threads": threads, "time_limit": time_limit, "shard": shard,
               "pictures_folder": _pictures() if pictures_folder is None else pictures_folder}
    (found,) = json.loads(_lowlux.bench(output_of(output), overwrite, words_of(options), entries))
    return Leaderboard(found["rows"], found["settings"], found["machine"], found["failures"])
