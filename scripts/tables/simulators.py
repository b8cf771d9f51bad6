"""Tables of scripts/simulator_peers: contacts in random poses, and what becomes of bodies."""
from common import tabular


def pairs(rows):
    header = ["bodies", "peer", "poses that touch", "missed", "poses apart", "invented"]
    cells = [[row["case"], _name(row), row["touch"], row["missed"], row["apart"], row["invented"]] for row in rows if row["touch"]]
    return tabular.markdown(header, cells, "ll")


def scenes(rows):
    header = ["scene", "engine", "asked for", "found", "right", "contacts", "µs a step"]
    cells = [[row["case"], _name(row), row["quantity"], row["value"], row["right"], row["contacts"], f"{int(row['us_per_step']):,}"] for row in rows if row["quantity"]]
    return tabular.markdown(header, cells, "lll")


def _name(row):
    return row["peer"].replace("mujoco", "MuJoCo").replace("newton", "Newton")
