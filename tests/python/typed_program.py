"""Uses everything that the package has, as types allow: mypy --strict checks it, and it runs. It is no test by itself."""
from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import numpy.typing as npt

import tandem
import tandem.gradients

VERTICES: npt.NDArray[np.float64] = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
FACES = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]


class Turn:
    def as_matrix(self) -> npt.NDArray[np.float64]:
        return np.eye(3)


class Box:
    vertices = VERTICES
    faces = FACES


def assets(folder: Path) -> list[tandem.Asset]:
    shares: list[float] = []
    made, report = tandem.build(VERTICES, FACES, effort="best", threads=2, gpu_blocks=True, topology=True, refit=True, imaginary_share=0.5, face_ids=range(12),
                                parts=[("box", "", 12)], provenance="{}", progress=shares.append, return_report=True)
    count: int = report.degenerate
    same: tandem.Asset = tandem.build(Box(), effort="fast")
    print(same)
    assert count == 0
    made.save(folder / "box.bvh")
    loaded: tandem.Asset = tandem.Asset.load(folder / "box.bvh", access="read", check="quick")
    whole = tandem.Asset.from_bytes(bytes(loaded), check="full").levels_from(0, 1)
    level: tandem.Level = whole.levels[whole.coarsest_level(0.1)]
    part: tandem.Part = whole.parts[0]
    corners: npt.NDArray[np.float64] = whole.triangles(0)
    faces: npt.NDArray[np.uint32] = whole.faces()
    print(level.triangle_count, part.name, corners.shape, faces.shape, whole.bounds.tolist(), whole.origin + 0.0, whole.rounding_error, whole.hash,
          whole.file_bytes, whole.source_faces, whole.provenance, len(whole.data), sorted(whole.statistics()))
    return [loaded, whole]


def ask(scene: tandem.Scene) -> None:
    rows = tandem.instances(asset=[0, 1], rotation=np.eye(3), translation=[[0.0, 0.0, 0.0], [0.5, 0.25, 0.125]])
    filter = tandem.Filter(motion=[tandem.MOVING, tandem.FIXED], group=[1, 1], mask=[1, 1], excluded=[[0, 0]])
    scene.threads = 2
    contacts: tandem.Contacts = scene.place(rows, filter=filter).contacts(mode="exact", first_contact_only=False, self_pairs=False, within=0.0,
                                                                          add_error_bounds=False, leave_out_rings=1)
    work: tandem.Counters = contacts.counters
    touching: npt.NDArray[np.void] = contacts.touching
    faces: npt.NDArray[np.uint32] = contacts.contacts["face_a"]
    manifolds: tandem.Manifolds = scene.manifolds(most_points=4, match_previous=False)
    contained: tandem.Contained = scene.contained()
    distances: tandem.Distances = scene.distances(reach=1.0, absolute_tolerance=1e-9, relative_tolerance=1e-9, former=np.zeros(0, tandem.FORMER))
    impacts: tandem.Impacts = scene.impacts(np.zeros(2, tandem.MOTION), 1.0, tolerance=1e-5)
    verdicts: tandem.Verdicts = scene.verdicts(tolerance=0.1, pairs=[[0, 1]])
    signed: tandem.gradients.SignedDistances = tandem.gradients.signed_distances(scene, pairs=[[0, 1]], reach=1.0)
    print(signed.pairs["a"], signed.distances["gradient_a"].shape, signed.distances["kind"] == tandem.gradients.OVERLAPPING)
    body: int = scene.add(1, translation=[0.0, 0.0, 0.25], motion=tandem.KINEMATIC, group=1, mask=1)
    scene.move(body, rotation=np.eye(3))
    scene.move(body, rotation=Turn())
    scene.move([0, body], rows)
    scene.set_motion(body, tandem.MOVING)
    scene.remove(body)
    bodies: npt.NDArray[np.void] = scene.instances
    print(work.contacts, touching["a"], faces.max(), len(manifolds.manifolds), len(manifolds.points), len(contained.contained), distances.distances["upper"],
          impacts.impacts["status"], verdicts.verdicts["verdict"], len(scene.pairs(reach=0.5)), len(bodies))
    try:
        scene.place(transform=np.zeros((2, 4, 4)))
    except ValueError as error:
        print(error)
    try:
        scene.place(asset=[0, 2])
    except tandem.Error as error:
        status: int = error.status
        where: int | None = error.where
        subject: str | None = error.subject
        print(status, error.name, where, subject)


def simulate(assets: list[tandem.Asset]) -> None:
    filter = tandem.Filter(motion=[tandem.FIXED, tandem.MOVING])
    world = tandem.World(assets, asset=[0, 1], rotation=Turn(), translation=[[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]], filter=filter, density=500, velocity=np.zeros(3),
                         angular_velocity=[0, 0, 1], gravity=(0, 0, -1), friction=0.1, restitution=0.5, slop=None, rolling_resistance=0.0, substeps=4,
                         sleeping=True, continuous=True, threads=2)
    world.set_force(1, [0, 0, 5], torque=np.zeros(3))
    pairs: list[tuple[int, int]] = world.touching[["a", "b"]].tolist() + world.began[["a", "b"]].tolist() + world.ended.tolist()
    broken: list[int] = world.broken.tolist()
    assert not pairs and not broken
    joint: int = world.add_joint(tandem.Joint("ball", None, 1, anchor=(0.0, 0.0, 2.0), breaking_force=1e3, breaking_torque=None))
    world.remove_joint(joint)
    world.set_material(1, friction=0.2, rolling_resistance=None)
    world.set_gravity_scale(1, 0.5)
    state: tandem.WorldState = world.save()
    world.step(1 / 60, steps=10)
    world.push(1, [0, 0, 1], at=np.zeros(3))
    world.move(1, translation=[0, 0, 3], velocity=[0, 0, 0], angular_velocity=[0, 0, 0])
    world.restore(state)
    rotation: npt.NDArray[np.float64] = world.rotation
    sleeping: npt.NDArray[np.bool_] = world.sleeping
    bodies: npt.NDArray[np.void] = world.bodies
    time: float = world.time
    print(rotation.shape, sleeping.any(), bodies["centre"], time, world.translation, world.velocity, world.angular_velocity, world.mass, len(world.contacts))
    print(world.place(world.instances, filter=filter, density=[1, 2]).time, tandem.BODY_MOTION, tandem.WORLD_CONTACT)


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        made = assets(Path(folder))
        ask(tandem.Scene(made, threads=1))
        simulate(made)
    try:
        mesh: tandem.Mesh = tandem.read_mesh("nowhere.obj")
        print(mesh.vertices.shape, mesh.triangles.shape, mesh.face_ids.shape, mesh.parts, mesh.remarks)
    except (tandem.FileError, ImportError) as error:
        print(error)


if __name__ == "__main__":
    main()
