#!/usr/bin/python3
"""bvhbench answers as the table scenes.json says, as far as a scene file and a command can express it; what they cannot is printed.

Environment: TANDEM_BVHBENCH, TANDEM_CONTRACT_MESHES. Needs h5py.
"""
import collections
import json
import os
import re
import subprocess
import tempfile
import unittest
from pathlib import Path

import h5py
import numpy as np

from scene_table import SCENES, bodies_of, expect_rows, motions_of, option

MESHES = Path(os.environ["TANDEM_CONTRACT_MESHES"])
COMMANDS = {"pairs": ["query"], "contacts": ["query"], "manifolds": ["query", "--manifolds"], "contained": ["query", "--contained"], "distances": ["distance"],
            "impacts": ["impact"], "verdicts": ["query"]}
# The group of a question's columns in the file that is written, where it is not the question's name.
GROUPS = {"distances": "distance", "impacts": "impact", "verdicts": "verdict"}
FLAGS = {"first_contact_only": "--first-contact", "self_pairs": "--self"}
NUMBERS = {"mode": "--mode", "within": "--within", "leave_out_rings": "--leave-out-rings", "reach": "--reach", "absolute_tolerance": "--absolute", "relative_tolerance": "--tolerance",
           "tolerance": "--tolerance", "duration": "--dt"}
COUNTERS = {"inside": "contained", "outer_open": None}
DONE, USAGE, UNREADABLE_INPUT = range(3)


class LeftOut(Exception):
    """The command cannot express a step."""


class Door:
    def __init__(self, assets, folder):
        self.assets, self.scene, self.results = assets, folder / "scene.h5", folder / "results.h5"
        self.bodies, self.filter, self.threads, self.contacts = bodies_of([]), {}, 1, {}

    def change(self, step):
        """Keeps the bodies as a step leaves them. Raises LeftOut where a scene file has no place for them."""
        self.contacts = {}
        if "place" in step:
            self.bodies, self.filter = bodies_of(step["place"]), step.get("filter", {})
            return
        if self.bodies is None:
            raise LeftOut("bodies were removed")
        if "remove" in step:
            self.bodies = None
        elif "set_motion" in step:
            body, motion = step["set_motion"]
            self.filter = {**self.filter, "motion": [motion if i == body else old for i, old in enumerate(self.filter.get("motion", [0] * len(self.bodies[0])))]}
        elif "add" in step:
            self.filter = {name: [*rows, *step.get("filter", {}).get(name, [2**32 - 1])] for name, rows in self.filter.items()}
            self.bodies = tuple(np.concatenate(both) for both in zip(self.bodies, bodies_of([step["add"]])))
        elif "move" in step:
            for old, new in zip(self.bodies[1:], bodies_of(step["to"])[1:]):
                old[step["move"]] = new

    def write(self, step):
        asset, rotation, translation = self.bodies
        columns = {"instances/asset": asset, "instances/rotation": rotation, "instances/translation": translation, "simulation/motion": self.filter.get("motion"),
                   "instances/group": self.filter.get("group"), "instances/mask": self.filter.get("mask"), "instances/world": self.filter.get("world"), "excluded": self.filter.get("excluded")}
        if "pairs" in step:
            columns["pairs"] = np.array(step["pairs"], "u4").reshape(-1, 2)
        if "motion" in step:
            motion = motions_of(step["motion"], len(asset))
            columns |= {"simulation/velocity": motion[:, :3], "simulation/angular_velocity": motion[:, 3:6], "simulation/centre": motion[:, 6:]}
        with h5py.File(self.scene, "w") as file:
            file["assets"] = np.array([str(MESHES / f"{name}.bvh") for name in self.assets], dtype=h5py.string_dtype())
            for name, rows in columns.items():
                if rows is not None:
                    file[name] = rows

    def ask(self, step):
        """Runs the command of a question. Result: what it did."""
        if self.bodies is None:
            raise LeftOut("bodies were removed")
        question = step["ask"]
        unknown = set(step) - {"ask", "expect", "except", "pairs", "motion", "match_previous", *FLAGS, *NUMBERS}
        if unknown or question == "pairs" and "reach" in step:
            raise LeftOut(f"no option for {unknown or 'reach'}")
        if step.get("pairs", []) != sorted(sorted(pair) for pair in step.get("pairs", [])):
            raise LeftOut("the command sorts given pairs")
        if question == "contacts":
            self.contacts = {"pairs": step["pairs"]} if "pairs" in step else {}
        self.write({**self.contacts, **step} if question in ("manifolds", "contained") else step)
        self.results.unlink(missing_ok=True)
        words = [*COMMANDS[question], *(word for name, word in FLAGS.items() if step.get(name)), "--threads", self.threads, "--repeat", 1]
        for name, word in NUMBERS.items():
            if name in step and option(step[name]) != np.inf or name in step and name != "reach":
                words += [word, step[name]]
        words = [str(word) for word in (os.environ["TANDEM_BVHBENCH"], words[0], self.scene, *words[1:], "--json", "--out", self.results)]
        return subprocess.run(words, capture_output=True, text=True, timeout=100)

    def columns(self, question):
        """The pairs, and the columns of the rows and of points, as lists."""
        with h5py.File(self.results) as file:
            read = {group: {name: rows[()] for name, rows in file[group].items()} for group in file if isinstance(file[group], h5py.Group)}
            pairs = file["pairs"][()].tolist()
        rows = collections.defaultdict(dict, read)[GROUPS.get(question, question)]
        if question == "manifolds":
            rows["first_point"], rows["point_count"] = rows["first"][:-1], np.diff(rows.pop("first"))
        if question == "contained":
            rows["flags"] = rows["inside"] + 2 * rows["open"]
        return pairs, *({name: column.tolist() for name, column in part.items()} for part in (rows, read.get("points", {})))


def expect_refused(done, expected):
    assert done.returncode in (USAGE, UNREADABLE_INPUT), (done.returncode, done.stderr)
    blamed = re.search(r": (?:/\w+: row|instance) (\d+)", done.stderr)
    assert blamed is None or int(blamed[1]) == expected.get("where", int(blamed[1])), done.stderr


def expect_found(door, done, step):
    """Result: names of what is expected and not in the file."""
    question, expected = step["ask"], step.get("expect", {})
    assert done.returncode == DONE, done.stderr
    report, (pairs, rows, points) = json.loads(done.stdout), door.columns(question)
    assert pairs == expected.get("pairs", pairs)
    unknown = expect_rows(rows, len(next(iter(rows.values()), pairs)), expected)
    unknown += expect_rows(points, len(next(iter(points.values()), [])), expected.get("points", {}))
    assert report["hash"] == expected.get("hash", report["hash"])
    for name, count in expected.get("counters", {}).items():
        assert report.get(COUNTERS.get(name, name), count) == count, name
    return unknown


class ContractTest(unittest.TestCase):
    def test_every_scene(self):
        asked = 0
        for name, scene in SCENES.items():
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                door = Door(scene["assets"], Path(folder))
                for step in scene["steps"]:
                    try:
                        asked += self.take(door, step)
                    except LeftOut as why:
                        print(f"left out: {name}: {why}: {json.dumps(step)[:150]}")
        self.assertGreater(asked, 80)

    def test_bodies_at_a_point(self):
        with tempfile.TemporaryDirectory() as folder:
            door = Door(["cube"], Path(folder))
            door.change({"place": [[0, 0, 0], [0.75, 0, 0], [3, 0, 0]]})
            door.write({})
            command = [os.environ["TANDEM_BVHBENCH"], "query", door.scene, "--at", "0.375", "0", "0"]
            self.assertEqual(json.loads(subprocess.run([*command, "--json"], capture_output=True, check=True).stdout)["bodies_at"], [0, 1])
            self.assertRegex(subprocess.run(command, capture_output=True, check=True, text=True).stdout, "bodies there +2")

    def take(self, door, step):
        """Result: whether a question was asked."""
        expected = step.get("expect", {})
        if "command" in step.get("except", {}):
            raise LeftOut(step["except"]["command"])
        if "standing" in step:
            raise LeftOut("the command shows no bodies")
        if "threads" in step:
            door.threads = step["threads"]
        elif "ask" not in step and "status" not in expected:
            door.change(step)
        elif "place" in step:
            door.change(step)
            expect_refused(door.ask({"ask": "contacts"}), expected)
            door.change({"place": []})
        elif "ask" not in step:
            raise LeftOut("a scene file cannot be changed wrongly")
        elif "status" in expected:
            expect_refused(door.ask(step), expected)
        else:
            unknown = expect_found(door, door.ask(step), step)
            if unknown:
                print(f"left out: columns {', '.join(unknown)} of {step['ask']}")
        return "ask" in step


if __name__ == "__main__":
    unittest.main()
