#!/usr/bin/python3
"""The quick sweep of scripts/paper, from the outside: what it leaves, and that it goes on after a kill. Exit code 77 without Snakemake or FCL.

Environment: TANDEM_BUILD, the folder of the build; TANDEM_SOURCE_DIR.
"""
import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

SCRIPTS = Path(os.environ["TANDEM_SOURCE_DIR"]) / "scripts"
BVHBENCH = Path(os.environ["TANDEM_BUILD"]) / "tools/bvhbench/bvhbench"


def missing():
    if shutil.which("snakemake") is None:
        return "Snakemake"
    helped = subprocess.run([BVHBENCH, "compare", "--help"], capture_output=True, text=True, check=True).stdout
    return None if "fcl" in helped else "FCL"


class PaperTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.out = Path(self.folder.name) / "quick"

    def sweep(self):
        return subprocess.Popen([SCRIPTS / "paper/sweep", "quick"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True,
                                env=os.environ | {"TANDEM_PAPER_OUT": str(self.out), "HOME": self.folder.name})

    def passes(self):
        process = self.sweep()
        said, _ = process.communicate()
        self.assertEqual(process.returncode, 0, said)
        return said

    def script(self, *command):
        return subprocess.run([str(word) for word in command], capture_output=True, text=True)

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
        self.table_has_all_runs()
        self.figures_are_drawn()
        self.other_contacts_are_refused()

    def table_has_all_runs(self):
        with open(self.out / "paper.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        runs = {(row["configuration"], row["triangles"], row["objects"], row["seed"]) for row in rows}
        self.assertEqual(len(runs), 7)
        self.assertEqual(len(rows), 7 * 2 * 2)  # frames, engines
        self.assertEqual({row["engine"] for row in rows}, {"tandem", "fcl"})
        self.assertTrue(all(float(row["milliseconds_best"]) > 0 for row in rows))
        self.assertTrue(all(int(row["contacts"]) > 0 for row in rows if row["configuration"] == "stack" and row["engine"] == "tandem"))

    def figures_are_drawn(self):
        drawn = self.script(SCRIPTS / "plot_paper", self.out / "paper.csv", "-o", self.out / "figure")
        self.assertEqual(drawn.returncode, 0, drawn.stderr)
        self.assertIn("structured stack | 64", drawn.stdout)
        for name in ("figure_speedup", "figure_time"):
            self.assertGreater((self.out / f"{name}.png").stat().st_size, 10_000)

    def other_contacts_are_refused(self):
        times = self.out / "times/stack_12_27_1.cpu.json"
        rows = [row | {"device": "another", "hash": "0" * 16} for row in json.loads(times.read_text()) if row["engine"] == "tandem"]
        times.with_name("stack_12_27_1.cuda.json").write_text(json.dumps(rows))
        collected = self.script(SCRIPTS / "paper/collect", self.out, "-o", self.out / "other.csv")
        self.assertEqual(collected.returncode, 1)
        self.assertIn("other contacts", collected.stderr)


if __name__ == "__main__":
    lacking = missing()
    if lacking:
        print(f"skipped: there is no {lacking}")
        sys.exit(77)
    unittest.main()
