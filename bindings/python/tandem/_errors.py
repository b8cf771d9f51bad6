"""The exceptions of the package."""
from __future__ import annotations

import errno
import os

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
    """A file cannot be found, opened or read: `filename`. It is a FileNotFoundError, PermissionError or IsADirectoryError too where Python's open() raises that."""

    def __str__(self) -> str:
        return str(self.args[0])


class _FileNotFound(FileError, FileNotFoundError):
    pass


class _NoPermission(FileError, PermissionError):
    pass


class _IsADirectory(FileError, IsADirectoryError):
    pass


_FILE_STATUSES = range(100, 104)  # TANDEM_FILE_NOT_FOUND to TANDEM_CANNOT_READ
_OUT_OF_MEMORY = 4


def with_path(error: Error, path: str) -> Error:
    """Returns the same error, about the file of a path."""
    if not isinstance(error, FileError):
        return type(error)(f"{path}: {error}", error.status, error.name, error.subject, error.where)
    kind, number = (_FileNotFound, errno.ENOENT) if error.status == _FILE_STATUSES[0] else _kind_of(path)
    told = kind(f"{path}: {error}", error.status, error.name, error.subject, error.where)
    told.filename, told.errno = path, number
    return told


def _kind_of(path: str) -> tuple[type[FileError], int | None]:
    """What FileError a file that cannot be read is, and its errno: opening it once more tells."""
    try:
        if os.path.isdir(path):
            return _IsADirectory, errno.EISDIR
        os.close(os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0)))  # which does not wait for the other end of a pipe
    except FileNotFoundError as error:
        return _FileNotFound, error.errno
    except PermissionError as error:
        return _NoPermission, error.errno
    except OSError as error:
        return FileError, error.errno
    return FileError, None


def from_status(status: int, name: str, sentence: str, subject: str | None, where: int) -> BaseException:
    """The exception of a status; the extension raises it."""
    if status == _OUT_OF_MEMORY:
        return MemoryError(sentence)
    place = where if subject is not None else None
    message = sentence if place is None else f"{subject} {place}: {sentence}"
    kind = FileError if status in _FILE_STATUSES else Error
    return kind(message, status, name, subject, place)
