"""Arguments of Python as those of the command. All texts go to C++ as bytes, so that any name of a file does."""
import numbers
import os

import numpy as np

from . import errors
from ._lowlux import RawImage

# Options of the verbs that take no value.
_FLAGS = frozenset(["even_light", "half", "maps", "masked", "merge", "no_truth", "per_photon", "preserve_white", "quick",
                    "seeing_map", "steady_light"])


def bytes_of(text, name):
    """Return a text or a path as bytes of the file system. ArgumentError if it is empty or holds a NUL."""
    try:
        found = os.fsencode(text)
    except (TypeError, UnicodeEncodeError):
        what = repr(text) if isinstance(text, str) else f"a {type(text).__name__}"
        raise errors.ArgumentError(f"{name}: {what} is neither a text nor a path", name) from None
    if not found:
        raise errors.ArgumentError(f"{name}: an empty text names nothing", name)
    if b"\0" in found:
        raise errors.ArgumentError(f"{name}: {text!r} holds a NUL, which no file's name does", name)
    return found


def output_of(output):
    """Return the path of an output as bytes; empty for None, which writes nothing."""
    return b"" if output is None else bytes_of(output, "output")


def _value(name, value):
    if isinstance(value, (bool, np.bool_)):
        raise errors.ArgumentError(
            f'{name}: it takes a value, not {value}: None is the default, and "off" turns off what can be', name)
    if isinstance(value, numbers.Number):
        return (repr(float(value)) if isinstance(value, float) else str(value)).encode()
    return bytes_of(value, name)


def _values(value):
    """Return what an argument lists, and itself as a list if it is one value."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    return value if isinstance(value, (list, tuple)) else [value]


def _truth(name, value):
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    raise errors.ArgumentError(f"{name}: {value!r} is neither True nor False", name)


def words_of(options, files=()):
    """Return the command's options: flags that are True; values that are not None, lists joined by commas.

    files: names of options that name files, once for each of a list.
    """
    words = []
    for name, value in options.items():
        flag = b"--" + name.replace("_", "-").encode()
        if value is None:
            continue
        if name in _FLAGS:
            words += [flag] if _truth(name, value) else []
            continue
        values = [_value(name, one) for one in _values(value)]
        words += [flag + b"=" + one for one in (values if name in files else [b",".join(values)])]
    return words


def input_of(raw, name="raw"):
    """Return the name, as bytes, and the frame (None for a file) of a path or a RawImage."""
    if isinstance(raw, RawImage):
        return name.encode(), raw
    if not isinstance(raw, (str, bytes, os.PathLike)):
        raise errors.ArgumentError(
            f"{name}: a {type(raw).__name__} is neither a path nor a RawImage; raw_from_array makes one of an array", name)
    path = bytes_of(raw, name)
    if path == b"-":
        raise errors.ArgumentError(f"{name}: standard input is for the command; the file of that name is ./-", name)
    return path, None


def inputs_of(raws):
    """Return input_of of each of a list."""
    if isinstance(raws, (str, bytes, os.PathLike, RawImage)) or not hasattr(raws, "__iter__"):
        raise errors.ArgumentError(f"raws: a {type(raws).__name__} is not a list of frames", "raws")
    return [input_of(raw, f"raws[{index}]") for index, raw in enumerate(raws)]
