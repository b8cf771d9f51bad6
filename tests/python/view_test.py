"""tandem.view(): what its pictures show, and where."""
import json
import os
import re
import shlex
import subprocess
import sys

import numpy as np
import pytest

# Where nothing draws, this skips all that follows.
from pictures import RED, SIZE, SOURCE_DIR, TURNED, body_of_pixels, box, command, grown, h5py, hue_distance, hues, inner, is_backdrop, projected, write_run

import matplotlib
import matplotlib.image

import tandem
import z_buffer
from meshes import BOX_VERTICES, read_obj
from tandem import scene_files, tree, viewer


@pytest.fixture(scope="module")
def cow():
    return tandem.build(*read_obj(SOURCE_DIR / "assets/cow_1500.obj"))


@pytest.fixture
def shown():
    """Makes views that are closed when the test ends."""
    views = []

    def make(*arguments, **options):
        views.append(viewer.View(*arguments, off_screen=True, **{"size": SIZE, **options}))
        return views[-1]

    yield make
    for view in views:
        view.close()


@pytest.fixture(scope="module")
def herd(cow):
    """A scene of six cows that meet."""
    random = np.random.default_rng(3)
    orthogonal = np.linalg.qr(random.normal(size=(6, 3, 3)))[0]
    rotation = orthogonal * np.linalg.det(orthogonal)[:, None, None]
    return [cow], tandem.instances(np.zeros(6, int), rotation=rotation, translation=random.uniform(-0.6, 0.6, (6, 3)))


# ---- Bodies

def test_bodies_are_where_a_z_buffer_puts_them(shown, herd):
    assets, instances = herd
    view = shown(assets, instances)
    picture, expected = view.picture(), body_of_pixels(view, assets, instances)
    drawn, covered = ~is_backdrop(picture), expected >= 0
    # A pixel at an outline shows what covers a part of it, be it not its middle.
    assert covered.mean() > 0.1 and not (covered & ~drawn).any() and not (drawn & ~grown(grown(covered))).any()
    colours = view.body_colours()
    found = hues(picture)[..., 0]
    for body in range(len(instances)):
        where = (expected == body) & inner(expected)
        assert where.sum() > 20 and np.median(hue_distance(found[where], hues(colours[body])[0])) < 0.03


def test_the_camera_comes_as_near_as_all_bodies_are_in_the_picture(shown, herd):
    assets, instances = herd
    for azimuth, elevation in ((0, 0), (-60, 24), (90, 90), (200, -90)):
        drawn = ~is_backdrop(shown(assets, instances, azimuth=azimuth, elevation=elevation).picture())
        rows, columns = (np.flatnonzero(drawn.any(axis=axis)) for axis in (1, 0))
        margins = rows[0] / SIZE[1], 1 - (rows[-1] + 1) / SIZE[1], columns[0] / SIZE[0], 1 - (columns[-1] + 1) / SIZE[0]
        assert min(margins) >= 0.02 and min(margins) < 0.12, (azimuth, elevation, margins)


def test_azimuth_and_elevation_say_from_where_one_looks(shown, box):
    instances = tandem.instances([0, 0], translation=[[0, 0, 0], [0, 3, 0]])
    view = shown([box], instances, azimuth=0, elevation=0)  # from +x: +y is right
    left, right = view.body_colours()
    picture = view.picture()
    for colour, column in ((left, 60), (right, 260)):
        assert hue_distance(hues(picture[100, column])[0], hues(colour)[0]) < 0.03
    above = shown([box], instances, azimuth=0, elevation=90)  # up in the picture is away from where one looked
    assert projected(above, np.array([-1.0, 0, 0]))[1] < projected(above, np.array([1.0, 0, 0]))[1]


def test_a_scene_far_from_the_origin_looks_the_same(shown, cow, herd):
    near = shown(*herd).picture().astype(int)
    vertices, faces = read_obj(SOURCE_DIR / "assets/cow_1500.obj")
    far_asset = tandem.build(vertices + 2.0 ** 20, faces)
    far = herd[1].copy()
    far["translation"] += 2.0 ** 23 - np.einsum("nij->ni", far["rotation"]) * 2.0 ** 20
    assert np.abs(shown([far_asset], far).picture() - near).mean() < 0.5


def test_fixed_bodies_are_grey_and_need_not_be_in_the_picture(shown, box):
    instances = tandem.instances([0, 0], translation=[[0, 0, 0], [0, 50, 0]])
    view = shown([box], instances, motion=[tandem.MOVING, tandem.FIXED])
    assert np.ptp(view.body_colours(), axis=1).tolist()[1] < 20 < np.ptp(view.body_colours(), axis=1)[0]
    assert (~is_backdrop(view.picture())).mean() > 0.1


def test_opacity_is_what_was_asked_for(shown, box):
    colour = [shown(box, opacity=opacity, azimuth=0, elevation=0).picture()[100, 160].astype(float) for opacity in (0, 0.25, 1)]
    np.testing.assert_allclose(colour[1], 0.75 * colour[0] + 0.25 * colour[2], atol=3)


def test_translucent_bodies_have_dark_outlines(shown, box, monkeypatch):
    def pictures(opacity):
        for most in (viewer.OUTLINED, 23):  # both boxes together have 24 triangles
            monkeypatch.setattr(viewer, "OUTLINED", most)
            yield shown([box], tandem.instances([0, 0], translation=[[0, 0, 0], [0, 3, 0]]), azimuth=0, elevation=0, opacity=opacity).picture().astype(int)
        monkeypatch.undo()

    with_lines, without = pictures(0.35)
    darker = (without - with_lines).max(axis=2)
    lines, bodies = darker > 20, ~is_backdrop(without)
    assert darker.min() > -20 and 0.02 < lines.sum() / bodies.sum() < 0.2 and not (lines & ~grown(bodies)).any()
    assert (grown(lines) | inner(bodies) | ~bodies).all()  # all around the bodies
    for opacity in (0, 1):
        assert np.array_equal(*pictures(opacity))


# ---- What queries find

def test_triangles_that_meet_are_red_and_no_others(shown, box):
    instances = tandem.instances([0, 0, 0], translation=[[0, 0, 0], [0, 0.5, 0.25], [0, 4, 0]])
    found = tandem.Scene([box], instances).contacts()
    for contacts in (True, found):
        view = shown([box], instances, contacts=contacts, opacity=0.05, azimuth=30)
        picture = hues(view.picture())
        red = (hue_distance(picture[..., 0], RED) < 0.05) & (picture[..., 1] > 0.5)
        touched = np.unique(np.concatenate([np.stack([found.pairs[found.contacts["pair"]][s], found.contacts[f"triangle_{s}"]], 1)
                                            for s in "ab"]), axis=0)
        posed = np.array([box.triangles()[t] + instances["translation"][b] for b, t in touched])
        expected = z_buffer.rasterise(projected(view, posed), SIZE)[1] >= 0
        assert expected.sum() > 200 and not (expected & inner(expected) & ~red).any() and not (red & ~grown(expected)).any()


def test_contact_points_are_where_they_are_in_the_colour_of_their_depths(shown, box):
    c, s = np.cos(0.1), np.sin(0.1)
    instances = tandem.instances([0, 0], rotation=[np.eye(3), [[c, 0, s], [0, 1, 0], [-s, 0, c]]], translation=[[0, 0, 0], [0.2, 0.3, 0.95]])
    manifolds = tandem.Scene([box], instances).manifolds()
    view = shown([box], instances, manifolds=manifolds, opacity=0)
    picture = view.picture()
    at = projected(view, manifolds.points["position"])
    apart = np.linalg.norm(at[:, None, :2] - at[None, :, :2], axis=2) + 1e9 * np.eye(len(at))
    alone = apart.min(axis=1) > viewer.POINT_PIXELS
    depth = manifolds.points["depth"]
    seen = 0
    for (x, y, _), share in zip(at[alone], depth[alone] / depth.max()):
        wanted = hues(np.array(matplotlib.colormaps["plasma"](share, bytes=True)[:3]))[0]
        near = hues(picture[int(y) - 1:int(y) + 2, int(x) - 1:int(x) + 2])
        seen += (hue_distance(near[..., 0], wanted) < 0.06)[near[..., 1] > 0.3].any()
    assert alone.sum() >= 3 and seen == alone.sum() and np.ptp(depth[alone]) > 0.2 * depth.max()


def test_normals_point_from_a_to_b(shown, box):
    instances = tandem.instances([0, 0], translation=[[0, 0, 0], [0, 0.95, 0]])
    manifolds = tandem.Scene([box], instances).manifolds()
    assert np.allclose(manifolds.manifolds["normal"], [[0, 1, 0]])
    view = shown([box], instances, manifolds=manifolds, opacity=0, azimuth=0, elevation=0)
    dark = view.picture()[:, :270].max(axis=2) < 150  # the bar of depths is on the right
    centre = manifolds.manifolds["centre"][0]
    reach = viewer.NORMAL_LENGTH * np.sqrt(3)  # the diagonal of the box is sqrt(3)
    columns = np.flatnonzero(dark[int(projected(view, centre)[1])])
    start, end = (projected(view, centre + [0, y, 0])[0] for y in (0, reach))
    assert abs(columns[0] - start) <= viewer.POINT_PIXELS and abs(columns[-1] - end) <= 4


def test_distances_are_lines_between_the_nearest_points(shown, box):
    instances = tandem.instances([0, 0], translation=[[0, 0, 0], [0, 2, 0]])
    found = tandem.Scene([box], instances).distances()
    view = shown([box], instances, distances=found, azimuth=0, elevation=20)
    picture = hues(view.picture())
    for share in (0.25, 0.5, 0.75):
        row = found.distances[0]
        x, y, _ = projected(view, (1 - share) * row["point_a"] + share * row["point_b"])
        assert picture[int(y) - 1:int(y) + 2, int(x), 1].max() > 0.5


def test_bars_of_colours_are_beside_each_other_and_beside_the_bodies(shown, cow):
    instances = tandem.instances([0, 0, 0], translation=[[0, 0, 0], [0.3, 0.2, 0], [2.5, 0, 0]])
    distances = tandem.Scene([cow], instances).distances()
    for manifolds, columns in ((False, 1), (True, 2)):
        view = shown([cow], instances, distances=distances, manifolds=manifolds)
        bars = [bar for _, bar in view.plotter.scalar_bars.items()]
        left = sorted(bar.GetPosition()[0] for bar in bars)
        assert len(bars) == columns and all(next - one >= bars[0].GetPosition2()[0] for one, next in zip(left, left[1:]))
        vertices = cow.triangles().reshape(-1, 3)
        x = np.array([projected(view, vertices + row["translation"])[:, 0] for row in instances])
        assert 0 <= x.min() and x.max() < left[0] * SIZE[0]


def test_a_legend_of_one_level_has_its_number(shown, box):
    pictures = []
    for label in ("level 0", "level 1"):
        view = shown(box, color="level", size=(900, 562))
        legend = view.plotter.renderer.legend
        assert legend.GetEntryString(0) == "level 0"
        legend.SetEntryString(0, label)
        pictures.append(view.picture())
    assert not np.array_equal(*pictures)


def test_nothing_found_draws_nothing(shown, box):
    instances = tandem.instances([0, 0], translation=[[0, 0, 0], [0, 3, 0]])
    bare = shown([box], instances, opacity=0.35).picture()
    found = shown([box], instances, contacts=True, manifolds=True)
    assert np.array_equal(found.picture(), bare)


# ---- Trees and levels

def test_boxes_of_every_depth_hold_the_mesh(cow):
    triangles = cow.triangles()
    depth = cow.levels[0].depth
    np.testing.assert_allclose(tree.boxes(cow, 0), cow.bounds[None], atol=1e-6)
    count = 0
    for at in range(depth + 1):
        boxes = tree.boxes(cow, at)
        inside = (boxes[:, None, 0] <= triangles.min(axis=1)) & (triangles.max(axis=1) <= boxes[:, None, 1])
        assert inside.all(axis=2).any(axis=0).all() and count < len(boxes) <= 4 ** at
        count = len(boxes)
    assert count == len(triangles)
    assert len(tree.boxes(cow, depth + 3)) == count
    with pytest.raises(IndexError):
        tree.boxes(cow, 1, level=1)
    with pytest.raises(ValueError):
        tree.boxes(cow, -1)


def test_edges_of_boxes_are_drawn_at_the_poses_of_bodies(shown, box):
    instances = tandem.instances([0, 0], rotation=[np.eye(3), TURNED], translation=[[0, 0, 0], [0, 3, 0]])
    view = shown([box], instances, tree_depth=0, opacity=0)
    lines = ~is_backdrop(view.picture())
    low, high = box.bounds
    for row in instances:
        for axis in range(3):
            middle = np.where(np.arange(3) == axis, (low + high) / 2, high)
            x, y, _ = projected(view, row["rotation"] @ middle + row["translation"])
            assert lines[int(y) - 1:int(y) + 2, int(x) - 1:int(x) + 2].any()
    assert lines.mean() < 0.1
    view.show_tree(None)
    assert is_backdrop(view.picture()).all()


@pytest.fixture(scope="module")
def levelled(tmp_path_factory):
    """A cow of several levels, and its file."""
    path = tmp_path_factory.mktemp("levels") / "cow.bvh"
    subprocess.run([os.environ["TANDEM_BVHBUILD"], SOURCE_DIR / "assets/cow_1500.obj", "-o", path, "-q", "--levels", "1%,3%"], check=True)
    return tandem.Asset.load(path), path


def test_levels_are_those_asked_for(shown, levelled):
    asset, _ = levelled
    coarsest = len(asset.levels) - 1
    assert coarsest >= 1
    instances = tandem.instances([0, 0], translation=[[0, 0, 0], [0, 2, 0]])
    view = shown([asset], instances, levels=[0, coarsest], color="level")
    assets = [asset, asset.levels_from(coarsest)]
    expected = body_of_pixels(view, assets, tandem.instances([0, 1], translation=instances["translation"]))
    colours = matplotlib.colormaps["viridis"]([0.0, 0.8], bytes=True)[:, :3]
    picture = view.picture()
    for body in (0, 1):
        where = (expected == body) & inner(expected)
        assert np.median(hue_distance(hues(picture[where])[:, 0], hues(colours[body])[0])) < 0.03
    np.testing.assert_array_equal(tree.boxes(asset, 99, coarsest), tree.boxes(assets[1], 99))
    assert len(tree.boxes(assets[1], 99)) == asset.levels[coarsest].triangle_count


def test_what_is_found_is_found_at_the_levels_shown(shown, levelled):
    asset, _ = levelled
    instances = tandem.instances([0, 0], translation=[[0, 0, 0], [0, 0.3, 0]])
    coarse = asset.levels_from(len(asset.levels) - 1)
    expected = shown([coarse], instances, contacts=True).picture()
    assert np.array_equal(shown([asset], instances, contacts=True, levels=len(asset.levels) - 1).picture(), expected)
    assert not np.array_equal(shown([asset], instances, contacts=True).picture(), expected)


# ---- Files

def test_a_scene_file_is_read_with_its_levels_and_motions(levelled, tmp_path):
    path = tmp_path / "scene.h5"
    with h5py.File(path, "w") as file:
        file["assets"] = [os.fspath(levelled[1])]
        file["instances/asset"], file["instances/level"] = np.zeros(2, "u4"), np.array([1, 0], "u1")
        file["instances/rotation"], file["instances/translation"] = np.stack([np.eye(3), TURNED]), np.arange(6.0).reshape(2, 3)
        file["simulation/motion"] = np.array([0, 1])
    scene = scene_files.read(path)
    assert (scene.level.tolist(), scene.motion.tolist(), scene.steps.tolist()) == ([1, 0], [0, 1], [0])
    assert np.array_equal(scene.instances()["rotation"][1], TURNED) and scene.instances()["translation"][1].tolist() == [3, 4, 5]
    picture = tandem.view(path, off_screen=True, size=SIZE)
    assert picture.shape == (SIZE[1], SIZE[0], 3) and picture.dtype == np.uint8


@pytest.mark.parametrize(("name", "rows"), [("simulation/motion", [1, 1]), ("instances/group", [1, 2]), ("excluded", [[1, 0]]),
                                            ("pairs", np.zeros((0, 2), "u4"))])
def test_pairs_that_a_scene_file_leaves_out_are_not_red(shown, box, tmp_path, name, rows):
    box.save(tmp_path / "box.bvh")
    with h5py.File(tmp_path / "scene.h5", "w") as file:
        file["assets"], file["instances/asset"] = ["box.bvh"], np.zeros(2, "u4")
        file["instances/rotation"], file["instances/translation"] = np.stack([np.eye(3)] * 2), np.array([[0, 0, 0], [0.5, 0, 0]])
        if name == "instances/group":
            file["instances/mask"] = np.array([1, 2], "u4")
    whole = shown(tmp_path / "scene.h5", contacts=True, color="level")
    with h5py.File(tmp_path / "scene.h5", "r+") as file:
        file[name] = np.array(rows, "u4")
    limited = shown(tmp_path / "scene.h5", contacts=True, color="level")
    bare = shown(tmp_path / "scene.h5", opacity=limited.opacity, color="level")
    assert not np.array_equal(whole.picture(), bare.picture()) and np.array_equal(limited.picture(), bare.picture())


def test_a_run_shows_its_steps_and_sliders_choose(shown, box, tmp_path):
    write_run(tmp_path / "run.h5", box)
    scene = scene_files.read(tmp_path / "run.h5")
    assert scene.steps.tolist() == [0, 5, 10]
    corners = scene.rotation[1, 1] @ BOX_VERTICES.T + scene.translation[1, 1][:, None]
    np.testing.assert_allclose([corners.min(axis=1), corners.max(axis=1)], [[-0.5, 1.4, -0.5], [0.5, 2.4, 0.5]], atol=1e-12)
    view = shown(tmp_path / "run.h5", contacts=True, manifolds=True, opacity=0.5)
    assert view.state == 2
    far = view.picture()
    for step, meets in ((0, True), (5, False), (0, True)):
        view.show_step(step)
        saturated = hues(view.picture())
        red = (hue_distance(saturated[..., 0], RED) < 0.05) & (saturated[..., 1] > 0.6)
        assert red.any() == meets
    view.show_step(10)
    assert np.array_equal(view.picture(), far)  # without contacts, points, or the bar of their depths
    with pytest.raises(ValueError, match=r"step 3: the run keeps the states after \[0, 5, 10\]"):
        view.show_step(3)
    view.show_tree(1)
    view.add_sliders()
    step, depth = view.plotter.widgets.slider_widgets
    for slider, value in ((step, 6.0), (depth, 1.7)):
        slider.GetRepresentation().SetValue(value)
        slider.InvokeEvent("InteractionEvent")
    assert (view.state, view.tree_depth) == (1, 2)


def test_no_assets_are_kept_once_a_view_is_closed(box, tmp_path):
    program = ("import sys, tandem\nfrom tandem.viewer import View\n"
               "view = View(sys.argv[1], off_screen=True, tree_depth=1)\nview.add_sliders()\nview.picture()\nview.close()\n")
    write_run(tmp_path / "run.h5", box)
    result = subprocess.run([sys.executable, "-c", program, tmp_path / "run.h5"], capture_output=True, text=True)
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")


# ---- Arguments, and the command

@pytest.mark.parametrize(("options", "text"), [
    ({"color": "mood"}, "color 'mood': is none of body, asset, level"),
    ({"levels": 0, "contacts": "found"}, "contacts: belong to one state, at its levels"),
    ({"levels": -1}, "levels: -1 is not from 0 to"),
    ({"levels": [0, 0]}, r"levels: has shape \(2,\); one number or \(1,\) is needed"),
    ({"motion": 9}, "motion: 9 is not from 0 to 3"),
    ({"opacity": 2}, "opacity 2: is not from 0 to 1"),
    ({"opacity": np.nan}, "opacity nan: is not from 0 to 1"),
    ({"size": (0, 0)}, r"size \(0, 0\): is not a width and a height in pixels"),
    ({"size": 3}, "size 3: is not a width"),
    ({"step": 4}, "step 4: the run keeps the states after"),
])
def test_arguments_that_do_not_fit_are_named(box, options, text):
    if options.get("contacts"):
        options = options | {"contacts": tandem.Scene([box], translation=[[0, 0, 0]]).contacts()}
    with pytest.raises(ValueError, match=text):
        tandem.view(box, off_screen=True, **options)


@pytest.mark.parametrize(("name", "given"), [("contacts", None), ("contacts", np.True_), ("manifolds", np.zeros(3)), ("distances", True), ("levels", 0.5),
                                             ("motion", "fixed")])
def test_arguments_of_another_type_are_named(box, name, given):
    with pytest.raises(TypeError, match=f"^{name}: "):
        tandem.view(box, off_screen=True, **{name: given})


def test_what_is_missing_is_named_with_how_to_install_it(monkeypatch, box):
    monkeypatch.delitem(sys.modules, "tandem.viewer")
    monkeypatch.setitem(sys.modules, "pyvista", None)
    with pytest.raises(ImportError, match=r"needs pyvista, vtk and h5py: pip install '\.\[view\]' in the folder of the sources"):
        tandem.view(box, off_screen=True)


def test_places_and_scenes_that_cannot_be_shown_are_refused(box, tmp_path):
    nowhere = tandem.instances([0])
    nowhere["translation"][0, 1] = np.nan
    with pytest.raises(ValueError, match="not in a finite place"):
        tandem.view([box], nowhere, off_screen=True)
    with pytest.raises(ValueError, match="no body to show"):
        tandem.view([], off_screen=True)
    with pytest.raises(tandem.Error):
        tandem.view(box, off_screen=True, levels=1)
    with pytest.raises(ValueError, match="neither a scene nor a run"):
        with h5py.File(tmp_path / "empty.h5", "w"):
            pass
        tandem.view(tmp_path / "empty.h5", off_screen=True)
    for path, kind, reason in ((tmp_path / "none.h5", FileNotFoundError, "no such file or directory"), (tmp_path, IsADirectoryError, "is a directory")):
        with pytest.raises(kind) as caught:
            tandem.view(path, off_screen=True)
        assert str(caught.value) == f"{path}: {reason}"
    for name in ("garbage.h5", "mesh.obj"):
        (tmp_path / name).write_bytes(b"no scene" * 99)
        with pytest.raises(OSError, match=f"{name}: is neither a scene file nor a run file, which are HDF5, nor a .bvh file by its name; bvhbuild makes"):
            tandem.view(tmp_path / name, off_screen=True)
    with pytest.raises(ValueError, match="picture.jpg: is not a .png file"):
        tandem.view(box, picture=tmp_path / "picture.jpg")


@pytest.mark.parametrize(("name", "shape"), [("instances/translation", (2, 3)), ("instances/translation", (3, 2)), ("instances/rotation", (3, 9)),
                                             ("instances/level", (2,)), ("simulation/motion", (4,)), ("instances/group", (3, 1))])
def test_a_scene_file_whose_rows_do_not_fit_is_named(box, tmp_path, name, shape):
    box.save(tmp_path / "box.bvh")
    path = tmp_path / "scene.h5"
    rows = {"instances/asset": np.zeros(3, np.uint32), "instances/rotation": np.tile(np.eye(3), (3, 1, 1)), "instances/translation": np.zeros((3, 3)),
            name: np.zeros(shape)}
    with h5py.File(path, "w") as file:
        file["assets"] = ["box.bvh"]
        for place, array in rows.items():
            file[place] = array
    with pytest.raises(ValueError) as caught:
        tandem.view(path, off_screen=True)
    assert str(caught.value).startswith(f"{path}: {name} has shape {shape} where (3,")


@pytest.mark.parametrize(("name", "shape"), [("trajectory/position", (2, 2, 3)), ("trajectory/orientation", (1, 1, 4)), ("bodies/centre_of_mass", (1, 3)),
                                             ("bodies/motion", (5,))])
def test_a_run_file_whose_rows_do_not_fit_is_named(box, tmp_path, name, shape):
    path = tmp_path / "run.h5"
    write_run(path, box)
    with h5py.File(path, "a") as file:
        del file[name]
        file[name] = np.zeros(shape)
    with pytest.raises(ValueError) as caught:
        tandem.view(path, off_screen=True)
    assert str(caught.value).startswith(f"{path}: {name} has shape {shape} where (")


def test_a_path_of_an_asset_shows_the_asset(cow, tmp_path):
    cow.save(tmp_path / "cow.bvh")
    assert np.array_equal(tandem.view(tmp_path / "cow.bvh", off_screen=True, size=SIZE), tandem.view(cow, off_screen=True, size=SIZE))


def test_the_command_writes_the_picture_that_view_makes(box, tmp_path):
    write_run(tmp_path / "run.h5", box)
    result = command("view", tmp_path / "run.h5", "--step", "5", "--manifolds", "--width", "320", "--height", "200", "-o", tmp_path / "a.png")
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")
    written = (matplotlib.image.imread(tmp_path / "a.png")[..., :3] * 255).round().astype(np.uint8)
    assert np.array_equal(written, tandem.view(tmp_path / "run.h5", off_screen=True, step=5, manifolds=True, size=SIZE))


def test_the_command_says_what_is_wrong(box, tmp_path, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    box.save(tmp_path / "box.bvh")
    result = command("view", tmp_path / "box.bvh")
    text = "tandem: there is no display for a window; picture= and off_screen=True draw without one\n"
    assert (result.returncode, result.stderr) == (2, text)
    (tmp_path / "broken.bvh").write_bytes(b"no asset")
    result = command("view", tmp_path / "broken.bvh", "-o", tmp_path / "a.png")
    assert result.returncode == 2 and result.stderr.startswith("tandem: ") and "broken.bvh" in result.stderr
    result = command("view", tmp_path / "none.h5")
    assert (result.returncode, result.stderr) == (2, f"tandem: {tmp_path / 'none.h5'}: no such file or directory\n")
    result = command("view", tmp_path / "box.bvh", "-o", tmp_path / "a.png", "--width", "100000")
    assert result.returncode == 2 and re.fullmatch(r"tandem: size \(100000, 562\): is more than \d+ pixels wide or high, the most that can be drawn here\n", result.stderr)
    assert command("view").returncode == 1 and not (tmp_path / "a.png").exists()


def test_info_prints_statistics(box, tmp_path):
    box.save(tmp_path / "box.bvh")
    result = command("info", tmp_path / "box.bvh")
    assert result.returncode == 0 and json.loads(result.stdout) == box.statistics()


def test_what_the_page_shows_works(shown, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    build, bench = (os.environ[name] for name in ("TANDEM_BVHBUILD", "TANDEM_BVHBENCH"))
    (tmp_path / "slab.obj").write_text("v -20 -20 0\nv 20 -20 0\nv 20 20 0\nv -20 20 0\nf 1 2 3 4\n")
    for command_line in ([build, SOURCE_DIR / "assets/cow_1500.obj", "-o", "cow.bvh"], [build, "slab.obj", "-o", "slab.bvh"],
                         [bench, "scene", "lattice", "--mesh", "cow.bvh", "--count", "8", "-o", "scene.h5"],
                         [bench, "simulate", "pile", "--mesh", "cow.bvh", "--ground", "slab.bvh", "--count", "2", "--frames", "120",
                          "--trajectory", "60", "-o", "run.h5"]):
        subprocess.run(command_line, check=True, capture_output=True)
    page = (SOURCE_DIR / "docs/python_view.md").read_text()
    code, shell = ("\n".join(re.findall(rf"^```{language}\n(.*?)^```", page, re.MULTILINE | re.DOTALL)) for language in ("python", "sh"))
    on_screen = tandem.view
    monkeypatch.setattr(tandem, "view", lambda *what, **options: on_screen(*what, **{"off_screen": True, **options}))
    names = {}
    exec(code, names)
    assert names["image"].shape == (562, 900, 3) and (tmp_path / "step.png").exists()
    for line in shell.splitlines():
        words = shlex.split(line, comments=True)
        assert words[:3] == ["python3", "-m", "tandem"]
        result = command(*words[3:], *(["-o", "picture.png"] if words[3] == "view" and "-o" not in words else []))
        assert (result.returncode, result.stderr) == (0, ""), line
