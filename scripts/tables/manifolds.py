"""The table of what `manifold_peers` and `manifold_peers_newton` measured: contact manifolds beside closed forms."""
from common.tabular import markdown, three_digits


def shown(text, least):
    """A figure, or that it is below what is worth telling."""
    return f"< {least:g}" if float(text) < least else three_digits(float(text))


def spread(texts):
    """The smallest and the largest of some figures."""
    least, most = (choose(texts, key=lambda text: float(text.replace(",", ""))) for choose in (min, max))
    return least if least == most else f"{least} to {most}"


def error(rows, name, least):
    """The largest median of some kinds of bodies, and the largest error of all."""
    median, largest = (shown(max((row[column] for row in rows), key=float), least) for column in (name, f"{name}_largest"))
    return median if median == largest else f"{median} ({largest})"


def cells(rows):
    return [error(rows, "normal_degrees", 1e-3), error(rows, "depth_percent", 1e-2), spread([row["time_ratio"] for row in rows])]


def peers(rows):
    """One row for each peer; columns for boxes on boxes, where side faces meet too, and for bodies that reach into a block."""
    heads = ["peer"] + [f"{group}: {what}" for group in ("boxes", "block") for what in ("normal off, °", "depth off, %", "time")]
    lines = []
    for peer in dict.fromkeys(row["peer"] for row in rows):
        groups = [[row for row in rows if row["peer"] == peer and row["bodies"].endswith(end)] for end in ("box", "block")]
        lines.append([peer, *(cell for group in groups for cell in cells(group))])
    return markdown(heads, lines)


def threads(rows):
    """One row for each peer: nuts on bolts, in few worlds and in many."""
    heads = ["peer", "normal off, °", "depth off, %", "invented", "µs a pair"]
    lines = []
    for peer in dict.fromkeys(row["peer"] for row in rows):
        own = [row for row in rows if row["peer"] == peer]
        lines.append([peer, error(own, "normal_degrees", 1e-3), error(own, "depth_percent", 1e-2), max((row["invented"] for row in own), key=int),
                      spread([three_digits(float(row["microseconds"])) for row in own])])
    return markdown(heads, lines)
