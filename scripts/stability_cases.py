"""What the modules of scripts/stability share: the list of cases, and rows of the table that they make."""
CASES, LONG, OPEN = {}, [], []


def case(measure):
    CASES[measure.__name__] = measure
    return measure


def open_case(measure):
    """A case in which the simulator fails as yet: not of --quick."""
    OPEN.append(measure.__name__)
    return case(measure)


def long_case(measure):
    LONG.append(measure.__name__)
    return case(measure)


def row(variant, run, quantity, unit, value, mesh="box_12", reference=None, kind="", relative=False, limit=None):
    """The error is the distance to the reference, or to 0; it has to be at most the limit, where there is one."""
    error = None
    if reference is not None:
        error = abs(value - reference) / (abs(reference) if relative else 1)
    judged = abs(value) if error is None else error
    options = run.options
    found = {"variant": variant, "quantity": quantity, "unit": unit, "value": value, "reference": reference, "reference_kind": kind, "error": error,
             "limit": limit, "verdict": "" if limit is None else "holds" if judged <= limit else "fails", "mesh": mesh,
             "seconds": len(run.frames["time"]) * run.dt, "bodies": int(run.moving.sum()), "contacts": run.mean_of("contacts", 1),
             "ms_per_step": run.ms_per_step, "options": run.command}
    return found | {key: options[key] for key in ("mode", "dt", "substeps", "iterations", "position_iterations", "friction", "order", "seed")}
