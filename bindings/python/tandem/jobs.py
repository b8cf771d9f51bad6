"""The pieces of work that is divided among processes or machines, as functions for any engine: `tandem.dask`, Ray, Spark, or concurrent.futures.

A function of this module depends on its arguments alone, and these pickle. An engine may run it anywhere, in any order, and again where a worker was lost:

- `build_file` makes the .bvh file of one mesh;
- `ask` answers one slice of a scene's contacts, which `divide` cuts and `join` puts together;
- `verdicts` and `touching` answer some configurations of the moving bodies of a scene.

docs/clusters.md has programs for these engines.
"""
from __future__ import annotations

import functools
import hashlib
import json
import os
import threading
import uuid
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

import tandem

from ._arrays import Rotations, Rows, instances_of, pairs_of, whole_number
from ._asset import Asset
from ._build import Effort, Levels, Mesh, _words, build, read_mesh
from ._errors import Error
from ._rows import CONTACT, INSTANCE, PAIR
from ._scene import Configurations, Contacts, Counters, Filter, Scene

__all__ = ["AssetFile", "BuildOptions", "Built", "FileScene", "NotWritten", "Slice", "ask", "build_file", "divide", "file_of", "join", "touching", "verdicts"]

_CHECKED_AT_ONCE = 1 << 16
#: What a pair costs whose boxes hardly overlap, in triangles.
_WORK_OF_A_PAIR = 64.0


class BuildOptions(NamedTuple):
    """The options of `tandem.build` and `tandem.read_mesh` that shape a file."""

    effort: Effort = "default"
    levels: Levels | None = None
    gpu_blocks: bool = True
    topology: bool = True
    refit: bool = True
    imaginary_share: float = 0.0
    outside_files: bool = False

    def of_build(self) -> dict[str, Any]:
        """The arguments for `tandem.build`."""
        options = self._asdict()
        del options["outside_files"]
        return options


class Built(NamedTuple):
    """A mesh file that has its .bvh file."""

    mesh: str
    file: str
    #: The size of the .bvh file.
    bytes: int
    #: False: a sound file was there already.
    is_new: bool


class NotWritten(OSError):
    """A file was built and could not be written: `asset` is what `filename` should hold."""

    def __init__(self, error: OSError, filename: str, asset: Asset):
        super().__init__(error.errno, error.strerror or str(error), filename)
        self.asset = asset


def _key(mesh: Mesh, options: BuildOptions) -> str:
    """The digest of all that the bytes of a .bvh file depend on."""
    digest = hashlib.blake2b(digest_size=20)
    words = [tandem.__version__, {**options.of_build(), "levels": _words(options.levels)}, mesh.vertices.shape, mesh.triangles.shape, mesh.parts]
    digest.update(json.dumps(words).encode())
    for array in (mesh.vertices, mesh.triangles, mesh.face_ids):
        digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()


def _is_sound(file: str, key: str) -> bool:
    """Says whether a file is there that passes all checks and was made for this key."""
    try:
        provenance = Asset.load(file).provenance
    except Error:
        return False
    return isinstance(provenance, dict) and provenance.get("key") == key


def _planned(path: str, folder: str, options: BuildOptions) -> tuple[Mesh, str, str]:
    """A mesh, its key, and the path of its .bvh file."""
    mesh = read_mesh(path, outside_files=options.outside_files)
    key = _key(mesh, options)
    return mesh, key, os.path.join(folder, f"{key}.bvh")


def file_of(path: str | os.PathLike[str], folder: str | os.PathLike[str], options: BuildOptions = BuildOptions()) -> tuple[str, bool]:
    """Reads a mesh file. Returns the path of the .bvh file that `build_file` makes of it, and whether that is there and sound.

    Raises:
        FileError, ImportError: as `tandem.read_mesh`.
    """
    _, key, file = _planned(os.fspath(path), os.fspath(folder), options)
    return file, _is_sound(file, key)


def build_file(path: str | os.PathLike[str], folder: str | os.PathLike[str], options: BuildOptions = BuildOptions(), *, threads: int = 1) -> Built:
    """Builds the .bvh file of a mesh file, unless a sound one is there.

    Its name is a digest of the mesh as it is read, of the options and of the version of tandem, so that equal meshes share a file. Its bytes depend on nothing
    else. It appears whole or not at all, and several processes may make the same file at once.

    Args:
        path: of the mesh file.
        folder: for .bvh files, which exists.
        threads: of `tandem.build`.

    Raises:
        FileError, ImportError: the mesh cannot be read (`tandem.read_mesh`).
        Error: it has no usable triangle.
        NotWritten: the file cannot be written, such as on a full disk. The error has the asset.
    """
    mesh, key, file = _planned(os.fspath(path), os.fspath(folder), options)
    if _is_sound(file, key):
        return Built(os.fspath(path), file, os.path.getsize(file), False)
    provenance = {"tool": "tandem.jobs", "version": tandem.__version__, "key": key, "options": {**options.of_build(), "levels": _words(options.levels)}}
    try:
        asset = build(mesh.vertices, mesh.triangles, threads=threads, face_ids=mesh.face_ids, parts=mesh.parts, provenance=json.dumps(provenance), **options.of_build())
    except Error as error:
        raise type(error)(f"{os.fspath(path)}: {error}", error.status, error.name, error.subject, error.where) from None
    try:
        asset.save(file)
    except OSError as error:
        raise NotWritten(error, file, asset) from None
    return Built(os.fspath(path), file, asset.file_bytes, True)


class AssetFile(NamedTuple):
    """A .bvh file, the hash of its content, which FileScene fills in, and the level of detail that counts; None: its finest."""

    path: str
    hash: str
    level: int | None = None


@functools.lru_cache(maxsize=4096)
def _mapped(path: str, wanted: str | None, level: int | None) -> Asset:
    """Maps a file once a process. Raises Error where its content is another than the caller has."""
    asset = Asset.load(path)
    if wanted is not None and asset.hash != wanted:
        raise Error(f"{path}: has the hash {asset.hash} on this worker, and {wanted} where the scene was made")
    return asset if level is None else asset.levels_from(level, 1)


class FileScene:
    """The bodies of a scene whose assets are .bvh files. It pickles: files go as paths with their hashes, and whoever opens it checks the hashes.

    Args:
        files: paths of .bvh files, which bodies refer to by their place in this list, or AssetFile for another level than the finest. They are opened once here.
        instances, filter, asset, rotation, translation, transform: bodies, as of `tandem.Scene`.

    Raises:
        FileError, Error: a file that cannot be read or is no .bvh file; an asset that there is not; a pose that is not rigid.
    """

    __slots__ = ("_name", "filter", "files", "instances")

    def __init__(self, files: Iterable[str | os.PathLike[str] | AssetFile], instances: Rows | None = None, *, filter: Filter | None = None,
                 asset: npt.ArrayLike | None = None, rotation: Rotations | None = None, translation: npt.ArrayLike | None = None,
                 transform: npt.ArrayLike | None = None):
        self.files = [_asset_file(file) for file in files]
        self.instances = instances_of(instances, asset, rotation, translation, transform).copy()
        self.instances.setflags(write=False)
        self.filter = filter
        self._name = uuid.uuid4().hex  # under which processes keep it open
        self.open()  # which raises what is wrong

    def open(self, *, threads: int = 1) -> Scene:
        """Makes the scene. A process maps each file once, however many scenes it opens.

        Raises:
            FileError: a file cannot be read here.
            Error: a file has other content than where the FileScene was made.
        """
        return Scene([_mapped(*file) for file in self.files], self.instances, filter=self.filter, threads=threads)

    @property
    def moving(self) -> npt.NDArray[np.uint32]:
        """The numbers of the bodies that configurations move, ascending: those that the filter does not call FIXED."""
        motion = None if self.filter is None else self.filter._motion
        if motion is None:
            return np.arange(len(self.instances), dtype=np.uint32)
        return np.flatnonzero(motion != tandem.FIXED).astype(np.uint32)

    def configurations(self, poses: npt.ArrayLike | Rows) -> Rows:
        """Makes the rows of configurations of poses.

        Args:
            poses: (k, m, 4, 4), or INSTANCE of shape (k, m), whose assets do not count: for each configuration the poses of the bodies `moving`.

        Returns:
            An array of INSTANCE, (k, m).

        Raises:
            ValueError: another shape.
            Error: a pose that is not rigid; `where` is the configuration.
        """
        count = len(self.moving)
        given = np.asarray(poses)
        if given.dtype != INSTANCE:
            if given.ndim != 4 or given.shape[1:] != (count, 4, 4):
                raise ValueError(f"poses has shape {given.shape} where (k, {count}, 4, 4), or (k, {count}) of INSTANCE, is wanted")
            given = tandem.instances(transform=given.reshape(-1, 4, 4)).reshape(-1, count) if given.size else np.empty((len(given), count), INSTANCE)
        if given.ndim != 2 or given.shape[1] != count:
            raise ValueError(f"poses has shape {given.shape} where (k, {count}) of INSTANCE is wanted")
        rows = np.ascontiguousarray(given).copy()
        rows["asset"] = self.instances["asset"][self.moving]
        self._check(rows)
        return rows

    def _check(self, rows: Rows) -> None:
        scene = Scene([_mapped(*file) for file in self.files])
        bodies = rows.reshape(-1)
        for first in range(0, len(bodies), _CHECKED_AT_ONCE):
            try:
                scene.place(bodies[first:first + _CHECKED_AT_ONCE])
            except Error as error:
                if error.where is None:
                    raise
                configuration, body = divmod(first + error.where, rows.shape[1])
                raise Error(f"configuration {configuration}, body {self.moving[body]}: {str(error).partition(': ')[2]}", error.status, error.name, "configuration",
                            configuration) from None


def _asset_file(file: str | os.PathLike[str] | AssetFile) -> AssetFile:
    """A file with an absolute path and its hash."""
    path, level = (file.path, file.level) if isinstance(file, AssetFile) else (os.fsdecode(file), None)
    path = os.path.abspath(path)
    return AssetFile(path, Asset.load(path, check="quick").hash, level)


class Slice(NamedTuple):
    """Some object pairs of a scene, with the bodies that they are about and no others. Of `ask`."""

    files: list[AssetFile]
    #: The numbers of the bodies in the scene, ascending.
    bodies: npt.NDArray[np.uint32]
    #: These bodies, whose assets are places in `files`.
    instances: Rows
    #: Array of PAIR, of places in `bodies`.
    pairs: Rows
    #: Arguments of `tandem.Scene.contacts`.
    options: dict[str, Any]

    @property
    def scene_pairs(self) -> Rows:
        """The pairs by the scene's numbers of bodies, array of PAIR."""
        pairs: Rows = self.bodies[self.pairs.view("<u4")].view(PAIR)
        return pairs


def divide(scene: FileScene, count: int, *, pairs: npt.ArrayLike | None = None, self_pairs: bool = False, within: float = 0.0, **options: Any) -> list[Slice]:
    """Divides the object pairs of a scene into runs of about as much work.

    Args:
        count: of slices, at most.
        pairs, self_pairs, within, options: as of `tandem.Scene.contacts`.

    Raises:
        Error: as of `tandem.Scene.contacts`; ValueError: a pair has a body that there is not.
    """
    whole_number(count, "count", 1, 1 << 32)
    opened = scene.open()
    opened.contacts(pairs=np.empty((0, 2), np.uint32), within=within, **options)  # which raises what is wrong with options
    given = pairs_of(pairs)
    rows = opened.pairs(reach=within, self_pairs=self_pairs) if given is None else given
    numbers = rows.view("<u4").reshape(-1, 2)
    if numbers.size and numbers.max() >= len(scene.instances):
        row = int(np.flatnonzero((numbers >= len(scene.instances)).any(axis=1))[0])
        raise ValueError(f"pairs: row {row} is {numbers[row].tolist()}, and there are {len(scene.instances)} bodies")
    work = np.cumsum(_expected_work(scene, numbers, within))
    cuts = np.searchsorted(work, work[-1] * np.arange(1, count) / count).tolist() if len(work) else []
    bounds = sorted({0, *cuts, len(rows)})
    return [_slice(scene, numbers[first:end], {"within": within, **options}) for first, end in zip(bounds, bounds[1:])]


def _slice(scene: FileScene, numbers: npt.NDArray[np.uint32], options: dict[str, Any]) -> Slice:
    bodies, places = np.unique(numbers, return_inverse=True)
    instances = scene.instances[bodies]
    used, instances["asset"] = np.unique(instances["asset"], return_inverse=True)
    pairs = np.ascontiguousarray(places.reshape(-1, 2), dtype=np.uint32).view(PAIR).reshape(-1)
    return Slice([scene.files[asset] for asset in used.tolist()], bodies, instances, pairs, options)


def _expected_work(scene: FileScene, pairs: npt.NDArray[np.uint32], within: float) -> npt.NDArray[np.float64]:
    """A guess for each pair: the triangles of both bodies where their world boxes overlap, if triangles were spread evenly over the faces of the boxes. It decides
    how slices are cut and no answer."""
    assets = [_mapped(*file) for file in scene.files]
    bounds = np.array([asset.bounds for asset in assets]).reshape(-1, 2, 3)[scene.instances["asset"]]
    triangles = np.array([asset.levels[0].triangle_count for asset in assets], float)[scene.instances["asset"]]
    rotation = scene.instances["rotation"]
    centre = np.einsum("nij,nj->ni", rotation, bounds.mean(axis=1)) + scene.instances["translation"]
    half = np.einsum("nij,nj->ni", np.abs(rotation), (bounds[:, 1] - bounds[:, 0]) / 2) + within / 2
    a, b = pairs[:, 0], pairs[:, 1]
    overlap = np.minimum(centre[a] + half[a], centre[b] + half[b]) - np.maximum(centre[a] - half[a], centre[b] - half[b])
    work = np.full(len(pairs), _WORK_OF_A_PAIR)
    for side in (a, b):
        with np.errstate(all="ignore"):  # of flat boxes
            share = np.nan_to_num(np.clip(overlap, 0, None) / (2 * half[side]), nan=1.0).clip(0, 1)
        work += triangles[side] * np.cbrt(share.prod(axis=1)) ** 2
    return work


def ask(part: Slice) -> Contacts:
    """Finds the contacts of a slice. Pairs have the scene's numbers of bodies; contacts count the pairs of the slice.

    Raises:
        FileError, Error: a file cannot be read here, or has other content than where the slice was cut.
    """
    scene = Scene([_mapped(*file) for file in part.files], part.instances)
    found = scene.contacts(pairs=part.pairs, **part.options)
    return Contacts(part.scene_pairs, found.contacts, found.counters)


def join(answers: Sequence[Contacts]) -> Contacts:
    """Puts the answers of slices together, in the order of `divide`: the rows and counters that `tandem.Scene.contacts` has for all pairs at once."""
    if not answers:
        return Contacts(np.empty(0, PAIR), np.empty(0, CONTACT), Counters._make([0] * len(Counters._fields)))
    contacts = np.concatenate([answer.contacts for answer in answers])
    first = np.cumsum([0, *(len(answer.pairs) for answer in answers[:-1])])
    contacts["pair"] += np.repeat(first, [len(answer.contacts) for answer in answers]).astype(np.uint32)
    counters = Counters._make(sum(column) for column in zip(*(answer.counters for answer in answers)))
    return Contacts(np.concatenate([answer.pairs for answer in answers]), contacts, counters)


class _Opened(threading.local):
    """The scene that a thread has asked last, since a scene takes one call at a time."""

    name: str | None = None
    scene: Scene


_opened = _Opened()


def _kept(scene: FileScene) -> Scene:
    """Opens a scene, or returns what this thread has open of it. The poses of moving bodies are those of the last configuration."""
    if _opened.name != scene._name:
        _opened.name = None
        _opened.scene = scene.open()
        _opened.name = scene._name
    return _opened.scene


def _answered(scene: FileScene, poses: Rows, all_pairs: bool) -> Configurations:
    return _kept(scene).configurations(scene.moving, rotation=poses["rotation"], translation=poses["translation"], pairs="all" if all_pairs else "first")


def verdicts(scene: FileScene, poses: Rows) -> npt.NDArray[np.bool_]:
    """Says of each configuration, row of an array of `FileScene.configurations`, whether a body that moves touches another, (k,). A thread keeps the last scene open.

    Raises:
        FileError, Error: as `FileScene.open`.
    """
    return _answered(scene, poses, False).touching


def touching(scene: FileScene, poses: Rows) -> Rows:
    """Finds the pairs that touch in each configuration, as `verdicts` says whether there are any: array of CONFIGURATION_PAIR, by configuration, then by pair."""
    return _answered(scene, poses, True).pairs
