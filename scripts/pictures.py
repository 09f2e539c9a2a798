"""8-bit RGB pictures as NumPy arrays of height x width x 3, for scripts/crop-pictures and scripts/side-by-side."""
import re
import struct
import zlib

import numpy as np

TO_XYZ = np.array([[0.4124564, 0.3575761, 0.1804375],  # linear sRGB to XYZ, IEC 61966-2-1
                   [0.2126729, 0.7151522, 0.0721750],
                   [0.0193339, 0.1191920, 0.9503041]])


def parse_tiff(data):
    order = {b"II": "<", b"MM": ">"}.get(data[:2])
    if not order:
        raise ValueError("not a TIFF file")
    directory, = struct.unpack(order + "I", data[4:8])
    count, = struct.unpack(order + "H", data[directory:directory + 2])
    tags = {}
    for i in range(count):
        at = directory + 2 + 12 * i
        tag, kind, number, value = struct.unpack(order + "HHII", data[at:at + 12])
        size = {3: 2, 4: 4}.get(kind)
        if size is None:
            continue
        start = at + 8 if number * size <= 4 else value
        tags[tag] = np.frombuffer(data, f"{order}u{size}", number, start).astype(int)
    width, height = tags[256][0], tags[257][0]
    if tags[259][0] != 1 or (tags[258] != 8).any():
        raise ValueError("expected 8 bits, uncompressed")
    strips = b"".join(data[o:o + n] for o, n in zip(tags[273], tags[279]))
    return np.frombuffer(strips, np.uint8).reshape(height, width, 3)


def read_tiff(data):
    """Return the picture of an uncompressed TIFF file; ValueError for another."""
    try:
        return parse_tiff(data)
    except (struct.error, KeyError, IndexError) as fault:
        raise ValueError("a damaged TIFF file, or one of another kind") from fault


def read_ppm(data):
    """Return the picture of a binary PPM; ValueError for another."""
    header = re.match(rb"P6\s+(?:#[^\n]*\n\s*)*(\d+)\s+(\d+)\s+255\s", data)
    if not header:
        raise ValueError("not an 8-bit PPM")
    width, height = int(header[1]), int(header[2])
    return np.frombuffer(data, np.uint8, 3 * width * height, header.end()).reshape(height, width, 3)


def write_png(name, picture):
    height, width, _ = picture.shape
    rows = np.concatenate([np.zeros((height, 1), np.uint8), picture.reshape(height, -1)], axis=1).tobytes()

    def chunk(kind, content):
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    with open(name, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n")
        out.write(chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)))
        out.write(chunk(b"IDAT", zlib.compress(rows, 6)))
        out.write(chunk(b"IEND", b""))


def lightness_and_chroma(picture):
    """Return CIE L* and C*ab of each pixel of an sRGB picture, white D65."""
    code = np.arange(256) / 255
    linear = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055)**2.4).astype(np.float32)[picture]
    xyz = linear @ (TO_XYZ / TO_XYZ.sum(1, keepdims=True)).T.astype(np.float32)
    f = np.where(xyz > 216 / 24389, np.cbrt(xyz), (24389 / 27 * xyz + 16) / 116)
    return 116 * f[..., 1] - 16, np.hypot(500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2]))
