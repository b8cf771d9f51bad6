#!/usr/bin/python3
"""scripts/paper from the outside. ScriptsTest: what the steps of a sweep leave, one after the other, without Snakemake. SweepTest: the quick sweep, and that it
goes on after a kill. Exit code 77 without FCL, and of SweepTest without Snakemake.

Environment: TANDEM_BUILD, the folder of the build; TANDEM_SOURCE_DIR.
"""
import csv
import json
import os
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

SOURCE_DIR = Path(os.environ["TANDEM_SOURCE_DIR"])
SCRIPTS = SOURCE_DIR / "scripts"
TOOLS = Path(os.environ["TANDEM_BUILD"]) / "tools"
BVHBENCH = TOOLS / "bvhbench/bvhbench"


def missing(wanted):
    if "ScriptsTest" not in wanted and shutil.which("snakemake") is None:
        return "Snakemake"
    helped = subprocess.run([BVHBENCH, "compare", "--help"], capture_output=True, text=True, check=True).stdout
    return None if "fcl" in helped else "FCL"


class PaperTest(unittest.TestCase):
    """Each test has a folder for a sweep."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.out = Path(self.folder.name) / "quick"

    def script(self, *command):
        return subprocess.run([str(word) for word in command], capture_output=True, text=True)

    def runs(self, *command):
        done = self.script(*command)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def rows(self, table="paper.csv"):
        with open(self.out / table, newline="") as file:
            return list(csv.DictReader(file))


class ScriptsTest(PaperTest):
    def setUp(self):
        super().setUp()
        for folder in ("runs", "times", "scenes/stack_12_27_1"):
            (self.out / folder).mkdir(parents=True)
        mesh, run = self.out / "box_12.bvh", self.out / "runs/stack_12_27_1.h5"
        self.times = self.out / "times/stack_12_27_1.cpu.json"
        scenes = [self.out / f"scenes/stack_12_27_1/{frame}.h5" for frame in (2, 4)]
        self.runs(TOOLS / "bvhbuild/bvhbuild", SOURCE_DIR / "assets/box_12.obj", "-o", mesh)
        self.runs(BVHBENCH, "simulate", "stack", "--mesh", mesh, "--count", 27, "--frames", 4, "--trajectory", 2, "-o", run)
        for frame, scene in zip((2, 4), scenes):
            self.runs(BVHBENCH, "frame", run, "--frame", frame, "-o", scene)
        self.runs(SCRIPTS / "paper/time_frames", "cpu", os.path.relpath(BVHBENCH), "--repeat", 1, "-o", self.times, *scenes)

    def collect(self, table="paper.csv", *options):
        return self.script(SCRIPTS / "paper/collect", self.out, "-o", self.out / table, *options)

    def add_gpu(self, **changes):
        """Rows as a GPU leaves them, that found what the CPU did but for the changes."""
        rows = [row | {"device": "NVIDIA H100", "milliseconds_best": row["milliseconds_best"] / 8} | changes
                for row in json.loads(self.times.read_text()) if row["engine"] == "tandem"]
        self.times.with_name("stack_12_27_1.cuda.json").write_text(json.dumps(rows))

    def test_engines_are_timed_on_the_same_frames_and_agree(self):
        self.assertEqual(self.collect().returncode, 0)
        rows = self.rows()
        self.assertEqual([(row["frame"], row["engine"]) for row in rows], [("2", "fcl"), ("2", "tandem"), ("4", "fcl"), ("4", "tandem")])
        for row in rows:
            self.assertEqual((row["configuration"], row["triangles"], row["objects"], row["frames"], row["wrong"]), ("stack", "12", "27", "4", "0"))
            self.assertGreater(int(row["contacts"]), 0)
            self.assertGreater(float(row["milliseconds_best"]), 0)

    def test_other_contacts_are_refused(self):
        self.add_gpu(hash="0" * 16)
        collected = self.collect("other.csv")
        self.assertEqual(collected.returncode, 1)
        self.assertIn("other contacts", collected.stderr)
        self.assertFalse((self.out / "other.csv").exists())

    def test_figures_say_how_many_times_as_fast_and_whether_a_gpu_was_there(self):
        self.collect("cpu.csv")
        self.assertNotIn("H100", self.runs(SCRIPTS / "plot_paper", self.out / "cpu.csv", "-o", self.out / "cpu"))
        self.assertIn("no GPU was at hand", self.text_of("cpu_speedup.svg"))
        self.add_gpu()
        self.collect("both.csv")
        tables = self.runs(SCRIPTS / "plot_paper", self.out / "both.csv", "-o", self.out / "both")

        def mean(engine, device):
            return statistics.fmean(float(row["milliseconds_best"]) for row in self.rows("both.csv") if (row["engine"], device in row["device"]) == (engine, True))

        on_gpu = mean("fcl", "1 core") / mean("tandem", "H100")
        speedup = f"{on_gpu:,.0f}" if on_gpu >= 100 else f"{on_gpu:.3g}"
        self.assertIn(f"({speedup}) |", tables)
        self.assertNotIn("no GPU was at hand", self.text_of("both_time.svg"))

    def text_of(self, chart):
        """What matplotlib notes of its texts."""
        return (self.out / chart).read_text()


class SweepTest(PaperTest):
    def sweep(self):
        return subprocess.Popen([SCRIPTS / "paper/sweep", "quick"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True,
                                env=os.environ | {"TANDEM_PAPER_OUT": str(self.out), "HOME": self.folder.name})

    def passes(self):
        process = self.sweep()
        said, _ = process.communicate()
        self.assertEqual(process.returncode, 0, said)
        return said

    def test_a_sweep_that_was_killed_goes_on_and_one_that_is_done_does_nothing(self):
        killed = self.sweep()
        while killed.poll() is None and not list(self.out.glob("runs/*.h5")):
            time.sleep(0.01)
        os.killpg(killed.pid, signal.SIGKILL)
        killed.communicate()
        self.assertFalse((self.out / "paper.csv").exists())
        made = {path: path.stat().st_mtime_ns for path in self.out.glob("trees/*.bvh")}
        self.passes()
        self.assertEqual(made, {path: path.stat().st_mtime_ns for path in made})
        self.assertIn("Nothing to be done", self.passes())
        rows = self.rows()
        self.assertEqual(len({(row["configuration"], row["triangles"], row["objects"], row["seed"]) for row in rows}), 7)
        self.assertEqual(len(rows), 7 * 2 * 2)  # frames, engines
        self.assertIn("structured stack | 64", self.runs(SCRIPTS / "plot_paper", self.out / "paper.csv"))


if __name__ == "__main__":
    lacking = missing(sys.argv[1:])
    if lacking:
        print(f"skipped: there is no {lacking}")
        sys.exit(77)
    unittest.main()
