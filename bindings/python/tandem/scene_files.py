"""Scenes, and the states that runs of bvhbench simulate keep (docs/scenes.md, docs/run_file.md).

Reading needs h5py.
"""
from __future__ import annotations

import dataclasses
import os
import pathlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

import tandem

MOVING, FIXED, KINEMATIC, SLEEPING = 0, 1, 2, 3


@dataclasses.dataclass(frozen=True)
class Scene:
    """n bodies at one time, or at the k times of which a run keeps states."""

    assets: list[tandem.Asset]
    asset: NDArray[np.uint32]  # (n,): row of `assets`
    level: NDArray[np.uint32]  # (n,): level of detail of that asset at which the body is
    motion: NDArray[np.uint8]  # (n,): MOVING, FIXED, KINEMATIC or SLEEPING
    steps: NDArray[np.int64]  # (k,): steps made before each state, ascending
    rotation: NDArray[np.float64]  # (k, n, 3, 3): world = rotation x + translation
    translation: NDArray[np.float64]  # (k, n, 3)
    pairs: NDArray[Any] | None = None  # (m, 2): those to test; None: those that `filter` lets through
    filter: tandem.Filter | None = None

    def instances(self, state: int = -1) -> NDArray[np.void]:
        """The bodies of a state, (n,) of tandem.INSTANCE. Their assets are rows of `assets`, whatever `level` says."""
        return tandem.instances(self.asset, rotation=self.rotation[state], translation=self.translation[state])


def at_levels(assets: list[tandem.Asset], asset: NDArray[Any], level: NDArray[Any]
              ) -> tuple[list[tandem.Asset], NDArray[np.uint32]]:
    """Assets that show one level each, one for each pair of an asset and a level that occurs, and the row of each body.

    Raises tandem.Error where an asset has no such level.
    """
    used, row = np.unique(np.stack([asset, level], axis=1), axis=0, return_inverse=True)
    shown = [assets[a].levels_from(first, 1) for a, first in used.tolist()]
    return shown, row.reshape(-1).astype(np.uint32)


def scene_of(world: tandem.World) -> Scene:
    """The bodies of a world as they are."""
    bodies = world.instances
    return Scene(world.assets, bodies["asset"], np.zeros(len(bodies), np.uint32), world.motion, np.zeros(1, np.int64), bodies["rotation"][None],
                 bodies["translation"][None], filter=world.filter)


def world(path: str | os.PathLike[str], **options: Any) -> tandem.World:
    """Makes the world of a scene file, with its densities and velocities. Bodies are at their levels of detail, with the masses of these.

    options: those of tandem.World, such as friction.

    Raises what read() and tandem.World raise, and ValueError for what is no scene file.
    """
    import h5py

    path = pathlib.Path(path)
    if path.suffix == ".bvh":
        raise ValueError(f"{path}: is an asset; a world is made of a scene file")
    scene = read(path)
    with h5py.File(path) as file:
        if "bodies" in file:
            raise ValueError(f"{path}: is a run; bvhbench frame makes a scene file of one of its states")
        count = len(scene.asset)
        start = {name: _dataset(path, file, f"simulation/{name}", count, *shape)
                 for name, shape in (("density", ()), ("velocity", (3,)), ("angular_velocity", (3,))) if f"simulation/{name}" in file}
    assets, asset = at_levels(scene.assets, scene.asset, scene.level)
    return tandem.World(assets, asset=asset, rotation=scene.rotation[0], translation=scene.translation[0], filter=scene.filter, **start, **options)


def read(path: str | os.PathLike[str]) -> Scene:
    """Reads a scene file, or a run file with its states, and the assets that it names.

    Raises OSError where a file is not there or is no HDF5 file, tandem.Error where an asset is broken, and ValueError,
    with the path, where something is missing or has another shape.
    """
    import h5py  # type: ignore[import-untyped,import-not-found,unused-ignore]

    path = pathlib.Path(path)
    try:
        opened = h5py.File(path)
    except OSError as error:
        if path.is_file() and os.access(path, os.R_OK) and not h5py.is_hdf5(path):
            raise OSError(f"{path}: is neither a scene file nor a run file, which are HDF5, nor a .bvh file by its "
                          "name; bvhbuild makes a .bvh file of a mesh") from None
        if error.errno is not None:  # h5py's own text tells of the inner life of HDF5
            raise type(error)(f"{path}: {os.strerror(error.errno).lower()}") from None
        raise OSError(f"{path}: {error}") from error
    with opened as file:
        try:
            return _read(path, file)
        except KeyError as error:
            raise ValueError(f"{path}: neither a scene nor a run: {error.args[0]}") from error


def _read(path: pathlib.Path, file: Any) -> Scene:
    is_run = "bodies" in file
    group = "bodies" if is_run else "instances"
    asset = file[f"{group}/asset"][:].astype(np.uint32)
    count = len(asset)
    level = np.zeros_like(asset)
    if f"{group}/level" in file:
        level[:] = _dataset(path, file, f"{group}/level", count)
    names = [os.fsdecode(name) for name in file["assets"][:]]
    if len(asset) and asset.max() >= len(names):
        raise ValueError(f"{path}: a body has asset {asset.max()} of {len(names)}")
    assets = [tandem.Asset.load(path.parent / name) for name in names]
    motion = np.zeros(count, np.uint8)
    moved_by = "bodies/motion" if is_run else "simulation/motion"
    if is_run or moved_by in file:
        motion[:] = _dataset(path, file, moved_by, count)
    steps, rotation, translation = (_states if is_run else _state)(path, file, count)
    limits = {name: _dataset(path, file, f"instances/{name}", count) for name in ("group", "mask", "world")
              if f"instances/{name}" in file}
    if "excluded" in file:
        limits["excluded"] = file["excluded"][:]
    return Scene(assets, asset, level, motion, steps, rotation.astype(float), translation.astype(float),
                 file["pairs"][:] if "pairs" in file else None, tandem.Filter(motion=motion, **limits))


def _dataset(path: pathlib.Path, file: Any, name: str, *shape: int) -> NDArray[Any]:
    """A dataset of this very shape."""
    array: NDArray[Any] = file[name][()]
    if array.shape != shape:
        raise ValueError(f"{path}: {name} has shape {array.shape} where {shape} is wanted")
    return array


def _state(path: pathlib.Path, file: Any, count: int) -> tuple[NDArray[np.int64], NDArray[Any], NDArray[Any]]:
    rotation = _dataset(path, file, "instances/rotation", count, 3, 3)
    translation = _dataset(path, file, "instances/translation", count, 3)
    return np.zeros(1, np.int64), rotation[None], translation[None]


def _states(path: pathlib.Path, file: Any, count: int) -> tuple[NDArray[np.int64], NDArray[Any], NDArray[Any]]:
    if "trajectory" not in file:
        raise ValueError(f"{path}: keeps no state: simulate with --trajectory")
    steps = file["trajectory/frame"][:].astype(np.int64)
    quaternions = _dataset(path, file, "trajectory/orientation", len(steps), count, 4)
    rotation = tandem.rotations(wxyz=quaternions.reshape(-1, 4)).reshape(len(steps), count, 3, 3)
    centre = _dataset(path, file, "bodies/centre_of_mass", count, 3)
    position = _dataset(path, file, "trajectory/position", len(steps), count, 3)
    return steps, rotation, position - np.einsum("knij,nj->kni", rotation, centre)
