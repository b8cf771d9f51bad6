#!/usr/bin/python3
"""What bvhbuild --json reports. Environment: that of cli_test.py."""
import json
import unittest

from tool_test import CUBE_OBJ, DONE, NO_TRIANGLE, UNREADABLE_INPUT, UNWRITABLE_OUTPUT, ToolTest


class BuildJson(ToolTest):
    ALWAYS = {"tool", "version", "exit_code", "error", "input", "output", "reader", "single_precision_reader", "faces",
              "vertices", "remarks", "findings", "seconds", "peak_memory_bytes"}
    AFTER_SUCCESS = {"interrupted", "parts", "origin", "rounding_error", "tree", "gpu_blocks", "topology", "bytes",
                     "hash"}
    FINDINGS = {"faces_index_out_of_range", "faces_too_few_corners", "faces_not_finite", "faces_too_large",
                "faces_repeated_corner", "faces_not_simple",
                "vertices_unreferenced", "vertices_welded", "triangles_degenerate", "triangles_duplicate",
                "triangles_duplicate_reversed", "triangles_flattened"}

    def test_a_success_has_all_keys(self):
        report = self.built_json("a.obj", CUBE_OBJ)
        self.assertEqual(set(report), self.ALWAYS | self.AFTER_SUCCESS)
        self.assertEqual(set(report["findings"]), self.FINDINGS)
        self.assertEqual(set(report["seconds"]), {"import", "clean", "build", "write"})
        self.assertEqual((report["exit_code"], report["error"]), (DONE, None))
        self.assertEqual((report["faces"], report["vertices"], report["tree"]["triangles"]), (6, 8, 12))
        self.assertEqual(report["bytes"], self.out.stat().st_size)
        self.assertEqual(report["hash"], json.loads(self.info(self.out, "--json").stdout)["hash"])

    def test_a_file_without_oriented_blocks_is_told(self):
        self.assertTrue(self.built_json("a.obj", CUBE_OBJ)["gpu_blocks"])
        self.assertFalse(self.built_json("a.obj", CUBE_OBJ, "--no-gpu-blocks")["gpu_blocks"])
        mesh = self.write("a.obj", CUBE_OBJ)
        self.assertIn(b"no oriented blocks", self.build(mesh, "-o", self.out, "--no-gpu-blocks").stdout)
        self.assertNotIn(b"oriented", self.build(mesh, "-o", self.out).stdout)

    def test_a_file_without_topology_is_told(self):
        self.assertTrue(self.built_json("a.obj", CUBE_OBJ)["topology"])
        self.assertFalse(self.built_json("a.obj", CUBE_OBJ, "--no-topology")["topology"])
        mesh = self.write("a.obj", CUBE_OBJ)
        self.assertIn(b"no topology", self.build(mesh, "-o", self.out, "--no-topology").stdout)
        self.assertNotIn(b"topology", self.build(mesh, "-o", self.out).stdout)

    def test_a_failure_has_its_reason_on_both_streams(self):
        for path, out, code in ((self.inputs / "none.obj", self.out, UNREADABLE_INPUT),
                                (self.write("l.obj", "v 0 0 0\n"), self.out, NO_TRIANGLE),
                                (self.write("a.obj", CUBE_OBJ), "/dev/full", UNWRITABLE_OUTPUT)):
            result = self.build(path, "-o", out, "--json")
            report = json.loads(result.stdout)
            self.assertEqual((result.returncode, report["exit_code"]), (code, code))
            self.assertEqual(set(report), self.ALWAYS)
            self.assertEqual(result.stderr.decode(), f"bvhbuild: {report['error']}\n")

    def test_a_mesh_with_defects_counts_them(self):
        unclean = CUBE_OBJ + "v 0 0 0\nv 5 5 5\nf 1 2 2\nf 1 2 99\nf 4 3 2 9\n"
        found = self.built_json("a.obj", unclean)["findings"]
        self.assertEqual(found["faces_index_out_of_range"], 1)
        self.assertEqual(found["vertices_unreferenced"], 1)
        self.assertEqual(found["vertices_welded"], 1)
        self.assertEqual(found["triangles_degenerate"], 1)
        self.assertEqual(found["triangles_duplicate"], 2)


if __name__ == "__main__":
    unittest.main()
