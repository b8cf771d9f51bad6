"""Tables of what scripts/stability measured of towers and of heavy boxes."""
import re

from common import tabular
from common.tabular import markdown


def read(path):
    """{case: {variant: {quantity: row}}}"""
    cases = {}
    for row in tabular.read(path):
        cases.setdefault(row["case"], {}).setdefault(row["variant"], {})[row["quantity"]] = row
    return cases


def name(variant):
    """A variant as the page writes it, with options of the command line as code."""
    variant = re.sub(r"\b(cold|shock)\b", r"`--\1`", variant)
    return re.sub(r"\bfast\b", "`fast`", variant).replace("iterations", "sweeps")


def two_digits(row):
    return f"{float(row['value']):.2g}"


def drift(quantities):
    row = quantities["largest drift"]
    shown = "down" if "falls after" in quantities else two_digits(row)
    return f"**fails**, {shown}" if row["verdict"] == "fails" else shown


def falls(quantities):
    return f"{float(quantities['falls after']['value']):g} s" if "falls after" in quantities else ""


def towers(cases):
    """Towers of 30. The speed of one that fell says nothing and is left out."""
    rows = []
    for variant, quantities in cases["tower30"].items():
        speed = "" if "falls after" in quantities else two_digits(quantities["speed, rms of the last second"])
        step = f"{float(quantities['largest drift']['ms_per_step']):.2g}"
        rows.append([name(variant), drift(quantities), falls(quantities), speed, step])
    return markdown(["tower of 30, 20 s", "largest drift, box lengths", "falls after", "rms speed at the end, m/s", "ms a step"], rows)


def masses(cases):
    rows = [[name(variant), drift(quantities), falls(quantities)] for variant, quantities in cases["masses"].items()]
    return markdown(["heavy on light, 10 s", "largest drift, box lengths", "falls after"], rows)
