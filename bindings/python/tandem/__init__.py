"""Exact collision detection of posed triangle meshes: contacts, manifolds, distances, times of impact; and worlds of rigid bodies.

In the examples of the docstrings, `box` is a cube of unit length with a corner at 0, `scene` is tandem.Scene([box]), and `np` is NumPy.

>>> import tandem
>>> box = tandem.build([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
>>> scene = tandem.Scene([box], translation=[[0, 0, 0], [0.25, 0.25, 0.25]])
>>> len(scene.contacts().contacts) > 0
True
"""
from typing import Any as _Any

from . import _tandem
from ._arrays import instances, rotations
from ._asset import Asset, Level, Part
from ._build import BuildReport, Mesh, build, read_mesh
from ._errors import Error, FileError
from ._rows import BODY_AT, BODY_MOTION, CLOSEST_POINT, CONFIGURATION_PAIR, CONTACT, CONTAINMENT, DISTANCE, FORMER, IMPACT, INSTANCE, JOINT, MANIFOLD, MOTION, NO_INDEX, PAIR, POINT, RAY_HIT, VERDICT, WORLD_CONTACT, WORLD_JOINT, WORLD_TOUCH
from ._scene import EVERY_WORLD, Configurations, Contacts, Contained, Counters, Distances, Filter, Impacts, Manifolds, Moved, Scene, Verdicts
from ._world import Joint, World, WorldState

#: Says what moves a body (Filter): forces; nothing; the caller; nothing until the caller wakes it.
MOVING, FIXED, KINEMATIC, SLEEPING = range(4)
#: Flags of manifolds: without overlap; the curve in which the surfaces cross does not close; one body goes through the other.
TOUCHING, OPEN_CURVE, GOES_THROUGH, AMBIGUOUS = 1, 2, 4, 8
#: Flags of contained components: inside; of an open body there is no inside.
INSIDE, OUTER_OPEN = 1, 2
#: Verdicts.
APART, TOUCH, WITHIN_TOLERANCE = range(3)
#: Statuses of impacts.
NO_IMPACT, IMPACT_IN_STEP, IMPACT_AT_START = range(3)


def view(what: _Any, instances: _Any = None, **options: _Any) -> _Any:
    """Shows bodies and what was found of them, in a window or as a picture: tandem.viewer.view().

    Raises ImportError, with how to install them, where pyvista, vtk or h5py are not there."""
    try:
        from .viewer import view as show

        return show(what, instances, **options)
    except ModuleNotFoundError as error:
        if error.name not in ("h5py", "matplotlib", "pyvista", "vtk", "vtkmodules"):
            raise
        raise ImportError("tandem.view() needs pyvista, vtk and h5py: pip install '.[view]' in the folder of the sources") from error


__version__ = f"{_tandem.version // 10000}.{_tandem.version // 100 % 100}.{_tandem.version % 100}"

__all__ = [
    "AMBIGUOUS", "APART", "BODY_MOTION", "CLOSEST_POINT", "CONFIGURATION_PAIR", "CONTACT", "CONTAINMENT", "DISTANCE", "EVERY_WORLD", "FIXED", "FORMER", "GOES_THROUGH", "IMPACT", "IMPACT_AT_START", "IMPACT_IN_STEP", "INSIDE", "INSTANCE",
    "JOINT", "KINEMATIC", "MANIFOLD", "MOTION", "MOVING", "NO_IMPACT", "NO_INDEX", "OPEN_CURVE", "OUTER_OPEN", "PAIR", "POINT", "RAY_HIT", "SLEEPING", "TOUCH", "TOUCHING", "VERDICT",
    "WITHIN_TOLERANCE", "WORLD_CONTACT", "WORLD_JOINT", "WORLD_TOUCH", "Asset", "BuildReport", "Configurations", "Contacts", "Contained", "Counters", "Distances", "Error", "FileError", "Filter", "Impacts", "Joint", "Level", "Manifolds", "Mesh",
    "Moved", "Part", "Scene", "Verdicts", "World", "WorldState", "build", "instances", "read_mesh", "rotations", "view",
]
