"""Scenes: bodies, and what is asked of them: what meets, how near, and when."""
from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _tandem
from ._arrays import FARTHEST, FINITE, Rotations, Rows, amount, flag, floats, instances as _instances, instances_of, pairs_of, poses_of, rows, whole_number, whole_numbers
from ._asset import Asset, _choice
from ._errors import Error
from ._poses import explained
from ._rows import BODY_AT, CLOSEST_POINT, CONFIGURATION_PAIR, CONTACT, CONTAINMENT, DISTANCE, FORMER, IMPACT, INSTANCE, MANIFOLD, MOTION, PAIR, POINT, RAY_HIT, VERDICT

__all__ = ["EVERY_WORLD", "Configurations", "Contacts", "Contained", "Counters", "Distances", "Filter", "Impacts", "Manifolds", "Moved", "Scene", "Verdicts"]

_frombuffer = np.frombuffer
_MODES = {"exact": 0, "fast": 1, "boxes": 2}
_MOST = 0xFFFFFFFF

#: The world of a body that is in all worlds (see Filter).
EVERY_WORLD = _MOST


class Counters(NamedTuple):
    """Work that a call did."""

    object_pairs: int
    block_pairs: int
    candidates: int
    decided_by_float32: int
    decided_by_float64: int
    decided_exactly: int
    contacts: int


class Contacts(NamedTuple):
    """Object pairs, array of PAIR, and triangles that meet, array of CONTACT, by ascending pair."""

    pairs: Rows
    contacts: Rows
    counters: Counters

    @property
    def touching(self) -> Rows:
        """The pairs that have a contact, array of PAIR in the order of `pairs`. `pairs` are those that were looked at: their world boxes meet, or they were given.

        >>> link = tandem.build([[0, 0, 0], [3, 0, 0], [0, 3, 0]], [[0, 1, 2]])
        >>> found = tandem.Scene([link], translation=[[0, 0, 0], [1, 1, 0], [2, 2, 0]]).contacts()
        >>> found.pairs.tolist(), found.touching.tolist()
        ([(0, 1), (0, 2), (1, 2)], [(0, 1), (1, 2)])
        """
        meets = np.zeros(len(self.pairs), bool)
        meets[self.contacts["pair"]] = True
        touching: Rows = self.pairs[meets]
        return touching


class Configurations(NamedTuple):
    """Whether anything touches in each configuration, (k,) bool, and what does, or is nearest, array of CONFIGURATION_PAIR by ascending configuration."""

    touching: npt.NDArray[np.bool_]
    pairs: Rows


class Moved(NamedTuple):
    """Object pairs, and those of them that have moved, arrays of PAIR."""

    pairs: Rows
    moved: Rows


class Manifolds(NamedTuple):
    """Object pairs; their contact regions, array of MANIFOLD by ascending pair; the points of these, array of POINT, manifold by manifold."""

    pairs: Rows
    manifolds: Rows
    points: Rows


class Contained(NamedTuple):
    """Object pairs, and components of bodies that lie within another, array of CONTAINMENT."""

    pairs: Rows
    contained: Rows


class Distances(NamedTuple):
    """Object pairs, and the distance of each, array of DISTANCE."""

    pairs: Rows
    distances: Rows


class Impacts(NamedTuple):
    """Object pairs, and when each of them meets, array of IMPACT."""

    pairs: Rows
    impacts: Rows


class Verdicts(NamedTuple):
    """Object pairs, and what is known of each, array of VERDICT."""

    pairs: Rows
    verdicts: Rows


class Filter:
    """Which pairs of bodies a scene looks at, of all whose world boxes meet. Keeps copies of what it is made of, and pickles.

    Args:
        motion: (n,), of each body MOVING, FIXED, KINEMATIC or SLEEPING; pairs without anything that moves are not looked at.
        group: (n,), the groups that a body is in, a bit each; all where not given.
        mask: (n,), the groups that it meets; all where not given. Two are looked at where each is in a group of the other's mask.
        world: (n,), the world of each body: only bodies of one world are looked at, and those of EVERY_WORLD with all. Worlds may lie in one place.
        excluded: (m, 2) or array of PAIR: pairs that are not looked at, in any order.

    >>> fixed = tandem.Filter(motion=[tandem.FIXED, tandem.FIXED, tandem.MOVING])
    >>> scene.place(translation=np.zeros((3, 3)), filter=fixed).pairs().tolist()
    [(0, 2), (1, 2)]
    """

    __slots__ = ("_core", "_given")

    def __init__(self, motion: npt.ArrayLike | None = None, group: npt.ArrayLike | None = None, mask: npt.ArrayLike | None = None,
                 world: npt.ArrayLike | None = None, excluded: npt.ArrayLike | None = None):
        motions = None if motion is None else whole_numbers(motion, "motion", 255, np.uint8)
        groups = None if group is None else whole_numbers(group, "group")
        masks = None if mask is None else whole_numbers(mask, "mask")
        worlds = None if world is None else whole_numbers(world, "world")
        shapes = {name: array.shape for name, array in (("motion", motions), ("group", groups), ("mask", masks), ("world", worlds)) if array is not None}
        for name, shape in shapes.items():
            if len(shape) != 1 or shape != next(iter(shapes.values())):
                raise ValueError(f"{name} has shape {shape} where (n,) is wanted, the same as of the others")
        pairs = pairs_of(excluded, "excluded")
        self._core = _tandem.Filter(motions, groups, masks, worlds, pairs)
        self._given: list[npt.NDArray[Any] | None] = [None if array is None else array.copy() for array in (motions, groups, masks, worlds, pairs)]

    def __reduce__(self) -> tuple[type, tuple[npt.NDArray[Any] | None, ...]]:
        return Filter, tuple(self._given)

    @property
    def _motion(self) -> npt.NDArray[np.uint8] | None:
        return self._given[0]


def _of_all(given: Any) -> Any:
    """What is given of each body of each configuration, of all one after the other."""
    if given is None:
        return None
    array = np.asarray(given.as_matrix() if hasattr(given, "as_matrix") else given)
    return array.reshape(-1, *array.shape[2:])


def _core_of(filter: Filter | None) -> _tandem.Filter | None:
    if filter is None:
        return None
    if not isinstance(filter, Filter):
        raise TypeError(f"filter is {type(filter).__name__} where a tandem.Filter is wanted")
    return filter._core


def gpu_of(device: str) -> int | None:
    """The number of the GPU that a device names; None: the CPU."""
    if device == "cpu":
        return None
    kind, _, number = device.partition(":") if isinstance(device, str) else ("", "", "")
    if kind != "cuda" or not (number or "0").isdecimal():
        raise ValueError(f"device is {device!r} where 'cpu', 'cuda' or 'cuda:1' is wanted")
    return int(number or 0)


def _device(name: str) -> int:
    """What answers a scene's questions, as the extensions know it; 0: the CPU."""
    gpu = gpu_of(name)
    if gpu is None:
        return 0
    from . import cuda  # says why it is not there

    return cuda.make_device(gpu)


def cores_of(assets: Iterable[Asset]) -> list[_tandem.Asset]:
    """What the extensions take a list of assets for."""
    if isinstance(assets, Asset):
        raise TypeError("assets is one asset where a list of them is wanted")
    cores = []
    for place, asset in enumerate(assets):
        if not isinstance(asset, Asset):
            raise TypeError(f"assets: entry {place} is {type(asset).__name__} where an Asset is wanted")
        cores.append(asset._core)
    return cores


class Scene:
    """Posed meshes, of which any number of questions can be asked.

    Args:
        assets: that bodies refer to by their place in this list. The scene keeps them.
        instances, filter, asset, rotation, translation, transform: bodies, as of `place`; none where none of these is given.
        threads: that a call may use, 1 to 1,024, the caller's thread included. Results do not depend on it.
        device: "cpu", or "cuda" or "cuda:1", the GPU that answers all questions. Contacts, manifolds, contained bodies and verdicts are the same;
            distances and impacts are as certified, but not the same bytes. `tandem.cuda` is for poses and results that lie in GPU memory.

    A body is known by its number: its place in the list that was placed, or what `add` returned. The scene checks poses when bodies are placed or moved, and
    finds object pairs once for all questions of one reach. Fixed bodies (Filter, `set_motion`) cost nothing while they stay.

    Questions are about the pairs whose world boxes meet, a < b, sorted, which the filter lets through; or about `pairs`, an array of PAIR or whole numbers
    (m, 2). Error: a body that there is not, with the pair as `where`. Results are arrays that the caller owns.

    Calls let other Python threads run. A scene takes one call at a time: a second thread gets RuntimeError; several scenes may share assets.

    >>> scene = tandem.Scene([box], translation=[[0, 0, 0], [2, 0, 0]])
    >>> body = scene.add(translation=[0.5, 0, 0])
    >>> scene.contacts().touching.tolist(), scene.distances(pairs=[[1, 2]]).distances["upper"].round(9).tolist()
    ([(0, 2)], [0.5])
    >>> scene.move(body, translation=[1.5, 0, 0])
    >>> scene.contacts().touching.tolist()
    [(1, 2)]
    """

    __slots__ = ("_core", "_threads", "__weakref__")

    def __init__(self, assets: Iterable[Asset], instances: Rows | None = None, *, threads: int = 1, filter: Filter | None = None,
                 asset: npt.ArrayLike | None = None, rotation: Rotations | None = None, translation: npt.ArrayLike | None = None,
                 transform: npt.ArrayLike | None = None, device: str = "cpu"):
        self._core = _tandem.Scene(cores_of(assets), _device(device))
        self._threads = 1
        self.threads = threads
        if not (instances is None and filter is None and asset is None and rotation is None and translation is None and transform is None):
            self.place(instances, filter=filter, asset=asset, rotation=rotation, translation=translation, transform=transform)

    @property
    def threads(self) -> int:
        """How many threads a call may use. May be set."""
        return self._threads

    @threads.setter
    def threads(self, threads: int) -> None:
        number = whole_number(threads, "threads", 1, 1024)
        if number != self._threads:
            self._core.set_threads(number)
            self._threads = number

    @property
    def instances(self) -> Rows:
        """The bodies by number, a copy, array of INSTANCE. Removed ones have the asset NO_INDEX."""
        bodies = _frombuffer(self._core.instances(), INSTANCE)
        bodies["reserved"] = 0  # padding in C++, which holds whatever was in memory
        return bodies

    def place(self, instances: Rows | None = None, *, filter: Filter | None = None, asset: npt.ArrayLike | None = None, rotation: Rotations | None = None,
              translation: npt.ArrayLike | None = None, transform: npt.ArrayLike | None = None) -> Scene:
        """Places all bodies anew; those that stand as before cost next to nothing. Returns the scene.

        Args:
            instances: array of INSTANCE, or instead of it `asset`, `rotation`, `translation` or `transform` (see `tandem.instances`).
            filter: where the scene finds the pairs.

        Raises:
            Error: a pose that is not rigid to 1e-6, a number that is not finite or beyond 1e300, an asset that there is not; `where` is the instance. There are
                no bodies then.

        >>> scene.place(rotation=2 * np.eye(3))
        Traceback (most recent call last):
        tandem._errors.Error: instance 0: a pose is not a rotation and a translation: its rotation is not orthonormal: it scales by 2
        """
        bodies = instances_of(instances, asset, rotation, translation, transform)
        try:
            self._core.place(bodies, _core_of(filter))
        except Error as error:
            raise explained(error, bodies) from None
        return self

    def add(self, asset: int = 0, *, rotation: Rotations | None = None, translation: npt.ArrayLike | None = None, transform: npt.ArrayLike | None = None,
            motion: int = 0, group: int = _MOST, mask: int = _MOST, world: int = _MOST) -> int:
        """Adds a body and leaves the others alone. Returns its number, the lowest that is free.

        Args:
            asset, rotation, translation, transform: of one body (see `tandem.instances`).
            motion, group, mask, world: the body's, as of Filter.

        Raises:
            Error: as of `place`; nothing has changed then.

        >>> scene.place(translation=np.zeros((2, 3))).add(translation=[0, 0, 3])
        2
        """
        body = instances_of(None, asset, rotation, translation, transform)
        if len(body) != 1:
            raise ValueError(f"{len(body)} bodies where one is wanted")
        filter = None if (motion, group, mask, world) == (0, _MOST, _MOST, _MOST) else Filter([motion], [group], [mask], [world])
        try:
            return self._core.add(body, _core_of(filter))
        except Error as error:
            raise explained(error, body) from None

    def move(self, bodies: npt.ArrayLike, instances: Rows | None = None, *, rotation: Rotations | None = None,
             translation: npt.ArrayLike | None = None, transform: npt.ArrayLike | None = None) -> None:
        """Moves a body, or several, and leaves the others alone.

        Args:
            bodies: a number, or (n,) of them.
            instances: array of INSTANCE, whose poses they get, or instead of it `rotation`, `translation` or `transform` (see `tandem.instances`).

        Raises:
            Error: as of `place`, or a body that there is not; `where` is the place in `bodies`. Nothing has changed then.
        """
        numbers = whole_numbers(bodies, "bodies").reshape(-1)
        poses = instances_of(instances, None, rotation, translation, transform)
        if len(poses) != len(numbers):
            if len(poses) != 1:
                raise ValueError(f"different numbers of rows: bodies {len(numbers)}, poses {len(poses)}")
            poses = np.repeat(poses, len(numbers))
        try:
            self._core.move(numbers, poses)
        except Error as error:
            raise explained(error, poses) from None

    def deform(self, asset: int, positions: npt.ArrayLike) -> None:
        """Gives the vertices of an asset other positions, as often as you like: all its bodies take the shape of the triangles between these.

        Questions are then about these positions, posed as usual, and decide as exactly as for rigid bodies. `verdicts` is not offered then, nor, where some
        coordinate is no float32 number, are `manifolds`, `contained` and `impacts`.

        Args:
            asset: its place in the list that the scene was made of. A body that bends alone gets an entry of its own there: list the asset twice.
            positions: (n, 3), a row for each vertex of the mesh that the asset was built from (`Asset.source_vertices`), in its coordinates. float32 and float64
                arrays are taken as they are.

        Raises:
            Error: an asset that there is not, or that says nothing of its vertices (`bvhbuild --no-refit`); another number of positions; or one that is NaN or too
                large: `where` is its row. Nothing has changed then.

        >>> vertices = np.array([[0, 0, 0], [3, 0, 0], [0, 3, 0]])
        >>> sheet = tandem.build(vertices, [[0, 1, 2]])
        >>> scene = tandem.Scene([sheet, sheet], asset=[0, 1], translation=[[0, 0, 0], [0, 0, 1]])
        >>> scene.deform(0, vertices + [[0, 0, 0], [0, 0, 0], [0, 0, 2]])
        >>> scene.contacts().touching.tolist()
        [(0, 1)]
        """
        array = floats(positions, "positions", 3) if np.asarray(positions).dtype != np.float32 else np.ascontiguousarray(positions)
        if array.ndim != 2 or array.shape[1] != 3:
            raise ValueError(f"positions has shape {array.shape} where (n, 3) is wanted")
        self._core.deform(whole_number(asset, "asset", 0, _MOST), array, array.dtype == np.float64)

    def looseness(self, asset: int) -> float:
        """How much looser the tree of a deformed asset is than as it was built: the surface of its inner boxes by that of the box around all of them, relative to
        the same of the asset. Above 1.75 an asset that is built anew of the positions may pay. 1 where the asset is not deformed."""
        return self._core.looseness(whole_number(asset, "asset", 0, _MOST))

    def set_motion(self, body: int, motion: int) -> None:
        """Changes what moves a body: MOVING, FIXED, KINEMATIC or SLEEPING."""
        self._core.set_motion(whole_number(body, "body", 0, _MOST), whole_number(motion, "motion", 0, 3))

    def remove(self, body: int) -> None:
        """Removes a body: no question finds it any more, and `add` uses its number again."""
        self._core.remove(whole_number(body, "body", 0, _MOST))

    def pairs(self, *, reach: float = 0.0, self_pairs: bool = False) -> Rows:
        """The object pairs whose world boxes are at most `reach` apart, or a little beyond, array of PAIR: a < b, sorted; with self_pairs also each body with
        itself.

        >>> scene.place(translation=[[0, 0, 0], [0.5, 0, 0], [3, 0, 0]]).pairs().tolist()
        [(0, 1)]
        """
        return _frombuffer(self._core.pairs(amount(reach, "reach", np.inf), flag(self_pairs, "self_pairs")), PAIR)

    def moved(self, tolerance: npt.ArrayLike = 0.0, *, pairs: npt.ArrayLike | None = None) -> Moved:
        """Finds the pairs that have moved since they last were rows of this question, or were not among the pairs of the call before. Contacts need only be asked
        of these, as `manifolds(keep=True)` keeps the manifolds of the others.

        Args:
            tolerance: how far a point of the smaller body, seen from the larger one, may move; a number, or (m,) of them, one for each of `pairs`.

        >>> scene = tandem.Scene([box], translation=[[0, 0, 0], [0.1, 0.2, 0.75], [0.2, 0, 1.5]])
        >>> for _ in range(2):
        ...     moved = scene.moved(0.001).moved
        ...     found = scene.contacts(pairs=moved)
        ...     print(len(moved), len(scene.manifolds(keep=True).manifolds))
        2 2
        0 2
        """
        tolerances = floats(tolerance, "tolerance")
        each = tolerances.ndim != 0
        found = self._core.moved(0.0 if each else float(tolerances), tolerances if each else None, None if pairs is None else pairs_of(pairs))
        return Moved(_frombuffer(found[0], PAIR), _frombuffer(found[1], PAIR))

    def contacts(self, *, pairs: npt.ArrayLike | None = None, mode: Literal["exact", "fast", "boxes"] = "exact", first_contact_only: bool = False,
                 self_pairs: bool = False, within: float = 0.0, add_error_bounds: bool = False, leave_out_rings: int = 0) -> Contacts:
        """Finds every pair of triangles that meet.

        Args:
            mode: "exact": as exact arithmetic on the posed vertices finds them; "fast": by float32, which may err where rounding does; "boxes": triangles whose
                boxes overlap.
            first_contact_only: one contact for each object pair that touches.
            self_pairs: where the scene finds the pairs, also each body with itself.
            within: clearance: triangles at most so far apart count, decided exactly.
            add_error_bounds: a pair without a contact is surely apart at the finest levels too.
            leave_out_rings: of a body with itself, 0 to 8: with 1, triangles that share a vertex are left out; with n, those that a path of n - 1 edges joins.

        Returns:
            Contacts: unpacks into pairs, contacts and counters; `touching` are the pairs that have a contact.

        >>> pairs, contacts, counters = scene.place(translation=[[0, 0, 0], [0.5, 0.5, 0.5]]).contacts()
        >>> pairs.tolist(), len(contacts), counters.contacts
        ([(0, 1)], 18, 18)
        """
        found = self._core.contacts(None if pairs is None else pairs_of(pairs), _MODES[mode] if mode in _MODES else _choice("mode", mode, tuple(_MODES)),
                                    flag(first_contact_only, "first_contact_only"), flag(self_pairs, "self_pairs"), amount(within, "within", FARTHEST),
                                    flag(add_error_bounds, "add_error_bounds"), whole_number(leave_out_rings, "leave_out_rings", 0, 8))
        return Contacts(_frombuffer(found[0], PAIR), _frombuffer(found[1], CONTACT), Counters._make(found[2]))

    def manifolds(self, *, most_points: int = 7, match_previous: bool = True, keep: bool = False, quick_depths: bool = False) -> Manifolds:
        """Makes contact manifolds of the last `contacts`, or, where none were asked for since bodies were placed, moved, added or removed, of all contacts, which
        are found first. They need all contacts: with `first_contact_only` they are of the one triangle pair that was found.

        Args:
            most_points: of a manifold, 1 to 7.
            match_previous: points are looked for among those of the last call, and keep their `id`.
            keep: the last `contacts` are of the pairs that have `moved`; the others keep the manifolds that they had, moved with the bodies, and rows are about
                all pairs of `moved`.
            quick_depths: less time for deep overlaps of bodies that are not convex, more of whose depths are too small then.

        Raises:
            Error: the last `contacts` raised one; an asset has no topology.

        >>> _, manifolds, points = scene.place(translation=[[0, 0, 0], [0.1, 0.2, 0.75]]).manifolds()
        >>> manifolds["normal"].tolist(), manifolds["depth"].tolist(), len(points)
        ([[0.0, 0.0, 1.0]], [0.25], 4)
        """
        pairs, manifolds, points = self._core.manifolds(whole_number(most_points, "most_points", 1, 7), flag(match_previous, "match_previous"), flag(keep, "keep"),
                                                        flag(quick_depths, "quick_depths"))
        return Manifolds(_frombuffer(pairs, PAIR), _frombuffer(manifolds, MANIFOLD), _frombuffer(points, POINT))

    def contained(self) -> Contained:
        """Finds bodies within others, which no contact tells, among the pairs of the last `contacts`, which are found first as for `manifolds`. Error where they
        were not in mode "exact", all, and with `within` 0.

        >>> small = tandem.build(box.triangles().reshape(-1, 3) / 4 + 0.25, np.arange(36).reshape(12, 3))
        >>> tandem.Scene([box, small], asset=[0, 1]).contained().contained["inner"].tolist()
        [1]
        """
        pairs, contained = self._core.contained()
        return Contained(_frombuffer(pairs, PAIR), _frombuffer(contained, CONTAINMENT))

    def distances(self, *, pairs: npt.ArrayLike | None = None, reach: float | None = None, absolute_tolerance: float = 0.0, relative_tolerance: float = 0.0,
                  former: Rows | None = None) -> Distances:
        """Finds how near the surfaces are: `lower` <= distance <= `upper`, both 0 exactly where triangles meet.

        Args:
            pairs: where not given, those whose world boxes are within reach.
            reach: pairs that are surely farther apart have NO_INDEX for triangles; None: all are looked at.
            absolute_tolerance, relative_tolerance: upper - lower <= max(absolute, relative * upper); relative 0: 1e-6.
            former: array of FORMER by ascending a, then b: where to begin to look.

        >>> scene.place(translation=[[0, 0, 0], [1.5, 0, 0]]).distances().distances["upper"].round(9).tolist()
        [0.5]
        """
        found, distances = self._core.distances(
            pairs_of(pairs), None if reach is None else amount(reach, "reach", np.inf), amount(absolute_tolerance, "absolute_tolerance", np.inf),
            amount(relative_tolerance, "relative_tolerance", np.inf), None if former is None else rows(former, "former", FORMER))
        return Distances(_frombuffer(found, PAIR), _frombuffer(distances, DISTANCE))

    def impacts(self, motion: Rows, duration: float, *, pairs: npt.ArrayLike | None = None, tolerance: float = 0.0) -> Impacts:
        """Finds until when moving bodies surely do not meet, in a step of `duration` seconds, of the object pairs whose boxes meet when swept.

        Args:
            motion: array of MOTION, one for each body, which stands as at the start: velocity of its centre, rad/s about that, and where the centre is in the
                world at the start, such as that of mass or the body's translation. It matters where a body turns: with zeros it goes around the world's origin.
            tolerance: how near triangles come before they stop a pair, as a part of the diagonal of the smaller body's bounds; 0: 1e-6.

        >>> motion = np.zeros(2, tandem.MOTION)
        >>> motion["velocity"][1] = [-1, 0, 0]
        >>> motion["angular_velocity"][1] = [1, 0, 0]
        >>> motion["centre"] = translation = [[0, 0, 0], [1.5, 0, 0]]
        >>> scene.place(translation=translation).impacts(motion, 2.0).impacts["t_safe"].round(3).tolist()
        [0.5]
        """
        motions = rows(motion, "motion", MOTION)
        if motions.shape != (self._core.count(),):
            raise ValueError(f"motion has shape {motions.shape} where ({self._core.count()},) is wanted")
        found, impacts = self._core.impacts(motions, amount(duration, "duration", FINITE), pairs_of(pairs), amount(tolerance, "tolerance", FINITE))
        return Impacts(_frombuffer(found, PAIR), _frombuffer(impacts, IMPACT))

    def verdicts(self, *, tolerance: float, pairs: npt.ArrayLike | None = None) -> Verdicts:
        """Tells of pairs whether they surely do not meet (APART), surely meet (TOUCH), or are within a tolerance (WITHIN_TOLERANCE), each body at the coarsest of
        its levels that can tell.

        Args:
            tolerance: what need not be told apart from touching; 0: all is decided.

        Raises:
            Error: an asset does not show its file's level 0; `where` is the asset.

        >>> scene.place(translation=[[0, 0, 0], [0.5, 0, 0]]).verdicts(tolerance=0.1).verdicts["verdict"].tolist() == [tandem.TOUCH]
        True
        """
        found, verdicts = self._core.verdicts(amount(tolerance, "tolerance", FARTHEST), pairs_of(pairs))
        return Verdicts(_frombuffer(found, PAIR), _frombuffer(verdicts, VERDICT))

    def configurations(self, bodies: npt.ArrayLike, *, rotation: Rotations | None = None, translation: npt.ArrayLike | None = None,
                       transform: npt.ArrayLike | None = None, pose: npt.ArrayLike | None = None, within: float | None = None,
                       pairs: Literal["first", "all", "nearest"] = "first", absolute_tolerance: float = 0.0, relative_tolerance: float = 0.0) -> Configurations:
        """Asks of many configurations whether anything touches, or how near it comes: the same, as exactly, as moving the bodies and asking for contacts or distances
        in each, and many times faster. The scene stays as it is. All its threads take part. Pairs of two bodies that stand are not looked at.

        Args:
            bodies: (n,), the numbers of the bodies that move, each once. All others stand where they are.
            rotation, translation, transform: of these in each of k configurations (see `tandem.instances`): (k, n, 3, 3), (k, n, 3), (k, n, 4, 4) and so on.
            pose: the same, (k, n, 4, 3) or (k, n, 12) float64: the three rows of the rotation, then the translation, as `tandem.cuda` takes them. It is the fastest,
                since nothing is converted.
            within: bodies touch where their distance is at most this; None: where they meet. For "nearest" how far is looked; None: without an end.
            pairs: "first": one that touches, if any does; "all": all that touch; both with the bounds 0 and `within`. "nearest": the nearest, with bounds of the
                least distance of all pairs, which are 0 exactly where some meet; touching says where they do.
            absolute_tolerance, relative_tolerance: of "nearest", as of `distances`.

        Raises:
            Error: a pose that is not rigid or reaches too far; `where` is its place among all. A body that there is not; `where` is its place in `bodies`.

        >>> found = scene.place(translation=[[0, 0, 0], [5, 0, 0]]).configurations([1], translation=[[[3, 0, 0]], [[0.5, 0, 0]]])
        >>> found.touching.tolist(), found.pairs.tolist()
        ([False, True], [(1, 0, 1, 0.0, 0.0)])
        >>> scene.configurations([1], translation=[[[3, 0, 0]], [[0.5, 0, 0]]], pairs="nearest").pairs["upper"].round(9).tolist()
        [2.0, 0.0]
        """
        find = _choice("pairs", pairs, ("first", "all", "nearest"))
        farthest = np.inf if pairs == "nearest" else FARTHEST
        looked = amount(within, "within", farthest) if within is not None else np.inf if pairs == "nearest" else 0.0
        moving = np.atleast_1d(whole_numbers(bodies, "bodies"))
        poses = poses_of(*map(_of_all, (pose, rotation, translation, transform)))
        count = len(poses) // len(moving) if len(moving) else 0
        try:
            found = _frombuffer(self._core.configurations(moving, poses, looked, find, amount(absolute_tolerance, "absolute_tolerance", np.inf),
                                                          amount(relative_tolerance, "relative_tolerance", np.inf)), CONFIGURATION_PAIR)
        except Error as error:
            raise explained(error, _instances(rotation=poses[:, :3], translation=poses[:, 3])) from None
        touching = np.zeros(count, bool)
        touching[found["configuration"] if pairs != "nearest" else found["configuration"][found["upper"] == 0]] = True
        return Configurations(touching, found)

    def bodies_at(self, points: npt.ArrayLike) -> Rows:
        """Finds which bodies' world boxes contain points, (n, 3) or one: array of BODY_AT by point, then by body.

        >>> scene.place(translation=[[0, 0, 0], [0.5, 0, 0]]).bodies_at([[0.25, 0.5, 0.5], [0.75, 0.5, 0.5]]).tolist()
        [(0, 0), (1, 0), (1, 1)]
        """
        return _frombuffer(self._core.bodies_at(floats(points, "points", 3)), BODY_AT)

    def closest(self, points: npt.ArrayLike, *, bodies: npt.ArrayLike | None = None, reach: float | None = None, absolute_tolerance: float = 0.0,
                relative_tolerance: float = 0.0, sides: bool = False) -> Rows:
        """Finds the closest point of the bodies' surfaces to each of the points, (n, 3) or one: array of CLOSEST_POINT, a row for each.

        `lower` <= distance <= `upper`, both 0 exactly where the point is on a triangle; `upper` - `lower` is at most the larger of the
        absolute tolerance and the relative one, 0: 1e-6, times `upper`. reach: what is surely farther away has no closest point, its
        `body` is NO_INDEX and `upper` infinite. sides: also `within`, the lowest body that the point is inside of, or NO_INDEX, and
        `winding`, how often closed surfaces wind around it, both decided exactly. bodies: numbers (m,); each point is asked about each
        of these bodies alone, and the array is (n, m).

        >>> row = scene.place(translation=[[0, 0, 0], [3, 0, 0]]).closest([0.5, 0.5, 0.75], sides=True)[0]
        >>> round(float(row["upper"]), 9), row["position"].tolist(), int(row["within"]), int(row["winding"])
        (0.25, [0.5, 0.5, 1.0], 0, 1)
        >>> scene.closest([[0.5, 0.5, 1.5], [4.5, 0.5, 0.5]], bodies=[1, 0])["upper"].round(3).tolist()
        [[2.55, 0.5], [0.5, 3.5]]
        """
        from_, asked = floats(points, "points", 3), whole_numbers([] if bodies is None else bodies, "bodies")
        if bodies is not None and asked.ndim != 1:
            raise ValueError(f"bodies has shape {asked.shape} where (m,) is wanted")
        if bodies is not None and asked.size == 0:
            return np.zeros((from_.size // 3, 0), CLOSEST_POINT)
        found = _frombuffer(self._core.closest(from_, asked, None if reach is None else amount(reach, "reach", np.inf),
                                               amount(absolute_tolerance, "absolute_tolerance", np.inf),
                                               amount(relative_tolerance, "relative_tolerance", np.inf), bool(sides)), CLOSEST_POINT)
        return found if bodies is None else found.reshape(-1, asked.size)

    def rays(self, origins: npt.ArrayLike, directions: npt.ArrayLike, *, reach: float | None = None, hits: str = "first") -> Rows:
        """Finds where rays origin + t direction, 0 <= t <= reach, meet the bodies: array of RAY_HIT.

        origins, directions: (n, 3) or one each. hits: "first" gives a row for each ray with the hit of the least `t`, "any" with some
        hit; without a hit `body` is NO_INDEX and `t` infinite. "all" gives a row for each triangle that a ray meets, by ascending ray,
        `t`, body and triangle. Whether a ray meets a triangle, its edges and corners included, and what comes first are decided
        exactly; `t` is within 2^-40 of itself. `weight`: of the triangle's corners 1 and 2 at the hit, within 2^-30.

        >>> scene.place(translation=[[0, 0, 0], [3, 0, 0]]).rays([-2, 0.25, 0.5], [1, 0, 0])[["t", "body"]].tolist()
        [(2.0, 0)]
        """
        numbers = {"first": 0, "any": 1, "all": 2}
        if hits not in numbers:
            raise ValueError(f"hits: {hits!r} is none of {', '.join(numbers)}")
        from_, along = floats(origins, "origins", 3), floats(directions, "directions", 3)
        if from_.shape != along.shape:
            raise ValueError(f"directions: there are {along.size // 3}, and {from_.size // 3} origins")
        return _frombuffer(self._core.rays(from_, along, None if reach is None else amount(reach, "reach", np.inf), numbers[hits]), RAY_HIT)
