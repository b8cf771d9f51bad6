"""Worlds: rigid bodies that move under gravity and contacts."""
from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from . import _tandem
from ._arrays import Rotations, Rows, amount, flag, floats, instances_of, number, whole_number
from ._asset import Asset
from ._errors import Error
from ._poses import explained
from ._rows import BODY_MOTION, INSTANCE, JOINT, NO_INDEX, PAIR, WORLD_CONTACT, WORLD_JOINT, WORLD_TOUCH
from ._scene import Filter, _core_of, cores_of, gpu_of

if TYPE_CHECKING:
    from . import _cuda

__all__ = ["Joint", "World", "WorldState"]

_MOST = 1e6  # of options that are numbers
_Numbers = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Joint:
    """Two bodies, of which at least one moves, joined as they are placed. Anchors and axis are those of the world at that time, and the bodies carry them along.

    Args:
        kind: "ball" turns about the anchor; "hinge" about an axis through it, by an angle; "slider" moves along the axis, by a way; "fixed" not at all; "distance"
            keeps how far the two anchors are apart, such as a rod or a rope.
        a, b: bodies; None: the world.
        anchor: (3,), where they are joined; of a distance, the point of a.
        anchor_b: (3,), of a distance alone: the point of b.
        axis: (3,), of a hinge or slider, of any length.
        limits: least and most of the angle or way, which is 0 as the bodies are placed, or of the distance, which without limits stays what it is; may be
            infinite.
        speed: that the motor of a hinge or slider drives b at, against a.
        most_effort: its greatest torque or force; 0: there is no motor.
        may_touch: the two bodies have contacts with each other.
        breaking_force, breaking_torque: the mean force or torque in a step beyond which it lets go at the end of the step, its motor and limits included: about b's
            anchor, in newtons and newton metres. None: it does not break.
    """

    kind: str
    a: int | None
    b: int | None
    anchor: npt.ArrayLike
    anchor_b: npt.ArrayLike = (0.0, 0.0, 0.0)
    axis: npt.ArrayLike = (0.0, 0.0, 1.0)
    limits: tuple[float, float] | None = None
    speed: float = 0.0
    most_effort: float = 0.0
    may_touch: bool = False
    breaking_force: float | None = None
    breaking_torque: float | None = None


def _breaking(value: float, name: str) -> float:
    most = number(value, name)
    if not most > 0:
        raise ValueError(f"{name} is {most} where more than 0 is wanted")
    return most


_KINDS = ("ball", "hinge", "slider", "fixed", "distance")


def _limits(value: Any) -> tuple[float, float]:
    try:
        least, most = value
    except (TypeError, ValueError):
        raise TypeError(f"limits is {value!r} where two numbers are wanted") from None
    return number(least, "limits[0]"), number(most, "limits[1]")


def _joint_rows(joints: Sequence[Joint]) -> Rows:
    joints = list(joints)
    rows = np.zeros(len(joints), JOINT)
    for i, (row, joint) in enumerate(zip(rows, joints)):
        if not isinstance(joint, Joint):
            raise TypeError(f"joint {i} is {type(joint).__name__} where a tandem.Joint is wanted")
        if joint.kind not in _KINDS:
            raise ValueError(f"kind is {joint.kind!r} where one of {', '.join(_KINDS)} is wanted")
        row["kind"] = _KINDS.index(joint.kind)
        for name, body in (("a", joint.a), ("b", joint.b)):
            row[name] = NO_INDEX if body is None else whole_number(body, name, 0, NO_INDEX - 1)
        row["anchor"], row["anchor_b"] = _vector(joint.anchor, "anchor"), _vector(joint.anchor_b, "anchor_b")
        row["axis"] = _vector(joint.axis, "axis")
        if joint.limits is not None:
            row["has_limits"] = 1
            row["least"], row["most"] = _limits(joint.limits)
        row["speed"], row["most_effort"] = number(joint.speed, "speed"), number(joint.most_effort, "most_effort")
        row["may_touch"] = flag(joint.may_touch, "may_touch")
        for name, most in (("breaking_force", joint.breaking_force), ("breaking_torque", joint.breaking_torque)):
            row[name] = 0 if most is None else _breaking(most, name)
    return rows


class WorldState:
    """What `World.save` keeps: all that the next steps depend on."""

    __slots__ = ("_core",)

    def __init__(self, core: _tandem.WorldState | _cuda.WorldState):
        self._core = core


def _gravity(value: npt.ArrayLike) -> _Numbers:
    gravity = _vector(value, "gravity")
    if not (np.abs(gravity) <= _MOST).all():
        raise ValueError(f"gravity is {gravity.tolist()} where numbers of -{_MOST:g} to {_MOST:g} are wanted")
    return gravity


def _vector(value: npt.ArrayLike, name: str) -> _Numbers:
    vector = floats(value, name, 3)
    if vector.shape != (3,):
        raise ValueError(f"{name} has shape {vector.shape} where (3,) is wanted")
    return vector


def _of_each(value: npt.ArrayLike | None, name: str, bodies: int, *tail: int) -> _Numbers | None:
    """The same for all bodies, or a row for each."""
    if value is None:
        return None
    given = floats(value, name, *tail)
    if given.ndim > len(tail) and len(given) not in (1, bodies):
        raise ValueError(f"{name} has {len(given)} rows where there are {bodies} bodies")
    return np.ascontiguousarray(np.broadcast_to(given, (bodies, *tail)))


def _of_world(value: npt.ArrayLike | None, name: str, most: float, default: Any) -> tuple[Any, npt.ArrayLike | None]:
    """The number of a world, and the numbers of its bodies, of an argument that is either."""
    if value is None:
        return default, None
    return (default, value) if np.ndim(value) > 0 else (amount(value, name, most), None)


def duration(dt: float) -> float:
    """The length of a step."""
    seconds = number(dt, "dt")
    if not 0 < seconds <= 1000:
        raise ValueError(f"dt is {seconds} where more than 0 and at most 1000 is wanted")
    return seconds


def _material(value: npt.ArrayLike | None, name: str, bodies: int, most: float = _MOST) -> _Numbers | None:
    given = _of_each(value, name, bodies)
    if given is not None and not (given <= most).all():
        row = int(np.argmin(given <= most))
        raise ValueError(f"{name} of body {row} is {given[row]} where at most {most:g} is wanted")
    return given


def _core(gpu: int | None, assets: list[_tandem.Asset], gravity: _Numbers, friction: float, restitution: float, slop: float | None, lever: float | None,
          substeps: int, sleeping: bool, continuous: bool, threads: int) -> _tandem.World | _cuda.World:
    """What moves the bodies: the CPU, or the GPU of a number."""
    options = (assets, gravity, friction, restitution, slop, lever, substeps, sleeping, continuous, threads)
    if gpu is None:
        return _tandem.World(*options)
    from . import cuda  # says why it is not there

    return cuda.WorldCore(*options, gpu)


class World:
    """Rigid bodies that move under gravity and contacts, which are exact, for any meshes. Lengths are metres, masses kilograms, times seconds, angles radians.

    Args:
        assets: that bodies refer to by their place in this list. The world keeps them.
        instances, filter, asset, rotation, translation, transform, density, velocity, angular_velocity, gravity_scale, joints: bodies, as of `place`; none where
            none of the poses is given.
        gravity: (3,).
        friction: Coulomb's coefficient; (n,): of each body, as of `place`, and that of the world is 0.5.
        restitution: part of the speed that an impact gives back, 0 to 1; (n,): of each body, and that of the world is 0.
        slop: overlap that is left alone; None: 1/4000 of the least diagonal of an asset of a moving body.
        rolling_resistance: lever at which the force between two bodies resists that they turn against each other; None: 16 slops; (n,): of each
            body, and that of the world is 16 slops.
        substeps: parts of a step that share its contacts, 1 to 10,000.
        sleeping: bodies that rest with all that they touch are left alone.
        continuous: fast bodies are carried to where they first meet others.
        threads: that a call may use, 1 to 1,024, the caller's thread included. Results do not depend on it. A GPU uses them for continuous motion alone.
        device: "cpu", or "cuda" or "cuda:1", the GPU on which the bodies move.

    On a GPU bodies move by the same rules, but joints and large groups of bodies are always soft. Results are arrays in CPU memory, as on the CPU, and `states`
    lies in GPU memory. The same calls give the same bytes on GPUs of one kind, but not those of the CPU.

    Calls let other Python threads run. A world takes one call at a time: a second thread gets RuntimeError; several worlds may share assets.

    >>> fixed = tandem.Filter(motion=[tandem.FIXED, tandem.MOVING])
    >>> world = tandem.World([box], translation=[[0, 0, 0], [0.25, 0, 1.5]], filter=fixed)
    >>> world.step(1 / 60, 120)
    >>> world.translation[1].round(2).tolist(), world.sleeping.tolist()
    ([0.25, 0.0, 1.0], [False, True])
    """

    __slots__ = ("_asset", "_assets", "_core", "_filter", "__weakref__")

    def __init__(self, assets: Iterable[Asset], instances: Rows | None = None, *, filter: Filter | None = None, asset: npt.ArrayLike | None = None,
                 rotation: Rotations | None = None, translation: npt.ArrayLike | None = None, transform: npt.ArrayLike | None = None,
                 density: npt.ArrayLike = 1000.0, velocity: npt.ArrayLike | None = None, angular_velocity: npt.ArrayLike | None = None,
                 gravity_scale: npt.ArrayLike = 1.0, joints: Sequence[Joint] = (), gravity: npt.ArrayLike = (0.0, 0.0, -9.81), friction: npt.ArrayLike = 0.5,
                 restitution: npt.ArrayLike = 0.0, slop: float | None = None, rolling_resistance: npt.ArrayLike | None = None, substeps: int = 16,
                 sleeping: bool = True, continuous: bool = False, threads: int = 1, device: str = "cpu"):
        world_friction, frictions = _of_world(friction, "friction", _MOST, 0.5)
        world_restitution, restitutions = _of_world(restitution, "restitution", 1.0, 0.0)
        world_lever, levers = _of_world(rolling_resistance, "rolling_resistance", _MOST, None)
        if not isinstance(assets, Asset):  # which cores_of() refuses
            assets = list(assets)
        self._core = _core(
            gpu_of(device), cores_of(assets), _gravity(gravity), world_friction, world_restitution, None if slop is None else amount(slop, "slop", _MOST),
            world_lever, whole_number(substeps, "substeps", 1, 10_000), flag(sleeping, "sleeping"), flag(continuous, "continuous"), whole_number(threads, "threads", 1, 1024))
        self._assets = list(assets)
        self._asset = np.zeros(0, np.uint32)
        self._filter: Filter | None = None
        if not (instances is None and asset is None and rotation is None and translation is None and transform is None):
            self.place(instances, filter=filter, asset=asset, rotation=rotation, translation=translation, transform=transform, density=density, velocity=velocity,
                       angular_velocity=angular_velocity, friction=frictions, restitution=restitutions, rolling_resistance=levers, gravity_scale=gravity_scale, joints=joints)
        elif any(given is not None for given in (filter, velocity, angular_velocity, frictions, restitutions, levers)) or joints:
            raise TypeError("instances is missing, or asset, rotation, translation or transform")

    def place(self, instances: Rows | None = None, *, filter: Filter | None = None, asset: npt.ArrayLike | None = None, rotation: Rotations | None = None,
              translation: npt.ArrayLike | None = None, transform: npt.ArrayLike | None = None, density: npt.ArrayLike = 1000.0,
              velocity: npt.ArrayLike | None = None, angular_velocity: npt.ArrayLike | None = None, friction: npt.ArrayLike | None = None,
              restitution: npt.ArrayLike | None = None, rolling_resistance: npt.ArrayLike | None = None, gravity_scale: npt.ArrayLike = 1.0,
              joints: Sequence[Joint] = ()) -> World:
        """Places all bodies anew, at time 0. Returns the world.

        Args:
            instances: array of INSTANCE, or instead of it `asset`, `rotation`, `translation` or `transform` (see `tandem.instances`).
            filter: what moves bodies, and which of them meet. A kinematic body keeps its velocities; a sleeping one starts awake.
            density: () or (n,), of bodies that move. The mass is that of what the mesh encloses; an open mesh is a shell, a hundredth of its diagonal thick.
            velocity: (3,) or (n, 3), of the centre of mass; 0 where it is not given.
            angular_velocity: (3,) or (n, 3); 0 where it is not given.
            friction, restitution, rolling_resistance: () or (n,); None, or less than 0: as of the world. Two bodies that touch have the geometric mean of their
                frictions, the larger restitution and the larger rolling resistance.
            gravity_scale: () or (n,), the part of gravity that acts on a body; 0: it floats.
            joints: between these bodies, and with the world.

        Raises:
            Error: as of `Scene.place`; a velocity beyond 1e10 along an axis, a mass that is not from 1e-30 to 1e30 kg, or a gravity_scale beyond 1e6; a moving body whose
                mesh has no topology or no extent, or whose density is not positive; a joint of a body that there is not, of two that nothing moves, without an axis, or with numbers that its kind cannot have. There are no bodies then.
        """
        bodies = instances_of(instances, asset, rotation, translation, transform)
        given = (_of_each(density, "density", len(bodies)), _of_each(velocity, "velocity", len(bodies), 3),
                 _of_each(angular_velocity, "angular_velocity", len(bodies), 3), _material(friction, "friction", len(bodies)),
                 _material(restitution, "restitution", len(bodies), 1.0), _material(rolling_resistance, "rolling_resistance", len(bodies)),
                 _of_each(gravity_scale, "gravity_scale", len(bodies)))
        joined = _joint_rows(joints)
        self._asset, self._filter = np.zeros(0, np.uint32), None
        try:
            self._core.set_bodies(bodies, _core_of(filter), *given, joined)
        except Error as error:
            raise explained(error, bodies) from None
        self._asset, self._filter = bodies["asset"].copy(), filter
        return self

    def step(self, dt: float, steps: int = 1) -> None:
        """Makes steps of dt seconds, from more than 0 to 1000. Ctrl-C, and an error, leave the bodies as after the last step that was whole.

        Raises:
            Error: a body has left the range of numbers that questions take, or has become faster than `place` allows; `where` is the body. There are no contacts then.
        """
        self._core.step(duration(dt), whole_number(steps, "steps", 0, 2**63))

    def move(self, body: int, *, rotation: Rotations | None = None, translation: npt.ArrayLike | None = None, transform: npt.ArrayLike | None = None,
             velocity: npt.ArrayLike | None = None, angular_velocity: npt.ArrayLike | None = None) -> None:
        """Puts a body elsewhere or gives it other velocities, and wakes it. A fixed or kinematic body wakes what touches it or is joined to it, there and at its new
        place; a fixed one has no velocities.

        Args:
            rotation, translation, transform: of one body (see `tandem.instances`); it stays where none of these is given.
            velocity, angular_velocity: (3,); each stays where it is not given.

        Raises:
            Error: a pose that is not rigid, or a number that is not finite. Nothing has changed then.

        >>> world = tandem.World([box], translation=[0, 0, 5])
        >>> world.move(0, velocity=[1, 0, 0])
        >>> world.step(0.5)
        >>> world.translation.round(3)[0, 0]
        0.5
        """
        row = self._body(body)
        motion = self.bodies[row:row + 1].copy()
        if not (rotation is None and translation is None and transform is None):
            pose = instances_of(None, None, rotation, translation, transform)
            if len(pose) != 1:
                raise ValueError(f"{len(pose)} poses where one is wanted")
            motion["rotation"], motion["translation"] = pose["rotation"], pose["translation"]
        for name, value in (("velocity", velocity), ("angular_velocity", angular_velocity)):
            if value is not None:
                motion[name] = _vector(value, name)
        try:
            self._core.set_body(row, motion)
        except Error as error:
            raise explained(error, np.broadcast_to(motion, row + 1)) from None

    def push(self, body: int, impulse: npt.ArrayLike, at: npt.ArrayLike | None = None) -> None:
        """Adds to a moving body's velocities what an impulse does, and wakes it. Others stay as they are.

        Args:
            impulse: (3,), newton seconds.
            at: (3,), the point of the world where it acts; None: the centre of mass.
        """
        row = self._body(body)
        self._core.push(row, _vector(impulse, "impulse"), np.ascontiguousarray(self.bodies["centre"][row]) if at is None else _vector(at, "at"))

    def set_force(self, body: int, force: npt.ArrayLike = (0.0, 0.0, 0.0), torque: npt.ArrayLike = (0.0, 0.0, 0.0)) -> None:
        """Sets what acts on a moving body in all steps from now on, beside gravity and contacts, in place of what did before. States keep it. Wakes the body where it
        is not what it was.

        Args:
            force: (3,), newtons, at the centre of mass.
            torque: (3,), newton metres, about it; both along the world's axes.

        >>> world = tandem.World([box], translation=[0, 0, 5])
        >>> world.set_force(0, [0, 0, world.mass[0] * 9.81])
        >>> world.step(1 / 60, 60)
        >>> world.translation.round(6).tolist()
        [[0.0, 0.0, 5.0]]
        """
        self._core.set_force(self._body(body), _vector(force, "force"), _vector(torque, "torque"))

    def set_material(self, body: int, *, friction: float | None = None, restitution: float | None = None, rolling_resistance: float | None = None) -> None:
        """Gives a body another material in place of the one that it has; None, or less than 0: as of the world. States keep it. Where it is not what it was, the body
        wakes, and of a fixed or kinematic body what touches it or is joined to it.

        >>> fixed = tandem.Filter(motion=[tandem.FIXED, tandem.MOVING])
        >>> world = tandem.World([box], translation=[[0, 0, 0], [0, 0, 1]], filter=fixed, gravity=[2, 0, -9.81])
        >>> world.step(1 / 60, 60)
        >>> world.set_material(0, friction=0)
        >>> world.step(1 / 60, 12)
        >>> world.velocity[:, 0].round(2).tolist()
        [0.0, 0.4]
        """
        row = self._body(body)
        given = (("friction", friction, _MOST), ("restitution", restitution, 1.0), ("rolling_resistance", rolling_resistance, _MOST))
        material = []
        for name, value, most in given:
            material.append(-1.0 if value is None else number(value, name))
            if not material[-1] <= most:
                raise ValueError(f"{name} is {material[-1]} where at most {most:g} is wanted")
        self._core.set_material(row, *material)

    def set_gravity_scale(self, body: int, gravity_scale: float) -> None:
        """Sets the part of gravity that acts on a body; 0: it floats. States keep it. Wakes as `set_material` does."""
        self._core.set_gravity_scale(self._body(body), number(gravity_scale, "gravity_scale"))

    def add_joint(self, joint: Joint) -> int:
        """Joins bodies as they are now, and wakes them. Returns the joint's place in `joints`: the first from which a joint has been removed, or else one at the end.

        Raises:
            Error: a body that there is not, two that nothing moves, no axis, or numbers that the kind cannot have. Nothing has changed then.

        >>> world = tandem.World([box], translation=[0, 0, 5])
        >>> world.step(1 / 60, 30)
        >>> world.add_joint(tandem.Joint("fixed", None, 0, anchor=world.translation[0], breaking_force=1e6))
        0
        >>> world.step(1 / 60, 30)
        >>> world.joints["holds"].tolist(), world.broken.tolist()
        ([1], [])
        >>> world.remove_joint(0)
        >>> world.step(1 / 60, 60)
        >>> world.velocity.round(2).tolist()
        [[0.0, 0.0, -9.81]]
        """
        return self._core.add_joint(_joint_rows([joint]))

    def remove_joint(self, joint: int) -> None:
        """Removes a joint, broken or not, and wakes the bodies. Others keep their places. Error, where `where` is the joint: there is none such."""
        self._core.remove_joint(whole_number(joint, "joint", 0, NO_INDEX))

    def set_motor(self, joint: int, speed: float, most_effort: float) -> None:
        """Gives the motor of a hinge or slider another speed and greatest torque or force, and wakes the bodies. Error, where `where` is the joint: there is none
        such, it has broken, or it has no motor."""
        self._core.set_motor(whole_number(joint, "joint", 0, NO_INDEX), number(speed, "speed"), number(most_effort, "most_effort"))

    def save(self) -> WorldState:
        """Keeps all that the next steps depend on: of a world on a GPU, in GPU memory."""
        return WorldState(self._core.save())

    def restore(self, state: WorldState) -> None:
        """Goes back to a state of this world that was saved since its bodies were placed, else Error. There are no contacts until the next step.

        >>> world = tandem.World([box], translation=[0, 0, 5])
        >>> start = world.save()
        >>> world.step(0.1, steps=5)
        >>> world.restore(start)
        >>> world.time, world.translation.tolist()
        (0.0, [[0.0, 0.0, 5.0]])
        """
        if not isinstance(state, WorldState):
            raise TypeError(f"state is {type(state).__name__} where a tandem.WorldState is wanted")
        try:
            self._core.restore(state._core)  # type: ignore[arg-type]
        except TypeError:
            raise ValueError("state is of a world on another kind of device") from None

    def wake(self) -> None:
        """Wakes all bodies of a world on a GPU. Call it once you have written to `states`."""
        self._on_gpu("wake()").wake()

    @property
    def bytes(self) -> int:
        """The GPU memory that a world on a GPU holds, but for its assets and states."""
        return self._on_gpu("bytes").bytes()

    @property
    def states(self) -> _cuda.Array:
        """How the bodies of a world on a GPU stand and move, (n, 13) float64 in GPU memory, by DLPack and `__cuda_array_interface__`: the very memory that steps read
        and write. A row has the centre of mass, the file's axes as a unit quaternion w, x, y, z, the velocity of the centre and the angular velocity, all in the
        world. Steps work on the default stream. After you have written there, wait for the stream on which you did, if it was another one, and call `wake`. The
        array keeps its memory when bodies are placed anew, but the new ones are elsewhere: ask for `states` again.

            states = torch.from_dlpack(world.states)
            states[1:, 7:10] *= 0.5  # half as fast
            world.wake()
        """
        return self._on_gpu("states").states()

    def _on_gpu(self, what: str) -> _cuda.World:
        if isinstance(self._core, _tandem.World):
            raise NotImplementedError(f"a world on the CPU has no {what}: that is of device='cuda'")
        return self._core

    def _body(self, body: int) -> int:
        count = self._core.count()
        if count == 0:
            raise ValueError("there are no bodies")
        return whole_number(body, "body", 0, count - 1)

    @property
    def bodies(self) -> Rows:
        """The bodies by number, a copy, array of BODY_MOTION: poses, centres of mass, velocities, and whether they sleep."""
        return np.frombuffer(self._core.bodies(), BODY_MOTION)

    @property
    def rotation(self) -> _Numbers:
        """(n, 3, 3) of the bodies."""
        return np.ascontiguousarray(self.bodies["rotation"])

    @property
    def translation(self) -> _Numbers:
        """(n, 3) of the bodies."""
        return np.ascontiguousarray(self.bodies["translation"])

    @property
    def velocity(self) -> _Numbers:
        """(n, 3), of the centres of mass."""
        return np.ascontiguousarray(self.bodies["velocity"])

    @property
    def angular_velocity(self) -> _Numbers:
        """(n, 3), in the world."""
        return np.ascontiguousarray(self.bodies["angular_velocity"])

    @property
    def sleeping(self) -> npt.NDArray[np.bool_]:
        """(n,), which bodies rest with all that they touch, and are not looked at until they are touched."""
        sleeps: npt.NDArray[np.bool_] = self.bodies["sleeps"] != 0
        return sleeps

    @property
    def assets(self) -> list[Asset]:
        """The assets that bodies refer to."""
        return list(self._assets)

    @property
    def filter(self) -> Filter | None:
        """What the bodies were placed with: what moves them, and which of them meet; joints beside."""
        return self._filter

    @property
    def motion(self) -> npt.NDArray[np.uint8]:
        """(n,), what moves each body, as of `Filter`; MOVING where nothing was said."""
        given = None if self._filter is None else self._filter._motion
        return np.zeros(len(self._asset), np.uint8) if given is None else given.copy()

    @property
    def instances(self) -> Rows:
        """The bodies by number, a copy, array of INSTANCE: what `tandem.view` and scenes take."""
        bodies = self.bodies
        made = np.zeros(len(bodies), INSTANCE)
        made["asset"], made["rotation"], made["translation"] = self._asset, bodies["rotation"], bodies["translation"]
        return made

    @property
    def mass(self) -> _Numbers:
        """(n,); 0 of bodies that contacts do not move."""
        return np.frombuffer(self._core.masses(), np.float64)

    @property
    def contacts(self) -> Rows:
        """The contacts that the last step solved, a copy, array of WORLD_CONTACT by ascending pair of bodies; not those of two sleeping bodies.

        >>> world = tandem.World([box], translation=[[0, 0, 0], [0, 0, 1]], filter=tandem.Filter(motion=[tandem.FIXED, tandem.MOVING]))
        >>> world.step(1 / 60)
        >>> weight = world.contacts["impulse"].sum(axis=0) * 60
        >>> weight.round(-1).tolist()
        [0.0, 0.0, 9810.0]
        """
        return np.frombuffer(self._core.contacts(), WORLD_CONTACT)

    @property
    def touching(self) -> Rows:
        """The pairs of bodies that touch in the last step, a copy, array of WORLD_TOUCH, ascending: at its start they had a contact that is no gap, or one of their
        contacts pushed in it. Two bodies that sleep go on as they were. `impulse` says how hard they pushed each other apart, in newton seconds, `position` where the
        hardest contact is, and `speed` how fast they approached each other at the start of the step.

        >>> world = tandem.World([box], translation=[[0, 0, 0], [0, 0, 1.01]], filter=tandem.Filter(motion=[tandem.FIXED, tandem.MOVING]))
        >>> for _ in range(5):
        ...     world.step(1 / 60)
        ...     print(world.touching[["a", "b"]].tolist(), "began:", world.began["speed"].round(2).tolist())
        [] began: []
        [] began: []
        [(0, 1)] began: [0.33]
        [(0, 1)] began: []
        [(0, 1)] began: []
        """
        return np.frombuffer(self._core.touching(), WORLD_TOUCH)

    @property
    def began(self) -> Rows:
        """The pairs that came to touch in any of the steps of the last call of `step`, a copy, array of WORLD_TOUCH, ascending; a pair that bounced is in `ended` too.
        Each has the numbers of the step of the call, from when the pair began to touch, in which it pushed hardest, and the largest speed: an impact often takes two
        steps, the first of which lets the bodies come as far as they meet."""
        return np.frombuffer(self._core.began(), WORLD_TOUCH)

    @property
    def ended(self) -> Rows:
        """The pairs that came to touch no longer in any of the steps of the last call of `step`, a copy, array of PAIR, ascending."""
        return np.frombuffer(self._core.ended(), PAIR)

    @property
    def broken(self) -> npt.NDArray[np.uint32]:
        """The joints that broke in any of the steps of the last call of `step`, a copy, ascending. A broken joint keeps its place until it is removed, and its bodies may
        touch from the next step on."""
        return np.frombuffer(self._core.broken(), np.uint32)

    @property
    def joints(self) -> Rows:
        """What the joints did in the last step, a copy, array of WORLD_JOINT in the order they were given: angle, way or distance, its speed, impulses, and whether they
        hold.

        >>> hinge = tandem.Joint("hinge", None, 0, anchor=[0, 0, 5], axis=[0, 0, 1], speed=2, most_effort=1e6)
        >>> world = tandem.World([box], translation=[[0, 0, 4]], joints=[hinge])
        >>> world.step(1 / 60, 30)
        >>> world.joints["speed"].round(3).tolist()
        [2.0]
        """
        return np.frombuffer(self._core.joints(), WORLD_JOINT)

    @property
    def time(self) -> float:
        """The seconds of all steps since bodies were placed."""
        return self._core.time()
