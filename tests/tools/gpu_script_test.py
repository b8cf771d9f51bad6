#!/usr/bin/python3
"""scripts/gpu_test without a GPU: programs that stand in for the tests, the driver's tool and compute-sanitizer; what it counts as a failure, and what it says.

Environment: TANDEM_SOURCE_DIR.
"""
import csv
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SCRIPT = Path(os.environ["TANDEM_SOURCE_DIR"]) / "scripts/gpu_test"
# Writes the report that googletest would; lists nothing else. Runs of a sanitizer ask for no report.
PROGRAM = '''#!/bin/sh
for word; do case "$word" in --gtest_output=xml:*) cat "$0.xml" > "${word#--gtest_output=xml:}";; esac; done
exit %d
'''
PASSED = '<testcase name="Passes" classname="Suite" result="completed" time="0.0125" />'
SKIPPED = '<testcase name="Skips" classname="Suite" result="skipped" time="0"><skipped message="a.cu:7&#x0A;%s" /></testcase>'
FAILED = '<testcase name="Fails" classname="Suite" result="completed" time="0.001"><failure message="a.cu:9&#x0A;1 is not 2" /></testcase>'


class GpuScriptTest(unittest.TestCase):
    """Each test has a folder of programs whose tests all pass."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder, self.out = Path(folder.name) / "programs", Path(folder.name) / "out"
        self.bin = Path(folder.name) / "bin"
        self.bin.mkdir()
        self.write(self.bin / "nvidia-smi", "#!/bin/sh\necho 'NVIDIA Example, 80GB'\n")
        self.write(self.bin / "compute-sanitizer", "#!/bin/sh\necho '========= ERROR SUMMARY: 0 errors'\n")
        for name in ("gpu_test", "first_sort_test", "contract_gpu_test", "paper_engine_test", "engine_gpu_test", "parallel_newton_step_gpu_test", "parallel_soft_step_gpu_test", "gpu_world_test", "gpu_absent_test", "gpu_use_test", "gpu_deform_test", "gpu_world_use_test", "libtandem.so.0", "libtandem_cuda.so.0"):
            self.program(name, PASSED)

    def write(self, path, text):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        path.chmod(0o755)

    def program(self, name, *cases, code=0):
        self.write(self.folder / "tests" / name, PROGRAM % code)
        report = f"<testsuites><testsuite>{''.join(cases)}</testsuite></testsuites>" if cases else ""
        (self.folder / f"tests/{name}.xml").write_text(report)

    def run_script(self):
        environment = os.environ | {"PATH": f"{self.bin}:{os.environ['PATH']}", "OUT": str(self.out), "TANDEM_COMMIT": "abc1234"}
        return subprocess.run([sys.executable, SCRIPT, self.folder], capture_output=True, text=True, env=environment)

    def results(self):
        with open(self.out / "gpu_test.csv", newline="") as file:
            return {row["test"]: row for row in csv.DictReader(file)}

    def test_the_table_has_a_row_for_each_test(self):
        done = self.run_script()
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(self.results()["no_gpu.Suite.Passes"],
                         {"machine": "NVIDIA Example, 80GB", "commit": "abc1234", "test": "no_gpu.Suite.Passes", "result": "passed", "milliseconds": "12"})
        self.assertEqual(set(self.results()), {"Suite.Passes", "no_gpu.Suite.Passes", "old_driver.Suite.Passes"})
        self.assertEqual(done.stdout.count("ERROR SUMMARY: 0 errors"), 9)  # and three of the C interface

    def test_a_test_that_wants_a_mesh_is_named_and_the_sanitizers_run(self):
        self.program("gpu_test", PASSED, SKIPPED % "cow.obj is not here (set TANDEM_MESHES)")
        done = self.run_script()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("skipped: Suite.Skips: cow.obj is not here (set TANDEM_MESHES)", done.stdout)
        self.assertEqual(self.results()["Suite.Skips"]["result"], "skipped")
        self.assertIn("memcheck gpu_test", done.stdout)

    def test_without_a_gpu_it_fails_and_leaves_the_sanitizers_out(self):
        self.program("paper_engine_test", PASSED, SKIPPED % "no GPU here")
        done = self.run_script()
        self.assertEqual((done.returncode, done.stderr), (1, "no usable GPU: 1 tests were skipped\n"))
        self.assertNotIn("memcheck", done.stdout)

    def test_a_failure_fails_in_the_end_and_the_sanitizers_run(self):
        self.program("engine_gpu_test", PASSED, FAILED, code=1)
        done = self.run_script()
        self.assertEqual((done.returncode, done.stderr), (1, "engine_gpu_test: exit code 1\n"))
        self.assertEqual(self.results()["Suite.Fails"]["result"], "failed")
        self.assertIn("racecheck gpu_test", done.stdout)

    def test_a_program_that_ends_before_its_report_is_named(self):
        self.write(self.folder / "tests/gpu_test", "#!/bin/sh\nkill -SEGV $$\n")
        done = self.run_script()
        self.assertEqual(done.returncode, 1)
        self.assertIn("gpu_test: exit code -11, before the end of its tests", done.stderr)

    def test_what_a_sanitizer_finds_fails_and_stays_to_be_read(self):
        self.write(self.bin / "compute-sanitizer", '#!/bin/sh\necho "========= ERROR SUMMARY: 3 errors"\n[ "$2" != synccheck ]\n')
        done = self.run_script()
        self.assertEqual(done.returncode, 1)
        self.assertIn("compute-sanitizer: synccheck gpu_test", done.stderr)
        self.assertEqual([path.name for path in self.out.glob("*.txt")], ["synccheck_gpu_test.txt"])

    def test_a_failure_of_the_c_interface_fails(self):
        self.program("gpu_use_test", code=1)
        done = self.run_script()
        self.assertEqual((done.returncode, done.stderr), (1, "gpu_use_test: exit code 1\n"))
        self.assertIn("gpu_use_test under memcheck: exit code 0", done.stdout)
        self.assertIn("the Python package is not in", done.stdout)

    def test_the_package_is_tested_where_it_is(self):
        self.write(self.folder / "python/tandem/_cuda.so", "")  # which Python cannot load: the tests say so and are skipped
        done = self.run_script()
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertIn("cuda_test.py: skipped", done.stdout)

    def test_a_program_that_is_missing_is_named(self):
        (self.folder / "tests/paper_engine_test").unlink()
        done = self.run_script()
        self.assertEqual(done.returncode, 1)
        self.assertIn("there is no paper_engine_test in", done.stderr)


if __name__ == "__main__":
    unittest.main()
