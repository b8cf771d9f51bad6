"""Scene files as the C programs read them (scene_text.h)."""
import h5py


def as_text(scene, folder):
    """What read_scene() reads; assets are named relative to `folder`. repr() of a float64 is read back as it was."""
    lines = []
    with h5py.File(scene) as file:
        for path in file["assets"].asstr()[:]:
            lines.append(f"asset {folder / path}")
        instances = file["instances"]
        lines.append(f"instances {len(instances['asset'])}")
        for asset, rotation, translation in zip(instances["asset"][:], instances["rotation"][:], instances["translation"][:]):
            lines.append(" ".join([str(asset)] + [repr(float(x)) for x in rotation.ravel()] + [repr(float(x)) for x in translation]))
        if "simulation/motion" in file:
            lines += ["motion", " ".join(str(m) for m in file["simulation/motion"][:])]
        if "pairs" in file:
            lines.append(f"pairs {len(file['pairs'])}")
            lines += [f"{a} {b}" for a, b in file["pairs"][:]]
    return "\n".join(lines) + "\n"
