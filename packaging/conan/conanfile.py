from pathlib import Path

from conan import ConanFile
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeToolchain, cmake_layout
from conan.tools.files import copy, get, rmdir


class Tandem(ConanFile):
    name = "tandem"
    version = "@VERSION@"
    license = "MIT"
    description = "Exact triangle collision by tandem traversal of 4-ary blocked AABB trees"
    topics = "collision-detection", "geometry", "physics", "bvh"
    settings = "os", "arch", "compiler", "build_type"
    no_copy_source = True

    def layout(self):
        cmake_layout(self, src_folder="src")

    def validate(self):
        check_min_cppstd(self, 20)

    def source(self):
        get(self, **self.conan_data["sources"][self.version], strip_root=True)

    def generate(self):
        toolchain = CMakeToolchain(self)
        for part in ("TOOLS", "TESTS", "CUDA", "PYTHON"):
            toolchain.cache_variables[f"TANDEM_{part}"] = "OFF"
        toolchain.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        copy(self, "LICENSE", self.source_folder, str(Path(self.package_folder) / "licenses"))
        CMake(self).install()
        rmdir(self, str(Path(self.package_folder) / "lib/pkgconfig"))

    def package_info(self):
        """The targets are those of Tandem's own CMake package, which needs nothing of Conan's."""
        self.cpp_info.set_property("cmake_find_mode", "none")
        self.cpp_info.builddirs = ["lib/cmake/tandem"]
