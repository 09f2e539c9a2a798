"""Exceptions of lowlux. Each carries the message of the `lowlux` command and derives from the closest built-in one."""


class Error(Exception):
    """Base of all exceptions of lowlux.

    str(error) is the message of the command in one line: place, cause and what would help.
    """

    def __init__(self, message: str, where: str = ""):
        super().__init__(message)
        self.where = where
        """The file, option or tag concerned; empty if there is none."""

    def __str__(self) -> str:
        return str(self.args[0])


class NotFoundError(Error, FileNotFoundError):
    """There is no such file or device."""


class UnreadableError(Error, OSError):
    """It exists and cannot be read."""


class MalformedError(Error, ValueError):
    """A file contradicts its format or itself."""


class UnsupportedError(Error, ValueError):
    """It is well formed, and lowlux does not handle it."""


class TooLargeError(Error, MemoryError):
    """It would take more memory than there is or than the limit."""


class ExistsError(Error, FileExistsError):
    """An output exists; overwrite=True replaces it."""


class UnwritableError(Error, OSError):
    """An output cannot be written."""


class ArgumentError(Error, ValueError):
    """An argument is out of its range or contradicts another one."""


class InsufficientError(Error, ValueError):
    """The data hold too little to answer without guessing."""
