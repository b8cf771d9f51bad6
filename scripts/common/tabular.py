"""Tables as CSV and as Markdown, and the numbers in them. Needs nothing but Python's standard library."""
import csv
from pathlib import Path


def read(path):
    """The rows of a CSV file, each a dictionary of text."""
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def write(path, rows, columns=None):
    """Writes rows, dictionaries, to a CSV file, whose folder is made; the columns are those of the first row unless they are given."""
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    with open(path, "w", newline="") as file:
        write_to(file, rows, columns)


def write_to(file, rows, columns=None):
    table = csv.DictWriter(file, columns or list(rows[0]), lineterminator="\n")
    table.writeheader()
    table.writerows(rows)


def tell(row):
    """Prints a row as soon as it is measured."""
    print(", ".join(f"{key} {value}" for key, value in row.items()), flush=True)


def markdown(header, rows, alignment="l"):
    """A table in Markdown, of rows of text. The alignment has a letter for each column, l or r; columns without a letter are aligned to the right."""
    rule = ["---" if side == "l" else "---:" for side in alignment.ljust(len(header), "r")]
    lines = [f"| {' | '.join(cells)} |" for cells in (header, *rows)]
    return "\n".join([lines[0], f"|{'|'.join(rule)}|", *lines[1:]]) + "\n"


def size(value):
    """Bytes, by powers of ten."""
    for unit, power in (("GB", 9), ("MB", 6)):
        if value >= 10 ** power:
            return f"{value / 10 ** power:.3g} {unit}"
    return f"{value / 1e3:.3g} kB"


def three_digits(value):
    """Three digits that count, and commas: 0.052, 2.18, 46.6, 7,099; a dash for None."""
    return "–" if value is None else f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def whole(value):
    """A number without decimals, with commas; a dash for None."""
    return "–" if value is None else f"{value:,.0f}"
