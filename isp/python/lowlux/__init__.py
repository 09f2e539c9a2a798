"""lowlux: a camera ISP for the dark.

Functions are the verbs of the `lowlux` command, with the same options, defaults, results and messages. Arrays are NumPy's.
All work runs without Python's global lock, so that threads run at once.
"""
from ._lowlux import RawImage, __version__
from ._bench import Leaderboard, bench
from ._calibrate import Profile, calibrate
from ._raw import ImageSizes, raw_from_array, read_raw, write_dng
from ._simulate import Simulated, compare, simulate
from ._verbs import Denoised, Developed, Merged, denoise, develop, merge
from .errors import (ArgumentError, Error, ExistsError, InsufficientError, MalformedError, NotFoundError, TooLargeError,
                     UnreadableError, UnsupportedError, UnwritableError)

__all__ = [
    "ArgumentError", "Denoised", "Developed", "Error", "ExistsError", "ImageSizes", "InsufficientError", "Leaderboard",
    "MalformedError", "Merged", "NotFoundError", "Profile", "RawImage", "Simulated", "TooLargeError", "UnreadableError",
    "UnsupportedError", "UnwritableError", "__version__", "bench", "calibrate", "compare", "denoise", "develop",
    "merge", "raw_from_array", "read_raw", "simulate", "write_dng",
]
