"""The exceptions of the package."""
from __future__ import annotations

import errno

__all__ = ["Error", "FileError"]


class Error(Exception):
    """A status of the library that is not success.

    Attributes: `status`, the number in tandem.h; `name`, such as "PoseNotRigid"; `where`, the number of the row to blame, or None where no row is; `subject`,
    what `where` counts, such as "instance", or None.
    """

    def __init__(self, message: str, status: int = 0, name: str = "", subject: str | None = None, where: int | None = None):
        super().__init__(message)
        self.status = status
        self.name = name
        self.subject = subject
        self.where = where

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        return type(self), (str(self), self.status, self.name, self.subject, self.where)


class FileError(Error, OSError):
    """A file cannot be found, opened or read: `filename`. One that is not there is a FileNotFoundError too."""

    def __str__(self) -> str:
        return str(self.args[0])


class _FileNotFound(FileError, FileNotFoundError):
    pass


_FILE_STATUSES = range(100, 104)  # TANDEM_FILE_NOT_FOUND to TANDEM_CANNOT_READ
_OUT_OF_MEMORY = 4


def with_path(error: Error, path: str) -> Error:
    """Returns the same error, about the file of a path."""
    kind = _FileNotFound if error.status == _FILE_STATUSES[0] else type(error)
    told = kind(f"{path}: {error}", error.status, error.name, error.subject, error.where)
    if isinstance(told, FileError):
        told.filename = path
        told.errno = errno.ENOENT if isinstance(told, FileNotFoundError) else None
    return told


def from_status(status: int, name: str, sentence: str, subject: str | None, where: int) -> BaseException:
    """The exception of a status; the extension raises it."""
    if status == _OUT_OF_MEMORY:
        return MemoryError(sentence)
    place = where if subject is not None else None
    message = sentence if place is None else f"{subject} {place}: {sentence}"
    kind = FileError if status in _FILE_STATUSES else Error
    return kind(message, status, name, subject, place)
