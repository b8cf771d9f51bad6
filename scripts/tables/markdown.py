"""Markdown tables, and the cells of them."""


def table(header, rows, align=None):
    """Lines of a table; `align` has a letter for each column, l or r. Without it the first column is text and the others are numbers."""
    align = align or "l" + "r" * (len(header) - 1)
    rule = "|" + "".join({"l": "---|", "r": "---:|"}[letter] for letter in align)
    return ["| " + " | ".join(header) + " |", rule] + ["| " + " | ".join(row) + " |" for row in rows]


def number(value):
    """Three digits that count, and commas: 0.052, 2.18, 46.6, 7,099. A dash for what is not known."""
    return "–" if value is None else f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def count(value):
    return "–" if value is None else f"{value:,.0f}"


def size(value):
    """Bytes, by powers of ten."""
    for unit, power in (("GB", 9), ("MB", 6)):
        if value >= 10 ** power:
            return f"{value / 10 ** power:.3g} {unit}"
    return f"{value / 1e3:.3g} kB"
