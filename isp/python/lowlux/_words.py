"""Arguments of Python as those of the command."""
import os

from . import errors
from ._lowlux import RawImage


def _word(flag, value):
    if isinstance(value, (list, tuple)):
        return f"{flag}={','.join(_text(item) for item in value)}"
    return f"{flag}={_text(value)}"


def _text(value):
    if hasattr(value, "__fspath__"):
        return os.fsdecode(value)
    return repr(float(value)) if isinstance(value, float) else str(value)


def words_of(options, files=()):
    """Return the command's options: True is a flag, None and False are left out, lists are joined by commas.

    files: names of options that name files, once for each of a list.
    """
    words = []
    for name, value in options.items():
        flag = "--" + name.replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            words.append(flag)
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
