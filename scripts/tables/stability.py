"""Tables of what scripts/stability measured: verdicts by solver, towers, heavy boxes, stacks and heaps."""
import re

from common import tabular
from common.tabular import markdown

SOLVERS = ("auto", "soft", "newton", "sweeps")
# What the table of verdicts asks: words for it with the unit of its error, case, variant, quantity.
ASKED = (("steepest slope on which a block sticks, relative", "sticking", "default, mu 0.5", "angle"),
         ("way of a pushed block, relative", "sliding", "pushed, default, 4 m/s, mu 0.4", "stopping distance"),
         ("speed of a cow at rest, m/s", "rest", "cow_1500", "speed, rms"),
         ("drift of a tower of 30", "tower30", "default", "largest drift"),
         *((f"drift of a box on another, {ratio:,} times lighter", "masses", f"heavy on light, {ratio}:1", "largest drift") for ratio in (100, 1000)),
         ("drift of a box on nine others, 1,000 times lighter", "masses", "heavy on nine, 1000:1", "largest drift"),
         ("drift of a stack of 5³", "stack", "default", "largest drift"),
         ("drift of a stack of 10³", "stack60", "default", "largest drift"))


def read(path):
    """{case: {(solver, variant): {quantity: row}}}"""
    cases = {}
    for row in tabular.read(path):
        cases.setdefault(row["case"], {}).setdefault((row["solver"], row["variant"]), {})[row["quantity"]] = row
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


def judged(quantities, quantity):
    """The error of a quantity, and whether it holds."""
    row = quantities[quantity]
    shown = "falls" if "falls after" in quantities else f"{float(row['error'] or row['value']):.2g}"
    return f"**fails**, {shown}" if row["verdict"] == "fails" else shown


def verdicts(cases):
    """What each solver makes of a case with the default settings."""
    rows = []
    for words, case, variant, quantity in ASKED:
        found = {solver: cases[case].get((solver, variant)) for solver in SOLVERS}
        limit = next(quantities[quantity]["limit"] for quantities in found.values() if quantities)
        rows.append([words, f"{float(limit):.2g}", *(judged(quantities, quantity) if quantities else "–" for quantities in found.values())])
    return markdown(["error", "limit", *(f"`{solver}`" for solver in SOLVERS)], rows)


def failures(rows):
    """How many of the verdicts of each case and solver are failures."""
    cases = {}
    for row in (row for row in rows if row["verdict"]):
        cases.setdefault(row["case"], {}).setdefault(row["solver"], []).append(row["verdict"] == "fails")
    cases["all"] = {solver: [failed for found in cases.values() for failed in found.get(solver, [])] for solver in SOLVERS}
    lines = [[f"`{case}`" if case != "all" else case, *(f"{sum(found[solver])} of {len(found[solver])}" if solver in found else "–" for solver in SOLVERS)]
             for case, found in cases.items()]
    return markdown(["case", *(f"`{solver}`" for solver in SOLVERS)], lines)


def towers(cases):
    """Towers of 30. The speed of one that fell says nothing and is left out."""
    rows = []
    for (solver, variant), quantities in cases["tower30"].items():
        speed = "" if "falls after" in quantities else two_digits(quantities["speed, rms of the last second"])
        step = f"{float(quantities['largest drift']['ms_per_step']):.2g}"
        rows.append([f"`{solver}`", name(variant), drift(quantities), falls(quantities), speed, step])
    return markdown(["solver", "tower of 30, 20 s", "largest drift, box lengths", "falls after", "rms speed at the end, m/s", "ms a step"], rows, "ll")


def masses(cases):
    rows = [[f"`{solver}`", name(variant), drift(quantities), falls(quantities)] for (solver, variant), quantities in cases["masses"].items()]
    return markdown(["solver", "heavy on light, 10 s", "largest drift, box lengths", "falls after"], rows, "ll")


def stacks(cases):
    rows = [[f"`{solver}`", size, name(variant), drift(quantities), f"{float(quantities['largest drift']['ms_per_step']):.3g}"]
            for size, case in (("5³, 10 s", "stack"), ("10³, 60 s", "stack60")) for (solver, variant), quantities in cases[case].items()]
    return markdown(["solver", "stack", "", "largest drift, box lengths", "ms a step"], rows, "lll")


def heaps(rows):
    """Heaps of 1,000 cows, a row for each solver and seed."""
    found = {}
    for row in (row for row in rows if row["case"] == "heap"):
        found.setdefault((row["solver"], row["seed"]), {})[row["quantity"]] = row
    lines = []
    for (solver, seed), quantities in found.items():
        fastest = quantities["fastest body, last 2 s"]
        shown = f"**fails**, {two_digits(fastest)}" if fastest["verdict"] == "fails" else two_digits(fastest)
        last = float(quantities["last time that a body is faster than 1 cm/s"]["value"])
        lines.append([f"`{solver}`", seed, shown, f"{last:.1f}", f"{float(fastest['contacts']):,.0f}", f"{float(fastest['ms_per_step']):.0f}"])
    return markdown(["solver", "seed", "fastest body of the last 2 s, m/s", "last time above 1 cm/s, s", "contacts", "ms a step"], lines, "l")


def peers(rows):
    """Other engines, a row for each case."""
    engines = list(dict.fromkeys(row["engine"] for row in rows))
    cells = {(row["case"], row["variant"], row["engine"]): row for row in rows}

    def shown(row):
        return f"**fails**, {row['value']}" if row["verdict"] == "fails" else row["value"]

    lines = [[label or f"{case}, {variant}", *(shown(cells[case, variant, engine]) if (case, variant, engine) in cells else "–" for engine in engines)]
             for (case, variant), label in dict.fromkeys(((row["case"], row["variant"]), "plates, m/s" if row["case"] == "tunnelling" else "") for row in rows)]
    return markdown(["largest drift, box lengths", *(f"{engine} {next(row['version'] for row in rows if row['engine'] == engine)}" for engine in engines)], lines)
