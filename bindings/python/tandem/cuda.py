"""Queries on an NVIDIA GPU, of arrays that lie there: poses in and results out without a copy. Worlds on a GPU are `tandem.World(..., device="cuda")`.

    query = tandem.cuda.Query([cow])
    found = query.contacts(pose=poses)                  # (n, 4, 3) float64 of PyTorch, CuPy, JAX, ...
    faces = torch.from_dlpack(found.contacts["face_a"])  # the query's own memory

Arrays are taken by DLPack or `__cuda_array_interface__`, and given by both. `stream` is where a call's work goes: a number, an object of PyTorch or CuPy, or None
for the default stream. The results keep such an object; where a number was given, the stream must live as long as they.
"""
from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from ._arrays import FARTHEST, FINITE, amount, flag, pairs_of, whole_number
from ._asset import Asset, _choice
from ._errors import Error
from ._rows import CLOSEST_POINT, CONTACT, CONTAINMENT, DISTANCE, IMPACT, MANIFOLD, PAIR, POINT, RAY_HIT, VERDICT
from ._scene import Counters, cores_of

try:
    from . import _cuda
except ImportError as missing:
    raise ImportError(f"tandem.cuda is not there: the package was built without CUDA, or CUDA's runtime is not found ({missing})") from missing

__all__ = ["Array", "Contacts", "Contained", "Distances", "Filter", "Impacts", "Instances", "Manifolds", "Positions", "Query", "Queued", "QueuedProbes", "Rows", "TooLittleRoom", "Verdicts"]

#: An array in GPU memory, with DLPack and `__cuda_array_interface__`, `shape`, `dtype` and `pointer`. It keeps the memory that it lies in.
Array = _cuda.Array

make_device = _cuda.make_device  # for tandem.Scene
WorldCore = _cuda.World  # for tandem.World

_MODES = ("exact", "fast", "boxes")
_CONTENTS = ("all", "exact", "manifolds")
_HITS = ("first", "any", "all")
_MOST = (1 << 31) - 1
_KINDS = {"i": 0, "u": 1, "f": 2}
_REPORT = np.dtype([("status", "<u4"), ("complete", "<u4"), ("where", "<u8"), ("needed_pairs", "<u4"), ("reserved", "<u4"), ("needed_contacts", "<u8"),
                    ("needed_undecided", "<u8"), ("contacts", "<u8"), ("world_pairs", "<u8"), ("counters", "<u8", (7,))])
_MANIFOLD_REPORT = np.dtype([("status", "<u4"), ("complete", "<u4"), ("needed_pairs", "<u4"), ("reserved", "<u4"), ("needed_contacts", "<u8"), ("needed_manifolds", "<u4"),
                             ("needed_points", "<u4"), ("manifolds", "<u4"), ("points", "<u4"), ("counters", "<u8", (6,))])

_PROBE_REPORT = np.dtype([("status", "<u4"), ("complete", "<u4"), ("where", "<u8"), ("needed_instances", "<u4"), ("needed_probes", "<u4"), ("needed_hits", "<u4"),
                          ("needed_words", "<u4"), ("rows", "<u4"), ("exact", "<u4"), ("counters", "<u8", (4,))])


def _columns(dtype: np.dtype[Any]) -> dict[str, tuple[int, int, int, int]]:
    """Returns for each field what Rows.column() takes: offset, kind, bits and how many; 0: one."""
    columns = {}
    for name in dtype.names or ():
        field, offset = dtype.fields[name][:2]  # type: ignore[index]
        columns[name] = (offset, _KINDS[field.base.kind], 8 * field.base.itemsize, field.shape[0] if field.shape else 0)
    return columns


_FIELDS = {dtype: _columns(dtype) for dtype in (PAIR, CLOSEST_POINT, CONTACT, MANIFOLD, POINT, CONTAINMENT, DISTANCE, IMPACT, RAY_HIT, VERDICT, _REPORT, _MANIFOLD_REPORT, _PROBE_REPORT)}


class Rows:
    """Rows of a result in GPU memory, of one of the dtypes that the CPU's results have.

    `rows["face_a"]` is a field of all of them, an Array in the same memory, (n,) or (n, 3), with a stride: PyTorch and CuPy take it as it is, JAX takes `words`
    alone. As an array, Rows are their `words`. The memory stays as long as any of this, or what was made of it, is there.
    """

    __slots__ = ("_core", "dtype")

    def __init__(self, core: _cuda.Rows, dtype: np.dtype[Any]):
        self._core: _cuda.Rows = core
        #: NumPy's, byte for byte.
        self.dtype = dtype

    def __len__(self) -> int:
        return len(self._core)

    def __getitem__(self, field: str) -> Array:
        return self._core.column(*_FIELDS[self.dtype][field])

    @property
    def words(self) -> Array:
        """Returns all of it as whole numbers, contiguous, (n, k): uint32, or uint8 where a row is no multiple of 4 bytes."""
        return self._core.words(8 if self.dtype.itemsize % 4 else 32)

    def numpy(self) -> npt.NDArray[Any]:
        """A copy in CPU memory, array of `dtype`; waits for the stream of the call that made the rows."""
        return np.frombuffer(self._core.to_cpu(), self.dtype)

    def __dlpack__(self, **arguments: Any) -> Any:
        return self.words.__dlpack__(**arguments)

    def __dlpack_device__(self) -> tuple[int, int]:
        return self.words.__dlpack_device__()

    @property
    def __cuda_array_interface__(self) -> dict[str, Any]:
        return self.words.__cuda_array_interface__

    def __repr__(self) -> str:
        return f"<tandem.cuda.Rows: {len(self)} of {', '.join(self.dtype.names or ())}>"


# Results, with the fields of the CPU's: `pairs` are rows of PAIR, or what was given.
#: Rows of CONTACT, in any order unless sorted or grouped, and the work. There is no `touching`, which would take the GPU another pass.
Contacts = NamedTuple("Contacts", [("pairs", Any), ("contacts", Rows), ("counters", Counters)])
#: Rows of MANIFOLD and POINT.
Manifolds = NamedTuple("Manifolds", [("pairs", Any), ("manifolds", Rows), ("points", Rows)])
#: Rows of CONTAINMENT.
Contained = NamedTuple("Contained", [("pairs", Any), ("contained", Rows)])
#: Rows of DISTANCE, one for each pair; as certified as the CPU's, but not its bytes.
Distances = NamedTuple("Distances", [("pairs", Any), ("distances", Rows)])
#: Rows of IMPACT, one for each pair; with the guarantee of the CPU's, but not its bytes.
Impacts = NamedTuple("Impacts", [("pairs", Any), ("impacts", Rows)])
#: Rows of VERDICT, one for each pair.
Verdicts = NamedTuple("Verdicts", [("pairs", Any), ("verdicts", Rows)])


class TooLittleRoom(Error):
    """A queued query did not fit: rows are missing. `pairs`, `contacts`, `undecided`, `manifolds` and `points`, or of points and rays `hits` and `words`, are the room
    that it needs at least, and 0 where it has none of these: exact for what follows from what did fit, so that with them it may still want more of another."""

    def __init__(self, **needed: int):
        room = ", ".join(f"{count} {name}" for name, count in needed.items() if count)
        super().__init__(f"too little room: reserve {room}", name="TooLittleRoom")
        self.pairs = needed.get("pairs", 0)
        self.contacts = needed.get("contacts", 0)
        self.undecided = needed.get("undecided", 0)
        self.manifolds = needed.get("manifolds", 0)
        self.points = needed.get("points", 0)
        self.hits = needed.get("hits", 0)
        self.words = needed.get("words", 0)


def _stream(stream: Any) -> _cuda.Stream:
    """A stream, which keeps the object that it was given as: CuPy destroys a stream with its object."""
    if stream is None:
        return _cuda.Stream(0, None)
    if isinstance(stream, int):
        if stream < 0:
            raise ValueError(f"stream is {stream} where a cudaStream_t is wanted")
        return _cuda.Stream(stream, None)
    for name in ("cuda_stream", "ptr"):  # PyTorch, CuPy
        number = getattr(stream, name, None)
        if isinstance(number, int):
            return _cuda.Stream(number, stream)
    protocol = getattr(stream, "__cuda_stream__", None)  # cuda.core
    if protocol is not None:
        return _cuda.Stream(int((protocol() if callable(protocol) else protocol)[1]), stream)
    raise TypeError(f"stream is {type(stream).__name__} where a number, a stream of PyTorch or CuPy, or None is wanted")


def _found(found: _cuda.Rows | None, given: Any) -> Any:
    """The pairs of a result: those that were found, or what was given."""
    return given if found is None else Rows(found, PAIR)


class Instances:
    """Bodies on a GPU: arrays of assets and poses, which every call reads where they are. Made once by `Query.instances`, it spares calls the look at the arrays;
    what writes poses there goes on the stream of the calls, or is waited for."""

    __slots__ = ("_core", "asset", "pose")

    def __init__(self, core: _cuda.Instances, asset: Any, pose: Any):
        self._core: _cuda.Instances = core
        #: These are kept as they were given.
        self.asset = asset
        self.pose = pose

    def __len__(self) -> int:
        return len(self._core)


class Positions:
    """Positions of assets that deform: arrays on a GPU, which every call reads where they are. Made once by `Query.positions`, it spares calls the look at the
    arrays; what writes there goes on the stream of the calls, or is waited for."""

    __slots__ = ("_core", "given")

    def __init__(self, core: _cuda.Positions, given: Mapping[int, Any]):
        self._core: _cuda.Positions = core
        #: By asset, as they were given.
        self.given = given


class Filter:
    """Says which pairs a query looks at, of all whose world boxes meet, as the CPU's Filter does; but its arrays lie in GPU memory and are read there in every
    call.

    Args:
        motion: (n,) uint8, of each instance MOVING, FIXED, KINEMATIC or SLEEPING.
        group, mask, world: (n,) uint32 or int32.
        excluded: (m, 2) or array of PAIR, in CPU memory, which are copied.
    """

    __slots__ = ("_core",)

    def __init__(self, motion: Any = None, group: Any = None, mask: Any = None, world: Any = None, excluded: npt.ArrayLike | None = None, *, device: int = 0, stream: Any = None):
        self._core = _cuda.Filter(motion, group, mask, world, pairs_of(excluded, "excluded"), _stream(stream), device)


class Queued:
    """A query that `Query.enqueue` has queued: arrays that the stream fills, as long as there is room, and their numbers, all in GPU memory. They are the same
    arrays in every call, and in every replay of a graph, until the next `Query.reserve`. Keep this until the stream has passed the query, and as long as a graph
    that was captured with it: it keeps the arrays that are read there."""

    __slots__ = ("_core", "_filter", "_given", "_instances")

    def __init__(self, core: _cuda.Step, instances: _cuda.Instances, given: _cuda.Pairs | None, filter: _cuda.Filter | None):
        self._core: _cuda.Step = core
        self._instances = instances
        self._given = given
        self._filter = filter

    @property
    def pairs(self) -> Rows | None:
        """Room for object pairs, rows of PAIR; the first `pair_count` of them are there. None where pairs were given."""
        return Rows(self._core.pairs(), PAIR) if self._given is None else None

    @property
    def pair_count(self) -> Array | None:
        """(1,) uint32; more than `len(pairs)` where they did not fit. None where pairs were given."""
        return self._core.pair_count() if self._given is None else None

    @property
    def contacts(self) -> Rows:
        """Room for contacts, rows of CONTACT; the first `contact_count` of them are there."""
        return Rows(self._core.contacts(), CONTACT)

    @property
    def contact_count(self) -> Array:
        """(1,) uint64."""
        return self.report["contacts"]

    @property
    def first_contact(self) -> Array:
        """Where the contacts of each pair begin, if they are grouped: those of pair p are first_contact[p] up to first_contact[p + 1]; uint32."""
        return self._core.first_contact()

    @property
    def report(self) -> Rows:
        """One row: `status`, not 0 where something is wrong; `complete`, 0 where something did not fit; `contacts`; `needed_pairs`, `needed_contacts`, ..."""
        return Rows(self._core.report(), _REPORT)

    @property
    def manifolds(self) -> Rows:
        """Room for manifolds, rows of MANIFOLD; `manifold_report["manifolds"]` of them are there. ValueError where none was reserved."""
        return Rows(self._core.manifolds(), MANIFOLD)

    @property
    def points(self) -> Rows:
        """Room for their points, rows of POINT; `manifold_report["points"]` of them are there."""
        return Rows(self._core.points(), POINT)

    @property
    def manifold_report(self) -> Rows:
        """One row: `status`, not 0 where something is wrong; `complete`, 0 where something did not fit, and then there are no manifolds; `manifolds`, `points`;
        `needed_manifolds`, ..."""
        return Rows(self._core.manifold_report(), _MANIFOLD_REPORT)

    def wait(self, stream: Any = None) -> tuple[int, int]:
        """Waits for a stream; how many pairs and contacts there are, of what ran last.

        Args:
            stream: that on which a graph was replayed. None: that of `enqueue`; where one was captured, all streams of the device.

        Raises:
            Error: what the GPU found wrong, with the instance or pair to blame, or with the vertex where positions of `Query.enqueue_deform` were bad.
            TooLittleRoom: contacts or manifolds are missing.
        """
        complete, pairs, contacts, *needed = self._core.wait(self._given, None if stream is None else _stream(stream))
        if not complete:
            raise TooLittleRoom(**dict(zip(("pairs", "contacts", "undecided", "manifolds", "points"), needed)))
        return pairs, contacts


class QueuedProbes:
    """Points or rays that `Query.enqueue_closest` or `Query.enqueue_rays` has queued: what Queued is for contacts. The next call that a query queues for points or
    rays writes to the same arrays."""

    __slots__ = ("_core", "_instances", "_probes", "rows")

    def __init__(self, core: _cuda.ProbeStep, instances: _cuda.Instances, probes: _cuda.Points | _cuda.Rays, rows: Rows):
        self._core: _cuda.ProbeStep = core
        self._instances = instances
        self._probes = probes
        #: Rows of CLOSEST_POINT, one for each point, or of RAY_HIT: one for each ray, or where all hits are asked for, room for them, and the first
        #: `report["rows"]` of them are there.
        self.rows = rows

    @property
    def report(self) -> Rows:
        """One row: `status`, not 0 where something is wrong; `complete`, 0 where something did not fit, and then rows mean nothing; `rows`; `needed_hits`, ..."""
        return Rows(self._core.report(), _PROBE_REPORT)

    def wait(self, stream: Any = None) -> int:
        """Waits for a stream, as `Queued.wait` does; how many rows there are, of what ran last.

        Raises:
            Error: what the GPU found wrong, with the instance, point or ray to blame.
            TooLittleRoom: hits are missing, or words of a coordinate.
        """
        complete, rows, hits, words = self._core.wait(None if stream is None else _stream(stream))
        if not complete:
            raise TooLittleRoom(hits=hits, words=words)
        return rows


class Query:
    """Finds what happens between posed meshes on one GPU, from arrays in its memory.

    Args:
        assets: that instances refer to by their place in this list; copied to the GPU.
        device: the GPU's number.
        contents: "all"; "exact": what `contacts` in mode "exact" and `verdicts` take, a third less; "manifolds": these and what manifolds and contained bodies take.
        deforming: the assets, by their places in the list, that `deform` gives other shapes; list an asset twice where one of its bodies bends alone. Their files
            need source vertices, and `contents` is not "exact". Each takes 48 bytes a triangle and 240 a block more, and `verdicts` is not offered.
        float64: whether their positions may be in float64, too, which takes 72 bytes a triangle more; `manifolds`, `contained` and `impacts` are not offered then.

    Calls take the instances as `Query.instances` made them, or as two arrays:

    - `asset`: (n,) uint32 or int32, or None where all are of asset 0;
    - `pose`: (n, 4, 3) or (n, 12) float64: the three rows of the rotation, then the translation; world = rotation @ x + translation.

    They must be contiguous and on the query's device: nothing is ever copied or converted. Wrong types raise TypeError, wrong shapes, strides and devices
    ValueError. Error: an instance's pose is not rigid, ...; `where` is the instance or pair to blame.

    Calls wait for their results, but for those that queue, and let other Python threads run meanwhile. The results lie in the query's memory, where nothing touches
    them as long as anybody has them: a call that finds its memory in use takes other memory. What reads an array on another stream must be done when the array goes.
    A query takes one call at a time: a second thread gets RuntimeError.
    """

    __slots__ = ("_assets", "_core", "_deforming", "_given", "_positions", "_probe_step", "_step", "__weakref__")

    def __init__(self, assets: Iterable[Asset], *, device: int = 0, contents: Literal["all", "exact", "manifolds"] = "all", deforming: Iterable[int] = (),
                 float64: bool = False, stream: Any = None):
        cores = cores_of(assets)
        self._deforming = sorted({whole_number(asset, "deforming", 0, len(cores) - 1) for asset in deforming})
        self._assets = _cuda.Assets(cores, device, _choice("contents", contents, _CONTENTS), self._deforming, bool(float64), _stream(stream))
        self._positions: _cuda.Positions | None = None  # those that were queued last
        self._core = _cuda.Query(self._assets)
        self._given: Any = None  # the pairs of the last contacts()
        self._step: _cuda.Step | None = None
        self._probe_step: _cuda.ProbeStep | None = None

    @property
    def device(self) -> int:
        return self._assets.device

    def instances(self, asset: Any = None, pose: Any = None, *, stream: Any = None) -> Instances:
        """Looks at arrays once for many calls, which read them anew: see Instances."""
        if pose is None:
            raise TypeError("pose is missing")
        return Instances(_cuda.Instances(self._assets, asset, pose, _stream(stream)), asset, pose)

    def positions(self, positions: Mapping[int, Any], *, stream: Any = None) -> Positions:
        """Looks at arrays of positions once for many calls, which read them anew.

        Args:
            positions: by asset, of some of those that deform: (n, 3) float32, or float64 if the query takes it, a row for each vertex of the mesh that the asset was
                built from (`Asset.source_vertices`), in its coordinates.
        """
        if not isinstance(positions, Mapping):
            raise TypeError(f"positions is {type(positions).__name__} where a dict of arrays by asset is wanted")
        for asset in positions:
            if asset not in self._deforming:
                raise ValueError(f"positions names asset {asset!r} where {self._deforming or 'no asset'} may deform: Query(..., deforming=[...])")
        return Positions(_cuda.Positions(self._assets, [positions.get(asset) for asset in self._deforming], _stream(stream)), positions)

    def deform(self, positions: Positions | Mapping[int, Any], *, stream: Any = None) -> None:
        """Gives assets other positions, as often as you like, and waits: all their bodies take the shape of the triangles between these, where they stand. What
        the query finds from then on is about these shapes, `verdicts` aside. Assets that are not named stay as they are.

        Args:
            positions: what `positions` made, or takes.

        Raises:
            Error: a position is NaN or too large: `where` is the first such vertex. Its asset stays as it is then.
        """
        made = positions if isinstance(positions, Positions) else self.positions(positions, stream=stream)
        self._assets.deform(made._core, _stream(stream))

    def enqueue_deform(self, positions: Positions, *, stream: Any = None) -> None:
        """Queues the same, for what is queued behind it, and neither waits nor allocates: it may be captured into a CUDA graph together with `enqueue`. Keep the
        positions until the stream has passed the call, and as long as such a graph. `Queued.wait` tells what was wrong with the positions."""
        if not isinstance(positions, Positions):
            raise TypeError(f"positions is {type(positions).__name__} where what Query.positions() made is wanted")
        self._assets.enqueue_deform(positions._core, _stream(stream))
        self._positions = positions._core

    def _about(self, instances: Instances | None, asset: Any, pose: Any, pairs: Any, filter: Filter | None, stream: Any
               ) -> tuple[_cuda.Instances, _cuda.Pairs | None, _cuda.Filter | None, _cuda.Stream]:
        """Returns what a call is about: bodies, pairs and filter, and its stream."""
        on = _stream(stream)
        if instances is not None and (asset is not None or pose is not None):
            raise TypeError("instances stand instead of asset and pose, not beside them")
        if instances is None and pose is None:
            raise TypeError("instances is missing, or pose")
        bodies = _cuda.Instances(self._assets, asset, pose, on) if instances is None else instances._core
        return bodies, None if pairs is None else _cuda.Pairs(pairs, on, self._assets.device), None if filter is None else filter._core, on

    def contacts(self, instances: Instances | None = None, *, asset: Any = None, pose: Any = None, pairs: Any = None,
                 mode: Literal["exact", "fast", "boxes"] = "exact", first_contact_only: bool = False, within: float = 0.0, add_error_bounds: bool = False,
                 leave_out_rings: int = 0, sorted: bool = False, grouped: bool = False, filter: Filter | None = None, stream: Any = None) -> Contacts:
        """Finds every pair of triangles that meet: the same set as on the CPU.

        Args:
            pairs: (m, 2) uint32 or int32, or rows of PAIR; where not given, those whose world boxes meet.
            sorted: pairs ascend, and contacts ascend by pair, face_a, face_b: the same bytes on every run.
            grouped: contacts lie pair by pair, and `manifolds` and `contained` may follow.

        The others: as of `tandem.Scene.contacts`.
        """
        bodies, given, chosen, on = self._about(instances, asset, pose, pairs, filter, stream)
        found = self._core.contacts(bodies, given, _choice("mode", mode, _MODES), flag(first_contact_only, "first_contact_only"),
                                    amount(within, "within", FARTHEST), flag(add_error_bounds, "add_error_bounds"),
                                    whole_number(leave_out_rings, "leave_out_rings", 0, 8), flag(sorted, "sorted"), flag(grouped, "grouped"), chosen, on)
        self._given = pairs
        return Contacts(_found(found[0], pairs), Rows(found[1], CONTACT), Counters._make(found[2]))

    def pairs(self, instances: Instances | None = None, *, asset: Any = None, pose: Any = None, sorted: bool = True, within: float = 0.0,
              filter: Filter | None = None, stream: Any = None) -> Rows:
        """The object pairs whose world boxes meet, rows of PAIR: a < b."""
        bodies, _, chosen, on = self._about(instances, asset, pose, None, filter, stream)
        return Rows(self._core.pairs(bodies, flag(sorted, "sorted"), amount(within, "within", FARTHEST), chosen, on), PAIR)

    def manifolds(self, *, most_points: int = 7, match_previous: bool = True, quick_depths: bool = False) -> Manifolds:
        """Makes contact manifolds of the last `contacts(..., grouped=True)` of this query, whose arrays must be as they were, on its stream: where that was sorted
        too, the rows of the CPU, byte for byte. They are copied within the GPU, since the query keeps its own to find the points again in the next step."""
        if not 1 <= most_points <= 7:
            raise ValueError(f"most_points is {most_points} where 1 to 7 is wanted")
        pairs, manifolds, points = self._core.manifolds(most_points, flag(match_previous, "match_previous"), flag(quick_depths, "quick_depths"))
        return Manifolds(_found(pairs, self._given), Rows(manifolds, MANIFOLD), Rows(points, POINT))

    def contained(self) -> Contained:
        """Finds bodies within others of the last `contacts(..., grouped=True)`, which was in mode "exact" and for all contacts."""
        pairs, contained = self._core.contained()
        return Contained(_found(pairs, self._given), Rows(contained, CONTAINMENT))

    def distances(self, instances: Instances | None = None, *, asset: Any = None, pose: Any = None, pairs: Any = None, reach: float | None = None,
                  absolute_tolerance: float = 0.0, relative_tolerance: float = 0.0, filter: Filter | None = None, stream: Any = None) -> Distances:
        """Finds how near the surfaces are. Arguments: as of `tandem.Scene.distances`."""
        bodies, given, chosen, on = self._about(instances, asset, pose, pairs, filter, stream)
        found = self._core.distances(bodies, given, None if reach is None else amount(reach, "reach", np.inf),
                                     amount(absolute_tolerance, "absolute_tolerance", np.inf), amount(relative_tolerance, "relative_tolerance", np.inf), chosen, on)
        return Distances(_found(found[0], pairs), Rows(found[1], DISTANCE))

    def impacts(self, instances: Instances | None = None, *, motion: Any, duration: float, asset: Any = None, pose: Any = None, pairs: Any = None,
                tolerance: float = 0.0, sorted: bool = True, filter: Filter | None = None, stream: Any = None) -> Impacts:
        """Finds until when moving bodies surely do not meet, in a step of `duration` seconds.

        Args:
            motion: (n, 3, 3) or (n, 9) float64: velocity of the centre, angular velocity, and where the centre is in the world at the start.
        """
        bodies, given, chosen, on = self._about(instances, asset, pose, pairs, filter, stream)
        found = self._core.impacts(bodies, motion, amount(duration, "duration", FINITE), given, amount(tolerance, "tolerance", FINITE),
                                   flag(sorted, "sorted"), chosen, on)
        return Impacts(_found(found[0], pairs), Rows(found[1], IMPACT))

    def verdicts(self, instances: Instances | None = None, *, tolerance: float, asset: Any = None, pose: Any = None, pairs: Any = None,
                 filter: Filter | None = None, stream: Any = None) -> Verdicts:
        """Tells of pairs whether they are apart, touch, or are within a tolerance. Arguments: as of `tandem.Scene.verdicts`."""
        bodies, given, chosen, on = self._about(instances, asset, pose, pairs, filter, stream)
        found = self._core.verdicts(bodies, amount(tolerance, "tolerance", FARTHEST), given, chosen, on)
        return Verdicts(_found(found[0], pairs), Rows(found[1], VERDICT))

    def closest(self, points: Any, instances: Instances | None = None, *, asset: Any = None, pose: Any = None, reach: float | None = None,
                absolute_tolerance: float = 0.0, relative_tolerance: float = 0.0, sides: bool = False, stream: Any = None) -> Rows:
        """Finds the closest point of the bodies' surfaces to each of the points: rows of CLOSEST_POINT, as certified as the CPU's and with the same sides, but not
        its bytes.

        Args:
            points: (n, 3) float64, in GPU memory.

        The others: as of `tandem.Scene.closest`.
        """
        bodies, _, _, on = self._about(instances, asset, pose, None, None, stream)
        return Rows(self._core.closest(bodies, self._points(points, reach, absolute_tolerance, relative_tolerance, sides, on), on), CLOSEST_POINT)

    def rays(self, origins: Any, directions: Any, instances: Instances | None = None, *, asset: Any = None, pose: Any = None, reach: float | None = None,
             hits: Literal["first", "any", "all"] = "first", stream: Any = None) -> Rows:
        """Finds where rays meet the bodies: rows of RAY_HIT, those of the CPU byte for byte, but that another of any hits may be named.

        Args:
            origins, directions: (n, 3) float64, in GPU memory.

        The others: as of `tandem.Scene.rays`.
        """
        bodies, _, _, on = self._about(instances, asset, pose, None, None, stream)
        return Rows(self._core.rays(bodies, self._rays(origins, directions, reach, hits, on), on), RAY_HIT)

    def _points(self, points: Any, reach: float | None, absolute_tolerance: float, relative_tolerance: float, sides: bool, stream: _cuda.Stream) -> _cuda.Points:
        return _cuda.Points(points, None if reach is None else amount(reach, "reach", np.inf), amount(absolute_tolerance, "absolute_tolerance", np.inf),
                            amount(relative_tolerance, "relative_tolerance", np.inf), flag(sides, "sides"), stream, self.device)

    def _rays(self, origins: Any, directions: Any, reach: float | None, hits: str, stream: _cuda.Stream) -> _cuda.Rays:
        return _cuda.Rays(origins, directions, None if reach is None else amount(reach, "reach", np.inf), _choice("hits", hits, _HITS), stream, self.device)

    def reserve(self, *, instances: int, pairs: int, contacts: int, undecided: int | None = None, mode: Literal["exact", "fast", "boxes"] = "exact",
                first_contact_only: bool = False, within: float = 0.0, add_error_bounds: bool = False, leave_out_rings: int = 0, sorted: bool = False,
                grouped: bool = False, manifolds: int = 0, points: int | None = None, most_points: int = 7, match_previous: bool = True) -> None:
        """Makes room for calls of `enqueue`, and says how they look for contacts. What was queued before keeps its own room.

        Args:
            undecided: candidates that are not decided quickly; None: as many as contacts.
            manifolds: where not 0, calls also make contact manifolds, as `manifolds()` does, of contacts that are grouped.
            points: of them; None: `most_points` for each.
        """
        count, most = whole_number(manifolds, "manifolds", 0, _MOST), whole_number(most_points, "most_points", 1, 7)
        if count and not grouped:
            raise ValueError("manifolds are made of contacts that are grouped")
        step = _cuda.Step(self._assets, instances, pairs, contacts, contacts if undecided is None else undecided, _choice("mode", mode, _MODES),
                          flag(first_contact_only, "first_contact_only"), amount(within, "within", FARTHEST), flag(add_error_bounds, "add_error_bounds"),
                          whole_number(leave_out_rings, "leave_out_rings", 0, 8), flag(sorted, "sorted"), flag(grouped, "grouped"))
        if count:
            step.reserve_manifolds(count, most * count if points is None else whole_number(points, "points", 0, _MOST), most, flag(match_previous, "match_previous"))
        self._step = step

    def enqueue(self, instances: Instances | None = None, *, asset: Any = None, pose: Any = None, pairs: Any = None, filter: Filter | None = None,
                stream: Any = None) -> Queued:
        """Queues a query of contacts on the stream, and neither waits nor allocates: it may be captured into a CUDA graph, `with torch.cuda.graph(...)` too, where
        `stream` is PyTorch's current one. The arrays are read when the stream comes to it: until then keep
        them, or what this returns."""
        if self._step is None:
            raise ValueError("nothing is reserved: call reserve() first")
        bodies, given, chosen, on = self._about(instances, asset, pose, pairs, filter, stream)
        self._step.enqueue(bodies, given, chosen, on)
        return Queued(self._step, bodies, given, chosen)

    def reserve_probes(self, *, instances: int, probes: int, hits: int = 0, words: int = 0) -> None:
        """Makes room for calls of `enqueue_closest` and `enqueue_rays`. What was queued before keeps its own room.

        Args:
            probes: points or rays.
            hits: where all hits of rays are asked for: that many, and those that float64 gives up again.
            words: 32-bit words of a coordinate in exact arithmetic; 0: 8, which are enough but for coordinates of very different sizes.
        """
        self._probe_step = _cuda.ProbeStep(self._assets, whole_number(instances, "instances", 0, _MOST), whole_number(probes, "probes", 0, _MOST),
                                           whole_number(hits, "hits", 0, _MOST), whole_number(words, "words", 0, 66))

    def enqueue_closest(self, points: Any, instances: Instances | None = None, *, asset: Any = None, pose: Any = None, reach: float | None = None,
                        absolute_tolerance: float = 0.0, relative_tolerance: float = 0.0, sides: bool = False, stream: Any = None) -> QueuedProbes:
        """Queues what `closest` asks, as `enqueue` queues contacts: it neither waits nor allocates, and may be captured into a CUDA graph."""
        step, (bodies, _, _, on) = self._reserved_probes(), self._about(instances, asset, pose, None, None, stream)
        given = self._points(points, reach, absolute_tolerance, relative_tolerance, sides, on)
        return QueuedProbes(step, bodies, given, Rows(step.enqueue_closest(bodies, given, on), CLOSEST_POINT))

    def enqueue_rays(self, origins: Any, directions: Any, instances: Instances | None = None, *, asset: Any = None, pose: Any = None, reach: float | None = None,
                     hits: Literal["first", "any", "all"] = "first", stream: Any = None) -> QueuedProbes:
        """Queues what `rays` asks, as `enqueue` queues contacts: it neither waits nor allocates, and may be captured into a CUDA graph."""
        step, (bodies, _, _, on) = self._reserved_probes(), self._about(instances, asset, pose, None, None, stream)
        given = self._rays(origins, directions, reach, hits, on)
        return QueuedProbes(step, bodies, given, Rows(step.enqueue_rays(bodies, given, on), RAY_HIT))

    def _reserved_probes(self) -> _cuda.ProbeStep:
        if self._probe_step is None:
            raise ValueError("nothing is reserved: call reserve_probes() first")
        return self._probe_step
