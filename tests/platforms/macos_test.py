#!/usr/bin/python3
"""Programs for macOS as files, since nothing here can run them: their processor, what they load and export, their vector and their fused instructions.

Environment: TANDEM_BUILD (the preset macos-arm64 or macos-x86-64), TANDEM_MACOS_CPU (aarch64 or x86_64), TANDEM_SOURCE_DIR; TANDEM_NATIVE_BUILD (a build of this machine).
"""
import bisect
import os
import pathlib
import resource
import struct
import subprocess
import tempfile
import unittest

import mach_o
from linked_programs import BUILD, SOURCE_DIR, LinkedPrograms, run_tests

CPU = os.environ["TANDEM_MACOS_CPU"]
NATIVE = pathlib.Path(os.environ["TANDEM_NATIVE_BUILD"])
BVHBUILD, BVHINFO, LIBRARY = BUILD / "tools/bvhbuild/bvhbuild", BUILD / "tools/bvhinfo/bvhinfo", BUILD / "bindings/c/libtandem.dylib"
MADE = (BVHBUILD, BVHINFO, LIBRARY)
FILE_ITSELF = {"__mh_dylib_header", "___dso_handle"}
# The objects of the walks, each with the vectors that it is compiled for.
WALKS = "kernels/CMakeFiles/tandem_walk.dir"
VARIANTS = {"lanes4": "__ZN6tandem7kLanes4E", "avx2": "__ZN6tandem5kAvx2E", "avx512": "__ZN6tandem7kAvx512E"}
# Instructions of 64-bit Arm: (mask, value).
SUM_OF_FOUR_LANES = (0xFFFFFC00, 0x4EB1B800)  # ADDV of four 32-bit lanes, by which NEON's masks become bits
FUSED = {
    "FMADD": (0xFF208000, 0x1F000000), "FMSUB": (0xFF208000, 0x1F008000), "FNMADD": (0xFF208000, 0x1F200000), "FNMSUB": (0xFF208000, 0x1F208000),
    "FMLA": (0xBFA0FC00, 0x0E20CC00), "FMLS": (0xBFA0FC00, 0x0EA0CC00), "FMLA by element": (0xBF00F400, 0x0F001000), "FMLS by element": (0xBF00F400, 0x0F005000),
}
EXACT_PRODUCTS = ("height_along", "assign_product")  # functions that two_product() is inlined in
THREAD_STACK = 512 * 1024  # of a thread that is not the first


def places(code, mask, value):
    """The offsets of the instructions that have this pattern."""
    return [4 * place for place, (word,) in enumerate(struct.iter_unpack("<I", code[:len(code) // 4 * 4])) if word & mask == value]


class Programs(LinkedPrograms, unittest.TestCase):
    programs, library = (BVHBUILD, BVHINFO), LIBRARY
    system = {"/usr/lib/libSystem.B.dylib"}

    def loaded_by(self, file):
        return mach_o.read(file).loads

    def exported_by(self, file):
        """Without operators new and delete, which libc++ always exports, and names of the file's own places."""
        return {name[1:] for name in mach_o.read(file).exports if not name.startswith(("__Zn", "__Zd")) and name not in FILE_ITSELF}

    def test_they_are_for_the_processor_and_the_oldest_system(self):
        for file in MADE:
            made = mach_o.read(file)
            self.assertEqual((made.cpu, made.oldest), (CPU, (13, 3)), file)
            self.assertEqual(made.kind, "library" if file == LIBRARY else "program")

    def test_apple_silicon_finds_a_signature(self):
        """It runs nothing without one; the linker's own is enough."""
        for file in MADE:
            self.assertTrue(mach_o.read(file).signed or CPU == "x86_64", file)

    def test_the_library_is_found_beside_its_user(self):
        self.assertEqual(mach_o.read(LIBRARY).name, "@rpath/libtandem.0.dylib")

    def test_the_tests_that_were_built_are_for_the_processor_too(self):
        tests = [file for file in (BUILD / "tests").rglob("*") if file.is_file() and os.access(file, os.X_OK) and mach_o.is_mach_o(file)]
        if not tests:
            self.skipTest("no test was built")
        for file in tests:
            made = mach_o.read(file)
            self.assertEqual((made.cpu, made.kind), (CPU, "program"), file)
            self.assertLessEqual(made.loads, self.system | {"@rpath/libtandem.0.dylib"}, file)


class Instructions(unittest.TestCase):
    def test_each_way_of_vectors_is_compiled_in(self):
        wanted = set(VARIANTS.values()) if CPU == "x86_64" else {VARIANTS["lanes4"]}
        self.assertEqual(mach_o.read(LIBRARY).defined.keys() & set(VARIANTS.values()), wanted)

    def test_the_linker_takes_nothing_for_all_from_code_for_some_processors(self):
        if CPU != "x86_64":
            self.skipTest("one way of vectors is for all")
        for name in ("avx2", "avx512"):
            made = mach_o.read(BUILD / WALKS / f"variants/{name}.cpp.o")
            self.assertIn(VARIANTS[name], made.defined)
            self.assertEqual(made.weak, set())

    def test_four_lanes_are_those_of_neon(self):
        if CPU != "aarch64":
            self.skipTest("NEON is Arm's")
        self.assertGreater(len(places(mach_o.read(LIBRARY).text, *SUM_OF_FOUR_LANES)), 10)

    def test_products_are_fused_with_sums_by_fma_alone(self):
        """Of all code, two_product() in expansion.h calls it, for the exact rest of a product."""
        if CPU != "aarch64":
            self.skipTest("the oldest x86-64 has no fused instruction")
        for file in MADE:
            made = mach_o.read(file)
            starts = sorted((address, name) for name, address in made.defined.items())
            found = {starts[bisect.bisect_right(starts, (made.text_address + place, "~")) - 1][1] for pattern in FUSED.values() for place in places(made.text, *pattern)}
            self.assertEqual({name for name in found if not any(of in name for of in EXACT_PRODUCTS)}, set(), file)
        self.assertNotEqual(found, set())

    def test_fused_instructions_would_be_seen(self):
        samples = {"FMADD": 0x1F420C20, "FMSUB": 0x1F428C20, "FNMADD": 0x1F620C20, "FNMSUB": 0x1F628C20, "FMLA": 0x4E62CC20, "FMLS": 0x4EE2CC20,
                   "FMLA by element": 0x4FC21020, "FMLS by element": 0x4FC25020}
        for name, word in samples.items():
            self.assertEqual([other for other, pattern in FUSED.items() if places(struct.pack("<I", word), *pattern)], [name])


class Stacks(unittest.TestCase):
    def test_the_stack_of_a_thread_there_is_enough(self):
        """Of this machine's bvhbuild, whose threads get as little as those of macOS have."""
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "cow.bvh"
            command = [NATIVE / "tools/bvhbuild/bvhbuild", SOURCE_DIR / "assets/cow.obj", "-o", out, "--quiet", "--levels", "auto", "--threads", "4"]
            _, most = resource.getrlimit(resource.RLIMIT_STACK)
            result = subprocess.run(command, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_STACK, (THREAD_STACK, most)))
            self.assertEqual(result.returncode, 0)
            self.assertTrue(out.exists())


if __name__ == "__main__":
    run_tests()
