"""The reference of the Python package: which names stand on which page. Signatures and docstrings come from the sources, by mkdocstrings."""
import re

from . import titles

# {page: (title, what it is about, names of the package)}
PAGES = {
    "scenes": ("Scenes and questions", "A scene holds bodies and answers questions about them.",
               ["Scene", "Filter", "Contacts", "Manifolds", "Distances", "Impacts", "Verdicts", "Contained", "Moved", "Configurations", "Counters", "instances", "rotations"]),
    "assets": ("Assets", "An asset is a mesh and its tree, from a file or built from arrays.", ["Asset", "Level", "Part", "build", "BuildReport", "read_mesh", "Mesh"]),
    "worlds": ("Worlds", "A world moves rigid bodies under gravity, contacts and joints.", ["World", "WorldState", "Joint"]),
    "errors": ("Errors and views", "What is raised, and how bodies are looked at.", ["Error", "FileError", "view"]),
}
# {module: what it is about}
MODULES = {
    "cuda": "questions about arrays in GPU memory", "gradients": "signed distances and their derivatives", "torch": "these as functions of PyTorch", "jax": "these as functions of JAX",
    "trimesh": "in place of trimesh's collision manager", "mujoco": "contacts for MuJoCo", "mujoco_warp": "contacts for MuJoCo Warp", "newton": "contacts for Newton",
    "dask": "work on a cluster of Dask", "jobs": "the pieces of such work, for other engines", "viewer": "pictures and windows of scenes", "live_view": "worlds that go on before your eyes",
    "scene_files": "scene files in HDF5", "tree": "blocks and nodes of an asset",
}
_ROW = re.compile(r"((?:^#: .*\n)+)^([A-Z_, ]+) = (.*(?:\n {8}.*)*)", re.MULTILINE)
_FIELD = re.compile(r'\("(\w+)", "([^"]+)"(?:, \(([\d, ]+)\))?\)')
NUMBERS = {"u1": "uint8", "<u4": "uint32", "<i4": "int32", "<f4": "float32", "<u8": "uint64", "<f8": "float64"}


def rows_page(package):
    """The constants and the dtypes of rows, which docstrings cannot describe: their comments begin with "#:"."""
    lines = ["# Rows and constants", "", "Rows of arguments and results are NumPy arrays of these dtypes.", ""]
    for file in ("_rows.py", "_scene.py", "__init__.py"):
        for comment, names, value in _ROW.findall((package / file).read_text(encoding="utf-8")):
            text = " ".join(part.removeprefix("#: ") for part in comment.strip().split("\n"))
            first, *others = names.split(", ")
            lines += [f"## {', '.join(f'`{name}`' for name in (first, *others))} {{ #tandem.{first} }}", ""]
            lines += ["".join(f'<a id="tandem.{name}"></a>' for name in others) + titles.linked(text.replace("*", r"\*"), lambda name: f"../../{name}.md"), ""]
            lines += [f"- `{field}`: {NUMBERS[number]}{' × ' + shape.rstrip(',').replace(', ', ' × ') if shape else ''}" for field, number, shape in _FIELD.findall(value)]
            lines.append("")
    return "\n".join(lines)


def pages(package):
    """{place in the site: Markdown}. Raises ValueError if a public name of the package stands nowhere."""
    made = {f"reference/python/{name}.md": "\n\n".join([f"# {title}", about, *(f"::: tandem.{of}" for of in names)]) + "\n" for name, (title, about, names) in PAGES.items()}
    made["reference/python/rows.md"] = rows_page(package)
    for module, about in MODULES.items():
        made[f"reference/python/{module}.md"] = f"# tandem.{module}\n\nThis module is for {about}.\n\n::: tandem.{module}\n    options:\n      show_root_heading: false\n      heading_level: 1\n"
    listed = [("Scenes and questions", "scenes"), ("Assets", "assets"), ("Worlds", "worlds"), ("Rows and constants", "rows"), ("Errors and views", "errors")]
    contents = [f"- [{title}]({name}.md)" for title, name in listed] + [f"- [tandem.{module}]({module}.md)" for module in MODULES]
    made["reference/python/SUMMARY.md"] = "\n".join(contents) + "\n"
    init = (package / "__init__.py").read_text(encoding="utf-8")
    public = set(re.findall(r'"(\w+)"', init[init.index("__all__"):]))
    shown = {name for _, _, names in PAGES.values() for name in names} | set(re.findall(r"(?:#|id=\")tandem\.(\w+)", made["reference/python/rows.md"]))
    modules = {path.stem for path in package.glob("*.py") if not path.stem.startswith("_")}
    if (public - shown) or modules ^ set(MODULES):
        raise ValueError(f"scripts/pages/python_names.py and bindings/python/tandem differ: {sorted((public - shown) | (modules ^ set(MODULES)))}")
    return made
