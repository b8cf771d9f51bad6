"""Checks of programs for another system that need not run: they load what that system has, and the library exports its interface alone."""
import os
import pathlib
import sys
import unittest

SOURCE_DIR = pathlib.Path(os.environ["TANDEM_SOURCE_DIR"])
BUILD = pathlib.Path(os.environ["TANDEM_BUILD"])
sys.path.insert(0, str(SOURCE_DIR / "scripts"))
from common import c_header  # noqa: E402

# A test that returns this code counts as skipped.
SKIPPED = 77


class LinkedPrograms:
    """The base of a unittest.TestCase, which has: programs, the files; library, that of the C interface; system, the libraries that the system has;
    loaded_by(file) and exported_by(file), sets of names."""

    def test_they_load_no_library_but_those_of_the_system(self):
        for file in (*self.programs, self.library):
            loaded = self.loaded_by(file)
            self.assertTrue(loaded, file)
            self.assertLessEqual(loaded, self.system, file)

    def test_the_library_exports_its_interface_alone(self):
        header = c_header.read(SOURCE_DIR / "bindings/c/include/tandem/tandem.h")
        self.assertEqual(self.exported_by(self.library), {function.name for function in header.functions})


def run_tests():
    """Runs the tests of the file that was started, of the classes that its arguments name. It fails where there are none."""
    result = unittest.main(module="__main__", exit=False).result
    sys.exit(0 if result.testsRun > 0 and result.wasSuccessful() else 1)
