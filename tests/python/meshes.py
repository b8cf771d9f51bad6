"""Small meshes of the tests."""
import contextlib
import errno
import os
import signal
import sys

import numpy as np
import pytest

import tandem

BOX_VERTICES = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
BOX_FACES = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]])

needs_alarm = pytest.mark.skipif(not hasattr(signal, "SIGALRM"), reason="this system has no alarm that stands for Ctrl-C")


@contextlib.contextmanager
def without_rights_of_root():
    """Nobody's rights for a while, so that a file's mode counts."""
    was = os.geteuid()
    if was == 0:
        os.seteuid(65534)
    try:
        yield
    finally:
        if was == 0:
            os.seteuid(0)


def check_errors_of_files(read, folder, name):
    """read(): takes a path. A file that cannot be read raises tandem.FileError and what open() raises."""
    if sys.platform == "win32":
        pytest.skip("Windows has other paths and no user that can be changed")
    shut = folder / name
    shut.unlink(missing_ok=True)
    shut.write_bytes(b"")
    shut.chmod(0)
    with without_rights_of_root():
        for path, kind, number in ((f"/usr/gone/{name}", FileNotFoundError, errno.ENOENT), (shut, PermissionError, errno.EACCES),
                                   ("/usr", IsADirectoryError, errno.EISDIR)):
            with pytest.raises(kind) as caught:
                read(path)
            assert isinstance(caught.value, tandem.FileError) and str(caught.value).startswith(f"{path}: ")
            assert (caught.value.filename, caught.value.errno) == (str(path), number)


def read_obj(path):
    """Vertices and triangles of an .obj file whose faces are triangles."""
    vertices, faces = [], []
    for line in path.read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append([float(word) for word in words[1:4]])
        elif words[:1] == ["f"]:
            faces.append([int(word.split("/")[0]) - 1 for word in words[1:]])
    return np.array(vertices), np.array(faces)
