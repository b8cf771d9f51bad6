"""tandem.cuda: what it finds is what the CPU finds, from and to the arrays of PyTorch, CuPy and JAX, without a copy. Skipped where there is no GPU."""
import contextlib
import ctypes
import doctest
import gc
import os
import re
import subprocess
import sys
import threading
import weakref
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import tandem
from fakes import Interface, OwnStream, Producer
from meshes import BOX_FACES, BOX_VERTICES, read_obj

os.environ.setdefault("XLA_PYTHON_CLIENT_PREALLOCATE", "false")  # JAX would take most of the GPU's memory
cuda = pytest.importorskip("tandem.cuda", exc_type=ImportError)
ROOT = Path(os.environ["TANDEM_SOURCE_DIR"])
COUNT = 60


def has_gpu():
    try:
        cuda.Query([])
    except tandem.Error as error:
        assert error.name == "NoGpu"
        return False
    return True


GPU = has_gpu()
needs_gpu = pytest.mark.skipif(not GPU, reason="there is no GPU")


def rotations(random, count):
    w, x, y, z = (q := random.normal(size=(4, count))) / np.linalg.norm(q, axis=0)
    rows = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]
    return np.moveaxis(np.array(rows), 2, 0)


def make_scene(seed=1, count=COUNT):
    random = np.random.default_rng(seed)
    pose = np.concatenate([rotations(random, count), 2.5 * random.random((count, 1, 3))], axis=1)
    return random.integers(0, 3, count).astype(np.uint32), np.ascontiguousarray(pose)


def cpu_instances(asset, pose):
    return tandem.instances(asset, pose[:, :3], pose[:, 3])


@pytest.fixture(scope="module")
def assets():
    cow = tandem.build(*read_obj(ROOT / "assets/cow_1500.obj"), effort="fast")
    return [tandem.build(BOX_VERTICES, BOX_FACES), cow, tandem.build(0.2 * BOX_VERTICES + 0.4, BOX_FACES)]


@pytest.fixture
def torch():
    return pytest.importorskip("torch")


@pytest.fixture
def posed(assets, torch):
    """A query, and the scene as its instances."""
    asset, pose = make_scene()
    query = cuda.Query(assets)
    return query, query.instances(torch.from_numpy(asset).cuda(), torch.from_numpy(pose).cuda())


def test_arrays_are_given_back_once_whether_taken_or_refused():
    stream = cuda._stream(None)
    taken = Producer((0, 2), (2, 1))
    pairs = cuda._cuda.Pairs(taken, stream, 0)
    assert len(pairs) == 0 and taken.given_back == 0
    del pairs
    assert taken.given_back == 1
    for error, words, refused in ((ValueError, "pairs is not contiguous", Producer((5, 2), (1, 5))), (ValueError, "pairs has shape", Producer((5, 3), (3, 1))),
                                  (TypeError, "pairs is float32", Producer((5, 2), (2, 1), code=2))):
        with pytest.raises(error, match=words):
            cuda._cuda.Pairs(refused, stream, 0)
        assert refused.given_back == 1


def test_array_interfaces_are_not_believed_too_far():
    stream = cuda._stream(None)
    for told in ({}, {"typestr": "<i4"}, {"strides": (8, 4)}, {"mask": None}):
        assert len(cuda._cuda.Pairs(Interface(**told), stream, 0)) == 0
    for kind in ("|b1", "<c8", "<V4", "|O8", ">u4", "<u", "<f16", "<u3", "u4", "<\x004", "<u\x00"):
        with pytest.raises(TypeError, match="pairs has elements"):
            cuda._cuda.Pairs(Interface(typestr=kind), stream, 0)
    for words, told in ((r"pairs has shape \(-1, 2\)", {"shape": (-1, 2)}), ("pairs has a mask", {"mask": Interface()}), ("pairs has 1 strides", {"strides": (4,)}),
                        ("pairs has 3 strides", {"strides": (8, 4, 4)}), ("pairs is not contiguous", {"shape": (3, 2), "strides": (4, 12)})):
        with pytest.raises(ValueError, match=words):
            cuda._cuda.Pairs(Interface(**told), stream, 0)


def test_a_filter_names_what_is_wrong_with_excluded_pairs():
    box = tandem.build(BOX_VERTICES, BOX_FACES)
    for error, words, excluded in ((TypeError, "^excluded: Asset is given", box), (ValueError, "^excluded: row 1 is not", [[0, 1], [0, -1]]),
                                   (ValueError, r"^excluded has shape \(2,\)", [0, 1])):
        with pytest.raises(error, match=words):
            cuda.Filter(excluded=excluded)


def test_a_stream_keeps_its_object():
    own = OwnStream(7)
    lives, kept = weakref.ref(own), cuda._stream(own)
    del own
    gc.collect()
    assert lives() is not None
    del kept
    gc.collect()
    assert lives() is None


def of_torch(torch):
    return SimpleNamespace(put=lambda array: torch.from_numpy(array).cuda(), take=torch.from_dlpack, pointer=lambda array: array.data_ptr(),
                           cpu=lambda array: array.cpu().numpy(), takes_strides=True)


def of_cupy(cupy):
    return SimpleNamespace(put=cupy.asarray, take=cupy.from_dlpack, pointer=lambda array: array.data.ptr, cpu=lambda array: array.get(), takes_strides=True)


def of_jax(jax):
    jax.config.update("jax_enable_x64", True)
    return SimpleNamespace(put=jax.device_put, take=jax.dlpack.from_dlpack, pointer=lambda array: array.unsafe_buffer_pointer(), cpu=np.asarray,
                           takes_strides=False)


@pytest.fixture(params=[of_torch, of_cupy, of_jax], ids=["torch", "cupy", "jax"])
def library(request):
    return request.param(pytest.importorskip(request.param.__name__.removeprefix("of_")))


def sorted_contacts(contacts):
    return np.sort(contacts, order=["pair", "face_a", "face_b", "triangle_a", "triangle_b"])


def sorted_contacts_within(contacts):
    """Of bodies with themselves, where either triangle may come first."""
    ordered = contacts.copy()
    turned = ordered["triangle_a"] > ordered["triangle_b"]
    for name in ("triangle", "face"):
        ordered[f"{name}_a"][turned], ordered[f"{name}_b"][turned] = contacts[f"{name}_b"][turned], contacts[f"{name}_a"][turned]
    return sorted_contacts(ordered)


def test_without_a_gpu_the_reason_is_told():
    program = "import tandem.cuda\ntry:\n    tandem.cuda.Query([])\nexcept tandem.Error as error:\n    print(error.name, error)"
    told = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, env={**os.environ, "CUDA_VISIBLE_DEVICES": ""})
    assert told.stdout.startswith("NoGpu there is no GPU"), told.stderr


@needs_gpu
def test_contacts_are_those_of_the_cpu(assets, library):
    asset, pose = make_scene()
    on_cpu = tandem.Scene(assets, cpu_instances(asset, pose)).contacts()
    query = cuda.Query(assets)
    for shape in ((COUNT, 4, 3), (COUNT, 12)):
        found = query.contacts(asset=library.put(asset), pose=library.put(pose.reshape(shape)), sorted=True)
        assert len(on_cpu.contacts) > 1000
        assert np.array_equal(found.pairs.numpy(), on_cpu.pairs)
        assert np.array_equal(found.contacts.numpy(), sorted_contacts(on_cpu.contacts))
        assert found.counters.contacts == len(on_cpu.contacts)


@needs_gpu
def test_results_are_the_memory_of_the_query(assets, library):
    asset, pose = make_scene()
    found = cuda.Query(assets).contacts(asset=library.put(asset), pose=library.put(pose), sorted=True)
    words = library.take(found.contacts)
    assert library.pointer(words) == found.contacts.words.pointer
    assert words.shape == (len(found.contacts), 5)
    expected = found.contacts.numpy()
    assert np.array_equal(library.cpu(words), expected.view("<u4").reshape(-1, 5))
    if library.takes_strides:
        for name in ("pair", "triangle_b", "face_a"):
            assert np.array_equal(library.cpu(library.take(found.contacts[name])), expected[name])
    assert library.pointer(library.take(found.pairs)) == found.pairs.words.pointer


@needs_gpu
def test_the_array_interface_gives_the_same_memory(assets):
    cupy = pytest.importorskip("cupy")
    asset, pose = make_scene()
    found = cuda.Query(assets).contacts(asset=cupy.asarray(asset), pose=cupy.asarray(pose), sorted=True)
    faces = cupy.asarray(found.contacts["face_b"])
    assert faces.data.ptr == found.contacts["face_b"].pointer == found.contacts.words.pointer + 16
    assert np.array_equal(faces.get(), found.contacts.numpy()["face_b"])

    class ByInterfaceAlone:
        def __init__(self, array):
            self.__cuda_array_interface__ = array.__cuda_array_interface__

    again = cuda.Query(assets).contacts(asset=ByInterfaceAlone(cupy.asarray(asset)), pose=ByInterfaceAlone(cupy.asarray(pose)), sorted=True)
    assert np.array_equal(again.contacts.numpy(), found.contacts.numpy())


@needs_gpu
def test_poses_are_read_where_they_are(torch, assets):
    """Instances that were looked at once: what is written to the array later is found."""
    asset, pose = make_scene()
    query, on_cpu, at = cuda.Query(assets), tandem.Scene(assets), torch.from_numpy(pose).cuda()
    bodies = query.instances(torch.from_numpy(asset).cuda(), at)
    for step in range(3):
        pose[:, 3] += 0.01 * step
        pose[::2, 3, 0] += 0.02
        at.copy_(torch.from_numpy(pose))
        found = query.contacts(bodies, sorted=True)
        assert np.array_equal(found.contacts.numpy(), sorted_contacts(on_cpu.place(cpu_instances(asset, pose)).contacts().contacts))


@needs_gpu
def test_results_outlive_calls_queries_and_assets(torch, assets):
    asset, pose = make_scene()
    own = [tandem.Asset.from_bytes(bytes(one)) for one in assets]
    query = cuda.Query(own)
    first = query.contacts(asset=torch.from_numpy(asset).cuda(), pose=torch.from_numpy(pose).cuda(), sorted=True)
    expected, words = first.contacts.numpy(), torch.from_dlpack(first.contacts)
    for seed in range(4):  # which need other room, and other memory
        asset, pose = make_scene(seed, 20 + 60 * seed)
        query.contacts(asset=torch.from_numpy(asset).cuda(), pose=torch.from_numpy(pose).cuda())
    del query, first, own
    gc.collect()
    asset, pose = make_scene(7, 200)
    cuda.Query(assets).contacts(asset=torch.from_numpy(asset).cuda(), pose=torch.from_numpy(pose).cuda())
    assert np.array_equal(words.cpu().numpy(), expected.view("<u4").reshape(-1, 5))


@needs_gpu
def test_memory_that_nobody_has_is_used_again(posed):
    query, bodies = posed
    found = query.contacts(bodies)
    places = set()
    for _ in range(6):
        found = query.contacts(bodies)
        places.add(found.contacts.words.pointer)
    assert len(places) == 2  # the one before lives until the name has the new one


@needs_gpu
def test_manifolds_and_contained_bodies_are_those_of_the_cpu(torch, assets):
    asset, pose = make_scene()
    query, on_cpu = cuda.Query(assets), tandem.Scene(assets)
    followed = 0
    for step in range(3):
        pose[::2, 3, 0] += 1e-4
        on_cpu.place(cpu_instances(asset, pose)).contacts()
        made, inside = on_cpu.manifolds(), on_cpu.contained()
        found = query.contacts(asset=torch.from_numpy(asset).cuda(), pose=torch.from_numpy(pose).cuda(), sorted=True, grouped=True)
        on_gpu = query.manifolds()
        assert np.array_equal(on_gpu.pairs.numpy(), made.pairs) and np.array_equal(found.pairs.numpy(), made.pairs)
        assert on_gpu.manifolds.numpy().tobytes() == made.manifolds.tobytes()
        assert on_gpu.points.numpy().tobytes() == made.points.tobytes()
        normals = torch.from_dlpack(on_gpu.manifolds["normal"])
        assert np.array_equal(normals.cpu().numpy(), made.manifolds["normal"])
        assert query.contained().contained.numpy().tobytes() == inside.contained.tobytes()
        followed = np.count_nonzero(made.points["previous"] != tandem.NO_INDEX)
    assert followed > 0 and len(inside.contained) > 0
    query.contacts(asset=torch.from_numpy(asset).cuda(), pose=torch.from_numpy(pose).cuda())
    with pytest.raises(tandem.Error) as caught:
        query.manifolds()
    assert caught.value.name == "ContactsMissing"


@needs_gpu
def test_queued_manifolds_are_those_of_the_cpu(torch, assets):
    asset, pose = make_scene()
    query, on_cpu = cuda.Query(assets), tandem.Scene(assets)
    found, made = on_cpu.place(cpu_instances(asset, pose)).contacts(), on_cpu.manifolds(match_previous=False)
    bodies = query.instances(torch.from_numpy(asset).cuda(), torch.from_numpy(pose).cuda())
    room = {"instances": len(asset), "pairs": len(found.pairs), "contacts": len(found.contacts), "sorted": True, "grouped": True, "match_previous": False}
    with pytest.raises(ValueError, match="grouped"):
        query.reserve(**room | {"grouped": False}, manifolds=1)
    query.reserve(**room)
    with pytest.raises(ValueError, match="no room for manifolds"):
        query.enqueue(bodies).manifolds
    query.reserve(**room, manifolds=1, points=1)
    with pytest.raises(cuda.TooLittleRoom) as caught:
        query.enqueue(bodies).wait()
    assert caught.value.manifolds >= len(made.manifolds) and caught.value.points >= len(made.points)
    query.reserve(**room, manifolds=caught.value.manifolds, points=caught.value.points)
    queued = query.enqueue(bodies)
    assert queued.wait() == (len(found.pairs), len(found.contacts))
    report = queued.manifold_report.numpy()[0]
    assert report["complete"] and (report["manifolds"], report["points"]) == (len(made.manifolds), len(made.points))
    assert queued.manifolds.numpy()[:len(made.manifolds)].tobytes() == made.manifolds.tobytes()
    assert queued.points.numpy()[:len(made.points)].tobytes() == made.points.tobytes()
    pose[5] *= 1.1
    with pytest.raises(tandem.Error) as caught:
        query.enqueue(query.instances(torch.from_numpy(asset).cuda(), torch.from_numpy(pose).cuda())).wait()
    assert (caught.value.name, caught.value.where) == ("PoseNotRigid", 5)


@needs_gpu
def test_distances_impacts_and_verdicts(torch, assets):
    asset, pose = make_scene()
    query, on_cpu, instances = cuda.Query(assets), tandem.Scene(assets), cpu_instances(asset, pose)
    bodies = query.instances(torch.from_numpy(asset).cuda(), torch.from_numpy(pose).cuda())
    theirs, ours = on_cpu.place(instances).distances(reach=0.5), query.distances(bodies, reach=0.5)
    assert np.array_equal(ours.pairs.numpy(), theirs.pairs)
    near = theirs.distances["triangle_a"] != tandem.NO_INDEX
    lower, upper = (ours.distances.numpy()[name] for name in ("lower", "upper"))
    assert near.any() and np.all(lower[near] <= theirs.distances["upper"][near]) and np.all(theirs.distances["lower"][near] <= upper[near])
    assert np.array_equal(upper == 0, theirs.distances["upper"] == 0)
    pairs = torch.tensor([[3, 1], [5, 9]], dtype=torch.int32, device="cuda")
    assert np.array_equal(query.distances(bodies, pairs=pairs).distances.numpy()["upper"] == 0, on_cpu.place(instances).distances(pairs=[[3, 1], [5, 9]]).distances["upper"] == 0)

    motion = np.zeros(COUNT, tandem.MOTION)
    motion["velocity"] = np.random.default_rng(3).normal(size=(COUNT, 3))
    motion["centre"] = pose[:, 3]
    theirs = on_cpu.place(instances).impacts(motion, 0.1)
    found = query.impacts(bodies, motion=torch.from_numpy(motion.view("<f8").reshape(COUNT, 9)).cuda(), duration=0.1)
    assert np.array_equal(found.pairs.numpy(), theirs.pairs)
    assert np.allclose(found.impacts.numpy()["t_safe"], theirs.impacts["t_safe"], atol=1e-3)
    assert np.array_equal(found.impacts.numpy()["status"] == tandem.IMPACT_AT_START, theirs.impacts["status"] == tandem.IMPACT_AT_START)

    theirs, found = on_cpu.place(instances).verdicts(tolerance=0.01), query.verdicts(bodies, tolerance=0.01)
    assert np.array_equal(found.pairs.numpy(), theirs.pairs) and np.array_equal(found.verdicts.numpy(), theirs.verdicts)


@needs_gpu
def test_filters_and_pairs(torch, assets):
    asset, pose = make_scene()
    motion = np.where(np.arange(COUNT) % 3 == 0, tandem.FIXED, tandem.MOVING).astype(np.uint8)
    on_cpu, query = tandem.Scene(assets), cuda.Query(assets)
    instances = cpu_instances(asset, pose)
    excluded = on_cpu.place(instances).pairs()[:10]
    expected = on_cpu.place(instances, filter=tandem.Filter(motion=motion, excluded=excluded)).contacts()
    bodies = query.instances(torch.from_numpy(asset).cuda(), torch.from_numpy(pose).cuda())
    filter = cuda.Filter(motion=torch.from_numpy(motion).cuda(), excluded=excluded)
    assert np.array_equal(query.pairs(bodies, filter=filter).numpy(), expected.pairs)
    found = query.contacts(bodies, filter=filter, sorted=True)
    assert np.array_equal(found.contacts.numpy(), sorted_contacts(expected.contacts))
    given = query.contacts(bodies, pairs=found.pairs, sorted=True)
    assert given.pairs is found.pairs and np.array_equal(given.contacts.numpy(), found.contacts.numpy())
    with pytest.raises(ValueError, match="filter is of 3 instances where there are 60"):
        query.contacts(bodies, filter=cuda.Filter(motion=torch.zeros(3, dtype=torch.uint8, device="cuda")))
    near = query.contacts(bodies, within=0.02, sorted=True)
    assert np.array_equal(near.contacts.numpy(), sorted_contacts(on_cpu.place(instances).contacts(within=0.02).contacts))
    selves = np.repeat(np.arange(3, dtype=np.uint32), 2).reshape(-1, 2)
    for rings in (0, 1, 2):
        found = query.contacts(bodies, pairs=torch.from_numpy(selves.astype(np.int32)).cuda(), within=0.02, leave_out_rings=rings, sorted=True)
        expected = on_cpu.place(instances).contacts(pairs=selves, within=0.02, leave_out_rings=rings)
        assert np.array_equal(sorted_contacts_within(found.contacts.numpy()), sorted_contacts_within(expected.contacts))
    with pytest.raises(ValueError, match="leave_out_rings is 9 where 0 to 8"):
        query.contacts(bodies, leave_out_rings=9)


@needs_gpu
def test_streams_are_waited_for(torch, assets):
    """Poses that PyTorch writes on one stream, late, are found by a query on another, whose results PyTorch reads on a third."""
    asset, pose = make_scene()
    expected = sorted_contacts(tandem.Scene(assets, cpu_instances(asset, pose)).contacts().contacts)
    query = cuda.Query(assets)
    numbers, late = torch.from_numpy(asset).cuda(), torch.from_numpy(pose).cuda()
    at = torch.zeros_like(late)
    at[:, :3] = torch.eye(3, dtype=torch.float64, device="cuda")
    query.contacts(asset=numbers, pose=at)
    streams = [torch.cuda.Stream() for _ in range(3)]
    torch.cuda.synchronize()
    with torch.cuda.stream(streams[0]):
        torch.cuda._sleep(50_000_000)
        at.copy_(late)
        found = query.contacts(asset=numbers, pose=at, sorted=True, stream=streams[1])
    assert np.array_equal(found.contacts.numpy(), expected)
    query.reserve(instances=COUNT, pairs=4000, contacts=100_000, sorted=True)
    torch.cuda.synchronize()
    with torch.cuda.stream(streams[1]):
        torch.cuda._sleep(50_000_000)
    queued = query.enqueue(asset=numbers, pose=at, stream=streams[1].cuda_stream)
    with torch.cuda.stream(streams[2]):
        words = torch.from_dlpack(queued.contacts).clone()
    streams[2].synchronize()
    assert np.array_equal(words.cpu().numpy()[: len(expected)], expected.view("<u4").reshape(-1, 5))
    assert queued.wait()[1] == len(expected)


@needs_gpu
def test_a_graph_of_pytorch_finds_the_contacts_of_moved_poses(torch, assets):
    asset, pose = make_scene()
    query, on_cpu, at, numbers = cuda.Query(assets), tandem.Scene(assets), torch.from_numpy(pose).cuda(), torch.from_numpy(asset).cuda()
    query.reserve(instances=COUNT, pairs=4000, contacts=100_000, sorted=True)
    query.enqueue(asset=numbers, pose=at).wait()  # loads the kernels
    graph, shift = torch.cuda.CUDAGraph(), torch.zeros(3, dtype=torch.float64, device="cuda")
    with torch.cuda.graph(graph):
        at[::2, 3] += shift
        queued = query.enqueue(asset=numbers, pose=at, stream=torch.cuda.current_stream())
        total = torch.from_dlpack(queued.contact_count).view(torch.int64).clone()
    for step in range(3):
        moved = np.array([0.01 * step, 0.0, 0.003])
        shift.copy_(torch.from_numpy(moved))
        graph.replay()
        pose[::2, 3] += moved
        expected = sorted_contacts(on_cpu.place(cpu_instances(asset, pose)).contacts().contacts)
        torch.cuda.synchronize()
        assert int(total) == len(expected) > 0
        assert np.array_equal(queued.contacts.numpy()[: len(expected)], expected)


@needs_gpu
def test_waiting_after_a_replay(torch, assets):
    """A graph that is replayed late, on a stream that the query never saw."""
    asset, pose = make_scene()
    query, on_cpu, at, numbers = cuda.Query(assets), tandem.Scene(assets), torch.from_numpy(pose).cuda(), torch.from_numpy(asset).cuda()
    query.reserve(instances=COUNT, pairs=4000, contacts=100_000)
    query.enqueue(asset=numbers, pose=at).wait()
    graph, side, seen = torch.cuda.CUDAGraph(), torch.cuda.Stream(), set()
    with torch.cuda.graph(graph):
        at[::2, 3, 0] += 0.05
        queued = query.enqueue(asset=numbers, pose=at, stream=torch.cuda.current_stream())
    for stream in (side, None, side, None):
        torch.cuda.synchronize()
        with torch.cuda.stream(side):
            torch.cuda._sleep(50_000_000)
            graph.replay()
        pairs, contacts = queued.wait(stream)
        pose[::2, 3, 0] += 0.05
        found = on_cpu.place(cpu_instances(asset, pose)).contacts()
        assert (pairs, contacts) == (len(found.pairs), len(found.contacts))
        seen.add(contacts)
    assert len(seen) == 4


@contextlib.contextmanager
def held(stream):
    """What is queued on the stream behind this waits until the process that it gives is killed, or has slept for 30 seconds: the stream reads what that never writes,
    and Python's lock is not needed for that."""
    libc, driver = ctypes.CDLL(None), ctypes.CDLL("libcuda.so.1")
    libc.fdopen.restype = ctypes.c_void_p
    with subprocess.Popen(["sleep", "30"], stdout=subprocess.PIPE) as sleeper:
        file = ctypes.c_void_p(libc.fdopen(os.dup(sleeper.stdout.fileno()), b"r"))
        assert driver.cuLaunchHostFunc(ctypes.c_void_p(stream.cuda_stream), ctypes.cast(libc.fgetc, ctypes.c_void_p), file) == 0
        try:
            yield sleeper
        finally:
            sleeper.kill()
            stream.synchronize()
            libc.fclose(file)


@needs_gpu
def test_a_step_takes_one_call_at_a_time(torch, assets):
    """Two threads wait for a stream that stands still until one of them is refused."""
    asset, pose = make_scene()
    query, stream, counts, refused = cuda.Query(assets), torch.cuda.Stream(), [], []
    bodies = query.instances(torch.from_numpy(asset).cuda(), torch.from_numpy(pose).cuda())
    query.reserve(instances=COUNT, pairs=4000, contacts=100_000)
    expected = query.enqueue(bodies).wait()
    with held(stream) as hold:
        queued = query.enqueue(bodies, stream=stream)
        assert hold.poll() is None, "enqueue() waited for the stream"

        def wait():
            try:
                counts.append(queued.wait())
            except RuntimeError as error:
                refused.append(str(error))
                with pytest.raises(RuntimeError, match="at work for another thread"):  # which waits until the stream goes on
                    query.enqueue(bodies)
                hold.kill()

        threads = [threading.Thread(target=wait) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert refused == ["the query is at work for another thread"]
    assert counts == [expected] == [query.enqueue(bodies).wait()]


@needs_gpu
def test_a_query_takes_one_call_at_a_time(torch, posed):
    """A call that comes while another one takes its arrays is refused."""
    query, bodies = posed
    motion, refused = torch.zeros((COUNT, 9), dtype=torch.float64, device="cuda"), []

    class Asks:
        def __dlpack_device__(self):
            return motion.__dlpack_device__()

        def __dlpack__(self, **arguments):
            with pytest.raises(RuntimeError, match="at work for another thread"):
                query.contacts(bodies)
            refused.append(True)
            return motion.__dlpack__(**arguments)

    found = query.impacts(bodies, motion=Asks(), duration=0.1)
    assert refused == [True] and len(found.impacts) == len(query.impacts(bodies, motion=motion, duration=0.1).impacts) > 0


@needs_gpu
def test_given_pairs_are_not_handed_out_as_found(torch, posed):
    query, bodies = posed
    found = query.contacts(bodies)
    query.reserve(instances=COUNT, pairs=4000, contacts=100_000)
    first = query.enqueue(bodies)
    assert first.wait() == (len(found.pairs), len(found.contacts)) and len(first.pairs) == 4000
    few = torch.tensor([[3, 1], [5, 9]], dtype=torch.int32, device="cuda")
    queued = query.enqueue(bodies, pairs=few)
    assert queued.pairs is None and queued.pair_count is None
    assert queued.wait() == (2, len(query.contacts(bodies, pairs=few).contacts))

    query.contacts(bodies, pairs=found.pairs, grouped=True)
    with pytest.raises(ValueError, match="mode is 'best'"):
        query.contacts(bodies, pairs=few, mode="best")
    assert query.manifolds().pairs is found.pairs


@needs_gpu
def test_results_keep_their_stream(torch, assets):
    asset, pose = make_scene()
    query, made = cuda.Query(assets), torch.cuda.Stream()
    bodies = query.instances(torch.from_numpy(asset).cuda(), torch.from_numpy(pose).cuda())
    query.reserve(instances=COUNT, pairs=4000, contacts=100_000)
    for call in (lambda stream: query.contacts(bodies, stream=stream).contacts, lambda stream: query.enqueue(bodies, stream=stream).contacts):
        own = OwnStream(made.cuda_stream)
        lives, rows = weakref.ref(own), call(own)
        del own
        gc.collect()
        assert lives() is not None and len(rows.numpy()) > 0
        del rows
        query.enqueue(bodies).wait()  # on another stream
        gc.collect()
        assert lives() is None


@needs_gpu
def test_what_lies_on_another_gpu_is_refused(torch, posed, assets):
    (query, bodies), (asset, pose) = posed, make_scene()
    query.reserve(instances=COUNT, pairs=4000, contacts=100_000)
    filter = cuda.Filter(group=Producer((COUNT,), (1,), device=5), device=5)
    for call in (query.contacts, query.pairs, query.enqueue):
        with pytest.raises(ValueError, match="filter lies in the memory of GPU 5 where that of GPU 0"):
            call(bodies, filter=filter)
    if torch.cuda.device_count() > 1:
        there = cuda.Query(assets, device=1).instances(torch.from_numpy(asset).to("cuda:1"), torch.from_numpy(pose).to("cuda:1"))
        for call in (query.contacts, query.pairs, query.distances, query.enqueue):
            with pytest.raises(ValueError, match="instances lies in the memory of GPU 1 where that of GPU 0"):
                call(there)
    assert query.enqueue(bodies).wait()[1] == len(query.contacts(bodies).contacts)


@needs_gpu
def test_too_little_room_is_told(posed):
    query, bodies = posed
    with pytest.raises(ValueError, match="reserve"):
        query.enqueue(bodies)
    query.reserve(instances=COUNT, pairs=4000, contacts=10, undecided=100_000)
    with pytest.raises(cuda.TooLittleRoom) as caught:
        query.enqueue(bodies).wait()
    query.reserve(instances=COUNT, pairs=4000, contacts=caught.value.contacts, undecided=100_000)
    pairs, contacts = query.enqueue(bodies).wait()
    assert contacts == len(query.contacts(bodies).contacts) and pairs == len(query.pairs(bodies))


@needs_gpu
def test_what_is_wrong_is_told(torch, assets):
    asset, pose = make_scene()
    query, numbers, at = cuda.Query(assets), torch.from_numpy(asset).cuda(), torch.from_numpy(pose).cuda()
    for error, words, arguments in (
            (TypeError, "pose lies in CPU memory", {"pose": pose}), (TypeError, "pose lies in CPU memory", {"pose": torch.from_numpy(pose)}),
            (TypeError, "pose is float32 where float64 is wanted", {"pose": at.float()}),
            (TypeError, "pose is list where an array in GPU memory", {"pose": [1, 2]}), (ValueError, r"pose has shape \(60, 3\)", {"pose": at[:, 3].contiguous()}),
            (ValueError, "pose is not contiguous", {"pose": torch.cat([at, at], 2)[:, :, :3]}), (TypeError, "asset is int64 where uint32 or int32", {"asset": numbers.long(), "pose": at}),
            (ValueError, r"asset has shape \(59,\) where \(60,\)", {"asset": numbers[1:], "pose": at}), (TypeError, "pose", {}),
            (ValueError, r"pairs has shape \(3,\) where \(m, 2\)", {"pose": at, "pairs": torch.zeros(3, dtype=torch.int32, device="cuda")}),
            (TypeError, "sorted is int where True or False is wanted", {"pose": at, "sorted": 1}), (TypeError, "first_contact_only is str", {"pose": at, "first_contact_only": "no"}),
            (ValueError, "mode is 'best'", {"pose": at, "mode": "best"}), (TypeError, "stream is str", {"pose": at, "stream": "0"}),
            (ValueError, "pose requires a gradient", {"pose": at.clone().requires_grad_()})):
        with pytest.raises(error, match=words):
            query.contacts(**arguments)

    class Elsewhere:
        def __dlpack__(self, **_):
            raise AssertionError("not asked")

        def __dlpack_device__(self):
            return 2, 5

    with pytest.raises(ValueError, match="pose lies in the memory of GPU 5 where that of GPU 0"):
        query.contacts(pose=Elsewhere())
    at[17, 1, 1] += 0.1
    with pytest.raises(tandem.Error) as caught:
        query.contacts(asset=numbers, pose=at)
    assert (caught.value.name, caught.value.where, caught.value.subject) == ("PoseNotRigid", 17, "instance")
    at = torch.from_numpy(pose).cuda()
    numbers[23] = 3
    with pytest.raises(tandem.Error) as caught:
        query.contacts(asset=numbers, pose=at)
    assert (caught.value.name, caught.value.where) == ("UnknownAsset", 23)
    with pytest.raises(tandem.Error) as caught:
        query.contacts(pose=at, pairs=torch.tensor([[0, 1], [0, 60]], dtype=torch.int32, device="cuda"))
    assert (caught.value.name, caught.value.where, caught.value.subject) == ("UnknownInstance", 1, "pair")
    assert len(query.contacts(pose=at).contacts) > 0
    with pytest.raises(tandem.Error) as caught:
        cuda.Query(assets, contents="exact").distances(pose=at)
    assert caught.value.name == "NoAxisAlignedBlocks"


@needs_gpu
def test_the_page_shows_what_runs(assets, tmp_path, monkeypatch):
    pytest.importorskip("torch")
    assets[1].save(tmp_path / "cow.bvh")
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"^```pycon\n(.*?)^```$", (ROOT / "docs/python_gpu.md").read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    test = doctest.DocTestParser().get_doctest("\n".join(blocks), {}, "docs/python_gpu.md", None, 0)
    failed, tried = doctest.DocTestRunner().run(test, clear_globs=False)
    assert failed == 0 and tried > 10
    assert len(test.globs["faces"]) > 0 and test.globs["contacts"] > 0
