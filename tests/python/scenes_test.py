"""The same contacts through C++ (bvhbench), C (scene_hash) and Python, by their hash: on the scenes of the comparison and on random ones."""
import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

import tandem

pytest.importorskip("h5py")
pytest.importorskip("xxhash")
from scene_files import hash_of, load_scene, save_scene  # noqa: E402

ASSETS = Path(os.environ["TANDEM_SOURCE_DIR"]) / "assets"
MODES = ("exact", "fast", "boxes")


def run(*words):
    return subprocess.run([str(word) for word in words], check=True, capture_output=True, text=True).stdout


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scenes")
    for name in ("box_12", "box_48", "box_192", "cow_1500", "cow", "cow_24000", "ground"):
        run(os.environ["TANDEM_BVHBUILD"], ASSETS / f"{name}.obj", "-o", folder / f"{name}.bvh", "--quiet", "--effort", "fast")
    return folder


def through_cpp(scene, mode, self_pairs, within):
    words = ["--mode", mode] + ["--self"] * self_pairs + (["--within", within] if within else [])
    told = json.loads(run(os.environ["TANDEM_BVHBENCH"], "query", scene, "--repeat", 1, "--json", *words))
    return told["object_pairs"], told["contacts"], told["hash"]


def through_c(scene, instances, names, mode, self_pairs, within):
    lines = [f"asset {scene.parent / name}" for name in names] + [f"instances {len(instances)}"]
    for row in instances:
        lines.append(" ".join([str(row["asset"])] + [repr(float(x)) for x in (*row["rotation"].ravel(), *row["translation"])]))
    text = scene.with_suffix(".txt")
    text.write_text("\n".join(lines) + "\n")
    pairs, contacts, told = run(os.environ["TANDEM_SCENE_HASH"], text, MODES.index(mode), 0, int(self_pairs), repr(float(within)), 1).split()
    return int(pairs), int(contacts), told


def through_python(scene, mode="exact", self_pairs=False, within=0.0, threads=1):
    assets, instances, pairs, filter = load_scene(scene)
    scene = tandem.Scene(assets, instances, filter=filter, threads=threads)
    found = scene.contacts(pairs=pairs, mode=mode, self_pairs=self_pairs, within=within)
    return len(found.pairs), len(found.contacts), hash_of(found.pairs, found.contacts)


@pytest.mark.parametrize("name, words", [
    *((f"stack {count}", ["stack", "--mesh", f"box_{count}.bvh", "--count", 1000]) for count in (12, 48, 192)),
    *((f"pile {mesh}", ["pile", "--mesh", f"{mesh}.bvh", "--count", 1000]) for mesh in ("cow_1500", "cow", "cow_24000")),
    *((f"slide {mesh}", ["slide", "--mesh", f"{mesh}.bvh", "--ground", "ground.bvh", "--count", 1000]) for mesh in ("cow_1500", "cow", "cow_24000")),
    ("exact stack", ["stack", "--mesh", "box_12.bvh", "--count", 1000, "--exact"]),
    ("coincident", ["coincident", "--mesh", "cow_1500.bvh", "--count", 10])])
def test_scenes_of_the_comparison(folder, name, words):
    scene = folder / (name.replace(" ", "_") + ".h5")
    run(os.environ["TANDEM_BVHBENCH"], "scene", words[0], *(folder / word if str(word).endswith(".bvh") else word for word in words[1:]), "-o", scene)
    expected = through_cpp(scene, "exact", False, 0.0)
    assert expected[1] > 0
    assert through_python(scene, threads=2) == expected


@pytest.mark.parametrize("mode, self_pairs, within", [("exact", False, 0.0), ("exact", True, 0.0), ("fast", False, 0.0), ("boxes", True, 0.0),
                                                      ("exact", False, 0.05)])
def test_random_scenes(folder, mode, self_pairs, within):
    names = ["box_12.bvh", "box_192.bvh", "cow_1500.bvh"]
    random = np.random.default_rng([17, MODES.index(mode), self_pairs, bool(within)])
    met = 0
    for number in range(20):
        count = int(random.integers(2, 12))
        rotations = np.linalg.qr(random.normal(size=(count, 3, 3)))[0]
        rotations[:, 0] *= np.sign(np.linalg.det(rotations))[:, None]
        spread = random.uniform(0.3, 2.0)
        instances = tandem.instances(random.integers(0, 3, count), rotations, random.normal(size=(count, 3)) * spread + random.choice([0, 1e3]))
        scene = folder / f"random_{number}.h5"
        save_scene(scene, names, instances)
        expected = through_cpp(scene, mode, self_pairs, within)
        assert through_c(scene, instances, names, mode, self_pairs, within) == expected
        assert through_python(scene, mode, self_pairs, within) == expected
        met += expected[1] > 0
    assert met > 10
