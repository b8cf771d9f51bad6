#!/usr/bin/python3
"""Programs for Windows under Wine: they need no DLL but those of Windows, and do what those of this machine do, to the byte.

Environment: TANDEM_BUILD (the preset windows), TANDEM_NATIVE_BUILD (a build of this machine), TANDEM_SOURCE_DIR; TANDEM_MESHES: a folder of meshes, else
../shared/meshes beside the sources. What compares meshes of it is skipped (exit code 77) where it is not there.
"""
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

from linked_programs import BUILD, SKIPPED, SOURCE_DIR, LinkedPrograms, run_tests

NATIVE = pathlib.Path(os.environ["TANDEM_NATIVE_BUILD"])
MESHES = pathlib.Path(os.environ.get("TANDEM_MESHES", SOURCE_DIR.parent / "shared" / "meshes"))
BVHBUILD, BVHINFO, ANSWERS, VARIANTS = "tools/bvhbuild/bvhbuild", "tools/bvhinfo/bvhinfo", "tests/platforms/answers", "tests/kernels/variant_check"
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

    def test_ctrl_c_while_it_writes_leaves_no_partial_file(self):
        """Wine makes a Ctrl-C of SIGINT. It comes as soon as the temporary file is seen, until it once came before the end."""
        for _ in range(20):
            command = ["wine", BUILD / (BVHBUILD + ".exe"), SOURCE_DIR / "assets/cow_24000.obj", "-o", self.root / "a.bvh", "--quiet"]
            process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            while process.poll() is None and not any(".tmp" in name for name in self.files()):
                time.sleep(0.0002)
            process.send_signal(signal.SIGINT)
            process.wait(timeout=60)
            self.assertEqual([name for name in self.files() if name != "a.bvh"], [])
            if not (self.root / "a.bvh").exists():
                return
            (self.root / "a.bvh").unlink()
        self.fail("Ctrl-C always came too late")


if __name__ == "__main__":
    if "SharedMeshes" in sys.argv and not MESHES.is_dir():
        print(f"SKIPPED: {MESHES} is not here (set TANDEM_MESHES)")
        sys.exit(SKIPPED)
    run_tests()
