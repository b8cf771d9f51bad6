#!/usr/bin/python3
"""bvhbench query from the outside: what is in its files, and what it refuses.

Environment: that of tool_test.py, and TANDEM_BVHBENCH.
"""
import json
import os
import re
import shutil
import unittest

import h5py
import numpy as np

import bvh_file
from tool_test import BVHBUILD, CUBE_OBJ, DONE, SOURCE_DIR, UNREADABLE_INPUT, UNWRITABLE_OUTPUT, USAGE, ToolTest, limited_files

BVHBENCH = os.environ["TANDEM_BVHBENCH"]
IDENTITY = np.eye(3)


class BenchTest(ToolTest):
    """Each test has the unit cube, in/cube.bvh, and names for a scene and for contacts."""

    built_meshes = {}

    def setUp(self):
        super().setUp()
        self.mesh = self.mesh_of("cube", CUBE_OBJ)
        self.scene, self.contacts = self.outputs / "scene.h5", self.outputs / "contacts.h5"

    def mesh_of(self, name, content):
        path = self.inputs / f"{name}.bvh"
        if content not in self.built_meshes:
            self.succeeds(BVHBUILD, self.write(f"{name}.obj", content), "-o", path)
            self.built_meshes[content] = path.read_bytes()
        return self.write(path.name, self.built_meshes[content])

    def bench(self, *arguments, **options):
        return self.run_tool(BVHBENCH, *map(os.fspath, arguments), **options)

    def passes(self, *arguments, **options):
        return self.succeeds(BVHBENCH, *arguments, **options)

    def make(self, kind, *arguments, out=None):
        return self.passes("scene", kind, "--mesh", self.mesh, *arguments, "-o", out or self.scene)

    def query(self, *arguments):
        return json.loads(self.passes("query", self.scene, "--json", *arguments))

    def write_scene(self, asset=(0, 0), rotation=(IDENTITY, IDENTITY), translation=((0, 0, 0), (0.5, 0.5, 0.5)),
                    assets=("../in/cube.bvh",), **datasets):
        """A scene of two cubes that overlap. Other datasets by name with _ for /; None leaves one out."""
        fixed = isinstance(assets, np.ndarray)
        contents = {"assets": assets if fixed else np.array(assets, dtype=h5py.string_dtype()),
                    "instances/asset": np.array(asset, dtype="u4"), "instances/rotation": np.array(rotation, "f8"),
                    "instances/translation": np.array(translation, "f8")}
        contents.update({name.replace("_", "/"): data for name, data in datasets.items()})
        with h5py.File(self.scene, "w") as file:
            for name, data in contents.items():
                if data is not None:
                    file[name] = data

    def assert_refused(self, code, *words, arguments=(), **options):
        """The query fails with one line that names the scene file and holds the words."""
        result = self.bench("query", self.scene, "--out", self.contacts, *arguments, **options)
        self.assert_fails(result, code, *words)
        self.assertFalse(self.contacts.exists())


def datasets(path, *names):
    """The datasets of an HDF5 file by name: all of them, or these."""
    with h5py.File(os.fsencode(path)) as file:
        if not names:
            names = []
            file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
        return {name: file[name][()] for name in names}


def attributes(path):
    with h5py.File(path) as file:
        return dict(file.attrs)


def change(path, **columns):
    """Writes datasets of an HDF5 file anew: by name with _ for /, those that are None are taken out."""
    with h5py.File(path, "a") as file:
        for name, data in columns.items():
            name = name.replace("_", "/", 1)
            if name in file:
                del file[name]
            if data is not None:
                file[name] = data


def documented_keys(command, split="$^"):
    """The keys at the starts of the list items of a command's section of docs/json.md: a list for each part that the section is split into."""
    section = (SOURCE_DIR / "docs/json.md").read_text(encoding="utf-8").split(f"## `bvhbench {command}")[1].split("\n## ")[0]
    return [[key for line in part.split("\n") if line.startswith("- `") for key in re.findall(r"`(\w+)`", line.partition(":")[0])]
            for part in re.split(split, section)]


def documented_types(names):
    """The types of the datasets that docs/scenes.md lists: by name, type and shape of a row. names: a regular expression of what they start with."""
    kinds = {"u8": "uint8", "u32": "uint32", "u64": "uint64", "f64": "float64"}
    page = (SOURCE_DIR / "docs/scenes.md").read_text(encoding="utf-8")
    rows = re.findall(rf"^- (`/{names}.*?) \(([uf]\d+) \[\w\+?1?(,\d)?\]\)", page, re.M)
    return {name: (kinds[kind], (int(width[1]),) if width else ()) for row, kind, width in rows for name in re.findall(r"`/([\w/]+)`", row)}


def types_of(table):
    return {name: (str(column.dtype), column.shape[1:]) for name, column in table.items()}


def table_of(path):
    """The datasets of a contacts file, those of docs/scenes.md first and in that order."""
    table = datasets(path)
    first = ("pairs", "contacts/pair", "contacts/face_a", "contacts/face_b")
    return {name: table[name] for name in first} | {name: column for name, column in table.items() if name.startswith(("manifolds/", "points/"))}


class Query(BenchTest):
    def test_the_contacts_file_is_sorted_and_of_the_documented_types(self):
        self.make("pile", "--count", "50")
        self.query("--out", self.contacts)
        table = table_of(self.contacts)
        pairs = table["pairs"]
        self.assertEqual((pairs.dtype, pairs.shape[1]), ("u4", 2))
        self.assertTrue((pairs[:, 0] < pairs[:, 1]).all())
        self.assertEqual(pairs.tolist(), sorted(pairs.tolist()))
        rows = np.stack([table[f"contacts/{name}"] for name in ("pair", "face_a", "face_b")], 1)
        self.assertEqual(rows.dtype, "u4")
        self.assertGreater(len(rows), 50)
        self.assertEqual(rows.tolist(), sorted(rows.tolist()))
        self.assertLess(rows[:, 0].max(), len(pairs))
        self.assertLess(rows[:, 1:].max(), 6)

    def test_the_attributes_say_what_was_done(self):
        self.write_scene()
        report = self.query("--out", self.contacts, "--repeat", "3", "--threads", "2", "--mode", "boxes")
        told = attributes(self.contacts)
        for key in ("mode", "backend", "threads", "hash", "object_pairs", "block_pairs", "candidates",
                    "decided_by_float32", "decided_by_float64", "decided_exactly", "contacts"):
            self.assertEqual(told[key], report[key], key)
        self.assertEqual((told["mode"], told["backend"], told["repeats"]), ("boxes", "cpu", 3))
        self.assertEqual(told["tandem_version"], report["version"])
        self.assertEqual(told["best_seconds"], min(report["seconds"]["all"]))
        self.assertEqual(told["median_seconds"], sorted(report["seconds"]["all"])[1])
        self.assertEqual(len(report["seconds"]["all"]), 3)

    def test_the_hash_is_that_of_the_documentation(self):
        self.write_scene()
        hash_of_query = self.query("--out", self.contacts)["hash"]
        arrays = b"".join(column.astype("<u4").tobytes() for column in table_of(self.contacts).values())
        self.assertEqual(f"{bvh_file.xxh64(arrays):016x}", hash_of_query)

    def test_the_scene_of_the_documentation_is_one(self):
        snippet = (SOURCE_DIR / "docs" / "scenes.md").read_text().split("```python\n")[1].split("```")[0]
        self.mesh.rename(self.outputs / "cow.bvh")
        exec(snippet.replace('"scene.h5"', "path"), {"h5py": h5py, "np": np, "path": self.scene})
        self.assertGreater(self.query()["contacts"], 0)

    def test_the_keys_of_json_are_those_of_its_documentation(self):
        self.write_scene()
        keys = documented_keys("query", "\nWith `--")
        self.assertEqual(list(self.query()), keys[0])
        self.assertEqual(list(self.query("--manifolds", "--keep", "1e-3", "--contained")), keys[0] + keys[1] + keys[2] + keys[3])

    def test_two_cubes_cross_where_they_should(self):
        self.write_scene()
        self.query("--out", self.contacts)
        table = table_of(self.contacts)
        self.assertEqual(table["pairs"].tolist(), [[0, 1]])
        # Quads 1, 3, 4 of the lower cube (z, x, y = 1) meet 0, 5, 2 (z, x, y = 0) of the upper, not the parallel ones.
        met = set(zip(table["contacts/face_a"].tolist(), table["contacts/face_b"].tolist()))
        self.assertEqual(met, {(1, 5), (1, 2), (3, 0), (3, 2), (4, 0), (4, 5)})

    def test_given_pairs_in_any_order_give_the_contacts_of_found_ones(self):
        self.make("pile", "--count", "40")
        self.query("--out", self.contacts)
        found = table_of(self.contacts)
        for pairs in (found["pairs"], found["pairs"][::-1, ::-1], np.repeat(found["pairs"], 2, axis=0)[:, ::-1]):
            change(self.scene, pairs=pairs)
            report = self.query("--out", self.contacts)
            self.assertTrue(report["given_pairs"])
            for name, column in table_of(self.contacts).items():
                self.assertEqual(column.tolist(), found[name].tolist())

    def test_neither_scene_nor_mesh_is_overwritten_by_contacts(self):
        self.write_scene()
        for path in (self.scene, self.mesh):
            before = path.read_bytes()
            self.assert_fails(self.bench("query", self.scene, "--out", path), USAGE, "would be overwritten")
            self.assertEqual(path.read_bytes(), before)

    def test_the_summary_is_for_people(self):
        self.write_scene()
        text = self.passes("query", self.scene)
        for word in ("instances", "object pairs", "block pairs", "candidates", "contacts", "milliseconds"):
            self.assertIn(word, text)

    def test_a_folder_with_scene_and_mesh_can_move(self):
        folder = self.root / "Kühe & 牛 grasen"
        folder.mkdir()
        shutil.move(self.mesh, folder / "Kuh 1.bvh")
        self.mesh, self.scene = folder / "Kuh 1.bvh", folder / "Szene ñ.h5"
        self.make("coincident", "--count", "1")
        with h5py.File(os.fsencode(self.scene)) as file:
            self.assertEqual(file["assets"].asstr()[0], "Kuh 1.bvh")
        before = self.query()
        self.scene = folder.rename(self.root / "moved") / self.scene.name
        self.assertEqual(self.query("--out", folder.parent / "Kontakte ö.h5")["hash"], before["hash"])

    def test_integers_and_floats_of_other_sizes_and_fixed_strings_are_taken(self):
        self.write_scene()
        expected = self.query()["hash"]
        self.write_scene(assets=np.array([b"../in/cube.bvh"]), instances_asset=np.zeros(2, "<i8"),
                         instances_rotation=np.array([IDENTITY] * 2, ">f4"),
                         instances_translation=np.array([[0, 0, 0], [0.5] * 3], "f2"))
        self.assertEqual(self.query()["hash"], expected)

    def test_compressed_datasets_are_read(self):
        self.make("pile", "--count", "500")
        expected = self.query()["hash"]
        with h5py.File(self.scene, "a") as file:
            for name in ("rotation", "translation", "asset"):
                data = file[f"instances/{name}"][:]
                del file[f"instances/{name}"]
                file["instances"].create_dataset(name, data=data, compression="gzip", shuffle=True)
        self.assertEqual(self.query()["hash"], expected)


class WrongScenes(BenchTest):
    def test_what_is_no_file_is_told(self):
        self.assert_refused(UNREADABLE_INPUT, self.scene, "no such file")
        self.scene.mkdir()
        self.assert_refused(UNREADABLE_INPUT, self.scene, "is a folder")
        self.scene.rmdir()
        os.mkfifo(self.scene)
        self.assert_refused(UNREADABLE_INPUT, self.scene, "not a regular file")

    def test_what_is_no_hdf5_is_told(self):
        for content in (b"", b"\x89HDF\r\n\x1a", b"hello\n" * 1000, self.mesh.read_bytes()):
            self.scene.write_bytes(content)
            self.assert_refused(UNREADABLE_INPUT, self.scene, "not an HDF5 file")

    def test_a_missing_dataset_is_named(self):
        for name in ("assets", "instances_asset", "instances_rotation", "instances_translation"):
            self.write_scene()
            change(self.scene, **{name: None})
            self.assert_refused(UNREADABLE_INPUT, self.scene, "/" + name.replace("_", "/"), "no such dataset")

    def test_a_wrong_shape_or_type_is_named(self):
        for change, words in (({"instances_rotation": np.zeros((2, 9))}, ("/instances/rotation", "expected 3 dimensions, found 2")),
                              ({"instances_rotation": np.zeros((2, 3, 4))}, ("expected n x 3 x 3, found 2 x 3 x 4",)),
                              ({"instances_translation": np.zeros((3, 3))}, ("2 assets, 2 rotations and 3 translations",)),
                              ({"instances_translation": np.zeros((2, 2))}, ("expected n x 3, found 2 x 2",)),
                              ({"instances_asset": np.uint32(0)}, ("expected 1 dimension, found 0",)),
                              ({"instances_asset": np.zeros(2)}, ("expected integers, found floating-point",)),
                              ({"instances_asset": np.zeros(2, bool)}, ("found an enumeration",)),
                              ({"instances_asset": np.array([0, -1])}, ("/instances/asset",)),
                              ({"instances_asset": np.array([0, 1 << 40])}, ("/instances/asset",)),
                              ({"instances_asset": h5py.Empty("u4")}, ("expected 1 dimension, found 0",)),
                              ({"instances_rotation": np.zeros((2, 3, 3), "S1")}, ("found strings",)),
                              ({"instances_translation": np.zeros((2, 3), np.longdouble)}, ("more than 64 bits",)),
                              ({"instances_translation": np.full((2, 3), (1 << 62) + 1)}, ("/instances/translation",)),
                              ({"pairs": np.zeros((1, 3), "u4")}, ("/pairs", "expected n x 2, found 1 x 3")),
                              ({"pairs_x": np.zeros(1)}, ("/pairs", "not a dataset")),
                              ({"instances_group": np.zeros(3, "u4")}, ("/instances/group: 3 rows for 2 instances",)),
                              ({"instances_mask": np.zeros(1, "u4")}, ("/instances/mask: 1 rows for 2 instances",)),
                              ({"instances_mask": np.array([0, 1 << 32])}, ("/instances/mask",)),
                              ({"simulation_motion": np.zeros(0, "u1")}, ("/simulation/motion: 0 rows for 2 instances",)),
                              ({"simulation_motion": np.array([0, 4])}, ("/simulation/motion: instance 1: 4 is none of 0 moving",)),
                              ({"excluded": np.zeros(2, "u4")}, ("/excluded", "expected 2 dimensions, found 1"))):
            with self.subTest(words=words):
                self.write_scene(**change)
                self.assert_refused(UNREADABLE_INPUT, self.scene, *words)

    def test_indices_out_of_range_are_named(self):
        self.write_scene(asset=(0, 1))
        self.assert_refused(UNREADABLE_INPUT, self.scene, "instance 1 is of asset 1 of 1")
        self.write_scene(pairs=np.array([[0, 1], [2, 0]], "u4"))
        self.assert_refused(UNREADABLE_INPUT, self.scene, "/pairs: row 1 names instance 2 of 2")
        self.write_scene(excluded=np.array([[0, 1], [0, 0], [7, 1]], "u4"))
        self.assert_refused(UNREADABLE_INPUT, self.scene, "/excluded: row 2 names instance 7 of 2")

    def test_an_asset_that_cannot_be_read_is_named(self):
        whole = self.mesh.read_bytes()
        for name, content, told in (("none.bvh", None, "no such file"), ("cut.bvh", whole[:-1], "shorter"),
                                    ("flipped.bvh", whole[:600] + bytes([whole[600] ^ 1]) + whole[601:], "hash"),
                                    ("walk.bvh", b"HIERARCHY\nROOT Hips\n", "motion capture")):
            if content is not None:
                self.write(name, content)
            self.write_scene(assets=(f"../in/{name}",))
            self.assert_refused(UNREADABLE_INPUT, self.scene, name, told)
        self.write_scene(assets=("",))
        self.assert_refused(UNREADABLE_INPUT, self.scene, "/assets: row 0 is empty")

    def test_more_values_than_the_file_holds_are_refused_before_they_are_allocated(self):
        for layout in ({}, {"chunks": (1000, 3, 3)}, {"chunks": (1000, 3, 3), "compression": "gzip"},
                       {"maxshape": (None, 3, 3), "chunks": (1 << 24, 3, 3), "compression": "gzip"}):
            self.write_scene(instances_rotation=None)
            with h5py.File(self.scene, "a") as file:
                file["instances"].create_dataset("rotation", (1 << 40, 3, 3), "f8", **layout)
            self.assert_refused(UNREADABLE_INPUT, self.scene, "/instances/rotation", "more values than the file holds")

    def test_values_in_other_files_are_not_read(self):
        secret = self.write("secret", np.zeros(2, "u4").tobytes())
        self.write_scene(instances_asset=None)
        with h5py.File(self.scene, "a") as file:
            file["instances"].create_dataset("asset", (2,), "u4", external=[(os.fsencode(secret), 0, 8)])
        self.assert_refused(UNREADABLE_INPUT, "/instances/asset", "other files")
        other = self.inputs / "other.h5"
        with h5py.File(other, "w") as file:
            file["asset"] = np.zeros(2, "u4")
        self.write_scene(instances_asset=h5py.ExternalLink(os.fspath(other), "asset"))
        self.assert_refused(UNREADABLE_INPUT, "/instances/asset")

    def test_no_damage_to_a_scene_crashes_the_query(self):
        self.write_scene()
        whole = self.scene.read_bytes()
        random = np.random.default_rng(7)
        for length in range(0, len(whole), len(whole) // 6):
            self.scene.write_bytes(whole[:length])
            self.assertEqual(self.bench("query", self.scene).returncode, UNREADABLE_INPUT)
        for _ in range(30):
            damaged = bytearray(whole)
            for place in random.integers(0, len(whole), 3):
                damaged[place] = random.integers(256)
            self.scene.write_bytes(damaged)
            self.assertIn(self.bench("query", self.scene).returncode, (DONE, UNREADABLE_INPUT))


class BenchUsage(BenchTest):
    def test_help_names_commands_and_options(self):
        for arguments, words in (([], ("scene", "query", "Exit codes")), (["scene"], ("stack", "pile", "lattice", "slide", "coincident")),
                                 (["query"], ("SCENE", "--mode", "--first-contact", "--self", "--threads", "--repeat",
                                              "--out", "--json", "--backend"))):
            text = self.passes(*arguments, "--help")
            for word in words:
                self.assertIn(word, text)
        self.assertRegex(self.passes("--version"), r"^bvhbench \d+\.\d+\.\d+\n$")

    def test_wrong_arguments_are_told(self):
        self.write_scene()
        self.assert_fails(self.bench(), USAGE)
        self.assert_fails(self.bench("query"), USAGE, "SCENE")
        for words, told in ((["--backend", "abacus"], "abacus"), (["--mode", "0"], "--mode"),
                            (["--threads", "0"], "--threads"), (["--repeat", "0"], "--repeat"), (["--out", ""], "--out"),
                            (["more.h5"], "more.h5"), (["--fast"], "--fast")):
            with self.subTest(words=words):
                self.assert_fails(self.bench("query", self.scene, *words), USAGE, told)

    def test_self_with_given_pairs_is_refused(self):
        self.write_scene(pairs=np.array([[0, 1]], "u4"))
        self.assert_refused(USAGE, self.scene, "--self", arguments=["--self"])


class BenchOutput(BenchTest):
    def failing(self, path, *words, **options):
        self.write_scene()
        for command in (["query", self.scene, "--out", path], ["scene", "pile", "--mesh", self.mesh, "-o", path]):
            self.assert_fails(self.bench(*command, **options), UNWRITABLE_OUTPUT, path, *words)

    def test_outputs_that_cannot_be_written_are_told_and_leave_nothing(self):
        self.failing("/dev/full", "No space left on device")
        self.failing(self.outputs / "none" / "a.h5", "No such file or directory")
        self.failing(self.inputs, "is a folder")
        self.failing(self.outputs / "a.h5", "File too large", **limited_files(1024))
        self.assertEqual(os.listdir(self.outputs), ["scene.h5"])
        self.assert_full_disk_is_told(BVHBENCH, "scene", "pile", "--mesh", self.mesh)

    def test_an_output_that_cannot_be_written_is_left_as_it_was(self):
        self.contacts.write_bytes(b"older")
        self.write_scene(rotation=(IDENTITY, 2 * IDENTITY))
        self.assertEqual(self.bench("query", self.scene, "--out", self.contacts).returncode, UNREADABLE_INPUT)
        self.assertEqual(self.contacts.read_bytes(), b"older")

    def test_a_summary_that_cannot_be_printed_is_an_error(self):
        self.write_scene()
        with open("/dev/full", "wb") as full:
            self.assertEqual(self.bench("query", self.scene, stdout=full).returncode, UNWRITABLE_OUTPUT)

    def test_only_the_output_is_written(self):
        self.make("pile", "--count", "30")
        self.query("--out", self.contacts)
        self.assertEqual(sorted(os.listdir(self.outputs)), ["contacts.h5", "scene.h5"])


if __name__ == "__main__":
    unittest.main()
