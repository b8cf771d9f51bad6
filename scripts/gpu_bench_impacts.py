"""Times of impact on a GPU, the CPU beside it: the part of scripts/gpu_bench that --impact asks for."""
import os

from common import tabular, tools

STEP = 1 / 60
COWS = ("cow_1500", "cow_24000")
KINDS = {"lattice": ["lattice", "--spacing", "1.1"], "pile": ["pile"]}  # of 1,000 bodies
SPEEDS = {"slow": (2, 5), "fast": (20, 50)}  # metres and radians a second
COUNTERS = ("object_pairs", "at_start", "found", "walks", "block_pairs", "triangle_pairs", "advanced", "steps", "most_steps", "unconverged")


def add_motions(path, speed, turn):
    """Each body moves in a random direction and turns about a random axis through its centre of mass."""
    import h5py
    import numpy as np

    random = np.random.default_rng(1)
    with h5py.File(path, "r+") as file:
        count = len(file["instances/asset"])
        for name, size in (("velocity", speed), ("angular_velocity", turn)):
            directions = random.normal(size=(count, 3))
            file[f"simulation/{name}"] = size * directions / np.linalg.norm(directions, axis=1)[:, None]


def impacts_of(path):
    """Status and t_safe of each pair."""
    import h5py

    with h5py.File(path) as file:
        return file["impact/status"][:], file["impact/t_safe"][:]


def measure(bench, scene, threads):
    """Rows of the CPU, by one thread and by all, and of the GPU."""
    rows, first = [], None
    for place in (("--threads", 1), ("--threads", threads), ("--backend", "cuda")):
        on_gpu = "cuda" in place
        result = bench.json("impact", f"{scene}.h5", "--dt", STEP, *place, "--out", "impacts.h5", "--repeat", bench.repeat if on_gpu else 3)
        status, t_safe = impacts_of(bench.folder / "impacts.h5")
        first = (status, t_safe) if first is None else first
        rows.append({"scene": scene, "backend": result["backend"], "threads": result["threads"], **{name: result[name] for name in COUNTERS},
                     "rounds": result.get("rounds", ""), "other_status": int((status != first[0]).sum()),
                     "largest_difference": f"{abs(t_safe - first[1]).max() / STEP:.1e}", "median_ms": f"{1e3 * result['seconds']['median']:.4f}",
                     "best_ms": f"{1e3 * result['seconds']['best']:.4f}", "gpu_bytes": result.get("gpu_bytes", ""),
                     "gpu_bytes_bound": result.get("gpu_bytes_bound", "")})
    return rows


def measure_all(bench, only, table):
    """Writes the table; returns what failed. only: names of scenes, or None."""
    rows, gpu, commit = [], bench.ceilings()["gpu"], tools.commit()
    for cow in COWS:
        for kind, words in KINDS.items():
            for name, (speed, turn) in SPEEDS.items():
                scene = f"{kind}_{cow.removeprefix('cow_')}_{name}"
                if only and scene not in only.split(","):
                    continue
                bench.make_scene(scene, [*words, "--mesh", cow, "--count", "1000"])
                add_motions(bench.folder / f"{scene}.h5", speed, turn)
                for row in measure(bench, scene, os.cpu_count()):
                    rows.append({"gpu": gpu, "commit": commit, **row})
                    tabular.tell(row)
                tabular.write(table, rows)
    failures = [f"{row['scene']}, {row['backend']}: {row['other_status']} pairs of another status" for row in rows if row["other_status"]]
    return failures + [f"{row['scene']}: {row['gpu_bytes']} bytes of GPU memory, {row['gpu_bytes_bound']} at most by the rule"
                       for row in rows if row["gpu_bytes"] and row["gpu_bytes"] > row["gpu_bytes_bound"]]
