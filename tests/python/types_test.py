"""Types: the package and a program that uses all of it pass mypy --strict, and the stubs are those of the extensions."""
import ast
import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

import tandem

PACKAGE = Path(tandem.__file__).parent
PROGRAM = Path(os.environ["TANDEM_SOURCE_DIR"]) / "tests/python/typed_program.py"


def mypy(*words, folder):
    pytest.importorskip("mypy")
    environment = dict(os.environ)
    if PACKAGE.parent.name != "site-packages":  # where mypy looks anyway, and wants no path
        environment["MYPYPATH"] = str(PACKAGE.parent)
    return subprocess.run([sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(folder / "cache"), *words], capture_output=True, text=True, env=environment,
                          cwd=folder)


def test_mypy_finds_nothing(tmp_path):
    modules = [f"tandem.{path.stem}" for path in PACKAGE.glob("_[a-z]*.py")]
    public = ["tandem", *(f"tandem.{name}" for name in ("cuda", "gradients", "jax", "jobs", "torch"))]
    if importlib.util.find_spec("distributed"):
        public.append("tandem.dask")
    done = mypy(*(word for module in public + modules for word in ("-m", module)), folder=tmp_path)
    assert done.returncode == 0, done.stdout
    done = mypy(str(PROGRAM), folder=tmp_path)
    assert done.returncode == 0, done.stdout


def test_mypy_sees_a_wrong_argument(tmp_path):
    program = tmp_path / "wrong.py"
    program.write_text("import tandem\ntandem.build([[0.0, 0, 0]], [[0, 0, 0]], effort='most')\n")
    done = mypy(str(program), folder=tmp_path)
    assert done.returncode == 1 and "wrong.py:2" in done.stdout


def test_the_program_runs(tmp_path):
    subprocess.run([sys.executable, PROGRAM], check=True, capture_output=True, cwd=tmp_path)


# What classes of the extensions have in common, which only the stubs name.
COMMON = {node.name: node.body for node in ast.parse((PACKAGE / "_tandem.pyi").read_text()).body if isinstance(node, ast.ClassDef) and node.name[0] == "_"}


def signatures(text):
    """Names of functions and methods, and how many arguments each has."""
    found = {}
    for node in ast.parse(text).body:
        if isinstance(node, ast.FunctionDef):
            found[node.name] = len(node.args.posonlyargs)
        elif isinstance(node, ast.ClassDef) and node.name not in COMMON:
            found[node.name] = None
            body = sum((COMMON.get(base.id, []) for base in node.bases if isinstance(base, ast.Name)), node.body)
            found |= {f"{node.name}.{method.name}": len(method.args.posonlyargs) or len(method.args.args) for method in body if isinstance(method, ast.FunctionDef)}
    return found


@pytest.mark.parametrize("name", ["_tandem", "_bvhbuild", "_cuda"])
def test_stubs_are_those_of_the_extensions(name):
    stubgen = pytest.importorskip("nanobind.stubgen")
    module = pytest.importorskip(f"tandem.{name}")
    generated = stubgen.StubGen(module)
    generated.put(module)
    expected = signatures(generated.get())
    expected.pop("Asset.__buffer__", None)  # from Python 3.12 on; the stub says it by the base Buffer
    assert expected and signatures((PACKAGE / f"{name}.pyi").read_text()) == expected
