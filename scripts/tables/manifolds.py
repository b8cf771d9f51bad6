"""The table of what `manifold_peers` and `manifold_peers_newton` measured: contact manifolds beside closed forms."""
from common.tabular import markdown, three_digits


def shown(text, least):
    """A figure, or that it is below what is worth telling."""
    return f"< {least:g}" if float(text) < least else three_digits(float(text))


def peers(rows):
    """One row for each kind of bodies and peer."""
    heads = ["bodies", "peer", "missed", "invented", "points", "points upright, %", "normal off by, degrees", "at most", "depth off by, %", "at most", "time over Tandem's"]
    lines = [[row["bodies"], row["peer"], row["missed"], row["invented"], row["points"], row["points_upright_percent"],
              shown(row["normal_degrees"], 1e-3), shown(row["normal_degrees_largest"], 1e-3),
              shown(row["depth_percent"], 1e-2), shown(row["depth_percent_largest"], 1e-2), row["time_ratio"]] for row in rows]
    return markdown(heads, lines, "ll")
