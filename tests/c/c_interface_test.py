#!/usr/bin/python3
"""What libtandem.so exports is what tandem.h declares, and the structs of docs/c.md in other languages lie in memory as the C compiler lays them out."""
import os
import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

ROOT, LIBRARY = Path(os.environ["TANDEM_SOURCE_DIR"]), Path(os.environ["TANDEM_LIBRARY"])
HEADER = ROOT / "bindings/c/include/tandem/tandem.h"
CUDA_LIBRARY, CUDA_HEADER = os.environ.get("TANDEM_CUDA_LIBRARY"), ROOT / "bindings/c/cuda/include/tandem/tandem_cuda.h"
PAGE = (ROOT / "docs/c.md").read_text(encoding="utf-8")
SIZES = {"u8": 1, "u32": 4, "u64": 8, "f32": 4, "f64": 8, "usize": 8, "byte": 1, "uint": 4, "ulong": 8, "float": 4, "double": 8, "IntPtr": 8, "UIntPtr": 8}


def block(language):
    return re.search(rf"^```{language}\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)[1]


class Layouts:
    """Sizes and offsets of structs by the rule of C: each field at a multiple of its alignment."""

    def __init__(self, structs):
        self.size, self.align, self.offsets = dict(SIZES), dict(SIZES), {}
        for name, fields in structs:
            end, widest = 0, 1
            for field, kind, count in fields:
                end = -(-end // self.align[kind]) * self.align[kind]
                self.offsets[name, field] = end
                end, widest = end + count * self.size[kind], max(widest, self.align[kind])
            self.size[name], self.align[name] = -(-end // widest) * widest, widest


def rust_structs():
    for name, body in re.findall(r"#\[repr\(C\)\]\n(?:#\[derive[^\n]*\n)?pub struct (\w+) \{\n(.*?)^\}", block("rust"), re.MULTILINE | re.DOTALL):
        fields = []
        for field, kind in re.findall(r"^    pub (\w+): (.*),$", body, re.MULTILINE):
            count = 1
            while array := re.fullmatch(r"\[(.*); (\d+)\]", kind):
                kind, count = array[1], count * int(array[2])
            fields.append((field, "usize" if kind.startswith("*") else kind, count))
        yield name, fields


def csharp_structs():
    for name, body in re.findall(r"\[StructLayout\(LayoutKind\.Sequential\)\]\npublic (?:unsafe )?struct (\w+) \{\n(.*?)^\}", block("csharp"),
                                 re.MULTILINE | re.DOTALL):
        yield name, [(field, kind, int(count or 1)) for kind, field, count in re.findall(r"^  public (?:fixed )?(\w+) (\w+)(?:\[(\d+)\])?;$", body, re.MULTILINE)]


class CInterfaceTest(unittest.TestCase):
    def setUp(self):
        holder = tempfile.TemporaryDirectory()
        self.addCleanup(holder.cleanup)
        self.folder = Path(holder.name)

    def declared(self, header=HEADER):
        return set(re.findall(r"^TANDEM_API [^(]*?(tandem_\w+)\(", header.read_text(encoding="utf-8"), re.MULTILINE))

    def check_exports(self, library, header):
        listed = subprocess.run(["nm", "-D", "--defined-only", library], capture_output=True, text=True, check=True).stdout
        names = {line.split()[-1] for line in listed.splitlines()}
        self.assertEqual(names, {"TANDEM_0.1"} | {f"{name}@@TANDEM_0.1" for name in self.declared(header)})
        self.assertGreater(len(names), 50)

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

    def test_layouts_in_other_languages_are_those_of_c(self):
        for language, structs in (("rust", list(rust_structs())), ("csharp", list(csharp_structs()))):
            layouts = Layouts(structs)
            self.assertGreater(len(structs), 3)
            prints = [f'  printf("{name} %zu\\n", sizeof({name}));' for name, _ in structs]
            prints += [f'  printf("{name}.{field} %zu\\n", offsetof({name}, {field}));' for name, field in layouts.offsets]
            source = self.folder / "layouts.c"
            source.write_text("#include <stddef.h>\n#include <stdio.h>\n#include <tandem/tandem.h>\nint main(void) {\n" + "\n".join(prints) + "\n  return 0;\n}\n")
            subprocess.run(["cc", "-std=c99", f"-I{HEADER.parent.parent}", source, "-o", self.folder / "layouts"], check=True)
            told = subprocess.run([self.folder / "layouts"], capture_output=True, text=True, check=True).stdout
            computed = [f"{name} {layouts.size[name]}" for name, _ in structs] + [f"{name}.{field} {at}" for (name, field), at in layouts.offsets.items()]
            with self.subTest(language=language):
                self.assertEqual(told.splitlines(), computed)
                # A field that C has and the declaration has not would move none of the others.
                for name, fields in structs:
                    self.assertEqual([field for field, _, _ in fields], self.fields_in_c(name))

    def fields_in_c(self, name):
        body = re.search(rf"^typedef struct {name} \{{\n(.*?)^\}} {name};", HEADER.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)[1]
        code = re.sub(r"//.*", "", body)
        fields = []
        for declaration in filter(str.strip, code.split(";")):
            fields += [re.search(r"(\w+)(?:\[\d+\])*$", part.strip())[1] for part in declaration.split(",")]
        return fields

    def test_functions_that_other_languages_name_are_declared(self):
        for language, pattern in (("rust", r"^    fn (tandem_\w+)\("), ("csharp", r"extern [\w*]+ (tandem_\w+)\(")):
            named = re.findall(pattern, block(language), re.MULTILINE)
            self.assertGreater(len(named), 7)
            self.assertEqual(set(named) - self.declared(), set())

    def test_the_program_in_rust_says_what_the_one_in_c_says(self):
        if shutil.which("rustc") is None:
            self.skipTest("no rustc")
        source = self.folder / "contacts.rs"
        source.write_text(block("rust"), encoding="utf-8")
        built = subprocess.run(["rustc", "--edition", "2021", "-A", "nonstandard_style", "-A", "dead_code", "-D", "warnings", f"-Lnative={LIBRARY.parent}",
                                source, "-o", self.folder / "contacts"], capture_output=True, text=True)
        self.assertEqual((built.returncode, built.stderr), (0, ""))
        subprocess.run([os.environ["TANDEM_BVHBUILD"], ROOT / "assets/box_12.obj", "-o", self.folder / "box.bvh", "--quiet"], check=True)
        told = subprocess.run([self.folder / "contacts", self.folder / "box.bvh"], capture_output=True, text=True, env=os.environ | {"LD_LIBRARY_PATH": str(LIBRARY.parent)})
        self.assertEqual((told.returncode, told.stderr), (0, ""))
        self.assertIn(f"```\n{told.stdout}```", PAGE)


if __name__ == "__main__":
    unittest.main()
