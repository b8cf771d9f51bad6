"""Tables of scripts/simulator_peers: what becomes of bodies."""
from common import tabular


def scenes(rows):
    header = ["scene", "engine", "asked for", "found", "right", "contacts", "µs a step"]
    cells = [[row["case"], _name(row), row["quantity"], row["value"], row["right"], row["contacts"], f"{int(row['us_per_step']):,}"] for row in rows if row["quantity"]]
    return tabular.markdown(header, cells, "lll")


def _name(row):
    return row["peer"].replace("mujoco", "MuJoCo").replace("newton", "Newton")
