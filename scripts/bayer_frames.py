"""Bayer raw frames for scripts that pass them through networks: scripts/pmrid and scripts/train-denoiser."""


class Failure(Exception):
    """What is missing or wrong, in one line."""


def one_line(error):
    return (str(error).strip().splitlines() or [type(error).__name__])[0]


def import_torch(purpose):
    """Return the module of PyTorch."""
    try:
        import torch
    except ImportError as error:
        raise Failure(f"{purpose}: needs PyTorch (Debian: python3-torch): {error}") from None
    return torch


def import_lowlux():
    """Return lowlux's Python module and NumPy."""
    try:
        import lowlux
        import numpy as np
    except ImportError as error:
        raise Failure(f"needs NumPy and lowlux's Python module (python3-lowlux): {error}") from None
    return lowlux, np


def read_bayer(path):
    """Return the frame of a raw file. Failure: it cannot be read, or is not a Bayer mosaic."""
    lowlux, _ = import_lowlux()
    try:
        raw = lowlux.read_raw(path)
    except lowlux.Error as error:
        raise Failure(f"{path}: {error}") from None
    if len(raw.cfa) != 4 or raw.cfa == "MONO":
        raise Failure(f"{path}: a frame of {raw.cfa}, expected a Bayer mosaic")
    return raw


def at_sites(cells, shape):
    """Return a map of height x width of what each site of the 2 x 2 cell has."""
    _, np = import_lowlux()
    height, width = shape
    return np.tile(np.asarray(cells), (-(-height // 2), -(-width // 2)))[:height, :width]


def of_sites(of_colours, cfa):
    """Return what each site of the 2 x 2 cell has, of values of R, G and B."""
    _, np = import_lowlux()
    return np.asarray(of_colours)[["RGB".index(colour) for colour in cfa]].reshape(2, 2)


def pack(mosaic, cfa):
    """Return the half-size planes R, G next to R, G next to B, B. A cell begins at its R, whatever the phase; what a
    mosaic lacks of its first and last cells is its reflection."""
    _, np = import_lowlux()
    top, left = divmod(cfa.index("R"), 2)
    height, width = mosaic.shape
    padded = np.pad(mosaic, ((top, (top + height) % 2), (left, (left + width) % 2)), mode="reflect")
    return np.stack([padded[y::2, x::2] for y in (0, 1) for x in (0, 1)])


def unpack(planes, cfa, shape):
    """Return the mosaic of height x width that pack() made planes of."""
    _, np = import_lowlux()
    top, left = divmod(cfa.index("R"), 2)
    mosaic = np.empty((2 * planes.shape[1], 2 * planes.shape[2]), planes.dtype)
    for plane, (y, x) in zip(planes, np.ndindex(2, 2)):
        mosaic[y::2, x::2] = plane
    return mosaic[top:top + shape[0], left:left + shape[1]]
