"""Frames in memory for options of the command that name files."""
import contextlib
import os
import tempfile

import numpy as np

from . import _lowlux, errors
from ._lowlux import RawImage


def _listed(name, value):
    if isinstance(value, np.ndarray) and value.dtype.kind in "biufc":
        raise errors.ArgumentError(f"{name}: an array states no levels; raw_from_array makes a frame of it", name)
    return value if isinstance(value, (list, tuple)) else [value]


def _stored(folder, name, value):
    """Return the frames of an argument, with a new DNG in place of each RawImage."""
    out = []
    for index, frame in enumerate(_listed(name, value)):
        if isinstance(frame, RawImage):
            path = os.path.join(folder, f"{name}_{index}.dng")
            _lowlux.write_dng(frame, os.fsencode(path), False, "none")
            frame = path
        out.append(frame)
    return out


@contextlib.contextmanager
def on_disk(options, names):
    """Give options whose RawImages are DNGs in a temporary folder until the end of the block.

    names: the options that name raw files.
    Gives the options, and a function that removes the folder from a text. Errors do not name the folder either.
    """
    held = [name for name in names if any(isinstance(frame, RawImage) for frame in _listed(name, options.get(name)))]
    if not held:
        yield options, str
        return
    try:
        folder = tempfile.TemporaryDirectory(prefix="lowlux-")
    except OSError as error:
        what = f"{held[0]}: frames in memory need a temporary folder: {error.strerror}"
        raise errors.UnwritableError(what, held[0]) from None
    with folder:
        def without_folder(text):
            return text.replace(folder.name + os.sep, "")

        try:
            yield {**options, **{name: _stored(folder.name, name, options[name]) for name in held}}, without_folder
        except errors.Error as error:
            raise type(error)(without_folder(str(error)), without_folder(error.where)) from None
