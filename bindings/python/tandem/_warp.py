"""The doors to Newton and MuJoCo Warp share this: contact points of bodies whose poses lie in an array of Warp, on a CPU or a GPU."""
# Kernels are functions of Warp's language, and its decorators have no types where it is not installed.
# mypy: disable-error-code="untyped-decorator, no-untyped-def"
from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import warp as wp  # type: ignore[import-untyped,import-not-found,unused-ignore]

import tandem
from tandem import _tandem
from tandem._asset import Asset
from tandem._poses import explained
from tandem._scene import cores_of
from tandem._solver_pairs import asked_pairs

__all__ = ["Manifold", "Point", "Report", "Touch", "Touches", "rotation_of", "write_pose", "write_touches"]

# A CPU and a GPU are to round alike.
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

_TOUCH = np.dtype([("a", "<u4"), ("b", "<u4"), ("normal", "<f8", (3,)), ("position", "<f8", (3,)), ("gap", "<f8")])


@wp.struct
class Touch:
    """A contact point of two bodies: the struct Touch of the extension."""

    a: wp.uint32
    b: wp.uint32
    normal: wp.vec3d  # unit, from a towards b
    position: wp.vec3d  # in the world, half-way between the surfaces
    gap: wp.float64  # less than 0: they overlap


@wp.struct
class Manifold:
    """A row of tandem.MANIFOLD."""

    normal: wp.vec3d
    area_vector: wp.vec3d
    centre: wp.vec3d
    depth: wp.float64
    pair: wp.uint32
    first_point: wp.uint32
    point_count: wp.uint32
    flags: wp.uint32


@wp.struct
class Point:
    """A row of tandem.POINT."""

    position: wp.vec3d
    in_a: wp.vec3d
    in_b: wp.vec3d
    normal: wp.vec3d
    depth: wp.float64
    id: wp.uint64
    face_a: wp.uint32
    face_b: wp.uint32
    previous: wp.uint32
    manifold: wp.uint32


@wp.struct
class Report:
    """The row that tandem.cuda.Queued.manifold_report has."""

    status: wp.uint32
    complete: wp.uint32
    needed_pairs: wp.uint32
    reserved: wp.uint32
    needed_contacts: wp.uint64
    needed_manifolds: wp.uint32
    needed_points: wp.uint32
    manifolds: wp.uint32
    points: wp.uint32
    contacts: wp.uint64
    segments: wp.uint64
    made_manifolds: wp.uint64
    made_points: wp.uint64
    open_curves: wp.uint64
    ambiguous_touches: wp.uint64


@wp.func
def rotation_of(q: wp.quat):
    """The rotation of a quaternion of any length, as tandem.rotations() makes it."""
    x = wp.float64(q[0])
    y = wp.float64(q[1])
    z = wp.float64(q[2])
    w = wp.float64(q[3])
    one = wp.float64(1.0)
    two = wp.float64(2.0)
    length = wp.sqrt(x * x + y * y + z * z + w * w)
    x = x / length
    y = y / length
    z = z / length
    w = w / length
    return wp.mat33d(one - two * (y * y + z * z), two * (x * y - z * w), two * (x * z + y * w),
                     two * (x * y + z * w), one - two * (x * x + z * z), two * (y * z - x * w),
                     two * (x * z - y * w), two * (y * z + x * w), one - two * (x * x + y * y))


@wp.func
def write_pose(row: wp.array[wp.float64], rotation: wp.mat33d, translation: wp.vec3d):
    for i in range(3):
        for j in range(3):
            row[3 * i + j] = rotation[i, j]
        row[9 + i] = translation[i]


@wp.kernel
def write_touches(report: wp.array[Report], manifolds: wp.array[Manifold], points: wp.array[Point], pairs: wp.array[wp.uint32], touches: wp.array[Touch],
                  count: wp.array[int]):
    """Makes the rows that Touches::Scene::find_manifolds() of the extension makes. A thread takes a manifold."""
    m = wp.tid()
    is_whole = report[0].complete != wp.uint32(0) and report[0].status == wp.uint32(0)
    if m == 0:
        count[0] = wp.where(is_whole, int(report[0].points), 0)
    if not is_whole or m >= int(report[0].manifolds):
        return
    made = manifolds[m]
    first = int(made.first_point)
    last = first + int(made.point_count)
    second = wp.float64(0.0)
    for k in range(first + 1, last):
        second = wp.max(second, points[k].depth)
    for k in range(first, last):
        point = points[k]
        touch = Touch()
        touch.a = pairs[2 * int(made.pair)]
        touch.b = pairs[2 * int(made.pair) + 1]
        touch.normal = point.normal
        touch.position = point.position
        touch.gap = -point.depth
        # move_to_centre() of the extension has the reason.
        if k == first and made.depth > wp.float64(0.0) and point.normal == made.normal:
            share = wp.max(wp.float64(0.0), wp.float64(1.0) - wp.float64(2.0) * second / made.depth)
            way = share * (made.centre - point.position)
            touch.position = point.position + (way - wp.dot(way, point.normal) * point.normal)
        touches[k] = touch


class Touches:
    """Bodies, and the contact points of those pairs of them that may collide. The caller writes their poses into `pose`, (n, 12) float64, and calls find(), which fills
    `touches` with `count[0]` points; all three are arrays of Warp on its device.

    On a GPU nothing is copied to the CPU, and calls may be captured in a graph; but where bodies have margins, or the package has no tandem.cuda, the CPU looks at
    copies. Only the CPU finds points of bodies that are apart and within their margins.

    Args:
        asset: of each body.
        allowed: pairs that may collide, (m, 2).
        world: of each body, or None.
        margin: of each body: its pairs have points where they are no farther apart than both margins.
    """

    def __init__(self, assets: list[Asset], asset: npt.NDArray[Any], allowed: npt.NDArray[Any], is_mesh: npt.NDArray[np.bool_], world: npt.NDArray[Any] | None,
                 margin: npt.NDArray[np.float64], *, threads: int, most_points: int, device: Any):
        self.device = device
        self.pose: Any = wp.zeros((len(asset), 12), dtype=wp.float64, device=device)
        self.count: Any = wp.zeros(1, dtype=int, device=device)
        asked, columns = asked_pairs(allowed, is_mesh, world)
        self._finder: Any = None
        if device.is_cuda and not margin.any():
            try:
                from tandem import cuda
            except ImportError:
                pass
            else:
                self._finder = _OnGpu(cuda, self, assets, asset, asked, columns, most_points)
        if self._finder is None:
            self._finder = _OnCpu(self, assets, asset, asked, columns, margin, threads, most_points)
        self.is_on_gpu = isinstance(self._finder, _OnGpu)

    @property
    def touches(self) -> Any:
        return self._finder.touches

    def find(self) -> int | None:
        """Returns how many points there are, or None where the call was captured.

        Raises:
            tandem.Error: a body's pose is not rigid, or not a number.
        """
        found: int | None = self._finder.find()
        return found

    def check(self) -> None:
        """Waits for a graph that captured find(); raises what was wrong in its last replay."""
        self._finder.check()


class _OnCpu:
    def __init__(self, of: Touches, assets: list[Asset], asset: npt.NDArray[Any], asked: Any, columns: Any, margin: npt.NDArray[np.float64], threads: int,
                 most_points: int):
        self._of, self._margin = of, margin
        self._instances = np.zeros(len(asset), tandem.INSTANCE)
        self._instances["asset"] = asset
        filter = None if columns is None else tandem.Filter(**columns)._core
        self._native = _tandem.Touches(cores_of(assets), np.asarray(asset, np.uint32), asked, filter, margin, threads, most_points)
        self.touches: Any = wp.zeros(1, dtype=Touch, device=of.device)

    def find(self) -> int:
        poses = self._of.pose.numpy()
        self._instances["rotation"] = poses[:, :9].reshape(-1, 3, 3)
        self._instances["translation"] = poses[:, 9:]
        try:
            touches = np.frombuffer(self._native.find(self._instances), _TOUCH)
        except tandem.Error as error:
            raise explained(error, self._instances) from None
        touches = touches[touches["gap"] <= self._margin[touches["a"]] + self._margin[touches["b"]]]
        if len(touches):
            self.touches = wp.array(touches, dtype=Touch, device=self._of.device)
        self._of.count.fill_(len(touches))
        return len(touches)

    def check(self) -> None:
        pass  # find() cannot be captured


class _OnGpu:
    def __init__(self, cuda: Any, of: Touches, assets: list[Asset], asset: npt.NDArray[Any], asked: Any, columns: Any, most_points: int):
        def on_gpu(values: npt.NDArray[Any]) -> Any:
            return wp.array(np.ascontiguousarray(values, np.uint32), dtype=wp.uint32, device=of.device)

        self._cuda, self._of, self._most_points = cuda, of, most_points
        stream, device = self._stream(), of.device.ordinal
        self._query = cuda.Query(assets, device=device, contents="manifolds", stream=stream)
        self._instances = self._query.instances(on_gpu(asset), of.pose, stream=stream)
        self._pairs = None if asked is None else on_gpu(asked)
        self._filter = None
        if columns is not None:
            excluded = columns.pop("excluded")
            self._filter = cuda.Filter(**{name: on_gpu(values) for name, values in columns.items()}, excluded=excluded if len(excluded) else None, device=device,
                                       stream=stream)
        self._captured: list[Any] = []  # what graphs still read and write
        count = 4 * len(asset) if asked is None else len(asked)
        self._room = {"pairs": max(count, 1), "contacts": 32 * max(count, 1024), "undecided": 4 * max(count, 1024), "manifolds": max(count, 1024), "points": 4 * max(count, 1024)}
        self._reserve()

    def _reserve(self) -> None:
        self._query.reserve(instances=len(self._instances), **self._room, sorted=True, grouped=True, most_points=self._most_points, match_previous=False)
        self.touches: Any = wp.zeros(self._room["points"], dtype=Touch, device=self._of.device)

    def _stream(self) -> Any:
        return wp.get_stream(self._of.device) if self._of.device.is_cuda else None  # a test's stand-in for a GPU has none

    def find(self) -> int | None:
        stream, is_captured = self._stream(), self._of.device.is_capturing
        while True:
            queued = self._query.enqueue(self._instances, pairs=self._pairs, filter=self._filter, stream=stream)
            self._write(queued)
            if is_captured:
                self._captured.append((queued, self.touches))
                return None
            try:
                queued.wait(stream)
                return int(self._of.count.numpy()[0])
            except self._cuda.TooLittleRoom as needed:
                for name, least in self._room.items():
                    if getattr(needed, name) > least:
                        self._room[name] = getattr(needed, name) + getattr(needed, name) // 2
                self._reserve()

    def _write(self, queued: Any) -> None:
        device = self._of.device

        def rows(of: Any, dtype: Any) -> Any:
            return wp.array(ptr=of.words.pointer, dtype=dtype, shape=(len(of),), device=device)

        pairs = self._pairs.flatten() if self._pairs is not None else wp.array(
            ptr=queued.pairs.words.pointer, dtype=wp.uint32, shape=(2 * len(queued.pairs),), device=device)
        wp.launch(write_touches, dim=self._room["manifolds"], device=device,
                  inputs=[rows(queued.manifold_report, Report), rows(queued.manifolds, Manifold), rows(queued.points, Point), pairs],
                  outputs=[self.touches, self._of.count])

    def check(self) -> None:
        if self._captured:
            self._captured[-1][0].wait()
