"""The dtypes of rows are the structs of tandem.h, as a C compiler lays them out."""
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import tandem

ROWS = {"INSTANCE": "instance", "PAIR": "object_pair", "CONTACT": "contact", "MANIFOLD": "manifold", "POINT": "manifold_point", "CONTAINMENT": "containment",
        "DISTANCE": "distance", "FORMER": "former_nearest", "MOTION": "motion", "IMPACT": "impact", "VERDICT": "verdict"}
IN_C = {("instance", "rotation"): "pose.rotation", ("instance", "translation"): "pose.translation"}


def test_rows_are_those_of_c(tmp_path):
    compiler = shutil.which("cc") or pytest.skip("there is no C compiler")
    lines, expected = [], []
    for name, struct in ROWS.items():
        dtype = getattr(tandem, name)
        for field in dtype.names:
            of, offset = dtype.fields[field][:2]
            member = IN_C.get((struct, field), field)
            lines.append(f'printf("{name}.{field} %zu %zu\\n", offsetof(tandem_{struct}, {member}), sizeof(((tandem_{struct}*)0)->{member}));')
            expected.append(f"{name}.{field} {offset} {of.itemsize}")
        lines.append(f'printf("{name} %zu\\n", sizeof(tandem_{struct}));')
        expected.append(f"{name} {dtype.itemsize}")
    (tmp_path / "rows.c").write_text("#include <stdio.h>\n#include <stddef.h>\n#include <tandem/tandem.h>\nint main(void) {" + "\n".join(lines) + "return 0; }\n")
    header = Path(os.environ["TANDEM_SOURCE_DIR"]) / "bindings/c/include"
    subprocess.run([compiler, "-std=c99", "-I", header, tmp_path / "rows.c", "-o", tmp_path / "rows"], check=True)
    assert subprocess.run([tmp_path / "rows"], check=True, capture_output=True, text=True).stdout.splitlines() == expected


@pytest.mark.parametrize("name", ROWS)
def test_numpy_keeps_the_dtypes(name):
    rows = np.zeros(3, getattr(tandem, name))
    for other in (np.concatenate([rows, rows]), rows[::-1].copy(), np.array(rows.tolist(), rows.dtype), np.frombuffer(rows.tobytes(), rows.dtype)):
        assert other.dtype == rows.dtype
    assert rows.dtype.itemsize == sum(rows.dtype[field].itemsize for field in rows.dtype.names)  # no holes


def test_small_and_unsigned_numbers_are_taken():
    for dtype in ("i1", "u1", "i4", "i8", "u8", ">i4"):
        assert tandem.instances(np.array([0, 1, 2], dtype))["asset"].tolist() == [0, 1, 2]
    with pytest.raises(ValueError, match="asset: row 1"):
        tandem.instances(np.array([0, 2**63], "u8"))
