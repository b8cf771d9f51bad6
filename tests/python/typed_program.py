"""Uses everything that the package has, as types allow: mypy --strict checks it, and it runs. It is no test by itself."""
from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import numpy.typing as npt

import tandem

VERTICES: npt.NDArray[np.float64] = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
FACES = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]


def assets(folder: Path) -> list[tandem.Asset]:
    shares: list[float] = []
    made, report = tandem.build(VERTICES, FACES, effort="best", threads=2, gpu_blocks=True, topology=True, imaginary_share=0.5, face_ids=range(12),
                                parts=[("box", "", 12)], provenance="{}", progress=shares.append, return_report=True)
    count: int = report.degenerate
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


def ask(query: tandem.Query) -> None:
    rows = tandem.instances(asset=[0, 1], rotation=np.eye(3), translation=[[0.0, 0.0, 0.0], [0.5, 0.25, 0.125]])
    filter = tandem.Filter(motion=[tandem.MOVING, tandem.FIXED], group=[1, 1], mask=[1, 1], excluded=[[0, 0]])
    contacts: tandem.Contacts = query.contacts(rows, mode="exact", first_contact_only=False, self_pairs=False, within=0.0, add_error_bounds=False, filter=filter,
                                               threads=1)
    work: tandem.Counters = contacts.counters
    faces: npt.NDArray[np.uint32] = contacts.contacts["face_a"]
    manifolds: tandem.Manifolds = query.manifolds(most_points=4, match_previous=False)
    query.contacts(rows)
    contained: tandem.Contained = query.contained()
    distances: tandem.Distances = query.distances(rows, reach=1.0, absolute_tolerance=1e-9, relative_tolerance=1e-9, former=np.zeros(0, tandem.FORMER))
    impacts: tandem.Impacts = query.impacts(rows, np.zeros(2, tandem.MOTION), 1.0, tolerance=1e-5)
    verdicts: tandem.Verdicts = query.verdicts(rows, tolerance=0.1, pairs=[[0, 1]])
    query.keep_fixed(rows, [tandem.MOVING, tandem.FIXED])
    print(work.contacts, faces.max(), len(manifolds.manifolds), len(manifolds.points), len(contained.contained), distances.distances["upper"],
          impacts.impacts["status"], verdicts.verdicts["verdict"], len(query.pairs(rows)))
    try:
        query.contacts(transform=np.zeros((2, 4, 4)))
    except ValueError as error:
        print(error)
    try:
        query.contacts(asset=[0, 2])
    except tandem.Error as error:
        status: int = error.status
        where: int | None = error.where
        subject: str | None = error.subject
        print(status, error.name, where, subject)


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        ask(tandem.Query(assets(Path(folder)), threads=1))
    try:
        mesh: tandem.Mesh = tandem.read_mesh("nowhere.obj")
        print(mesh.vertices.shape, mesh.triangles.shape, mesh.face_ids.shape, mesh.parts, mesh.remarks)
    except (tandem.FileError, ImportError) as error:
        print(error)


if __name__ == "__main__":
    main()
