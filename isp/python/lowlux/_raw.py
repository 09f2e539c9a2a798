"""Raw frames: reading, views of their samples, writing."""
import collections
import os

import numpy as np

from . import _lowlux
from . import errors as _errors
from ._lowlux import RawImage
from ._words import bytes_of

ImageSizes = collections.namedtuple("ImageSizes", "raw_height raw_width height width top_margin left_margin")
ImageSizes.__doc__ = "Size of the readout and of its visible part, and where that begins [px], as rawpy names them."


def read_raw(path):
    """Read a raw file: a DNG, or any other that LibRaw decodes.

    Values that the file does not state are None, never guessed.
    Errors: NotFoundError, UnreadableError, MalformedError, UnsupportedError, TooLargeError.
    """
    return _lowlux.read_raw(bytes_of(path, "path"))


def _numbers(name, value):
    """Return an argument as a flat list of floats, an empty one for None."""
    if value is None:
        return []
    try:
        return np.asarray(value, dtype=np.float64).ravel().tolist()
    except (TypeError, ValueError):
        raise _errors.ArgumentError(f"{name}: {value!r} is neither a number nor numbers", name) from None


def _number(name, value):
    """Return an argument as a float; None stays."""
    try:
        return None if value is None else float(value)
    except (TypeError, ValueError, OverflowError):
        raise _errors.ArgumentError(f"{name}: {value!r} is not a number", name) from None


def _array(mosaic):
    try:
        return np.asarray(mosaic)
    except (TypeError, ValueError):
        raise _errors.ArgumentError(f"mosaic: a {type(mosaic).__name__} whose rows differ is no array", "mosaic") from None


def raw_from_array(mosaic, *, black=None, white=None, cfa=None, noise=None, matrix=None, exposure_s=None, iso=None,
                   like=None):
    """Make a raw frame of a copy of an array, for develop, denoise, merge and write_dng.

    mosaic: (height, width), or (height, width, 3) for RGB that is demosaiced already. Integers of 0 to 65535 or finite
        floats of any width, strides and byte order. Floats are held in 32 bits, and may lie below black and above white.
    black, white: levels in the units of the samples [DN]: one value; black also one for each site of the 2x2 cell, row
        by row; for RGB also three. The white level is an integer: scale floats to white=1.
    cfa: "RGGB" (default), "GRBG", "GBRG", "BGGR", or "MONO" for a sensor without filters; in any case.
    noise: (scale, offset), or three such pairs for R, G and B: the variance of x, with x = 0 at black and 1 at white, is
        scale * x + offset (DNG NoiseProfile).
    matrix: 3 x 3, from XYZ to camera RGB (DNG ColorMatrix1); without it colours are those of the camera, with a warning.
    exposure_s, iso: exposure time [s] and ISO setting.
    like: a RawImage of the camera: what is not given here is that of this frame, metadata included. The array has the
        size of its readout or of its visible part.
    Errors: ArgumentError for other types, shapes and values, and for figures that contradict each other; TooLargeError.
    """
    if like is not None and not isinstance(like, RawImage):
        raise _errors.ArgumentError(f"like: a {type(like).__name__} is not a RawImage; read_raw reads one", "like")
    return _lowlux.from_array(_array(mosaic), _numbers("black", black), _numbers("white", white),
                              b"" if cfa is None else bytes_of(cfa, "cfa").upper(), _numbers("noise", noise),
                              _numbers("matrix", matrix), _number("exposure_s", exposure_s), _number("iso", iso), like)


def write_dng(path, mosaic, *, black=None, white=None, cfa=None, noise=None, matrix=None, exposure_s=None, iso=None,
              like=None, overwrite=False, compression=None):
    """Write a DNG of 16-bit codes, or of 32-bit floats if the samples are floats, completely or not at all.

    path: ends with .dng; an existing file is an ExistsError unless overwrite is True.
    mosaic: an array, with the other arguments as in raw_from_array; or a RawImage, without them. Its sides are of 22 to
        64000 px, of floats of up to 65535 px: others are not read again.
    compression: "none" (default) or "lossless".
    Errors: those of raw_from_array; ExistsError, UnwritableError, TooLargeError.
    """
    path = bytes_of(path, "path")
    if not path.lower().endswith(b".dng"):
        name = os.fsdecode(path)
        raise _errors.ArgumentError(f"{name}: a raw file is written as DNG: its name ends with .dng", name)
    figures = dict(black=black, white=white, cfa=cfa, noise=noise, matrix=matrix, exposure_s=exposure_s, iso=iso,
                   like=like)
    if isinstance(mosaic, RawImage):
        given = [name for name, value in figures.items() if value is not None]
        if given:
            raise _errors.ArgumentError(f"{given[0]}: a RawImage states its own; give its array to change it", given[0])
        frame = mosaic
    else:
        frame = raw_from_array(mosaic, **figures)
    _lowlux.write_dng(frame, path, overwrite, "none" if compression is None else bytes_of(compression, "compression"))


def _colours(raw, rows, columns):
    pattern = raw.raw_pattern
    if pattern is None:
        return None
    return np.tile(pattern, ((rows + 3) // 2, (columns + 3) // 2))


def _raw_colors(self):
    sizes = self.sizes
    colours = _colours(self, sizes.raw_height, sizes.raw_width)
    return None if colours is None else colours[:sizes.raw_height, :sizes.raw_width]


def _raw_colors_visible(self):
    sizes, colours = self.sizes, self.raw_colors
    if colours is None:
        return None
    return colours[sizes.top_margin:sizes.top_margin + sizes.height, sizes.left_margin:sizes.left_margin + sizes.width]


def _black_level_per_channel(self):
    black = self.black_dn
    if black is None:
        return None
    if self.cfa in ("MONO", "RGB"):
        return black.ravel()[:len(self.color_desc)].tolist()
    sizes = self.sizes
    order = np.roll(self.raw_pattern, (-sizes.top_margin, -sizes.left_margin), (0, 1)).ravel().tolist()
    return [float(black.ravel()[order.index(channel)]) for channel in range(4)]


def _white_level(self):
    return float(self.white_dn.max())


def _raw_value(self, row, column):
    """Return the sample of raw_image at a row and column [DN]."""
    return self.raw_image[row, column]


def _raw_color(self, row, column):
    """Return the index into color_desc of the filter at a row and column of raw_image. ArgumentError without mosaic."""
    if self.raw_pattern is None:
        raise _errors.ArgumentError(f"raw_color: a frame of {self.cfa} has no mosaic", "raw_color")
    return int(self.raw_colors[row, column])


def _repr(self):
    sizes = self.sizes
    camera = f"{self.make} {self.model}".strip() or "unknown camera"
    return f"<lowlux.RawImage {sizes.height} x {sizes.width} {self.cfa} {self.raw_image.dtype}, {camera}>"


RawImage.sizes = property(lambda self: ImageSizes(*self._sizes), doc="ImageSizes of the readout [px].")
RawImage.num_colors = property(lambda self: len(set(self.color_desc)), doc="Number of different filters.")
RawImage.raw_colors = property(_raw_colors, doc="Index into color_desc of each pixel of raw_image; None without mosaic.")
RawImage.raw_colors_visible = property(_raw_colors_visible, doc="raw_colors of raw_image_visible.")
RawImage.black_level_per_channel = property(
    _black_level_per_channel, doc="Black levels [DN] in the order of color_desc; None if the file states none.")
RawImage.white_level = property(_white_level, doc="White level [DN], the largest of the channels.")
RawImage.raw_value = _raw_value
RawImage.raw_color = _raw_color
RawImage.__repr__ = _repr
