#!/usr/bin/python3
"""Programs for Windows under Wine: they need no DLL but those of Windows, and do what those of this machine do, to the byte.

Environment: TANDEM_BUILD (the preset windows), TANDEM_NATIVE_BUILD (a build of this machine), TANDEM_SOURCE_DIR; TANDEM_MESHES: a folder of meshes, else
../shared/meshes beside the sources. What compares meshes of it is skipped (exit code 77) where it is not there.
"""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import h5py

from linked_programs import BUILD, SKIPPED, SOURCE_DIR, LinkedPrograms, run_tests

NATIVE = pathlib.Path(os.environ["TANDEM_NATIVE_BUILD"])
MESHES = pathlib.Path(os.environ.get("TANDEM_MESHES", SOURCE_DIR.parent / "shared" / "meshes"))
BVHBUILD, BVHINFO, BVHBENCH = "tools/bvhbuild/bvhbuild", "tools/bvhinfo/bvhinfo", "tools/bvhbench/bvhbench"
ANSWERS, SCENE_HASHES, VARIANTS = "tests/platforms/answers", "tests/platforms/scene_hashes", "tests/kernels/variant_check"
UNREADABLE_INPUT, UNWRITABLE_OUTPUT = 2, 4


def windows(program, *arguments, **options):
    return subprocess.run(["wine", BUILD / (program + ".exe"), *arguments], capture_output=True, text=True, encoding="utf-8", **options)


def native(program, *arguments, **options):
    return subprocess.run([NATIVE / program, *arguments], capture_output=True, text=True, encoding="utf-8", **options)


class Folder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)

    def files(self, folder=None):
        return sorted(file.name for file in (folder or self.root).iterdir())

    def compare_builds(self, meshes):
        """Builds each mesh on both sides, and expects the same code, message and bytes. Returns how many files there were."""
        written = 0
        for mesh in meshes:
            with self.subTest(mesh=mesh.name):
                here, there = self.root / "native.bvh", self.root / "windows.bvh"
                for file in (here, there):
                    file.unlink(missing_ok=True)
                ours = native(BVHBUILD, mesh, "-o", here, "--quiet", "--reader", "tandem")
                theirs = windows(BVHBUILD, mesh, "-o", there, "--quiet", "--reader", "tandem")
                self.assertEqual((theirs.returncode, theirs.stderr), (ours.returncode, ours.stderr))
                self.assertEqual(there.exists(), here.exists())
                if here.exists():
                    self.assertEqual(there.read_bytes(), here.read_bytes())
                    written += 1
        return written


class Programs(LinkedPrograms, unittest.TestCase):
    programs, library = (BUILD / (BVHBUILD + ".exe"), BUILD / (BVHINFO + ".exe")), BUILD / "bindings/c/libtandem.dll"
    system = {"kernel32.dll", "msvcrt.dll", "psapi.dll", "user32.dll", "advapi32.dll", "shell32.dll"}

    @staticmethod
    def headers(file):
        return subprocess.run(["x86_64-w64-mingw32-objdump", "-p", file], capture_output=True, text=True, check=True).stdout

    def loaded_by(self, file):
        return {name.lower() for name in re.findall(r"DLL Name: (\S+)", self.headers(file))}

    def exported_by(self, file):
        listed = self.headers(file)
        return set(re.findall(r"^\s*\[\s*\d+\] (?:\+base\[\s*\d+\]\s+\S+ )?(\S+)$", listed[listed.index("[Ordinal/Name Pointer] Table"):], re.MULTILINE))


class SimdWays(unittest.TestCase):
    def test_all_ways_find_what_they_find_on_this_machine(self):
        ours, theirs = native(VARIANTS), windows(VARIANTS)
        self.assertEqual((theirs.returncode, theirs.stdout.split()), (ours.returncode, ours.stdout.split()))
        self.assertEqual(ours.returncode, 0)


class Bytes(Folder):
    def test_files_of_our_meshes_are_the_same(self):
        meshes = sorted((SOURCE_DIR / "assets").glob("*.obj"))
        self.assertEqual(self.compare_builds(meshes), len(meshes))

    def test_options_change_the_same_bytes(self):
        for words in (["--levels", "0.01"], ["--effort", "fast", "--imaginary", "free"], ["--no-gpu-blocks", "--no-topology"]):
            with self.subTest(words=words):
                here, there, cow = self.root / "native.bvh", self.root / "windows.bvh", SOURCE_DIR / "assets/cow_1500.obj"
                for result in (native(BVHBUILD, cow, "-o", here, "--quiet", *words), windows(BVHBUILD, cow, "-o", there, "--quiet", *words)):
                    self.assertEqual((result.returncode, result.stderr), (0, ""))
                self.assertEqual(there.read_bytes(), here.read_bytes())


class SharedMeshes(Folder):
    def test_files_of_collected_meshes_are_the_same(self):
        meshes = sorted(file for file in MESHES.iterdir() if file.suffix not in (".tsv", ".bin"))
        self.assertGreater(self.compare_builds(meshes), 20)


class Answers(Folder):
    """Hashes of the rows of questions about heaps of bodies."""

    def test_answers_are_the_same(self):
        files = []
        for mesh in ("box_12", "cow_1500", "cow"):
            files.append(self.root / f"{mesh}.bvh")
            self.assertEqual(native(BVHBUILD, SOURCE_DIR / f"assets/{mesh}.obj", "-o", files[-1], "--quiet").returncode, 0)
        ours, theirs = native(ANSWERS, *files), windows(ANSWERS, *files)
        self.assertEqual((ours.returncode, theirs.returncode), (0, 0), ours.stdout + theirs.stdout)
        self.assertEqual(self.without_sines(theirs.stdout), self.without_sines(ours.stdout))
        self.assertGreater(ours.stdout.count("contacts"), 2)

    @staticmethod
    def without_sines(lines):
        """Turning bodies takes the C library's sines, which differ in the last bit: of these, the number of rows."""
        return [line.split()[:2] if line.split()[0] in ("impacts", "world") else line.split() for line in lines.splitlines()]


class BenchScenes(Folder):
    """Object pairs, contacts and hashes of contacts of the bench's scenes. The Windows programs have no HDF5: they make the scenes themselves, and take positions of bodies that bend from raw files."""

    def bvh(self, mesh):
        path = self.root / f"{mesh}.bvh"
        if not path.exists():
            self.assertEqual(native(BVHBUILD, SOURCE_DIR / f"assets/{mesh}.obj", "-o", path, "--quiet").returncode, 0)
        return path

    def asked(self, *words):
        """What bvhbench finds on this machine."""
        result = native(BVHBENCH, "query", *words, "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        report = json.loads(result.stdout)
        return f"{report['object_pairs']} {report['contacts']} {report['hash']}"

    def hashes(self, *words):
        result = windows(SCENE_HASHES, *words)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        return result.stdout.splitlines()

    def test_scenes_of_every_kind_have_the_same_contacts(self):
        boxes, cows = ("box_12", "box_48", "box_192"), ("cow_1500", "cow", "cow_24000")
        scenes = [("stack", 1000, mesh, []) for mesh in boxes] + [("pile", 1000, mesh, []) for mesh in cows] + [("slide", 2500, mesh, ["--ground", self.bvh("ground")]) for mesh in cows]
        scenes += [("exact-stack", 1000, "box_12", ["--exact"]), ("coincident", 50, "cow_1500", []), ("lattice", 1000, "cow", []), ("field", 1000, "cow_1500", ["--fixed", 10000])]
        for kind, count, mesh, words in scenes:
            with self.subTest(kind=kind, mesh=mesh):
                scene, body = self.root / "scene.h5", self.bvh(mesh)
                made = native(BVHBENCH, "scene", kind.removeprefix("exact-"), "--mesh", body, "--count", str(count), *map(str, words), "-o", scene)
                self.assertEqual(made.returncode, 0, made.stderr)
                self.assertEqual(self.hashes(kind, str(count), body, *[word for word in words if word == self.bvh("ground")]), [self.asked(scene)])

    def test_bodies_that_bend_have_the_same_contacts(self):
        kinds = re.findall(r'"(\w+)"', re.search(r"^KINDS = .*", (SOURCE_DIR / "scripts/make_deformations").read_text(encoding="utf-8"), re.MULTILINE)[0])
        self.assertGreater(len(kinds), 11)
        for kind in kinds:
            with self.subTest(kind=kind):
                body, scene = self.bvh("ground" if kind == "cloth" else "cow_1500"), self.root / "bent.h5"
                subprocess.run([sys.executable, SOURCE_DIR / "scripts/make_deformations", kind, body, "-o", scene, "--frames", "5"], check=True)
                frames = []
                with h5py.File(scene) as file:
                    beside = [repr(float(x)) for x in file["instances/translation"][1]]
                    for positions in file["deformations/0"]:
                        frames.append(self.root / f"{len(frames)}.f32")
                        frames[-1].write_bytes(positions.astype("<f4").tobytes())
                found = self.hashes("bend", body, body, *beside, *frames)
                self.assertEqual(found, [self.asked(scene, "--frame", str(frame)) for frame in range(5)])
                self.assertGreater(len(set(found)), 2)


class Paths(Folder):
    def test_names_may_hold_blanks_and_letters_of_any_script(self):
        folder = self.root / "Ein Ordner \u4e2d\u6587 \u0440\u0443\u0441"
        folder.mkdir()
        mesh, out = folder / "K\u00fche \U0001f404.obj", folder / "K\u00fche \U0001f404.bvh"
        shutil.copy(SOURCE_DIR / "assets/box_48.obj", mesh)
        self.assertEqual(windows(BVHBUILD, mesh, "-o", out, "--quiet").stderr, "")
        self.assertEqual(self.files(folder), [out.name, mesh.name])
        self.assertIn(f'"{mesh.name}"'.encode(), out.read_bytes())
        shown = windows(BVHINFO, "K\u00fche \U0001f404.bvh", cwd=folder)
        self.assertEqual((shown.returncode, shown.stderr), (0, ""))
        self.assertIn(out.name, shown.stdout)
        self.assertNotIn("\r", shown.stdout)
        missing = windows(BVHBUILD, folder / "\u725b.obj", "-o", out)
        self.assertEqual(missing.returncode, UNREADABLE_INPUT)
        self.assertIn("\u725b.obj: no such file", missing.stderr)


class Outputs(Folder):
    def test_a_file_is_replaced_and_nothing_else_is_left(self):
        out = self.root / "a.bvh"
        out.write_text("old")
        self.assertEqual(windows(BVHBUILD, SOURCE_DIR / "assets/box_12.obj", "-o", out, "--quiet").returncode, 0)
        self.assertEqual(self.files(), ["a.bvh"])
        self.assertEqual(windows(BVHINFO, out, "--verify").returncode, 0)

    def test_a_full_disk_leaves_the_old_file_and_nothing_else(self):
        disk = self.root / "disk"
        disk.mkdir()
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", disk], stderr=subprocess.DEVNULL).returncode != 0:
            self.skipTest("a small disk cannot be mounted here")
        try:
            (disk / "a.bvh").write_text("old")
            result = windows(BVHBUILD, SOURCE_DIR / "assets/cow.obj", "-o", disk / "a.bvh", "--quiet")
            self.assertEqual(result.returncode, UNWRITABLE_OUTPUT)
            self.assertIn("isk full", result.stderr)
            self.assertEqual((self.files(disk), (disk / "a.bvh").read_text()), (["a.bvh"], "old"))
        finally:
            subprocess.run(["umount", disk], check=True)


class CtrlC(Folder):
    def press(self, when, *words):
        """Starts bvhbuild.exe and presses Ctrl-C in its console: when a temporary file is in the folder `when`, or after so many milliseconds. Returns what was printed."""
        result = windows("tests/platforms/ctrl_c", when, BUILD / (BVHBUILD + ".exe"), SOURCE_DIR / "assets/cow_24000.obj", "-o", self.root / "a.bvh", *words, timeout=300)
        self.assertEqual(result.returncode, 0, result.stderr)  # Wine may say there that a process is gone
        self.assertLessEqual(set(self.files()), {"a.bvh"})
        return result.stdout

    def test_while_it_writes_it_leaves_no_partial_file(self):
        for _ in range(40):
            self.press(self.root, "--quiet", "--effort", "fast")
            if not (self.root / "a.bvh").exists():
                return
            (self.root / "a.bvh").unlink()
        self.fail("Ctrl-C always came too late")

    def test_while_it_optimises_it_keeps_the_best_tree_so_far(self):
        delay = 250
        while '"interrupted": true' not in self.press(str(delay), "--effort", "best", "--json"):
            # It came before the optimisation, and ended the process.
            self.assertFalse((self.root / "a.bvh").exists(), "Ctrl-C never came")
            delay *= 2
        shown = windows(BVHINFO, self.root / "a.bvh", "--verify")
        self.assertEqual((shown.returncode, shown.stderr), (0, ""))


if __name__ == "__main__":
    if "SharedMeshes" in sys.argv and not MESHES.is_dir():
        print(f"SKIPPED: {MESHES} is not here (set TANDEM_MESHES)")
        sys.exit(SKIPPED)
    run_tests()
