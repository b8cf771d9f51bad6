"""Cases of scripts/stability whose bodies start apart, roll, spin, bounce or fall in heaps. By the default solver, at 60 Hz."""
import functools
import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from common import tools
from stability_cases import case, long_case, open_case, row
from stability_scenes import BOXES, GRAVITY, KINEMATIC, SLOP, Scene, random_rotation, rotation_about
from stability_shapes import BOWL, COIN, GAP, LEAD, PITCH, RING, TEETH, WALL, WIRE, bowl_profile

X, Y, Z = np.eye(3)


def by_default(measure):
    """Makes a case one of the default solver alone."""
    @functools.wraps(measure)
    def rows(shop):
        return measure(shop) if shop.solver == "auto" else ()
    return rows


def fastest(run):
    """The speed of the fastest centre of mass or turning point, in each frame."""
    return np.maximum(run.frames["speed_max"], run.frames["spin_max"])


def time_to_rest(run):
    """The last time that a body's centre of mass is faster than 1 cm/s."""
    moving = np.flatnonzero(run.frames["speed_max"] > 0.01)
    return (moving[-1] + 1) * run.dt if moving.size else 0.0


def axis_of(run, axis, body=0):
    """Where an axis of a body points, in each state that was kept."""
    return Rotation.from_quat(run.orientation[:, body, [1, 2, 3, 0]]).as_matrix()[:, :, axis]


def turning(run, axis, body=0):
    """The angle about the z axis by which an axis of a body has turned, in each state that was kept."""
    x, y, _ = axis_of(run, axis, body).T
    return np.unwrap(np.arctan2(y, x)) - math.atan2(y[0], x[0])


def rate(run, angle):
    """The slope of a straight line through an angle of each state that was kept."""
    return np.polyfit(np.linspace(0, run.frames["time"][-1], len(angle)), angle, 1)[0]


def properties(shop, mesh):
    """Mass, inertia about the centre of mass and that centre, of density 1000."""
    run = shop.simulate(Scene().add(mesh, [0, 0, 0]), 1 / 60, dt=1 / 60)
    return run.mass[0], run.inertia[0], run.centre[0]


# ---- Bodies that start a little apart ----

@case
@by_default
def slack_tower(shop):
    """30 boxes that start 10 um above each other: how deep they get, how high they leap, and whether the tower stands after 10 s."""
    scene = Scene().slab()
    for i in range(30):
        scene.add("box_12", [0, 0, i + 0.5 + 1e-5 * (i + 1)])
    run = shop.simulate(scene, 3 if shop.quick else 10, every=1 / 60)
    depth, height = run.frames["penetration_max"], run.position[..., 2]
    yield row("default", run, "penetration, largest", "m", depth.max(), limit=5e-3)
    yield row("default", run, "penetration after 1 s, largest", "m", depth[run.frames["time"] > 1].max(), limit=5e-3)
    yield row("default", run, "highest leap", "box lengths", (height - np.minimum.accumulate(height)).max(), reference=0.0, kind="closed form: none", limit=0.01)
    yield row("default", run, "largest drift", "box lengths", run.drift().max(), reference=0.0, kind="closed form: stays", limit=0.01)


@open_case
@by_default
def slack_chain(shop):
    """A chain of 20 rings with 0.1 mm of slack a link below a fixed one: the largest distance of two links' centres, to that at which they are taut."""
    taut = 2 * (RING - WIRE)
    for variant, way, turns in (("hanging", -Z, [rotation_about(Y, math.pi / 2), rotation_about(X, math.pi / 2)]),
                                ("swinging", X, [np.eye(3), rotation_about(X, math.pi / 2)])):
        scene = Scene()
        for i in range(6 if shop.quick else 21):
            scene.add("ring", i * (taut - 1e-4) * way, turns[i % 2], fixed=i == 0)
        run = shop.simulate(scene, 2 if shop.quick else 5, every=1 / 60)
        chain = np.concatenate([np.zeros_like(run.position[:, :1]), run.position], axis=1)
        apart = np.linalg.norm(np.diff(chain, axis=1), axis=2).max()
        yield row(variant, run, "distance of linked centres, largest", "of taut links", apart / taut, "ring", 1.0, "closed form: 2 (R - r)", limit=0.02)
        yield row(variant, run, "energy gain", "m of lift", run.energy_gain(5), "ring", 0.0, "closed form: none", limit=0.01)
        if variant == "hanging":
            yield row(variant, run, "speed, rms of the last second", "m/s", run.rms_speed(1), "ring", 0.0, "closed form: rests", limit=0.01)


@open_case
@by_default
def bowls(shop):
    """Ten bowls on the ground with gaps of 0.3 mm, each in the next larger one or standing on its like: how fast they get, and whether they rest after 5 s."""
    outside, inside = bowl_profile(BOWL), bowl_profile(BOWL - WALL)
    on_rim = GAP - np.interp(inside[-1, 0], *outside.T)
    for variant, mesh, step in (("in each other", "bowl_{}", 0), ("stacked", "bowl_0", on_rim)):
        scene = Scene().slab()
        for i in range(4 if shop.quick else 10):
            scene.add(mesh.format(i), [3, 5, GAP - outside[0, 1] + i * step])
        run = shop.simulate(scene, 3 if shop.quick else 5)
        yield row(variant, run, "speed, largest", "m/s", fastest(run).max(), "bowl_0", limit=0.5)
        yield row(variant, run, "speed, rms of the last half second", "m/s", run.rms_speed(0.5), "bowl_0", 0.0, "closed form: rests", limit=0.01)


# ---- Heaps ----

SPACING = {"rod": 1.05, "plate": 0.75, "bowl_0": 1.05, "ring": 1.25}  # a bit more than the length


def strewn(mesh, columns, count, seed):
    """Bodies above the slab, turned at random, too far from each other to touch."""
    random, scene = np.random.default_rng(seed), Scene().slab()
    for i in range(count):
        place = np.array([i % columns, i // columns % columns, i // columns ** 2])
        scene.add(mesh, SPACING[mesh] * (place + [3, 1, 0.6]), random_rotation(random))
    return scene


def heaps_at_rest(shop, mesh):
    columns, count, seeds = (3, 20, shop.seeds[:1]) if shop.quick else (5, 100, shop.seeds)
    for seed in seeds:
        run = shop.simulate(strewn(mesh, columns, count, seed), 26)
        below = int((run.position[-1, :, 2] < 0).sum())
        for found in (row("default", run, "last time that a body is faster than 1 cm/s", "s", time_to_rest(run), mesh, limit=25),
                      row("default", run, "fastest body, last 2 s", "m/s", run.frames["speed_max"][run.last(2)].max(), mesh, 0.0, "closed form: rests"),
                      row("default", run, "bodies that left the ground downwards", "", below, mesh, 0, "closed form: none", limit=0)):
            yield found | {"seed": seed}


@case
@by_default
def rods(shop):
    """Heaps of 100 rods of 4 cm by 4 cm by 1 m that fall on the ground: do they rest within 25 s, and is any below the ground?"""
    yield from heaps_at_rest(shop, "rod")


@case
@by_default
def plates(shop):
    """Heaps of 100 plates of 50 cm by 50 cm by 2 cm that fall on the ground: do they rest within 25 s, and is any below the ground?"""
    yield from heaps_at_rest(shop, "plate")


@long_case
@by_default
def continuous_heaps(shop):
    """Heaps of 30 rods, plates, bowls or rings with --continuous, five of a kind for each seed: do runs fail, and does energy grow?"""
    seconds = 1 if shop.quick else 4
    seeds = [1] if shop.quick else [10 * seed + i for seed in shop.seeds for i in range(5)]
    for mesh in SPACING:
        run, failed, wild, gains = shop.simulate(strewn(mesh, 3, 30, 1), 1 / 60, continuous=True), [], [], {}
        height = run.position[0, :, 2].mean()
        for seed in seeds:
            try:
                run = shop.simulate(strewn(mesh, 3, 30, seed), seconds, every=1 / 60, continuous=True)
            except tools.ToolFailed as failure:
                print(f"continuous_heaps: {mesh}, seed {seed}: {failure}", flush=True)
                failed.append(seed)
                continue
            gain = run.energy_gain(seconds)
            gains[gain if math.isfinite(gain) else math.inf] = seed
            wild += [] if np.isfinite(run.position).all() and np.isfinite(run.orientation).all() else [seed]
        variant, worst = f"{len(seeds)} heaps", max(gains, default=math.inf)
        yield row(variant, run, "runs that fail", "", len(failed), mesh, 0, "closed form: none", limit=0)
        yield row(variant, run, "runs with a coordinate that is not finite", "", len(wild), mesh, 0, "closed form: none", limit=0)
        yield row(variant, run, "energy gain, largest", "m of lift", worst, mesh, 0.0, "closed form: none", limit=0.01 * height) | {"seed": gains.get(worst, "")}


# ---- Rolling ----

@open_case
@by_default
def rolling(shop):
    """Fine balls that roll on a level plane and down a slope of 10 degrees, without rolling resistance. They are meant as balls: their facets, within 0.1 mm of
    one, are smaller than the slop. As inelastic polyhedra they would lose speed at each edge, which the run with a short step shows."""
    radius, seconds, angle = 0.5, 2 if shop.quick else 5, math.radians(10)
    acceleration = 5 / 7 * GRAVITY * math.sin(angle)
    for mesh in ("sphere_20480",) if shop.quick else ("sphere_20480", "sphere_81920"):
        slope = rotation_about(Y, angle)
        level = Scene().slab().add(mesh, [-100, 3, radius - SLOP], velocity=(2, 0, 0), spin=(0, 2 / radius, 0))
        tilted = Scene().slab(slope).add(mesh, slope @ [-100, 3, radius - SLOP], slope)
        for variant, scene, way, closed in (("level, 2 m/s", level, 2.0 * seconds, "closed form: v t"),
                                            ("10 degrees", tilted, acceleration * seconds ** 2 / 2, "closed form: 5/7 g sin t^2 / 2")):
            run = shop.simulate(scene, seconds, rolling_resistance=0)
            distance = run.drift()[-1]
            yield row(variant, run, "distance", "m", distance, mesh, way, closed, relative=True, limit=0.01)
            if not shop.quick:
                fine = shop.simulate(scene, seconds, rolling_resistance=0, dt=1 / 1920)
                yield row(variant, run, "distance, of a polyhedron", "m", distance, mesh, fine.drift()[-1], "run at dt 1/1920", relative=True)


@case
@by_default
def coin(shop):
    """A coin that rolls steadily without rolling resistance: on the spot (Euler's disk) or in a circle. How fast its axis goes round, in the first turn."""
    mass, inertia, _ = properties(shop, "coin")
    radius, half = COIN
    across, along = inertia[0, 0], inertia[2, 2]
    for variant, degrees, pace in (("Euler's disk, 30 degrees", 30, None), ("rolling, 70 degrees, 1.2 rad/s", 70, 1.2)):
        # The coin's axis n, the way e down the coin's side to the point that touches, and n x e. What turns the angular momentum is the
        # moment of gravity and of the force that keeps the centre on its circle; the spin along e is -pace sin.
        sine, cosine = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
        n, e = np.array([-sine, 0, cosine]), np.array([-cosine, 0, -sine])
        lever, gravity = radius * sine + half * cosine, mass * GRAVITY * (radius * cosine - half * sine)
        of_square = sine * (across * cosine + mass * half * lever)
        if pace is None:  # the centre rests
            spin = half * sine / radius
            pace = math.sqrt(gravity / (of_square - spin * (along * sine + mass * radius * lever)))
            spin *= pace
        else:
            spin = (of_square * pace ** 2 - gravity) / (pace * (along * sine + mass * radius * lever))
        omega = spin * n - pace * sine * e
        down = radius * e - half * n
        scene = Scene().slab().add("coin", [3, 5, -down[2] - SLOP], np.stack([np.cross(n, e), -e, n], axis=1),
                                 velocity=-np.cross(omega, down), spin=omega)
        run = shop.simulate(scene, 0.5 if shop.quick else 2 * math.pi / pace, every=1 / 60, rolling_resistance=0)
        yield row(variant, run, "precession", "rad/s", rate(run, turning(run, 2)), "coin", pace, "closed form: steady rolling", relative=True, limit=0.1)


# ---- Spinning ----

@case
@by_default
def flip(shop):
    """A free box with three different moments, spun about the middle axis and a thousandth as fast about the others: when it first lies on its side."""
    squares = np.square(BOXES["uneven"])
    moments = squares.sum() - squares

    def change(_, state):
        w, up = state.reshape(2, 3)
        return np.concatenate([np.cross(moments * w, w) / moments, np.cross(up, w)])

    def side(_, state):
        return state[4]
    side.terminal = True
    for speed in (6, 20):
        spin = speed * np.array([1e-3, 1, 1e-3])
        reference = solve_ivp(change, (0, 10), np.concatenate([spin, Y]), method="DOP853", events=side, rtol=1e-12, atol=1e-14).t_events[0][0]
        run = shop.simulate(Scene().add("uneven", [0, 0, 0], spin=spin), reference + 1, every=1 / 60, gravity=0.0)
        up = axis_of(run, 1)[:, 1]
        after = int((up < 0).argmax())
        time = (after - up[after] / (up[after] - up[after - 1])) * run.dt if after else math.inf
        yield row(f"{speed} rad/s", run, "time of the first flip", "s", time, "uneven", reference, "integration with rtol 1e-12", relative=True, limit=0.02)


@case
@by_default
def fast_spin(shop):
    """Free bodies spun fast about a slanted axis: how much their kinetic energy changes in 2 s."""
    axis = np.array([1, 0.3, 0.1]) / np.linalg.norm([1, 0.3, 0.1])
    for mesh in ("rod", "plate", "ring"):
        for speed in (30,) if shop.quick else (10, 30, 100, 300):
            run = shop.simulate(Scene().add(mesh, [0, 0, 0], spin=speed * axis), 2, gravity=0.0)
            start = speed ** 2 / 2 * axis @ run.inertia[0] @ axis
            change = run.frames["kinetic_energy"] / start - 1
            yield row(f"{speed} rad/s", run, "kinetic energy, change", "relative", change[np.abs(change).argmax()], mesh, 0.0, "closed form: kept", limit=0.01)


@open_case
@by_default
def top(shop):
    """A top that leans by 20 degrees and stands on its point, started in steady precession without rolling resistance: how fast its axis goes round."""
    mass, inertia, centre = properties(shop, "top")
    arm, lean = centre[2], math.radians(20)
    axis = np.array([math.sin(lean), 0, math.cos(lean)])
    across, along = inertia[0, 0] + mass * arm ** 2, inertia[2, 2]
    for spin in (200,) if shop.quick else (20, 50, 100, 200):
        # The slower root of pace^2 (across - along) cos - pace along spin' + m g arm = 0, where spin' is relative to the frame that precesses.
        pace = np.roots([across * math.cos(lean), -along * spin, mass * GRAVITY * arm]).min()
        omega = spin * axis + pace * (Z - math.cos(lean) * axis)
        turned = rotation_about(Y, lean)
        scene = Scene().slab().add("top", [3, 5, -SLOP], turned, velocity=np.cross(omega, arm * axis), spin=omega)
        run = shop.simulate(scene, 1 if shop.quick else 3, every=1 / 60, rolling_resistance=0)
        lean_now = np.degrees(np.arccos(np.clip(axis_of(run, 2)[:, 2], -1, 1)))
        yield row(f"{spin} rad/s", run, "precession", "rad/s", rate(run, turning(run, 2)), "top", pace, "closed form: m g l / (I w), steady", relative=True,
                  limit=0.1)
        yield row(f"{spin} rad/s", run, "lean at the end", "degrees", lean_now[-1], "top", 20.0, "closed form: stays")


# ---- Machines ----

@open_case
@by_default
def thread(shop):
    """Nuts of 30 cm and of 2 cm that sink along a bolt with a steep thread, without friction: how much they turn for their way, and how fast they get."""
    seconds = 0.5 if shop.quick else 1.2
    for mesh in ("nut", "thin_nut"):
        mass, inertia, _ = properties(shop, mesh)
        scene = Scene().add("bolt", [0, 0, 0], fixed=True).add(mesh, [0, 0, 2])
        run = shop.simulate(scene, seconds, every=1 / 60, friction=0.0, rolling_resistance=0)
        sunk = run.position[0, 0, 2] - run.position[-1, 0, 2]
        closed = GRAVITY / (1 + inertia[2, 2] / mass * (2 * math.pi / LEAD) ** 2)
        yield row("lead 0.5 m", run, "turns for the way", "of the thread's", -turning(run, 0)[-1] * LEAD / (2 * math.pi * sunk), mesh, 1.0,
                  "closed form: way / lead", limit=0.02)
        yield row("lead 0.5 m", run, "acceleration", "m/s^2", 2 * sunk / seconds ** 2, mesh, closed, "closed form: g / (1 + I (2 pi / lead)^2 / m)",
                  relative=True, limit=0.05)


@open_case
@by_default
def gears(shop):
    """A gear that turns at 3 rad/s drives its like, which lies on the ground around a fixed pin, with friction: how far the second turns for the first."""
    seconds = 1 if shop.quick else 5
    scene = Scene().slab().add("pin", [2 * PITCH, 0, 0], fixed=True)
    scene.add("gear", [0, 0, -SLOP], fixed=KINEMATIC, spin=(0, 0, 3)).add("gear", [2 * PITCH, 0, -SLOP], rotation_about(Z, math.pi / TEETH))
    run = shop.simulate(scene, seconds, every=1 / 60)
    yield row("3 rad/s", run, "turning", "of the first gear's", turning(run, 0)[-1] / (3 * seconds), "gear", -1.0, "closed form: teeth", limit=0.01)
    yield row("3 rad/s", run, "way of its centre, largest", "m", run.drift().max(), "gear", limit=5e-3)


# ---- Bouncing ----

@case
@by_default
def bounce(shop):
    """Balls and boxes dropped from 1 m, four whose impacts come at other parts of a step: the first bounce of the one that errs most, and by how much five
    bounces without loss exceed the start. Turned and spinning ones: by how much their energy does."""
    # A drop that is higher by the way of a quarter of a step at the end comes down a quarter of a step later.
    heights = 1 + np.arange(4) / 4 / 60 * math.sqrt(2 * GRAVITY)
    places = [np.array([3 * i + 0.3, 5, 0.5 + height]) for i, height in enumerate(heights)]
    seconds, random = 1.2 if shop.quick else 5.2, np.random.default_rng(1)
    for mesh in ("sphere_1280", "box_12"):
        for restitution in (1.0, 0.8):
            scene = Scene().slab()
            for place in places:
                scene.add(mesh, place)
            run = shop.simulate(scene, seconds, every=1 / 60, restitution=restitution)
            bounces = []
            for height in (run.position[..., 2] - 0.5).T / heights[:, None]:
                after = height[(np.diff(height) > 0).argmax():]
                bounces.append((after[:(np.diff(after) < 0).argmax() + 1].max() / restitution ** 2, after.max()))
            first, highest = np.array(bounces).T
            yield row(f"restitution {restitution}", run, "first bounce", "of e^2 h", first[np.abs(first - 1).argmax()], mesh, 1.0, "closed form: e^2 h", limit=0.02)
            if restitution == 1:
                yield row("restitution 1.0", run, "bounces, above the start", "of h", max(0.0, highest.max() - 1), mesh, 0.0, "closed form: none", limit=1e-3)
        scene = Scene().slab()
        for place in places:
            scene.add(mesh, place + 0.5 * Z, random_rotation(random), spin=(0, 3, 0))
        run = shop.simulate(scene, seconds, restitution=1.0)
        energy = run.frames["kinetic_energy"] + run.frames["potential_energy"]
        yield row("restitution 1.0, turned", run, "energy, above the start", "m of lift", (energy.max() - energy[0]) / (run.mass.sum() * GRAVITY), mesh, 0.0,
                  "closed form: none", limit=0.01)
