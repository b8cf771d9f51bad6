"""tandem.dask: any number of workers gives the same bytes, and what is lost on the way costs time or is named."""
import errno
import os
import importlib.util
import pickle
import re
import resource
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

import tandem
from meshes import read_obj

distributed = pytest.importorskip("distributed")
import cloudpickle  # noqa: E402  what distributed needs
import dask.config  # noqa: E402
import tandem.dask  # noqa: E402
from tandem import jobs  # noqa: E402

ASSETS = Path(os.environ["TANDEM_SOURCE_DIR"]) / "assets"
cloudpickle.register_pickle_by_value(sys.modules[__name__])  # workers cannot import the tests


BLOCKS = re.findall(r"^```python\n(.*?)^```\n```\n(.*?)^```\n", (ASSETS.parent / "docs/clusters.md").read_text(), re.MULTILINE | re.DOTALL)


def local_cluster(workers):
    return distributed.LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=":0", silence_logs=50)


@pytest.fixture(scope="module")
def client():
    with local_cluster(2) as cluster, distributed.Client(cluster) as client:
        yield client


def write_obj(path, vertices, faces):
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()] + [f"f {a} {b} {c}" for a, b, c in (np.asarray(faces) + 1).tolist()]
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture(scope="module")
def meshes(tmp_path_factory):
    """24 cows of 6,000 triangles, each with other noise."""
    folder = tmp_path_factory.mktemp("meshes")
    vertices, faces = read_obj(ASSETS / "cow.obj")
    random = np.random.default_rng(1)
    for number in range(24):
        write_obj(folder / f"cow_{number}.obj", vertices * random.uniform(0.5, 2) + random.normal(scale=1e-3, size=vertices.shape), faces)
    return sorted(map(str, folder.glob("*.obj")))


@pytest.fixture(scope="module")
def expected(meshes, tmp_path_factory):
    """The bytes of each mesh's .bvh file, by the name of the file, made by one process."""
    folder = tmp_path_factory.mktemp("expected")
    for mesh in meshes:
        jobs.build_file(mesh, folder)
    return contents(folder)


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """300 cows and boxes that meet, some of them fixed."""
    folder = tmp_path_factory.mktemp("scene")
    files = [jobs.build_file(ASSETS / f"{name}.obj", folder).file for name in ("cow_1500", "cow", "box_192")]
    random = np.random.default_rng(2)
    motion = np.where(np.arange(300) % 10 < 8, tandem.FIXED, tandem.MOVING)
    return jobs.FileScene(files, asset=np.arange(300) % 3, rotation=tandem.rotations(xyzw=random.normal(size=(300, 4))), translation=random.uniform(-3, 3, (300, 3)),
                          filter=tandem.Filter(motion=motion, excluded=[[0, 8]]))


@pytest.fixture(scope="module")
def asked_once(scene):
    return plain(scene).contacts()


def plain(scene):
    return tandem.Scene([tandem.Asset.load(file.path) for file in scene.files], scene.instances, filter=scene.filter)


def poses_of(scene, count):
    """Configurations of which some are free."""
    random = np.random.default_rng(3)
    poses = np.tile(np.eye(4), (count, len(scene.moving), 1, 1))
    poses[..., :3, 3] = random.uniform(-1, 1, (count, len(scene.moving), 3)) * np.geomspace(5, 300, count)[:, None, None]
    return poses


def assert_same(found, wanted):
    assert found.pairs.tobytes() == wanted.pairs.tobytes() and found.contacts.tobytes() == wanted.contacts.tobytes() and found.counters == wanted.counters


def contents(folder):
    return {path.name: path.read_bytes() for path in Path(folder).iterdir()}


def at_first_answer(monkeypatch, name, act):
    """Lets tandem.dask act once, in the middle of the tasks of a name, when the first of them has an answer."""
    outcomes, left = tandem.dask._outcomes, [act]

    def acting(client, run, *rest):
        for outcome in outcomes(client, run, *rest):
            if run == name and left:
                left.pop()()
            yield outcome

    monkeypatch.setattr(tandem.dask, "_outcomes", acting)
    return left


def kill_one_worker(client):
    os.kill(next(iter(client.run(os.getpid).values())), signal.SIGKILL)


@pytest.mark.parametrize("workers", [1, 2, 4])
def test_any_number_of_workers_gives_the_same_bytes(workers, meshes, expected, scene, asked_once, tmp_path):
    poses = poses_of(scene, 40)
    alone = plain(scene)
    touching = []
    for pose in poses:
        alone.move(scene.moving, transform=pose)
        touching.append(alone.contacts().touching.tolist())
    with local_cluster(workers) as cluster, distributed.Client(cluster):
        library = tandem.dask.build(meshes, tmp_path / "library")
        found = tandem.dask.contacts(scene)
        blocked = tandem.dask.check(scene, poses)
        pairs = tandem.dask.check(scene, poses, pairs=True)
    assert (set(library.files), library.failures, len(library.built)) == (set(meshes), {}, len(meshes))
    assert contents(tmp_path / "library") == expected
    assert len(asked_once.contacts) > 10_000
    assert_same(found, asked_once)
    assert 0 < blocked.sum() < len(blocked) and blocked.tolist() == [len(rows) > 0 for rows in touching]
    assert pairs.tolist() == [(number, *pair, 0, 0) for number, rows in enumerate(touching) for pair in rows]


@pytest.mark.parametrize("options", [{"within": 0.02}, {"first_contact_only": True}, {"self_pairs": True, "leave_out_rings": 1}, {"mode": "boxes"},
                                     {"pairs": [[5, 2], [2, 5], [7, 7], [2, 5], [299, 0]]}, {"pairs": np.empty((0, 2), int)}])
def test_contacts_are_those_of_a_scene_with_any_options(client, scene, options):
    assert_same(tandem.dask.contacts(scene, client=client, **options), plain(scene).contacts(**options))


def test_a_killed_worker_costs_time_only(client, meshes, expected, scene, asked_once, tmp_path, monkeypatch):
    poses = poses_of(scene, 40)
    blocked = jobs.verdicts(scene, scene.configurations(poses))
    for name in ("read", "build"):
        left = at_first_answer(monkeypatch, name, lambda: kill_one_worker(client))
        assert tandem.dask.build(meshes, tmp_path / name, client=client).failures == {}
        assert not left and {file: data for file, data in contents(tmp_path / name).items() if file.endswith(".bvh")} == expected
    left = at_first_answer(monkeypatch, "contacts", lambda: kill_one_worker(client))
    assert_same(tandem.dask.contacts(scene, client=client), asked_once)
    assert not left
    left = at_first_answer(monkeypatch, "check", lambda: kill_one_worker(client))
    assert tandem.dask.check(scene, poses, client=client).tolist() == blocked.tolist()
    assert not left


class Deadly(distributed.WorkerPlugin):
    """Kills a worker that reads a mesh file of that name."""

    def setup(self, worker):
        read = tandem.jobs.read_mesh

        def deadly(path, **options):
            if os.path.basename(path) == "deadly.obj":
                os.kill(os.getpid(), signal.SIGKILL)
            return read(path, **options)

        tandem.jobs.read_mesh = deadly


def test_bad_meshes_are_named_and_stop_nothing(meshes, expected, tmp_path):
    bad = {"line.obj": "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "words.obj": "v 0 0 x\n", "deadly.obj": ""}
    for name, text in bad.items():
        (tmp_path / name).write_text(text)
    given = [meshes[0], tmp_path / "gone.obj", *(tmp_path / name for name in bad), *meshes[1:]]
    with dask.config.set({"distributed.scheduler.allowed-failures": 0}), local_cluster(2) as cluster, distributed.Client(cluster) as client:
        client.register_plugin(Deadly())
        library = tandem.dask.build(given, tmp_path / "library")
    assert set(library.files) == set(meshes) and contents(tmp_path / "library") == expected
    reasons = {Path(path).name: reason for path, reason in library.failures.items()}
    assert {name: reason.removeprefix(f"{tmp_path}/{name}: ") for name, reason in reasons.items()} == {
        "gone.obj": "no such file", "line.obj": reasons["line.obj"].removeprefix(f"{tmp_path}/line.obj: "), "words.obj": "line 1: 'x' is not a number",
        "deadly.obj": "workers died while they worked on it"}
    assert "triangle" in reasons["line.obj"]


def limit_files(size):
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))


def test_a_full_disk_on_one_worker_costs_nothing(client, meshes, expected, tmp_path):
    full = next(iter(client.scheduler_info()["workers"]))
    client.run(limit_files, 100_000, workers=[full])
    try:
        library = tandem.dask.build(meshes, tmp_path, client=client)
    finally:
        client.run(limit_files, resource.RLIM_INFINITY, workers=[full])
    assert library.failures == {} and contents(tmp_path) == expected


def test_a_full_disk_everywhere_is_named_and_can_be_gone_on_from(client, meshes, expected, tmp_path, monkeypatch):
    tandem.dask.build(meshes[:3], tmp_path, client=client)
    client.run(limit_files, 100_000)
    with monkeypatch.context() as here:
        here.setattr(tandem.Asset, "save", lambda self, path: (_ for _ in ()).throw(OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), path)))
        try:
            library = tandem.dask.build(meshes, tmp_path, client=client)
        finally:
            client.run(limit_files, resource.RLIM_INFINITY)
    assert list(library.files) == meshes[:3] and set(library.failures) == set(meshes[3:]) and not library.built
    assert all("File too large" in reason and "No space left" in reason for reason in library.failures.values())
    assert len(contents(tmp_path)) == 3  # nothing half-written
    library = tandem.dask.build(meshes, tmp_path, client=client)
    assert library.failures == {} and len(library.built) == len(meshes) - 3 and contents(tmp_path) == expected


@pytest.fixture
def processes(tmp_path):
    """A client of a scheduler and a worker, and the process of the scheduler."""
    file = tmp_path / "scheduler.json"
    words = [sys.executable, "-m"]
    with open(os.devnull, "w") as quiet:
        scheduler = subprocess.Popen([*words, "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", file], stderr=quiet)
        worker = subprocess.Popen([*words, "distributed.cli.dask_worker", "--scheduler-file", file, "--nthreads", "1", "--no-nanny", "--no-dashboard",
                                   "--death-timeout", "20"], stderr=quiet, cwd=tmp_path)
    try:
        with distributed.Client(scheduler_file=str(file), timeout=30, set_as_default=False) as client:
            client.wait_for_workers(1, timeout=30)
            yield client, scheduler
    finally:
        for process in (scheduler, worker):
            process.kill()
            process.wait()


def test_without_its_scheduler_a_build_names_what_is_missing(processes, meshes, expected, tmp_path, monkeypatch, client):
    lonely, scheduler = processes
    at_first_answer(monkeypatch, "build", scheduler.kill)
    library = tandem.dask.build(meshes, tmp_path / "library", client=lonely)
    assert set(library.files) | set(library.failures) == set(meshes) and not set(library.files) & set(library.failures)
    assert library.files and library.failures and "scheduler" in next(iter(library.failures.values()))
    assert all(Path(file).read_bytes() == expected[Path(file).name] for file in library.files.values())
    assert tandem.dask.build(meshes, tmp_path / "library", client=lonely).files == {}
    assert tandem.dask.build(meshes, tmp_path / "library", client=client).failures == {}
    assert contents(tmp_path / "library") == expected


def test_without_its_scheduler_a_question_names_what_is_missing(processes, scene, asked_once, monkeypatch):
    lonely, scheduler = processes
    at_first_answer(monkeypatch, "contacts", scheduler.kill)
    with pytest.raises(tandem.dask.Incomplete, match="object pairs have no answer: .*scheduler") as caught:
        tandem.dask.contacts(scene, client=lonely)
    error = pickle.loads(pickle.dumps(caught.value))
    assert 0 < len(error.missing) < len(asked_once.pairs)
    assert sorted([*error.missing.tolist(), *error.found.pairs.tolist()]) == asked_once.pairs.tolist()
    rest = plain(scene).contacts(pairs=error.missing)
    assert sorted(told(error.found) + told(rest)) == sorted(told(asked_once))
    with pytest.raises(tandem.dask.Incomplete, match="^3 configurations have no answer") as caught:
        tandem.dask.check(scene, poses_of(scene, 3), client=lonely)
    assert caught.value.missing.tolist() == [0, 1, 2] and len(caught.value.found) == 0


def told(found):
    """Contacts by the numbers of their bodies."""
    return [(*found.pairs[row["pair"]].tolist(), *row.tolist()[1:]) for row in found.contacts]


def test_equal_meshes_are_built_once_and_sound_files_are_kept(client, meshes, expected, tmp_path):
    copy = shutil.copy(meshes[0], tmp_path / "copy.obj")
    library = tandem.dask.build([*meshes, copy], tmp_path / "library", client=client)
    assert len(library.built) == len(meshes) and library.files[str(copy)] == library.files[meshes[0]]
    cut, exchanged, kept = (Path(library.files[mesh]) for mesh in meshes[:3])
    os.truncate(cut, 5000)
    shutil.copy(kept, exchanged)
    before = kept.stat()
    again = tandem.dask.build(meshes, tmp_path / "library", client=client)
    assert again.built == sorted([str(cut), str(exchanged)]) and contents(tmp_path / "library") == expected
    assert (kept.stat().st_mtime_ns, kept.stat().st_ino) == (before.st_mtime_ns, before.st_ino)


def test_options_have_files_of_their_own(client, meshes, tmp_path):
    one, other = (tandem.dask.build(meshes[:2], tmp_path, client=client, **options) for options in ({}, {"effort": "fast", "refit": False}))
    assert len({*one.files.values(), *other.files.values()}) == 4
    asset = tandem.Asset.load(other.files[meshes[0]])
    mesh = tandem.read_mesh(meshes[0])
    assert asset.provenance["options"]["effort"] == "fast" and asset.source_vertices == 0
    built = tandem.build(mesh.vertices, mesh.triangles, face_ids=mesh.face_ids, parts=mesh.parts, effort="fast", refit=False, provenance=asset._core.provenance().decode())
    assert bytes(asset) == bytes(built)
    for wrong in ({"effort": "most"}, {"imaginary_share": 2}, {"levels": "no"}):
        with pytest.raises((ValueError, tandem.Error)):
            tandem.dask.build(meshes[:1], tmp_path, client=client, **wrong)


def test_a_file_that_has_changed_is_no_asset_of_the_scene(client, tmp_path):
    file = Path(jobs.build_file(ASSETS / "box_12.obj", tmp_path).file)
    scene = jobs.FileScene([file], translation=[[0, 0, 0], [0.5, 0, 0]])
    os.replace(jobs.build_file(ASSETS / "box_48.obj", tmp_path).file, file)
    with pytest.raises(tandem.dask.Incomplete, match="has the hash"):
        tandem.dask.contacts(scene, client=client)
    assert len(tandem.dask.contacts(jobs.FileScene([file], scene.instances), client=client).contacts) > 0


def test_levels_of_detail(tmp_path, client):
    pytest.importorskip("tandem._bvhbuild")
    file = jobs.build_file(ASSETS / "cow.obj", tmp_path, jobs.BuildOptions(effort="fast", levels="auto")).file
    scene = jobs.FileScene([file, jobs.AssetFile(file, "", 2)], asset=[0, 1, 1], translation=[[0, 0, 0], [0.3, 0, 0], [0.5, 0, 0]])
    whole = tandem.Asset.load(file)
    wanted = tandem.Scene([whole, whole.levels_from(2, 1)], scene.instances).contacts()
    assert len(wanted.contacts) and len(whole.levels) > 2
    assert_same(tandem.dask.contacts(scene, client=client), wanted)


def test_slices_cover_all_pairs_in_order(scene, asked_once):
    for count in (1, 7, 100_000):
        slices = jobs.divide(scene, count)
        assert len(slices) <= count and np.concatenate([part.scene_pairs for part in slices]).tobytes() == asked_once.pairs.tobytes()
        assert all(len(part.pairs) and len(part.bodies) == len(part.instances) and max(part.instances["asset"]) + 1 == len(part.files) for part in slices)
        if count < 10:
            assert_same(jobs.join([jobs.ask(pickle.loads(pickle.dumps(part))) for part in slices]), asked_once)
    assert jobs.divide(scene, 3, pairs=np.empty((0, 2), int)) == [] and len(jobs.join([]).pairs) == 0


def test_wrong_arguments_are_named(scene, client):
    poses = poses_of(scene, 3)
    with pytest.raises(ValueError, match="poses has shape"):
        scene.configurations(poses[:, 1:])
    with pytest.raises(ValueError, match="poses has shape"):
        scene.configurations(tandem.instances(translation=np.zeros((3, 3))))
    poses[1, 4, :3, :3] *= 2
    with pytest.raises(tandem.Error, match="configuration 1, body 28: a pose is not") as caught:
        tandem.dask.check(scene, poses, client=client)
    assert caught.value.where == 1
    with pytest.raises(ValueError, match="pairs: row 1 is"):
        jobs.divide(scene, 2, pairs=[[0, 1], [0, 300]])
    with pytest.raises(ValueError, match="mode"):
        tandem.dask.contacts(scene, mode="most", client=client)
    with pytest.raises(tandem.Error, match="instance 0"):
        jobs.FileScene(scene.files, rotation=2 * np.eye(3))
    with pytest.raises(tandem.FileError):
        jobs.FileScene(["/usr/gone.bvh"], translation=[0, 0, 0])
    assert len(tandem.dask.check(scene, poses[:0], client=client)) == 0


def test_threads_of_a_worker_have_scenes_of_their_own(scene):
    rows = scene.configurations(poses_of(scene, 8))
    wanted, found = jobs.verdicts(scene, rows).tolist(), {}
    threads = [threading.Thread(target=lambda number: found.update({number: jobs.verdicts(scene, rows).tolist()}), args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == {number: wanted for number in range(4)}


def test_filters_pickle():
    filter = tandem.Filter(motion=[0, 1, 0], group=[1, 2, 3], mask=[3, 2, 1], excluded=[[0, 2]])
    triangle = tandem.build([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    for kept in (filter, tandem.Filter(excluded=[[0, 1]]), tandem.Filter()):
        scenes = [tandem.Scene([triangle], translation=np.zeros((3, 3)), filter=one) for one in (kept, pickle.loads(pickle.dumps(kept)))]
        assert scenes[0].pairs().tolist() == scenes[1].pairs().tolist()


@pytest.mark.parametrize("number", range(3))
def test_programs_of_the_page_print_what_it_says(number, tmp_path):
    code, shown = BLOCKS[number]
    if "import ray" in code and not importlib.util.find_spec("ray"):
        pytest.skip("ray is not installed")
    (tmp_path / "program.py").write_text(code)
    done = subprocess.run([sys.executable, tmp_path / "program.py"], capture_output=True, text=True, cwd=ASSETS.parent)
    assert (done.returncode, done.stdout) == (0, shown), done.stderr
