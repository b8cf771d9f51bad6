"""The bill of materials of a release, as CycloneDX 1.5: what lies inside its files, and what they need beside them."""
import json
import re
import time
import uuid

from common import tools

# The licences of the Debian packages that the commands are compiled with, and what each file has of them. A package of scripts/packages that is neither here
# nor in BUILD_ONLY is an error.
LICENCES = {
    "libassimp-dev": "BSD-3-Clause", "libcgal-dev": "GPL-3.0-or-later", "libcli11-dev": "BSD-3-Clause", "libeigen3-dev": "MPL-2.0", "libhdf5-dev": "HDF5",
    "libtbb-dev": "Apache-2.0", "nlohmann-json3-dev": "MIT", "libbullet-dev": "Zlib", "libembree-dev": "Apache-2.0", "libfcl-dev": "BSD-3-Clause",
    "libode-dev": "BSD-3-Clause", "libboost-dev": "BSL-1.0", "libgmp-dev": "LGPL-3.0-or-later", "libmpfr-dev": "LGPL-3.0-or-later"}
THROUGH_CGAL = ["libboost-dev", "libgmp-dev", "libmpfr-dev"]
BUILD_ONLY = {"g++", "cmake", "ninja-build", "ccache"}
INSIDE_WHEELS = {"nanobind": "BSD-3-Clause"}
NEEDED_BY_WHEELS = {"numpy": "BSD-3-Clause"}
CUDA_RUNTIME = "NVIDIA CUDA Toolkit End User License Agreement"


def licence(name):
    """HDF5's licence has no identifier of SPDX."""
    return [{"license": {"name" if name in ("HDF5", CUDA_RUNTIME) else "id": name}}]


def debian_packages():
    lists = dict(re.findall(r'^(TANDEM_\w+)="([^"]*)"', (tools.ROOT / "scripts/packages").read_text(encoding="utf-8"), re.MULTILINE))
    names = [*lists["TANDEM_TOOL_PACKAGES"].split(), *lists["TANDEM_PEER_PACKAGES"].split(), *THROUGH_CGAL]
    return [name for name in names if name not in BUILD_ONLY]


def component(kind, name, version, licence_name, scope):
    made = {"type": "library", "name": name, "version": version, "licenses": licence(licence_name), "scope": scope}
    if not version:
        del made["version"]
    purl = f"pkg:{kind}/{name}" + (f"@{version}" if version else "")
    return made | {"purl": purl, "bom-ref": purl}


def write(version, epoch, python):
    """Returns the text. python is that of the virtual environment which makes the wheels."""
    components = []
    for name in debian_packages():
        there = tools.run("dpkg-query", "-W", "-f=${Version}", name)
        components.append(component("deb/debian", name, there, LICENCES[name], "required"))
    commands = [made["bom-ref"] for made in components]
    for name, licence_name in INSIDE_WHEELS.items():
        there = tools.run(python, "-c", f"import importlib.metadata; print(importlib.metadata.version({name!r}))").strip()
        components.append(component("pypi", name, there, licence_name, "required"))
    project = (tools.ROOT / "pyproject.toml").read_text(encoding="utf-8")
    for needed in re.findall(r'"([a-z0-9-]+)[^"]*"', re.search(r"^dependencies = \[(.*)\]", project, re.MULTILINE)[1]):
        components.append(component("pypi", needed, None, NEEDED_BY_WHEELS[needed], "required"))
    wheels = [made["bom-ref"] for made in components[len(commands):]]
    components.append(component("pypi", "nvidia-cuda-runtime", None, CUDA_RUNTIME, "optional"))
    parts = {"tandem-tools": commands, "tandem-contacts": wheels, "libtandem0": []}
    for name in parts:
        # The commands contain code of CGAL's under the GPL.
        words = {"id": "GPL-3.0-or-later" if name == "tandem-tools" else "MIT"}
        components.append({"type": "application" if name == "tandem-tools" else "library", "name": name, "version": version, "licenses": [{"license": words}],
                           "bom-ref": name})
    about = {"type": "library", "name": "tandem", "version": version, "licenses": licence("MIT"), "bom-ref": "tandem"}
    commit = tools.run("git", "rev-parse", "HEAD", cwd=tools.ROOT).strip()
    return json.dumps({
        "bomFormat": "CycloneDX", "specVersion": "1.5", "version": 1, "serialNumber": f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_URL, f'tandem:{commit}')}",
        "metadata": {"timestamp": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(int(epoch))), "component": about},
        "components": components,
        "dependencies": [{"ref": "tandem", "dependsOn": list(parts)}, *({"ref": name, "dependsOn": needed} for name, needed in parts.items())],
    }, indent=1) + "\n"
