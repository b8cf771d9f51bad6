"""Tables of what scripts/dynamics_peers and scripts/gpu_world_peers measured."""
from common.tabular import markdown

ENGINES = {"tandem": "Tandem", "box3d": "Box3D", "jolt": "Jolt", "mujoco": "MuJoCo", "mujoco, stiff": "MuJoCo, stiff", "pybullet": "PyBullet"}
# Scenes in words, by case and variant, with the quantity that is shown.
SCENES = {("tower30", "jittered"): ("tower of 30", "largest drift"), ("masses", "heavy on light, 1000:1"): ("heavy on light, 1,000:1", "largest drift"),
          ("masses", "heavy on nine, 1000:1"): ("heavy on nine, 1,000:1", "largest drift"), ("stack", "5^3"): ("stack of 5³", "largest drift"),
          ("pyramid", "base 20"): ("pyramid of 210", "largest drift"), ("pyramid", "base 100"): ("pyramid of 5,050", "largest drift"),
          ("arch", "15 wedges"): ("arch of 15 wedges", "largest drift"), ("dominoes", "50"): ("50 dominoes, fallen", "drift of the last second"),
          ("heap", "300 convex"): ("heap of 300 convex bodies", "drift of the last second")}
FALLEN = 0.5  # metres
GPU_ENGINES = {"tandem": "Tandem", "tandem, sleeping": "Tandem, sleeping", "newton, xpbd": "Newton, XPBD", "newton, mujoco": "Newton, MuJoCo's solver",
               "mujoco warp": "MuJoCo Warp, hulls", "mujoco warp, sdf": "MuJoCo Warp, fields", "genesis": "Genesis"}


def peers(rows):
    """Drift in mm, bold where it holds, and milliseconds a step, by scene and engine; a run that ended early has its time alone."""
    found = {(row["engine"], row["case"], row["variant"], row["quantity"]): row for row in rows}
    lines = [[words, *(_cell(found.get((engine, *scene, quantity))) for engine in ENGINES)] for scene, (words, quantity) in SCENES.items()]
    return markdown(["scene", *ENGINES.values()], lines)


def _cell(row):
    if row is None:
        return "–"
    drift, time = float(row["value"] or 0), _two_digits(float(row["ms_per_step"]))
    if not row["verdict"]:
        return f"not done; {time}"
    shown = "falls" if drift > FALLEN else "< 0.01" if drift < 1e-5 else _two_digits(1e3 * drift)
    return f"**{shown}**; {time}" if row["verdict"] == "holds" else f"{shown}; {time}"


def _two_digits(value):
    return f"{float(f'{value:.2g}'):,g}"


def gpu_pile(rows):
    """Milliseconds of 1/60 s by phase, millimetres of penetration and rest, by number of bodies and engine."""
    header = ["bodies", "engine", "falling", "piling", "rest", "deepest, mm", "mean, mm", "deepest of the run, mm", "fastest, m/s", "lost", "at rest"]
    columns = ["falling_ms", "piling_ms", "rest_ms", "deepest_mm", "mean_depth_mm", "deepest_of_run_mm", "fastest_m_s"]
    order = {name: i for i, name in enumerate(GPU_ENGINES)}
    lines = []
    for row in sorted(rows, key=lambda row: (int(row["bodies"]), order[row["engine"]])):
        figures = [_two_digits(float(row[name])) if row[name] else "–" for name in columns]
        lines.append([f"{int(row['bodies']):,}", GPU_ENGINES[row["engine"]], *figures, row["lost"] or "–", row["at_rest"] or f"ended at {row['simulated_s']} s"])
    return markdown(header, lines, "rl")
