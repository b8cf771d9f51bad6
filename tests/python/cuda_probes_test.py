"""Points and rays by tandem.cuda: what it finds is what the CPU finds, in calls that wait, that are queued, and in graphs. Skipped where there is no GPU."""
import numpy as np
import pytest

import tandem
from cuda_test import COUNT, assets, cpu_instances, cuda, library, make_scene, needs_gpu, posed, torch  # noqa: F401


@needs_gpu
def test_points_and_rays_are_those_of_the_cpu(assets, library):
    asset, pose = make_scene()
    random = np.random.default_rng(5)
    points, along = 3 * random.random((2000, 3)) - 0.25, random.normal(size=(2000, 3))
    query, on_cpu = cuda.Query(assets), tandem.Scene(assets).place(cpu_instances(asset, pose))
    bodies = query.instances(library.put(asset), library.put(pose))
    found = query.closest(library.put(points), bodies, sides=True)
    rows, theirs = found.numpy(), on_cpu.closest(points, sides=True)
    assert np.all(rows["lower"] <= theirs["upper"]) and np.all(theirs["lower"] <= rows["upper"])
    assert np.array_equal(rows["within"], theirs["within"]) and np.array_equal(rows["winding"], theirs["winding"])
    assert len({*rows["winding"]}) > 1 and found["winding"].dtype == "int32"
    for hits in ("first", "all"):
        assert np.array_equal(query.rays(library.put(points), library.put(along), bodies, hits=hits).numpy(), on_cpu.rays(points, along, hits=hits))
    within, theirs = (scene.rays(*of, hits="any", reach=0.5) for scene, of in ((query, (library.put(points), library.put(along), bodies)), (on_cpu, (points, along))))
    assert np.array_equal(within.numpy()["body"] == tandem.NO_INDEX, theirs["body"] == tandem.NO_INDEX)
    words = library.take(found)
    assert library.pointer(words) == found.words.pointer


@needs_gpu
def test_what_is_no_point_and_no_ray_is_named(torch, posed):
    query, bodies = posed
    points = torch.zeros((5, 3), dtype=torch.float64, device="cuda")
    along = torch.ones_like(points)
    along[3] = 0
    with pytest.raises(tandem.Error) as caught:
        query.rays(points, along, bodies)
    assert (caught.value.name, caught.value.where) == ("NoDirection", 3)
    points[2, 1] = float("nan")
    with pytest.raises(tandem.Error) as caught:
        query.closest(points, bodies)
    assert (caught.value.name, caught.value.where) == ("OutOfRange", 2)
    for error, words, given in ((TypeError, "points is float32", points.float()), (ValueError, r"points has shape \(15,\)", points.reshape(15))):
        with pytest.raises(error, match=words):
            query.closest(given, bodies)
    with pytest.raises(ValueError, match="directions has shape"):
        query.rays(along, along[:4].contiguous(), bodies)
    assert len(query.closest(points[:0], bodies)) == len(query.rays(points[:0], along[:0], bodies)) == 0


@pytest.fixture
def probes(torch):
    """2,000 points, and directions from there, on the CPU and on the GPU."""
    random = np.random.default_rng(7)
    arrays = 3 * random.random((2000, 3)) - 0.25, random.normal(size=(2000, 3))
    return (*arrays, *(torch.from_numpy(array).cuda() for array in arrays))


@needs_gpu
def test_queued_points_and_rays_are_those_of_calls_that_wait(posed, probes):
    (query, bodies), (_, _, points, along) = posed, probes
    with pytest.raises(ValueError, match="reserve_probes"):
        query.enqueue_closest(points, bodies)
    query.reserve_probes(instances=COUNT, probes=len(points), hits=10)
    queued = query.enqueue_closest(points, bodies, sides=True)
    assert queued.wait() == len(queued.rows) == len(points)
    assert queued.rows.numpy().tobytes() == query.closest(points, bodies, sides=True).numpy().tobytes()
    for hits in ("first", "any"):
        queued = query.enqueue_rays(points, along, bodies, hits=hits)
        assert queued.wait() == len(queued.rows) == len(points)
        assert queued.rows.numpy().tobytes() == query.rays(points, along, bodies, hits=hits).numpy().tobytes()
    queued = query.enqueue_rays(points, along, bodies, hits="all")
    with pytest.raises(cuda.TooLittleRoom, match="hits") as caught:
        queued.wait()
    assert queued.report.numpy()[0]["complete"] == 0 and caught.value.pairs == 0
    query.reserve_probes(instances=COUNT, probes=len(points), hits=caught.value.hits, words=caught.value.words)
    queued, expected = query.enqueue_rays(points, along, bodies, hits="all"), query.rays(points, along, bodies, hits="all").numpy()
    assert queued.wait() == len(expected) > 0 and queued.rows.numpy()[:len(expected)].tobytes() == expected.tobytes()
    report = queued.report.numpy()[0]
    assert (report["status"], report["rows"], report["counters"][1]) == (0, len(expected), len(expected))


@needs_gpu
def test_what_is_wrong_with_queued_points_is_told(posed, probes):
    (query, bodies), (_, _, points, along) = posed, probes
    query.reserve_probes(instances=COUNT, probes=len(points))
    points[5, 1] = float("nan")
    for queued in (query.enqueue_closest(points, bodies), query.enqueue_rays(points, along, bodies)):
        with pytest.raises(tandem.Error) as caught:
            queued.wait()
        assert (caught.value.name, caught.value.where) == ("OutOfRange", 5)
    points[5, 1] = 0
    with pytest.raises(tandem.Error) as caught:
        query.enqueue_rays(points, along, bodies, hits="all")
    assert caught.value.name == "OutOfRange"
    assert query.enqueue_rays(points, along, bodies).wait() == len(points)


@needs_gpu
def test_a_graph_asks_about_points_and_rays_where_they_are(torch, assets, probes):
    """Poses and points that a graph moves, on a stream that the query never saw."""
    asset, pose = make_scene()
    query, on_cpu, at, numbers = cuda.Query(assets), tandem.Scene(assets), torch.from_numpy(pose).cuda(), torch.from_numpy(asset).cuda()
    points, along, points_on_gpu, along_on_gpu = probes
    query.reserve_probes(instances=COUNT, probes=len(points))
    query.enqueue_closest(points_on_gpu, asset=numbers, pose=at).wait()  # loads the kernels
    query.enqueue_rays(points_on_gpu, along_on_gpu, asset=numbers, pose=at).wait()
    graph, side, seen = torch.cuda.CUDAGraph(), torch.cuda.Stream(), set()
    with torch.cuda.graph(graph):
        at[::2, 3, 0] += 0.05
        points_on_gpu[:, 1] += 0.01
        near = query.enqueue_closest(points_on_gpu, asset=numbers, pose=at, stream=torch.cuda.current_stream())
        upper = torch.from_dlpack(near.rows["upper"]).clone()
        queued = query.enqueue_rays(points_on_gpu, along_on_gpu, asset=numbers, pose=at, stream=torch.cuda.current_stream())
    for stream in (side, None, side):
        torch.cuda.synchronize()
        with torch.cuda.stream(side):
            graph.replay()
        assert queued.wait(stream) == len(points)
        pose[::2, 3, 0] += 0.05
        points[:, 1] += 0.01
        scene = on_cpu.place(cpu_instances(asset, pose))
        expected = scene.rays(points, along)
        assert queued.rows.numpy().tobytes() == expected.tobytes()
        assert np.allclose(upper.cpu().numpy(), scene.closest(points)["upper"], rtol=2e-6, atol=0)
        seen.add(np.count_nonzero(expected["body"] != tandem.NO_INDEX))
    assert len(seen) > 1
