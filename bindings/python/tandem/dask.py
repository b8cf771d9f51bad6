"""Large work on a cluster of Dask: libraries of meshes, contacts of big scenes, configurations (docs/clusters.md).

    client = distributed.Client(...)                      # any cluster of Dask
    library = tandem.dask.build(meshes, "library")
    scene = tandem.jobs.FileScene(library.files.values(), ...)
    found = tandem.dask.contacts(scene)
    blocked = tandem.dask.check(scene, poses)

No answer depends on the workers, their number or their order. Work of a worker that dies is done by another. What has no answer in the end is named. Dask shows
the progress under tandem-read, tandem-build, tandem-contacts and tandem-check. Needs `pip install 'tandem-contacts[dask]'`.
"""
from __future__ import annotations

import dataclasses
import functools
import os
import queue
import uuid
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Literal, NamedTuple, overload

import distributed
import numpy as np
import numpy.typing as npt

from . import jobs
from ._arrays import Rows, flag
from ._asset import Asset
from ._build import Effort, Levels, build as _build_asset
from ._errors import Error
from ._rows import CONFIGURATION_PAIR, PAIR
from ._scene import Contacts

__all__ = ["Incomplete", "Library", "build", "check", "contacts"]

#: Tasks for each thread of the workers: enough that those that have longer ones end at about the same time.
_TASKS_PER_THREAD = 8
#: Meshes of large files take longer, so that there are more tasks of them; but none is of fewer bytes than are worth a task.
_LARGE_TASKS_PER_THREAD = 32
_MOST_MESHES_PER_TASK, _MESH_BYTES_PER_TASK = 64, 1 << 20
_POSE_BYTES_PER_TASK = 1 << 23
#: Seconds without an answer after which the connection is looked at.
_LOOK_AFTER = 1.0
#: Seconds in which a scheduler says what workers it has, or is asked no more.
_SCHEDULER_ANSWERS = 20.0
_NO_SCHEDULER = "the connection to the scheduler is lost"


@dataclasses.dataclass(frozen=True)
class Library:
    """What became of mesh files: each path that was given is in `files` or in `failures`."""

    #: The .bvh file of each mesh file. Equal meshes share one.
    files: dict[str, str]
    #: Why a mesh file has none.
    failures: dict[str, str]
    #: Those of the .bvh files that this call has made, sorted; the others were there.
    built: list[str]


class Incomplete(RuntimeError):
    """Some questions have no answer, such as where the scheduler went away.

    Attributes: `missing`, the object pairs, array of PAIR, or the numbers of the configurations, ascending; `reasons`, each once; `found`, what was asked for, of
    all others alone.
    """

    def __init__(self, missing: npt.NDArray[Any], reasons: Sequence[str], found: Any):
        what = "object pairs" if missing.dtype == PAIR else "configurations"
        super().__init__(f"{len(missing)} {what} have no answer: {'; '.join(reasons[:3])}")
        self.missing = missing
        self.reasons = list(reasons)
        self.found = found

    def __reduce__(self) -> tuple[Any, ...]:
        return Incomplete, (self.missing, self.reasons, self.found)


class _Lost(NamedTuple):
    """Why a task has no result, and whether workers died of it or beside it."""

    reason: str
    worker_died: bool = False


class _Unwritten(NamedTuple):
    """A file that a worker has built and cannot write."""

    mesh: str
    file: str
    data: bytes
    reason: str


def _outcomes(client: Any, name: str, function: Callable[..., Any], tasks: Sequence[tuple[Any, ...]]) -> Iterator[tuple[int, Any]]:
    """Runs function(*task) for all tasks. Yields the number of each, once, and its result or a _Lost, as they come."""
    run = f"tandem-{name}-{uuid.uuid4().hex}"
    pending: dict[int, Any] = {}
    done: queue.SimpleQueue[int] = queue.SimpleQueue()
    for number, task in enumerate(tasks):
        try:
            if client.status != "running":  # a task would wait for another scheduler
                raise ConnectionError(_NO_SCHEDULER)
            future = client.submit(function, *task, key=(run, number), pure=False)
            future.add_done_callback(functools.partial(_tell, done, number))
            pending[number] = future
            del future  # so that a result is forgotten when it was handed on
        except Exception as error:
            yield number, _lost(error)
    while pending:
        try:
            number = done.get(timeout=_LOOK_AFTER)
        except queue.Empty:
            if client.status == "running":
                continue
            yield from ((number, _Lost(_NO_SCHEDULER)) for number in pending)
            return
        yield number, _outcome(pending.pop(number))


def _tell(done: queue.SimpleQueue[int], number: int, _: Any) -> None:
    done.put(number)


def _outcome(future: Any) -> Any:
    try:
        return future.result()
    except Exception as error:
        return _lost(error)


def _answers(client: Any, name: str, function: Callable[..., Any], tasks: Sequence[tuple[Any, ...]]) -> Iterator[tuple[int, Any]]:
    """As _outcomes. Tasks that workers died of, or that were beside such a one, are tried once more, one at a time, so that a deadly one takes no other along."""
    again = []
    for number, outcome in _outcomes(client, name, function, tasks):
        if isinstance(outcome, _Lost) and outcome.worker_died:
            again.append(number)
        else:
            yield number, outcome
    for number in sorted(again):
        yield from ((number, outcome) for _, outcome in _outcomes(client, name, function, [tasks[number]]))


def _lost(error: Exception) -> _Lost:
    if isinstance(error, distributed.KilledWorker):
        return _Lost("workers died while they worked on it", True)
    return _Lost(_reason(error))


def _reason(error: BaseException) -> str:
    """One line."""
    told = " ".join(str(error).split()) or type(error).__name__
    if not isinstance(error, (Error, OSError)):
        told = f"{type(error).__name__}: {told}"
    return told if error.__cause__ is None else f"{told} ({_reason(error.__cause__)})"


def _client(given: distributed.Client | None) -> Any:
    return distributed.default_client() if given is None else given  # type: ignore[no-untyped-call,unused-ignore]


def _task_count(client: Any) -> int:
    """How many tasks the work is divided into. No answer depends on it."""
    if client.status != "running":  # every task will say so by itself
        return _TASKS_PER_THREAD
    try:
        threads = client.sync(client.scheduler.ncores, callback_timeout=_SCHEDULER_ANSWERS)
    except Exception:
        return _TASKS_PER_THREAD
    return _TASKS_PER_THREAD * max(1, int(sum(threads.values())))


def build(paths: Iterable[str | os.PathLike[str]], folder: str | os.PathLike[str], *, effort: Effort = "default", levels: Levels | None = None, gpu_blocks: bool = True,
          topology: bool = True, refit: bool = True, imaginary_share: float = 0.0, outside_files: bool = False, client: distributed.Client | None = None) -> Library:
    """Makes a .bvh file of each mesh file, in a folder. Workers read the meshes and write the files; one that cannot write sends the file to the caller, who writes it.

    A file's name is a digest of the mesh as it is read, of the options and of the version of tandem, so that equal meshes are built once. Files that are there
    and pass all checks are kept: called again, after whatever has happened, it makes what is missing.

    Args:
        paths: of mesh files, as workers see them.
        folder: for .bvh files, made where it is not there.
        effort, levels, gpu_blocks, topology, refit, imaginary_share: as of `tandem.build`.
        outside_files: as of `tandem.read_mesh`.
        client: default: the current one of `distributed`.

    Raises:
        ValueError, TypeError: an option that is wrong, or no client.
        OSError: the folder cannot be made.
    """
    client, options = _client(client), jobs.BuildOptions(effort, levels, gpu_blocks, topology, refit, imaginary_share, flag(outside_files, "outside_files"))
    _build_asset([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], **options.of_build())  # which raises what is wrong with the options
    folder = os.path.abspath(folder)
    os.makedirs(folder, exist_ok=True)
    absolute = {os.fsdecode(path): os.path.abspath(os.fsdecode(path)) for path in paths}
    files, wanted, failures = _planned(client, list(dict.fromkeys(absolute.values())), folder, options)
    first = {min(equal): file for file, equal in wanted.items()}
    built = []
    for path, outcome in _of_each_mesh(client, "build", _build, sorted(first), folder, options):
        file = first[path]
        reason = _defect(outcome, file)
        if reason is None:
            built.append(file)
        for equal in wanted[file]:
            (files if reason is None else failures)[equal] = reason or file
    return Library({given: files[path] for given, path in absolute.items() if path in files},
                   {given: failures[path] for given, path in absolute.items() if path in failures}, sorted(built))


def _planned(client: Any, paths: list[str], folder: str, options: jobs.BuildOptions) -> tuple[dict[str, str], dict[str, list[str]], dict[str, str]]:
    """Reads all meshes: the .bvh files of those that have one, the .bvh files that are missing with all meshes of each, and why a mesh cannot be read."""
    files: dict[str, str] = {}
    wanted: dict[str, list[str]] = {}
    failures: dict[str, str] = {}
    for path, outcome in _of_each_mesh(client, "read", _plan, paths, folder, options):
        if isinstance(outcome, _Lost):
            failures[path] = outcome.reason
            continue
        file, is_there = outcome
        if is_there and os.path.exists(file):
            files[path] = file
        else:
            wanted.setdefault(file, []).append(path)
    return files, wanted, failures


def _of_each_mesh(client: Any, name: str, function: Callable[..., Any], paths: list[str], *rest: Any) -> Iterator[tuple[str, Any]]:
    """Runs function(paths, *rest), which returns a list, on batches of paths. Yields each path once, with its entry or a _Lost."""
    batches = list(_batches(paths, _task_count(client)))
    alone = []
    for number, outcome in _outcomes(client, name, function, [(batch, *rest) for batch in batches]):
        if isinstance(outcome, _Lost) and outcome.worker_died:
            alone += batches[number]
        else:
            yield from zip(batches[number], [outcome] * len(batches[number]) if isinstance(outcome, _Lost) else outcome)
    for path in alone:  # so that a deadly mesh takes no other along
        for _, outcome in _outcomes(client, name, function, [([path], *rest)]):
            yield path, outcome if isinstance(outcome, _Lost) else outcome[0]


def _bytes_of(path: str) -> int:
    try:
        return os.path.getsize(path)
    except OSError:  # where the caller does not see it
        return _MESH_BYTES_PER_TASK


def _batches(paths: list[str], tasks: int) -> Iterator[list[str]]:
    """Cuts paths into batches that are worth a task each. Those of the largest files come first, so that no worker has a long one left when the others are done.

    tasks: how many there should be at least, where the files are small.
    """
    sizes = {path: _bytes_of(path) for path in paths}
    enough = max(_MESH_BYTES_PER_TASK, sum(sizes.values()) * _TASKS_PER_THREAD // (tasks * _LARGE_TASKS_PER_THREAD))
    most = min(-(-len(paths) // tasks), _MOST_MESHES_PER_TASK)
    batch: list[str] = []
    size = 0
    for path in sorted(paths, key=lambda path: -sizes[path]):
        size += sizes[path]
        batch.append(path)
        if size >= enough or len(batch) >= most:
            yield batch
            batch, size = [], 0
    if batch:
        yield batch


def _plan(paths: list[str], folder: str, options: jobs.BuildOptions) -> list[Any]:
    """For each mesh the path of its .bvh file and whether that is there, or a _Lost. A task."""
    return [_tried(jobs.file_of, path, folder, options) for path in paths]


def _build(paths: list[str], folder: str, options: jobs.BuildOptions) -> list[Any]:
    """For each mesh a Built, an _Unwritten or a _Lost. A task."""
    return [_tried(jobs.build_file, path, folder, options) for path in paths]


def _tried(function: Callable[..., Any], path: str, *rest: Any) -> Any:
    try:
        return function(path, *rest)
    except jobs.NotWritten as error:
        return _Unwritten(path, str(error.filename), bytes(error.asset), _reason(error))
    except Exception as error:
        return _Lost(_reason(error))


def _defect(outcome: Any, file: str) -> str | None:
    """Why there is no file after a task of _build; None where there is."""
    if isinstance(outcome, _Lost):
        return outcome.reason
    if outcome.file != file:
        return f"{outcome.mesh}: changed while it was read"
    if isinstance(outcome, _Unwritten):
        try:
            Asset.from_bytes(outcome.data).save(file)
        except OSError as error:
            return f"{outcome.reason}; and where build() was called: {_reason(error)}"
        return None
    try:
        seen = os.path.getsize(file)
    except OSError:
        seen = -1
    return None if seen == outcome.bytes else f"{file}: a worker wrote it, and it is not seen where build() was called: is this one folder?"


def contacts(scene: jobs.FileScene, *, pairs: npt.ArrayLike | None = None, mode: Literal["exact", "fast", "boxes"] = "exact", first_contact_only: bool = False,
             self_pairs: bool = False, within: float = 0.0, leave_out_rings: int = 0, client: distributed.Client | None = None) -> Contacts:
    """Finds every pair of triangles that meet, as `tandem.Scene.contacts` does: the same rows in the same order, and the same counters.

    The caller finds the object pairs. A task gets a run of them, the poses of their bodies, and the paths of their files, which a worker maps once.

    Raises:
        Incomplete: some object pairs have no answer.
        Error, ValueError, TypeError: as `tandem.Scene.contacts`; no client.
    """
    client = _client(client)
    slices = jobs.divide(scene, _task_count(client), pairs=pairs, self_pairs=self_pairs, within=within, mode=mode, first_contact_only=first_contact_only,
                         leave_out_rings=leave_out_rings)
    answers = dict(_answers(client, "contacts", jobs.ask, [(part,) for part in slices]))
    found = jobs.join([answers[number] for number in range(len(slices)) if not isinstance(answers[number], _Lost)])
    lost = [slices[number] for number in range(len(slices)) if isinstance(answers[number], _Lost)]
    if lost:
        raise Incomplete(np.concatenate([part.scene_pairs for part in lost]), _reasons(answers), found)
    return found


@overload
def check(scene: jobs.FileScene, configurations: npt.ArrayLike | Rows, *, pairs: Literal[False] = ..., client: distributed.Client | None = ...) -> npt.NDArray[np.bool_]: ...


@overload
def check(scene: jobs.FileScene, configurations: npt.ArrayLike | Rows, *, pairs: Literal[True], client: distributed.Client | None = ...) -> Rows: ...


def check(scene: jobs.FileScene, configurations: npt.ArrayLike | Rows, *, pairs: bool = False, client: distributed.Client | None = None) -> Any:
    """Says of configurations of the moving bodies of a scene whether anything touches, as `tandem.Scene.configurations` does.

    A worker opens the scene once; a task gets some of the configurations.

    Args:
        configurations: (k, m, 4, 4), or INSTANCE of shape (k, m): poses of the m bodies `scene.moving`.
        pairs: which pairs touch, instead of whether any does.

    Returns:
        (k,) bool; with `pairs` an array of CONFIGURATION_PAIR, by configuration, then by pair.

    Raises:
        Incomplete: some configurations have no answer.
        Error: a pose that is not rigid; `where` is the configuration.
        ValueError, TypeError: another shape; no client.
    """
    client = _client(client)
    rows = scene.configurations(configurations)
    function = jobs.touching if flag(pairs, "pairs") else jobs.verdicts
    size = max(1, min(-(-len(rows) // _task_count(client)), _POSE_BYTES_PER_TASK // max(1, rows[:1].nbytes)))
    first = range(0, len(rows), size)
    sent: Any = scene  # with every task; without a scheduler every task says so by itself
    if client.status == "running":  # once, and again where the worker that has it dies
        sent = client.submit(_same, scene, key=f"tandem-scene-{uuid.uuid4().hex}")
    answers = dict(_answers(client, "check", function, [(sent, rows[begin:begin + size]) for begin in first]))
    found, missing = [np.empty(0, CONFIGURATION_PAIR if pairs else bool)], [np.empty(0, np.uint64)]
    for number, begin in enumerate(first):
        answer = answers[number]
        if isinstance(answer, _Lost):
            missing.append(np.arange(begin, min(begin + size, len(rows)), dtype=np.uint64))
            continue
        if pairs:
            answer = answer.copy()  # which came in memory that may not be written to
            answer["configuration"] += begin
        found.append(answer)
    if len(missing) > 1:
        raise Incomplete(np.concatenate(missing), _reasons(answers), np.concatenate(found))
    return np.concatenate(found)


def _same(scene: jobs.FileScene) -> jobs.FileScene:
    return scene


def _reasons(answers: dict[int, Any]) -> list[str]:
    return sorted({answer.reason for answer in answers.values() if isinstance(answer, _Lost)})
