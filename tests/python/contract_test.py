"""The Python package answers as the table tests/contract/scenes.json says. TANDEM_DEVICE: a device of tandem.Scene other than the CPU."""
import os
import warnings
from pathlib import Path

import numpy as np
import pytest

import tandem

pytest.importorskip("xxhash")
from scene_table import SCENES, bodies_of, expect_rows, hash_of, motions_of, option  # noqa: E402

MESHES = Path(os.environ["TANDEM_CONTRACT_MESHES"])
ON_DEVICE = {"device": os.environ["TANDEM_DEVICE"]} if "TANDEM_DEVICE" in os.environ else {}
OPTIONS = ("pairs", "reach", "mode", "first_contact_only", "self_pairs", "sides", "within", "add_error_bounds", "leave_out_rings", "most_points", "match_previous", "keep", "quick_depths", "absolute_tolerance",
           "relative_tolerance", "tolerance", "duration")
# The package says these by ValueError, because it checks arguments itself.
REFUSED_AS_ARGUMENT = {"OutOfRange", "BadMotion", "BadOption", "BadReach", "BadTolerance", "BadDuration", "MotionMismatch"}


class Door:
    def __init__(self, assets):
        self.scene = tandem.Scene([tandem.Asset.load(MESHES / f"{name}.bvh") for name in assets], **ON_DEVICE)
        self.found = {}

    def instances(self, entry):
        return tandem.instances(*bodies_of(entry))

    def take(self, step):
        """Does what a step says. Result: what it gives."""
        filter, scene = step.get("filter", {}), self.scene
        if "place" in step:
            return scene.place(self.instances(step["place"]), filter=tandem.Filter(**filter) if filter else None)
        if "add" in step:
            asset, rotation, translation = bodies_of([step["add"]])
            return scene.add(int(asset[0]), rotation=rotation[0], translation=translation[0], **filter)
        if "move" in step:
            return scene.move(step["move"], self.instances(step["to"]))
        if "set_motion" in step:
            return scene.set_motion(*step["set_motion"])
        if "remove" in step:
            return scene.remove(step["remove"])
        if "threads" in step:
            scene.threads = step["threads"]
            return None
        options = {name: option(step[name]) if isinstance(step[name], str) else step[name] for name in OPTIONS if name in step}
        if "motion" in step:
            options["motion"] = motions_of(step["motion"], len(scene.instances)).view(tandem.MOTION)[:, 0]
        if "former" in step:
            options["former"] = self.former()
        for name in ("points", "origins", "directions"):
            if name in step:
                options[name] = np.array(step[name], np.float64).reshape(-1, 3)
        for name in ("bodies", "hits"):
            if name in step:
                options[name] = step[name]
        found = self.found[step["ask"]] = getattr(scene, step["ask"])(**options)
        return found

    def former(self):
        """The triangles that were nearest in the last answer about distances."""
        found = self.found["distances"]
        former = np.zeros(len(found.pairs), tandem.FORMER)
        for name in former.dtype.names:
            former[name] = (found.pairs if name in "ab" else found.distances)[name]
        return former


def columns_of(rows):
    return {name: rows[name].tolist() for name in rows.dtype.names}


def expect_found(question, found, expected):
    if question == "pairs":
        pairs = rows = found
    elif question in ("bodies_at", "closest", "rays"):
        pairs, rows = np.zeros(0), found.ravel()
    else:
        pairs, rows = found.pairs, getattr(found, question)
    if question == "contacts":
        rows = np.sort(rows, order=["pair", "face_a", "face_b"])
    assert [list(pair) for pair in pairs.tolist()] == expected.get("pairs", [list(pair) for pair in pairs.tolist()])
    assert expect_rows(columns_of(rows), len(rows), expected) == []
    if "points" in expected:
        assert expect_rows(columns_of(found.points), len(found.points), expected["points"]) == []
    if "hash" in expected:
        assert hash_of(pairs, rows) == expected["hash"]
    for name, count in expected.get("counters", {}).items() if question == "contacts" else ():
        assert getattr(found.counters, name) == count


def expect_refused(door, step, expected):
    with pytest.raises((tandem.Error, ValueError)) as caught:
        door.take(step)
    if isinstance(caught.value, tandem.Error):
        assert caught.value.name == expected["status"]
        if "where" in expected:
            assert caught.value.where == expected["where"]
    else:
        assert expected["status"] in REFUSED_AS_ARGUMENT, caught.value


@pytest.mark.parametrize("name", SCENES)
def test_contract(name):
    door = Door(SCENES[name]["assets"])
    for step in SCENES[name]["steps"]:
        expected = step.get("expect", {})
        if "python" in step.get("except", {}):
            warnings.warn(f"left out: {name}: {step['except']['python']}: {step}", stacklevel=1)
        elif "standing" in step:
            assert [None if asset == tandem.NO_INDEX else asset for asset in door.scene.instances["asset"].tolist()] == step["standing"]
        elif "status" in expected:
            expect_refused(door, step, expected)
        else:
            found = door.take(step)
            if "ask" in step:
                expect_found(step["ask"], found, expected)
            assert "body" not in expected or found == expected["body"], step
