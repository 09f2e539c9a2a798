"""Arguments of Python as those of the command."""
import os

import numpy as np

from . import errors
from ._lowlux import RawImage

# Options of the verbs that take no value.
_FLAGS = frozenset(["even_light", "half", "maps", "masked", "merge", "no_truth", "per_photon", "preserve_white", "quick",
                    "seeing_map", "steady_light"])


def _word(flag, value):
    if isinstance(value, (list, tuple)):
        return f"{flag}={','.join(_text(item) for item in value)}"
    return f"{flag}={_text(value)}"


def _text(value):
    if hasattr(value, "__fspath__"):
        return os.fsdecode(value)
    return repr(float(value)) if isinstance(value, float) else str(value)


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
        flag = "--" + name.replace("_", "-")
        if value is None:
            continue
        if name in _FLAGS:
            words += [flag] if _truth(name, value) else []
        elif isinstance(value, (bool, np.bool_)):
            raise errors.ArgumentError(
                f'{name}: it takes a value, not {value}: None is the default, and "off" turns off what can be', name)
        elif name in files:
            words += [_word(flag, file) for file in (value if isinstance(value, (list, tuple)) else [value])]
        else:
            words.append(_word(flag, value))
    return words


def input_of(raw, name="raw"):
    """Return the name and the frame (None for a file) of a path or a RawImage."""
    if isinstance(raw, RawImage):
        return name, raw
    try:
        return os.fspath(raw), None
    except TypeError:
        raise errors.ArgumentError(
            f"{name}: a {type(raw).__name__} is neither a path nor a RawImage; raw_from_array makes one of an array",
            name) from None


def inputs_of(raws):
    """Return input_of of each."""
    return [input_of(raw, f"raws[{index}]") for index, raw in enumerate(raws)]
