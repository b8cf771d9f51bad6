"""Tables of what scripts/stability measured: verdicts by solver, and how many of them are failures."""
from common import tabular
from common.tabular import markdown

SOLVERS = ("auto", "soft", "newton", "sweeps")
# The table of verdicts asks these. Each has its words, with the unit of its error, and its case, variant and quantity.
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
