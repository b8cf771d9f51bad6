"""What the paper's experiment gave (tables of scripts/paper/collect), and tables of it."""
import statistics
from collections import defaultdict

from common import tabular
from common.tabular import markdown, three_digits, whole

KINDS = {"slide": "rock slide", "pile": "pile", "stack": "structured stack"}
PAPER = {"slide": "up to 2", "pile": "3 to 7", "stack": "5 to 8"}  # times RAPID, as the paper says of more than 500 objects
FCL, TANDEM, PAPER_GPU, TANDEM_GPU = ENGINES = ("fcl", "cpu"), ("tandem", "cpu"), ("paper", "gpu"), ("tandem", "gpu")
NAMES = {FCL: "FCL, one CPU core", TANDEM: "Tandem, one CPU core", PAPER_GPU: "the paper's engine", TANDEM_GPU: "Tandem"}


class Results:
    """Mean milliseconds by (kind, triangles, objects), for each engine; contact ratios; object pairs."""

    def __init__(self, paths):
        self.times, self.gpu = defaultdict(dict), ""
        samples, ratios, pairs = defaultdict(list), defaultdict(dict), defaultdict(dict)
        for path in paths:
            for row in tabular.read(path):
                run = (row["configuration"], int(row["triangles"]), int(row["objects"]))
                samples[self.engine_of(row), run].append(float(row["milliseconds_best"]))
                ratios[run][row["seed"]] = float(row["contact_ratio"])
                pairs[run][row["seed"], row["frame"]] = int(row["object_pairs"])
        for (engine, run), values in samples.items():
            self.times[engine][run] = statistics.fmean(values)
        self.ratios = {run: statistics.fmean(by_seed.values()) for run, by_seed in ratios.items()}
        self.pairs = {run: statistics.fmean(by_frame.values()) for run, by_frame in pairs.items()}

    def engine_of(self, row):
        if row["device"].endswith("1 core"):
            return row["engine"], "cpu"
        self.gpu = row["device"]
        return row["engine"], "gpu"

    def engines(self):
        return [engine for engine in ENGINES if self.times[engine]]

    def sizes(self, kind):
        return sorted({run[1] for run in self.ratios if run[0] == kind})

    def counts(self, kind):
        return sorted({run[2] for run in self.ratios if run[0] == kind})

    def kinds(self):
        return [kind for kind in KINDS if self.counts(kind)]

    def speedup(self, engine, run, base=FCL):
        """As many times as fast as `base`, or None."""
        slow, time = self.times[base].get(run), self.times[engine].get(run)
        return slow / time if slow and time else None

    def range_of(self, kind, engine, base=FCL):
        """Least and most speedup over the runs of a kind, or None."""
        values = [value for run in self.ratios if run[0] == kind and (value := self.speedup(engine, run, base))]
        return (min(values), max(values)) if values else None

    def name(self, engine):
        return NAMES[engine] + (f", {self.gpu.replace('NVIDIA ', '').split()[0]}" if engine[1] == "gpu" else "")


def ratios(results):
    """Figure 6: contacts by triangles."""
    rows = []
    for kind in results.kinds():
        for objects in results.counts(kind):
            cells = [results.ratios.get((kind, size, objects)) for size in results.sizes(kind)]
            rows.append([KINDS[kind], whole(objects), *("–" if cell is None else f"{cell:.4f}" for cell in cells)])
    return markdown(["configuration", "objects", "fewest triangles", "more", "most"], rows)


def speedups(results):
    """Figure 7: times as fast as FCL, least to most over the runs of a configuration."""
    def cell(kind, digits, *engines):
        values = results.range_of(kind, *engines)
        return " to ".join(digits(value) for value in values) if values else "–"

    engines = results.engines()[1:]
    head = ["configuration", "the paper, over RAPID, more than 500 objects", *(results.name(engine) for engine in engines)]
    rows = [[KINDS[kind], PAPER[kind], *(cell(kind, three_digits, engine) for engine in engines)] for kind in results.kinds()]
    if TANDEM_GPU in engines and PAPER_GPU in engines:
        head.append("Tandem over the paper's engine")
        for row, kind in zip(rows, results.kinds()):
            row.append(cell(kind, "{:.1f}".format, TANDEM_GPU, PAPER_GPU))
    return markdown(head, rows)


def times(results):
    """Figure 8: fewest and most objects, milliseconds and times as fast as FCL."""
    rows = []
    for kind in results.kinds():
        for size in results.sizes(kind):
            for objects in (results.counts(kind)[0], results.counts(kind)[-1]):
                run = (kind, size, objects)
                cells = (f"{three_digits(results.times[engine].get(run))} ({three_digits(results.speedup(engine, run))})" for engine in results.engines())
                rows.append([KINDS[kind], whole(size), whole(objects), whole(results.pairs[run]), *cells])
    return markdown(["configuration", "triangles", "objects", "object pairs", *map(results.name, results.engines())], rows)
