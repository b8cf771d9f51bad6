"""The scripts of docs/examples print what its README says, and make pictures where pyvista can draw."""
import importlib.util
import os
import pathlib
import re
import subprocess
import sys

import pytest

FOLDER = pathlib.Path(os.environ["TANDEM_SOURCE_DIR"], "docs/examples")
OUTPUT = re.compile(r"^```\n\$ python3 (\w+\.py)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
OUTPUTS = dict(OUTPUT.findall((FOLDER / "README.md").read_text()))
NEEDS = {"assembly_clashes.py": "tandem._bvhbuild", "how_fine.py": "tandem._bvhbuild", "pile_on_gpu.py": "tandem._cuda"}
DRAWS = "import pyvista; plotter = pyvista.Plotter(off_screen=True); plotter.add_mesh(pyvista.Sphere()); plotter.screenshot()"


@pytest.fixture(scope="module")
def can_draw():
    return subprocess.run([sys.executable, "-c", DRAWS], capture_output=True).returncode == 0


def run(name, *arguments, folder):
    return subprocess.run([sys.executable, FOLDER / name, *arguments], capture_output=True, text=True, cwd=folder)


def test_every_example_is_in_the_readme():
    assert set(OUTPUTS) == {path.name for path in FOLDER.glob("*.py")} - {"shapes.py"}


@pytest.mark.parametrize("name", OUTPUTS)
def test_prints_what_the_readme_says(name, can_draw, tmp_path):
    needed = NEEDS.get(name)
    if needed and not importlib.util.find_spec(needed):
        pytest.skip(f"{needed} was not built")
    result = run(name, *(["--picture"] if can_draw else []), folder=tmp_path)
    if result.returncode == 77:
        pytest.skip(result.stdout.strip())
    complaints = re.sub(r"^Warp CUDA warning: .*\n", "", result.stderr, flags=re.MULTILINE)  # where Warp finds no GPU
    assert (result.returncode, complaints, result.stdout) == (0, "", OUTPUTS[name])
    assert [path.suffix for path in tmp_path.iterdir()] == [".png"] * can_draw
