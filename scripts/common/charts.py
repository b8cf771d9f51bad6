"""The look of all charts: size, letters, colours, legends, files."""
import io
import math

import matplotlib
import PIL.Image

from .colours import BLACK, BLUE, FAINT, GREEN, ORANGE, PURPLE, SKY, VERMILION  # noqa: F401  (for those who draw charts)

matplotlib.use("Agg")
matplotlib.rcParams.update({
    "svg.hashsalt": "tandem", "font.size": 9, "axes.titlesize": 9.5, "legend.fontsize": 9, "xtick.labelsize": 8.5, "ytick.labelsize": 8.5,
    "axes.spines.top": False, "axes.spines.right": False, "axes.titlelocation": "left", "axes.axisbelow": True, "axes.grid": True,
    "grid.linewidth": 0.4, "grid.color": "#d0d0d0", "lines.linewidth": 1.3, "lines.markersize": 5.5, "legend.frameon": False})
import matplotlib.pyplot as plt  # noqa: E402  (after the choice of backend)

WIDTH = 8  # inches. Pages show charts about 800 pixels wide, where 9 points are 12 pixels.


def panels(rows, columns, height, **options):
    """A figure, `height` inches high, and its array of axes."""
    return plt.subplots(rows, columns, figsize=(WIDTH, height), squeeze=False, **options)


def thousands(axis):
    """Numbers with commas in place of powers of ten."""
    axis.set_major_formatter(matplotlib.ticker.FuncFormatter(lambda x, _: f"{x:,g}"))
    axis.set_minor_formatter(matplotlib.ticker.NullFormatter())


def ones_twos_fives(axis):
    """Ticks at 1, 2 and 5 times each power of ten, for a logarithmic axis of a few powers."""
    axis.set_major_locator(matplotlib.ticker.LogLocator(subs=(1, 2, 5)))
    thousands(axis)


def best(points):
    """Of (time, error, ...) those that no other undercuts in both."""
    front = []
    for point in sorted(points, key=lambda point: point[:2]):
        if not front or point[1] < front[-1][1]:
            front.append(point)
    return front


def sign(**style):
    """What stands for a series in a legend."""
    return plt.Line2D([], [], **style)


def handles_of(axes):
    """{label: handle} of all that is labelled in some axes."""
    return {label: handle for some in axes for handle, label in zip(*some.get_legend_handles_labels())}


def save(figure, out, legend=None, across=4, note=""):
    """Writes OUT.png and OUT.svg, with a legend below, {label: handle}, and a note above."""
    bottom = 0.23 * math.ceil(len(legend or ()) / across) / figure.get_figheight()
    top = 0.25 * bool(note) / figure.get_figheight()
    figure.set_layout_engine("constrained", rect=(0, bottom, 1, 1 - bottom - top))
    if legend:
        figure.legend(legend.values(), legend.keys(), loc="lower center", ncol=across, columnspacing=1.5, handletextpad=0.5, borderaxespad=0.2)
    if note:
        figure.text(0.01, 0.99, note, va="top")
    pixels = io.BytesIO()
    figure.savefig(pixels, dpi=200)
    PIL.Image.open(pixels).convert("RGB").quantize(96).save(f"{out}.png", optimize=True)  # a palette: a third of the bytes
    figure.savefig(f"{out}.svg", metadata={"Date": None})
    plt.close(figure)
