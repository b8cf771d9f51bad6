"""trimesh's collision manager over exact queries: `from tandem.trimesh import CollisionManager` in place of `from trimesh.collision import CollisionManager`.

>>> import trimesh
>>> from tandem.trimesh import CollisionManager
>>> manager = CollisionManager()
>>> ring = manager.add_object("ring", trimesh.creation.torus(1.0, 0.25))
>>> box = manager.add_object("box", trimesh.creation.box((0.5, 0.5, 0.5)))
>>> manager.in_collision_internal()  # the box is in the ring's hole
False
>>> manager.set_transform("box", trimesh.transformations.translation_matrix([0.6, 0, 0]))
>>> manager.in_collision_internal(return_names=True)
(True, {('box', 'ring')})

docs/python_trimesh.md says where answers differ from trimesh's own manager, and why.
"""

from __future__ import annotations

import sys
from collections.abc import Hashable
from typing import Any

import numpy as np
from trimesh.collision import ContactData, DistanceData

from ._bodies import Bodies, Nearest, Search, Shape
from ._convex import Array

__all__ = ["CollisionManager", "CollisionObject", "ContactData", "DistanceData", "scene_to_collision"]

EXTERNAL = "__external"  # the name of the object that the methods *_single() are given


class CollisionObject:
    """An object of a manager, which add_object() returns. It stands where its manager's set_transform() puts it."""

    __slots__ = ("_place", "_shape")

    def __init__(self, shape: Shape, place: Array) -> None:
        self._shape = shape
        self._place = place

    @property
    def transform(self) -> Array:
        """(4, 4) float64, a copy."""
        return self._place.copy()


class CollisionManager:
    """Tells which of its named objects collide, and how far apart they are.

    Answers are exact for the surfaces of the meshes, whose vertices are rounded to float32, at their transforms in float64. As in trimesh, a mesh that
    trimesh calls convex is solid: what is inside it collides with it. Of all others the surface counts.

    A mesh is built into an asset when it is first seen, and again when it changes; all objects and managers that are given the same mesh share the asset.
    A manager is used by one thread at a time.

    Parameters
    ----------
    threads : int
      How many threads a call may use, the caller's among them. Answers do not depend on it.
    """

    def __init__(self, *, threads: int = 1) -> None:
        self._threads = threads
        self._objs: dict[Hashable, CollisionObject] = {}
        self._ignored: set[tuple[Hashable, Hashable]] = set()
        self._bodies: Bodies | None = None
        self._number: dict[Hashable, int] = {}  # of the objects, among the bodies
        self._changed = False  # objects came or went
        self._moved: set[Hashable] = set()
        self._joined: Bodies | None = None  # of the last question about objects from elsewhere, ours first

    def add_object(self, name: Hashable, mesh: Any, transform: Any = None) -> CollisionObject:
        """Adds an object, in place of the one of that name if there is one.

        Parameters
        ----------
        name : hashable
          Names the object.
        mesh : trimesh.Trimesh
          Its geometry.
        transform : (4, 4) float, or None
          Where it stands; None: as the mesh does. A part that scales, shears or mirrors is applied to the vertices, for which an asset is built.

        Raises ValueError where the transform has another shape, and tandem.Error where no triangle of the mesh can be used.
        """
        place = np.eye(4)
        if transform is not None:
            transform = np.asanyarray(transform, dtype=np.float64)
            if transform.shape != (4, 4):
                raise ValueError("transform must be (4,4)!")
            place[:3] = transform[:3]
        made = CollisionObject(Shape.of(mesh), place)
        self._objs[name] = made
        self._changed = True
        return made

    def remove_object(self, name: Hashable) -> None:
        """Removes an object, and the ignored pairs that it is in. Raises ValueError where there is none of that name."""
        self._check(name)
        del self._objs[name]
        self._ignored = {pair for pair in self._ignored if name not in pair}
        self._changed = True

    def set_transform(self, name: Hashable, transform: Array) -> None:
        """Moves an object to the transform, (4, 4) float. Raises ValueError where there is none of that name."""
        self._check(name)
        rotation, translation = transform[:3, :3], transform[:3, 3]
        place = self._objs[name]._place
        place[:3, :3], place[:3, 3] = rotation, translation
        self._moved.add(name)

    def set_pair_ignored(self, name_a: Hashable, name_b: Hashable, ignored: bool = True) -> None:
        """Says that in_collision_internal() and min_distance_internal() do not look at a pair, such as links that meet at a joint; or, with False, that they do.
        Raises ValueError where there is none of one of the names, or where they are one."""
        self._check(name_a)
        self._check(name_b)
        if name_a == name_b:
            raise ValueError(f"{name_a} is no pair")
        (self._ignored.add if ignored else self._ignored.discard)(_pair(name_a, name_b))

    def is_pair_ignored(self, name_a: Hashable, name_b: Hashable) -> bool:
        """Returns whether a pair is ignored, its names in either order."""
        return _pair(name_a, name_b) in self._ignored

    def clear_ignored_pairs(self) -> None:
        """Ignores no pair any more."""
        self._ignored.clear()

    @property
    def ignored_pairs(self) -> set[tuple[Hashable, Hashable]]:
        """The pairs of names that are ignored, each in alphabetical order."""
        return set(self._ignored)

    def in_collision_single(self, mesh: Any, transform: Any = None, return_names: bool = False, return_data: bool = False) -> Any:
        """Tells whether a mesh at a transform, (4, 4) float, collides with any object.

        Returns
        -------
        is_collision : bool
        names : set of str
          Of the objects that it collides with; if return_names.
        contacts : list of ContactData
          All of them; if return_data. The mesh is called "__external". Normals point from the object to the mesh; where one of them is convex, to that.
        """
        return self._collisions(self._with_single(mesh, transform), lambda a, b: a, return_names, return_data)

    def in_collision_internal(self, return_names: bool = False, return_data: bool = False) -> Any:
        """Tells whether any two objects collide.

        Returns
        -------
        is_collision : bool
        names : set of (str, str)
          The pairs that collide, either in alphabetical order; if return_names.
        contacts : list of ContactData
          All of them; if return_data. Normals point from the object that was added first to the other; where one of them is convex, to that.
        """
        return self._collisions(self._search(), _pair, return_names, return_data)

    def in_collision_other(self, other_manager: CollisionManager, return_names: bool = False, return_data: bool = False) -> Any:
        """Tells whether any object collides with one of another manager.

        Returns
        -------
        is_collision : bool
        names : set of (str, str)
          The pairs that collide: this manager's object, the other's; if return_names.
        contacts : list of ContactData
          All of them; if return_data. Normals point from this manager's object to the other's; where one of them is convex, to that.
        """
        return self._collisions(self._with_other(other_manager), lambda a, b: (a, b), return_names, return_data)

    def min_distance_single(self, mesh: Any, transform: Any = None, return_name: bool = False, return_data: bool = False) -> Any:
        """The distance between a mesh at a transform, (4, 4) float, and the object that is nearest to it.

        Returns
        -------
        distance : float
          Where they collide, 0, or less than that where one of them is convex: minus the way that parts them (both are convex), or that parts the deepest
          face of the other from the convex one. The largest float where the manager is empty.
        name : str
          Of the nearest object, None where the manager is empty; if return_name.
        data : DistanceData
          If return_data. The mesh is called "__external".
        """
        return self._distance(self._with_single(mesh, transform), (None, EXTERNAL), lambda a, b: a, return_name, return_data)

    def min_distance_internal(self, name: Hashable = None, return_names: bool = False, return_data: bool = False) -> Any:
        """The distance between the two objects that are nearest to each other; or between the one of that name and what is nearest to it.

        Returns
        -------
        distance : float
          As of min_distance_single(). The largest float where there is one object, or none.
        names : (str, str)
          Of the two, in alphabetical order; if return_names.
        data : DistanceData
          If return_data.

        Raises ValueError where there is none of that name; TypeError where names or data are asked for and there is one object, or none.
        """
        if name is not None:
            self._check(name)
        return self._distance(self._search(name), (None, None), _pair, return_names, return_data)

    def min_distance_other(self, other_manager: CollisionManager, return_names: bool = False, return_data: bool = False) -> Any:
        """The distance between the two objects, one of each manager, that are nearest to each other.

        Returns
        -------
        distance : float
          As of min_distance_single(). The largest float where one of the managers is empty.
        names : (str, str)
          This manager's object and the other's; None and None where one of the managers is empty; if return_names.
        data : DistanceData
          If return_data.
        """
        return self._distance(self._with_other(other_manager), (None, None), lambda a, b: (a, b), return_names, return_data)

    def _check(self, name: Hashable) -> None:
        if name not in self._objs:
            raise ValueError(f"{name} not in collision manager!")

    def _placed(self) -> Bodies:
        if self._bodies is None or self._changed:
            self._number = {name: number for number, name in enumerate(self._objs)}
            objects = self._objs.values()
            self._bodies = Bodies(list(self._objs), [thing._shape for thing in objects], [thing._place for thing in objects])
        elif self._moved:
            moved = [self._number[name] for name in self._moved]
            places = [self._objs[name]._place for name in self._moved]
            self._bodies.move(moved, places)
            if self._joined is not None and self._joined.ours is self._bodies:
                self._joined.move(moved, places)
        self._moved.clear()
        self._changed = False
        return self._bodies

    def _search(self, name: Hashable = None) -> Search:
        bodies, number = self._placed(), self._number
        alone = None if name is None else number[name]
        return Search(bodies, self._threads, alone=alone, ignored=sorted((number[a], number[b]) for a, b in self._ignored))

    def _with_single(self, mesh: Any, transform: Any) -> Search:
        place = np.eye(4)
        if transform is not None:
            place[:3, :3] = transform[:3, :3]
            place[:3, 3] = transform[:3, 3]
        shape, ours = Shape.of(mesh), self._placed()
        count, joined = len(ours.names), self._joined
        if joined is None or joined.ours is not ours or joined.names[count:] != [EXTERNAL] or joined.given[count] is not shape:
            return self._with(Bodies([EXTERNAL], [shape], [place]))
        joined.move([count], [place])
        return Search(joined, self._threads, first_side=count)

    def _with_other(self, other: CollisionManager) -> Search:
        return self._with(other._placed())

    def _with(self, others: Bodies) -> Search:
        ours = self._placed()
        self._joined = Bodies.joined(ours, others, self._joined)
        return Search(self._joined, self._threads, first_side=len(ours.names))

    def _collisions(self, search: Search, pair_name: Any, return_names: bool, return_data: bool) -> Any:
        names = search.bodies.names
        contacts: list[ContactData] = []
        if return_data:
            make: Any = ContactData
            pairs = set()
            for contact in search.contacts():
                pairs.add((min(contact.a, contact.b), max(contact.a, contact.b)))
                contacts.append(make((names[contact.a], names[contact.b]), contact))
        elif return_names:
            pairs = search.colliding_pairs()
        else:
            return search.any_collision()
        answer: list[Any] = [bool(pairs)]
        if return_names:
            answer.append({pair_name(names[a], names[b]) for a, b in pairs})
        if return_data:
            answer.append(contacts)
        return tuple(answer)

    def _distance(self, search: Search, nobody: tuple[Any, Any], pair_name: Any, return_names: bool, return_data: bool) -> Any:
        nearest = search.nearest()
        names = nobody
        if nearest is None:
            nearest = Nearest(0, 0, sys.float_info.max, [None, None], -1, -1)
        else:
            names = (search.bodies.names[nearest.a], search.bodies.names[nearest.b])
        if not (return_names or return_data):
            return nearest.min_distance
        answer: list[Any] = [nearest.min_distance]
        pair = pair_name(*names)
        if return_names:
            answer.append(pair)
        if return_data:
            make: Any = DistanceData
            answer.append(make(names, nearest))
        return tuple(answer)


def _pair(a: Any, b: Any) -> tuple[Any, Any]:
    first, second = sorted((a, b))
    return first, second


def scene_to_collision(scene: Any) -> tuple[CollisionManager, dict[Hashable, CollisionObject]]:
    """A manager of the objects of a trimesh.Scene, named as its nodes, and those objects by name."""
    manager = CollisionManager()
    objects = {}
    for node in scene.graph.nodes_geometry:
        transform, geometry = scene.graph[node]
        objects[node] = manager.add_object(node, scene.geometry[geometry], transform)
    return manager, objects
