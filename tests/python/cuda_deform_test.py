"""tandem.cuda.Query.deform: what it finds of deformed assets is what the CPU finds, of positions that lie on a GPU. Skipped where there is no GPU."""
from types import SimpleNamespace

import numpy as np
import pytest

import tandem
from cuda_test import COUNT, ROOT, assets, cpu_instances, cuda, library, make_scene, needs_gpu, sorted_contacts, torch  # noqa: F401
from fakes import Interface
from meshes import BOX_FACES, BOX_VERTICES, read_obj


def test_assets_that_deform_are_checked_before_a_gpu_is_asked():
    box = tandem.build(BOX_VERTICES, BOX_FACES)
    for error, words, deforming in ((ValueError, "deforming is 1 where 0 to 0 is wanted", [1]), (ValueError, "deforming is -1", [-1]),
                                    (TypeError, "deforming is float", [0.5])):
        with pytest.raises(error, match=words):
            cuda.Query([box], deforming=deforming)


def waving(assets, step):
    """Source vertices of the cow and of a box, float32."""
    cow = read_obj(ROOT / "assets/cow_1500.obj")[0]
    cow = cow + 0.1 * step * np.stack([0 * cow[:, 0], np.sin(4 * cow[:, 0] + step), np.cos(3 * cow[:, 2])], 1)
    box = BOX_VERTICES * (1 + 0.3 * step)
    return {1: cow.astype(np.float32), 0: box.astype(np.float32)}


def deformed_on_cpu(assets, positions, instances):
    scene = tandem.Scene(assets, instances)
    for asset, numbers in positions.items():
        scene.deform(asset, numbers)
    return scene


@needs_gpu
def test_deformed_assets_have_the_contacts_of_the_cpu(assets, library):
    asset, pose = make_scene()
    query, arrays, seen = cuda.Query(assets, deforming=[1, 0]), (library.put(asset), library.put(pose)), set()
    on = SimpleNamespace(asset=arrays[0], pose=arrays[1])
    for step in (0, 1, 2, 1):
        shapes = waving(assets, step)
        query.deform({number: library.put(numbers) for number, numbers in shapes.items()})
        found = query.contacts(asset=on.asset, pose=on.pose, sorted=True, grouped=True)
        scene = deformed_on_cpu(assets, shapes, cpu_instances(asset, pose))
        expected = scene.contacts()
        assert np.array_equal(found.pairs.numpy(), expected.pairs) and np.array_equal(found.contacts.numpy(), sorted_contacts(expected.contacts))
        assert query.manifolds(match_previous=False).points.numpy().tobytes() == scene.manifolds(match_previous=False).points.tobytes()
        x, y = query.distances(asset=on.asset, pose=on.pose).distances.numpy(), scene.distances().distances
        assert (x["lower"] <= y["upper"]).all() and (y["lower"] <= x["upper"]).all()
        seen.add(len(expected.contacts))
    assert len(seen) == 3 and 0 not in seen


@needs_gpu
def test_positions_in_float64_count_as_they_are(assets, library):
    asset, pose = make_scene()
    query, on = cuda.Query(assets, deforming=[0, 1], float64=True), (library.put(asset), library.put(pose))
    for step in (1, 2):
        shapes = waving(assets, step)
        shapes[1] = shapes[1].astype(np.float64) / 3 * 3.1  # no float32 numbers, beside a box in float32
        query.deform({number: library.put(numbers) for number, numbers in shapes.items()})
        found = query.contacts(asset=on[0], pose=on[1], sorted=True)
        scene = deformed_on_cpu(assets, shapes, cpu_instances(asset, pose))
        expected = scene.contacts().contacts
        assert len(expected) > 0 and np.array_equal(found.contacts.numpy(), sorted_contacts(expected))
        x, y = query.distances(asset=on[0], pose=on[1]).distances.numpy(), scene.distances().distances
        assert (x["lower"] <= y["upper"]).all() and (y["lower"] <= x["upper"]).all()
    for ask in (query.manifolds, query.contained):
        query.contacts(asset=on[0], pose=on[1], sorted=True, grouped=True)
        with pytest.raises(tandem.Error) as caught:
            ask()
        assert caught.value.name == "NotFloat32"


@needs_gpu
def test_positions_are_read_where_they_are_and_by_the_array_interface(torch, assets):
    asset, pose = make_scene()
    on = torch.from_numpy(asset).cuda(), torch.from_numpy(pose).cuda()
    query, shapes = cuda.Query(assets, deforming=[1]), [waving(assets, step)[1] for step in range(3)]
    at = torch.from_numpy(shapes[0]).cuda()
    interface = {**at.__cuda_array_interface__, "stream": None}
    for positions in (query.positions({1: at}), query.positions({1: Interface(**interface)})):
        for shape in shapes:
            at.copy_(torch.from_numpy(shape))
            torch.cuda.synchronize()
            query.deform(positions)
            found = query.contacts(asset=on[0], pose=on[1], sorted=True).contacts.numpy()
            expected = deformed_on_cpu(assets, {1: shape}, cpu_instances(asset, pose)).contacts().contacts
            assert np.array_equal(found, sorted_contacts(expected))
    query.deform({})
    assert np.array_equal(query.contacts(asset=on[0], pose=on[1], sorted=True).contacts.numpy(), sorted_contacts(expected))


@needs_gpu
def test_a_graph_of_pytorch_deforms_and_finds_contacts(torch, assets):
    asset, pose = make_scene()
    query, numbers, poses = cuda.Query(assets, deforming=[1]), torch.from_numpy(asset).cuda(), torch.from_numpy(pose).cuda()
    at = torch.from_numpy(waving(assets, 0)[1]).cuda()
    positions = query.positions({1: at})
    query.reserve(instances=COUNT, pairs=4000, contacts=100_000, sorted=True)
    query.enqueue_deform(positions)
    query.enqueue(asset=numbers, pose=poses).wait()  # loads the kernels
    graph = torch.cuda.CUDAGraph()
    with torch.cuda.graph(graph):
        stream = torch.cuda.current_stream()
        query.enqueue_deform(positions, stream=stream)
        queued = query.enqueue(asset=numbers, pose=poses, stream=stream)
    for step in (1, 2, 3):
        shape = waving(assets, step)[1]
        at.copy_(torch.from_numpy(shape))
        graph.replay()
        pairs, contacts = queued.wait()
        expected = deformed_on_cpu(assets, {1: shape}, cpu_instances(asset, pose)).contacts()
        assert (pairs, contacts) == (len(expected.pairs), len(expected.contacts))
        assert np.array_equal(queued.contacts.numpy()[:contacts], sorted_contacts(expected.contacts))
    at[31, 2] = float("nan")
    graph.replay()
    with pytest.raises(tandem.Error) as caught:
        queued.wait()
    assert (caught.value.name, caught.value.where, caught.value.subject) == ("OutOfRange", 31, "vertex")
    assert np.array_equal(queued.contacts.numpy()[:contacts], sorted_contacts(expected.contacts))  # of the shape before


@needs_gpu
def test_what_is_wrong_with_positions_is_told(torch, assets):
    query, shapes = cuda.Query(assets, deforming=[0, 1]), waving(assets, 1)
    cow = torch.from_numpy(shapes[1]).cuda()
    for error, words, positions in (
            (TypeError, "positions of asset 1 is float64 where float32 is wanted", {1: cow.double()}),
            (ValueError, rf"positions of asset 1 has shape \({len(cow) - 1}, 3\) where \({len(cow)}, 3\)", {1: cow[1:]}),
            (ValueError, "positions of asset 1 has shape", {1: cow.flatten()}), (ValueError, "positions of asset 1 is not contiguous", {1: cow.T.contiguous().T}),
            (TypeError, "positions of asset 1 lies in CPU memory", {1: shapes[1]}), (ValueError, "positions names asset 2 where", {2: cow}),
            (TypeError, "positions is Tensor where a dict", cow)):
        with pytest.raises(error, match=words):
            query.deform(positions)
    with pytest.raises(TypeError, match="positions is dict where what Query.positions"):
        query.enqueue_deform({1: cow})
    with pytest.raises(ValueError, match="made by another query"):
        cuda.Query(assets, deforming=[1]).deform(query.positions({1: cow}))
    with pytest.raises(ValueError, match="names asset 1 where no asset may deform"):
        cuda.Query(assets).deform({1: cow})
    bad = cow.clone()
    bad[77, 0], bad[80, 1] = float("inf"), float("nan")
    with pytest.raises(tandem.Error, match="vertex 77: .*positions of asset 1") as caught:
        query.deform({0: torch.from_numpy(shapes[0]).cuda(), 1: bad})
    assert (caught.value.name, caught.value.where, caught.value.subject) == ("OutOfRange", 77, "vertex")
    with pytest.raises(tandem.Error) as caught:
        cuda.Query(assets, deforming=[1], contents="exact")
    assert (caught.value.name, caught.value.where, caught.value.subject) == ("NoSourceVertices", 1, "asset")
    pose = torch.eye(4, 3, dtype=torch.float64, device="cuda")[None].contiguous()
    with pytest.raises(tandem.Error) as caught:
        query.verdicts(pose=pose, tolerance=0.1)
    assert caught.value.name == "Deformed"
