#!/usr/bin/python3
"""What libtandem.so exports is what tandem.h declares, the files that scripts/write_interface writes are those of the headers, and structs lie in memory in Rust
and C# as the C compiler lays them out."""
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT, LIBRARY = Path(os.environ["TANDEM_SOURCE_DIR"]), Path(os.environ["TANDEM_LIBRARY"])
sys.path.insert(0, str(ROOT / "scripts"))
from common import c_header  # noqa: E402

HEADER = ROOT / "bindings/c/include/tandem/tandem.h"
CUDA_LIBRARY, CUDA_HEADER = os.environ.get("TANDEM_CUDA_LIBRARY"), ROOT / "bindings/c/cuda/include/tandem/tandem_cuda.h"
DECLARATIONS = ROOT / "bindings/c/declarations"
PAGE = (ROOT / "docs/c.md").read_text(encoding="utf-8")
BYTES_IN_CSHARP = {"byte": 1, "uint": 4, "int": 4, "float": 4, "ulong": 8, "double": 8, "IntPtr": 8, "UIntPtr": 8}


def csharp_structs():
    """{name: [(field, type, count)]}"""
    text = (DECLARATIONS / "Tandem.cs").read_text(encoding="utf-8")
    structs = re.findall(r"\[StructLayout\(LayoutKind\.Sequential\)\]\npublic unsafe struct (\w+) \{\n(.*?)^\}", text, re.MULTILINE | re.DOTALL)
    return {name: [(field, kind, int(count or 1)) for kind, field, count in re.findall(r"^  public (?:fixed )?([\w*]+) (\w+)(?:\[(\d+)\])?;$", body, re.MULTILINE)]
            for name, body in structs}


def lay_out(fields, structs):
    """(bytes, alignment, {field: offset}) by the rule of sequential layout: each field at a multiple of its alignment."""
    end, widest, offsets = 0, 1, {}
    for field, kind, count in fields:
        if kind in structs:
            size, align, _ = lay_out(structs[kind], structs)
        else:
            size = align = 8 if kind.endswith("*") else BYTES_IN_CSHARP[kind]
        offsets[field] = end = -(-end // align) * align
        end, widest = end + count * size, max(widest, align)
    return -(-end // widest) * widest, widest, offsets


class CInterfaceTest(unittest.TestCase):
    def setUp(self):
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.folder = Path(holder.name)
        self.header = c_header.read(HEADER)
        self.layouts = c_header.layouts(self.header.structs)

    def check_exports(self, library, header):
        listed = subprocess.run(["nm", "-D", "--defined-only", library], capture_output=True, text=True, check=True).stdout
        names = {line.split()[-1] for line in listed.splitlines()}
        declared = {function.name for function in c_header.read(header).functions}
        self.assertEqual(declared, set(re.findall(r"^TANDEM_API [^(]*?(tandem_\w+)\(", header.read_text(encoding="utf-8"), re.MULTILINE)))
        self.assertEqual(names, {"TANDEM_0.1"} | {f"{name}@@TANDEM_0.1" for name in declared})
        self.assertGreater(len(names), 40)

    def test_exports_are_the_declared_functions(self):
        self.check_exports(LIBRARY, HEADER)

    def dynamic(self, library):
        return subprocess.run(["readelf", "-d", library], capture_output=True, text=True, check=True).stdout

    def test_the_library_is_known_by_its_soname(self):
        self.assertIn("[libtandem.so.0]", self.dynamic(LIBRARY))

    def test_the_library_for_gpus(self):
        if CUDA_LIBRARY is None:
            self.skipTest("built without CUDA")
        self.check_exports(CUDA_LIBRARY, CUDA_HEADER)
        # It has no assets of its own: it uses those of the other library by functions that everybody may call.
        told = self.dynamic(CUDA_LIBRARY)
        self.assertIn("soname: [libtandem_cuda.so.0]", told)
        self.assertIn("(NEEDED)             Shared library: [libtandem.so.0]", told)

    def test_headers_compile_as_c99_alone(self):
        for header in (HEADER, CUDA_HEADER):
            source = self.folder / "alone.c"
            source.write_text(f"#include <tandem/{header.name}>\nint main(void) {{ return 0; }}\n")
            subprocess.run(["cc", "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", f"-I{HEADER.parent.parent}", f"-I{CUDA_HEADER.parent.parent}", "-c", source,
                            "-o", self.folder / "alone.o"], check=True)

    def written(self, root):
        return subprocess.run([ROOT / "scripts/write_interface", "--check", "--root", root], capture_output=True, text=True)

    def test_written_files_are_those_of_the_headers(self):
        done = self.written(ROOT)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""), "run scripts/write_interface")

    def test_a_change_of_one_side_fails(self):
        for file, before, after in (("bindings/c/include/tandem/tandem.h", "  uint32_t face_a, face_b;          ///< of the mesh files", "  uint32_t face_b, face_a;"),
                                    ("bindings/c/declarations/tandem.rs", "pub threads: u32", "pub threads: u64"), ("docs/c.md", "| `TANDEM_BAD_OPTION` | 3 |", "| `TANDEM_BAD_OPTION` | 4 |"),
                                    ("formats/include/tandem/formats/status.h", "kBadHeader = 120", "kBadHeader = 121"),
                                    ("formats/include/tandem/formats/status.h", "kCudaFailed,", "kCudaFailed, kNew,")):
            with self.subTest(file=file, after=after):
                root = self.folder / str(len(list(self.folder.iterdir())))
                for name in ("bindings/c", "bindings/python/tandem", "formats/include"):
                    shutil.copytree(ROOT / name, root / name, ignore=shutil.ignore_patterns("__pycache__"))
                (root / "docs").mkdir()
                shutil.copy(ROOT / "docs/c.md", root / "docs")
                text = (root / file).read_text(encoding="utf-8")
                self.assertIn(before, text)
                (root / file).write_text(text.replace(before, after, 1), encoding="utf-8")
                done = self.written(root)
                self.assertEqual(done.returncode, 1)
                self.assertNotEqual(done.stdout + done.stderr, "")

    def test_the_script_lays_structs_out_as_c_does(self):
        prints = [f'  printf("{name} %zu\\n", sizeof({name}));' for name in self.layouts]
        prints += [f'  printf("{name}.{field} %zu\\n", offsetof({name}, {field}));' for name, (_, _, offsets) in self.layouts.items() for field in offsets]
        source = self.folder / "layouts.c"
        source.write_text("#include <stddef.h>\n#include <stdio.h>\n#include <tandem/tandem.h>\nint main(void) {\n" + "\n".join(prints) + "\n  return 0;\n}\n")
        subprocess.run(["cc", "-std=c99", f"-I{HEADER.parent.parent}", source, "-o", self.folder / "layouts"], check=True)
        told = subprocess.run([self.folder / "layouts"], capture_output=True, text=True, check=True).stdout
        computed = [f"{name} {size}" for name, (size, _, _) in self.layouts.items()]
        computed += [f"{name}.{field} {at}" for name, (_, _, offsets) in self.layouts.items() for field, at in offsets.items()]
        self.assertEqual(told.splitlines(), computed)
        self.assertGreater(len(self.layouts), 30)

    def test_structs_in_csharp_are_those_of_c(self):
        structs = csharp_structs()
        self.assertEqual(set(structs), set(self.layouts))
        for name, fields in structs.items():
            size, align, offsets = lay_out(fields, structs)
            if name == "tandem_triangle":  # an array of structs is three fields in C#
                offsets = {"corner": offsets["corner0"]}
            self.assertEqual((size, align, offsets), self.layouts[name], name)

    def in_rust(self, program, *flags):
        (self.folder / "tandem.rs").write_text((DECLARATIONS / "tandem.rs").read_text(encoding="utf-8"), encoding="utf-8")
        (self.folder / "main.rs").write_text(program, encoding="utf-8")
        built = subprocess.run(["rustc", "--edition", "2021", "-D", "warnings", f"-Lnative={LIBRARY.parent}", *flags, self.folder / "main.rs", "-o", self.folder / "main"],
                               capture_output=True, text=True)
        self.assertEqual((built.returncode, built.stderr), (0, ""))

    @unittest.skipIf(shutil.which("rustc") is None, "no rustc")
    def test_structs_in_rust_are_those_of_c(self):
        lines = ["mod tandem;", "use std::mem::{offset_of, size_of};", "use tandem::*;"]
        for name, (size, _, offsets) in self.layouts.items():
            lines.append(f"const _: () = assert!(size_of::<{name}>() == {size});")
            lines += [f"const _: () = assert!(offset_of!({name}, {field}) == {at});" for field, at in offsets.items()]
        self.in_rust("\n".join(lines) + "\nfn main() {}\n")

    @unittest.skipIf(shutil.which("rustc") is None, "no rustc")
    def test_the_program_in_rust_says_what_the_one_in_c_says(self):
        self.in_rust((ROOT / "tests/c/contacts.rs").read_text(encoding="utf-8"))
        subprocess.run([os.environ["TANDEM_BVHBUILD"], ROOT / "assets/box_12.obj", "-o", self.folder / "box.bvh", "--quiet"], check=True)
        told = subprocess.run([self.folder / "main", self.folder / "box.bvh"], capture_output=True, text=True, env=os.environ | {"LD_LIBRARY_PATH": str(LIBRARY.parent)})
        self.assertEqual((told.returncode, told.stderr), (0, ""))
        self.assertIn(f"```\n{told.stdout}```", PAGE)


if __name__ == "__main__":
    unittest.main()
