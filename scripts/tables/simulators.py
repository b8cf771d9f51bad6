"""Tables of scripts/simulator_peers: contacts in random poses, and what becomes of bodies."""
from common import tabular


def pairs(rows):
    header = ["bodies", "peer", "poses that touch", "missed", "poses apart", "invented"]
    return tabular.markdown(header, [[row["case"], _name(row), row["touch"], row["missed"], row["apart"], row["invented"]] for row in rows if row["touch"]], "ll")


def scenes(rows):
    header = ["scene", "engine", "height, m", "where it ought to be", "contacts, last second", "µs a step"]
    cells = [[row["case"], _name(row), row["height"], row["right"], row["contacts"], row["us_per_step"]] for row in rows if row["height"]]
    return tabular.markdown(header, cells, "ll")


def _name(row):
    return row["peer"].replace("mujoco", "MuJoCo").replace("newton", "Newton")
