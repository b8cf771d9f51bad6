"""Queries: what meets, how near, and when."""
from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from . import _tandem
from ._arrays import FARTHEST, FINITE, Rows, amount, instances_of, pairs_of, rows, whole_number, whole_numbers
from ._asset import Asset, _choice
from ._rows import CONTACT, CONTAINMENT, DISTANCE, FORMER, IMPACT, MANIFOLD, MOTION, PAIR, POINT, VERDICT

__all__ = ["Contacts", "Contained", "Counters", "Distances", "Filter", "Impacts", "Manifolds", "Query", "Verdicts"]

_frombuffer = np.frombuffer
_MODES = {"exact": 0, "fast": 1, "boxes": 2}


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
    """Which pairs of instances a query looks at, of all whose world boxes meet. Keeps copies of what it is made of.

    Args:
        motion: (n,), of each instance MOVING, FIXED, KINEMATIC or SLEEPING; pairs without anything that moves are not looked at.
        group: (n,), the groups that an instance is in, a bit each; all where not given.
        mask: (n,), the groups that it meets; all where not given. Two are looked at where each is in a group of the other's mask.
        excluded: (m, 2) or array of PAIR: pairs that are not looked at, in any order.

    >>> fixed = tandem.Filter(motion=[tandem.FIXED, tandem.FIXED, tandem.MOVING])
    >>> query.pairs(translation=np.zeros((3, 3)), filter=fixed).tolist()
    [(0, 2), (1, 2)]
    """

    __slots__ = ("_core",)

    def __init__(self, motion: npt.ArrayLike | None = None, group: npt.ArrayLike | None = None, mask: npt.ArrayLike | None = None,
                 excluded: npt.ArrayLike | None = None):
        motions = None if motion is None else whole_numbers(motion, "motion", 255, np.uint8)
        groups = None if group is None else whole_numbers(group, "group")
        masks = None if mask is None else whole_numbers(mask, "mask")
        shapes = {name: array.shape for name, array in (("motion", motions), ("group", groups), ("mask", masks)) if array is not None}
        for name, shape in shapes.items():
            if len(shape) != 1 or shape != next(iter(shapes.values())):
                raise ValueError(f"{name} has shape {shape} where (n,) is wanted, the same as of the others")
        self._core = _tandem.Filter(motions, groups, masks, pairs_of(excluded, "excluded"))


def _core_of(filter: Filter | None) -> _tandem.Filter | None:
    if filter is None:
        return None
    if not isinstance(filter, Filter):
        raise TypeError(f"filter is {type(filter).__name__} where a tandem.Filter is wanted")
    return filter._core


class Query:
    """Finds what happens between posed meshes.

    Args:
        assets: that instances refer to by their place in this list. The query keeps them.
        threads: of its calls where they name no other number, 1 to 1,024, the caller's thread included. Results do not depend on it.

    Calls let other Python threads run. A query takes one call at a time: a second thread gets RuntimeError; several queries may share assets.

    Every call takes the instances as an array of INSTANCE, or as `asset`, `rotation`, `translation` or `transform` (see `tandem.instances`); pairs, where they
    are given, as an array of PAIR or whole numbers (m, 2), else the query finds the pairs whose world boxes meet, a < b, sorted. Error: a pose that is not rigid
    to 1e-6, a number that is not finite or beyond 1e300, an asset or instance that there is not; `where` is the instance or pair.
    """

    __slots__ = ("_core", "_threads", "__weakref__")

    def __init__(self, assets: Iterable[Asset], *, threads: int = 1):
        if isinstance(assets, Asset):
            raise TypeError("assets is one asset where a list of them is wanted")
        cores = []
        for place, asset in enumerate(assets):
            if not isinstance(asset, Asset):
                raise TypeError(f"assets: entry {place} is {type(asset).__name__} where an Asset is wanted")
            cores.append(asset._core)
        self._threads = 1
        self._threads = self._number_of_threads(threads)
        self._core = _tandem.Query(cores)

    def _number_of_threads(self, threads: int | None) -> int:
        if threads is None:
            return self._threads
        return whole_number(threads, "threads", 1, 1024)

    def contacts(self, instances: Rows | None = None, *, pairs: npt.ArrayLike | None = None, mode: Literal["exact", "fast", "boxes"] = "exact",
                 first_contact_only: bool = False, self_pairs: bool = False, within: float = 0.0, add_error_bounds: bool = False, filter: Filter | None = None,
                 threads: int | None = None, asset: npt.ArrayLike | None = None, rotation: npt.ArrayLike | None = None,
                 translation: npt.ArrayLike | None = None, transform: npt.ArrayLike | None = None) -> Contacts:
        """Finds every pair of triangles that meet.

        Args:
            mode: "exact": as exact arithmetic on the posed vertices finds them; "fast": by float32, which may err where rounding does; "boxes": triangles whose
                boxes overlap.
            first_contact_only: one contact for each object pair that touches.
            self_pairs: where the query finds the pairs, also each instance with itself.
            within: clearance: triangles at most so far apart count, decided exactly.
            add_error_bounds: a pair without a contact is surely apart at the finest levels too.
            filter: where the query finds the pairs.

        >>> pairs, contacts, counters = query.contacts(translation=[[0, 0, 0], [0.5, 0.5, 0.5]])
        >>> pairs.tolist(), len(contacts), counters.contacts
        ([(0, 1)], 18, 18)
        >>> query.contacts(rotation=np.ones((3, 3)))
        Traceback (most recent call last):
        tandem._errors.Error: instance 0: a pose is not a rotation and a translation
        """
        found = self._core.contacts(
            instances_of(instances, asset, rotation, translation, transform), None if pairs is None else pairs_of(pairs),
            _MODES[mode] if mode in _MODES else _choice("mode", mode, tuple(_MODES)), bool(first_contact_only), bool(self_pairs),
            amount(within, "within", FARTHEST), bool(add_error_bounds), _core_of(filter), self._threads if threads is None else self._number_of_threads(threads))
        return Contacts(_frombuffer(found[0], PAIR), _frombuffer(found[1], CONTACT), Counters._make(found[2]))

    def pairs(self, instances: Rows | None = None, *, self_pairs: bool = False, within: float = 0.0, add_error_bounds: bool = False,
              filter: Filter | None = None, threads: int | None = None, asset: npt.ArrayLike | None = None, rotation: npt.ArrayLike | None = None,
              translation: npt.ArrayLike | None = None, transform: npt.ArrayLike | None = None) -> Rows:
        """The object pairs whose world boxes meet, array of PAIR: a < b, sorted. Arguments: as of `contacts`.

        >>> query.pairs(translation=[[0, 0, 0], [0.5, 0, 0], [3, 0, 0]]).tolist()
        [(0, 1)]
        """
        found = self._core.pairs(instances_of(instances, asset, rotation, translation, transform), bool(self_pairs), amount(within, "within", FARTHEST),
                                 bool(add_error_bounds), _core_of(filter), self._number_of_threads(threads))
        return _frombuffer(found, PAIR)

    def keep_fixed(self, instances: Rows, motion: npt.ArrayLike, *, threads: int | None = None) -> None:
        """Keeps the instances whose motion is FIXED as they stand: calls of `contacts` and `pairs` to come, which must be of as many instances, take the time of
        the others. To be called again when one of them has moved or others are fixed. motion: (n,).

        >>> bodies = tandem.instances(translation=[[0, 0, 0], [0.5, 0, 0]])
        >>> tandem.Query([box]).keep_fixed(bodies, [tandem.FIXED, tandem.MOVING])
        """
        posed = instances_of(instances, None, None, None, None)
        motions = whole_numbers(motion, "motion", 255, np.uint8)
        if motions.shape != posed.shape:
            raise ValueError(f"motion has shape {motions.shape} where {posed.shape} is wanted")
        self._core.keep_fixed(posed, motions, self._number_of_threads(threads))

    def manifolds(self, *, most_points: int = 7, match_previous: bool = True, threads: int | None = None) -> Manifolds:
        """Makes contact manifolds of the last `contacts` of this query, whose instances it remembers. They need all contacts: with `first_contact_only` they are
        of the one triangle pair that was found.

        Args:
            most_points: of a manifold, 1 to 7.
            match_previous: points are looked for among those of the last call, and keep their `id`.

        Raises:
            Error: the last call did not find contacts; an asset has no topology.

        >>> found = query.contacts(translation=[[0, 0, 0], [0.1, 0.2, 0.75]])
        >>> _, manifolds, points = query.manifolds()
        >>> manifolds["normal"].tolist(), manifolds["depth"].tolist(), len(points)
        ([[0.0, 0.0, 1.0]], [0.25], 4)
        """
        pairs, manifolds, points = self._core.manifolds(whole_number(most_points, "most_points", 1, 7), bool(match_previous), self._number_of_threads(threads))
        return Manifolds(_frombuffer(pairs, PAIR), _frombuffer(manifolds, MANIFOLD), _frombuffer(points, POINT))

    def contained(self, *, threads: int | None = None) -> Contained:
        """Finds bodies within others, which no contact tells, of the object pairs of the last `contacts`, which was in mode "exact", for all contacts and with
        `within` 0; else Error.

        >>> small = tandem.build(box.triangles().reshape(-1, 3) / 4 + 0.25, np.arange(36).reshape(12, 3))
        >>> both = tandem.Query([box, small])
        >>> len(both.contacts(asset=[0, 1]).contacts), both.contained().contained["inner"].tolist()
        (0, [1])
        """
        pairs, contained = self._core.contained(self._number_of_threads(threads))
        return Contained(_frombuffer(pairs, PAIR), _frombuffer(contained, CONTAINMENT))

    def distances(self, instances: Rows | None = None, *, pairs: npt.ArrayLike | None = None, reach: float | None = None, absolute_tolerance: float = 0.0,
                  relative_tolerance: float = 0.0, filter: Filter | None = None, former: Rows | None = None, threads: int | None = None,
                  asset: npt.ArrayLike | None = None, rotation: npt.ArrayLike | None = None, translation: npt.ArrayLike | None = None,
                  transform: npt.ArrayLike | None = None) -> Distances:
        """Finds how near the surfaces are: `lower` <= distance <= `upper`, both 0 exactly where triangles meet.

        Args:
            pairs: where not given, those whose world boxes are within reach.
            reach: pairs that are surely farther apart have NO_INDEX for triangles; None: all are looked at.
            absolute_tolerance, relative_tolerance: upper - lower <= max(absolute, relative * upper); relative 0: 1e-6.
            former: array of FORMER by ascending a, then b: where to begin to look.

        >>> query.distances(translation=[[0, 0, 0], [1.5, 0, 0]]).distances["upper"].round(9).tolist()
        [0.5]
        """
        found, distances = self._core.distances(
            instances_of(instances, asset, rotation, translation, transform), pairs_of(pairs), None if reach is None else amount(reach, "reach", np.inf),
            amount(absolute_tolerance, "absolute_tolerance", np.inf), amount(relative_tolerance, "relative_tolerance", np.inf), _core_of(filter),
            None if former is None else rows(former, "former", FORMER), self._number_of_threads(threads))
        return Distances(_frombuffer(found, PAIR), _frombuffer(distances, DISTANCE))

    def impacts(self, instances: Rows | None, motion: Rows, duration: float, *, pairs: npt.ArrayLike | None = None, tolerance: float = 0.0,
                filter: Filter | None = None, threads: int | None = None, asset: npt.ArrayLike | None = None, rotation: npt.ArrayLike | None = None,
                translation: npt.ArrayLike | None = None, transform: npt.ArrayLike | None = None) -> Impacts:
        """Finds until when moving bodies surely do not meet, in a step of `duration` seconds, of the object pairs whose boxes meet when swept.

        Args:
            instances: at the start, or None where asset, rotation, ... are given.
            motion: array of MOTION, one for each instance: velocity of its centre, rad/s about that, and where the centre is in the world at the start, such as
                that of mass or the instance's translation. It matters where an instance turns: with zeros it goes around the world's origin.
            tolerance: how near triangles come before they stop a pair, as a part of the diagonal of the smaller body's bounds; 0: 1e-6.

        >>> motion = np.zeros(2, tandem.MOTION)
        >>> motion["velocity"][1] = [-1, 0, 0]
        >>> motion["angular_velocity"][1] = [1, 0, 0]
        >>> motion["center"] = translation = [[0, 0, 0], [1.5, 0, 0]]
        >>> query.impacts(None, motion, 2.0, translation=translation).impacts["t_safe"].round(3).tolist()
        [0.5]
        """
        posed = instances_of(instances, asset, rotation, translation, transform)
        motions = rows(motion, "motion", MOTION)
        if motions.shape != posed.shape:
            raise ValueError(f"motion has shape {motions.shape} where {posed.shape} is wanted")
        found, impacts = self._core.impacts(posed, motions, amount(duration, "duration", FINITE), pairs_of(pairs), amount(tolerance, "tolerance", FINITE),
                                            _core_of(filter), self._number_of_threads(threads))
        return Impacts(_frombuffer(found, PAIR), _frombuffer(impacts, IMPACT))

    def verdicts(self, instances: Rows | None = None, *, tolerance: float, pairs: npt.ArrayLike | None = None, filter: Filter | None = None,
                 threads: int | None = None, asset: npt.ArrayLike | None = None, rotation: npt.ArrayLike | None = None,
                 translation: npt.ArrayLike | None = None, transform: npt.ArrayLike | None = None) -> Verdicts:
        """Tells of pairs whether they surely do not meet (APART), surely meet (TOUCH), or are within a tolerance (WITHIN_TOLERANCE), each body at the coarsest of
        its levels that can tell.

        Args:
            tolerance: what need not be told apart from touching; 0: all is decided.

        Raises:
            Error: an asset does not show its file's level 0; `where` is the asset.

        >>> query.verdicts(translation=[[0, 0, 0], [0.5, 0, 0]], tolerance=0.1).verdicts["verdict"].tolist() == [tandem.TOUCH]
        True
        """
        found, verdicts = self._core.verdicts(instances_of(instances, asset, rotation, translation, transform), amount(tolerance, "tolerance", FARTHEST),
                                              pairs_of(pairs), _core_of(filter), self._number_of_threads(threads))
        return Verdicts(_frombuffer(found, PAIR), _frombuffer(verdicts, VERDICT))
