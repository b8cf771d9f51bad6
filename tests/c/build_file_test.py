#!/usr/bin/python3
"""What the builder makes in memory through the C interface: the bytes that bvhbuild writes."""
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

ROOT = Path(os.environ["TANDEM_SOURCE_DIR"])


class BuildFileTest(unittest.TestCase):
    def test_the_builder_makes_the_bytes_that_bvhbuild_writes(self):
        for name, words in (("box_48", []), ("cow_1500", ["--effort", "fast"]), ("ground", []), ("box_192", ["--no-topology", "--no-gpu-blocks"]),
                            ("cow_1500", ["--effort", "fast", "--imaginary", "free"]), ("box_48", ["--no-refit"])):
            with self.subTest(name=name, words=words), tempfile.TemporaryDirectory() as folder:
                written, made = Path(folder) / "written.bvh", Path(folder) / "made.bvh"
                subprocess.run([os.environ["TANDEM_BVHBUILD"], ROOT / f"assets/{name}.obj", "-o", written, "--quiet", *words], check=True)
                flags = [str(int(word in words)) for word in ("fast", "--no-gpu-blocks", "--no-topology", "--no-refit", "free")]
                subprocess.run([os.environ["TANDEM_BUILD_FILE"], ROOT / "assets", f"{name}.obj", written, made, *flags], check=True)
                self.assertEqual(written.read_bytes(), made.read_bytes())


if __name__ == "__main__":
    unittest.main()
