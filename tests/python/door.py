"""The contacts of scene files through the Python package: prints of each how many object pairs and contacts there are, and their hash by the rule of docs/scenes.md.

    door.py numpy|torch|cupy|jax SCENE.h5...      exit code 77: the library, or a GPU, is not here

TANDEM_REPEAT=N: then makes N calls again and says how many microseconds the median of them took, with arrays, and with instances that were looked at before.
"""
import os
import statistics
import sys
import time
from pathlib import Path

import numpy as np


def leave_out(why):
    print(why)
    sys.exit(77)


try:
    import h5py
    import xxhash

    import tandem
except ImportError as missing:
    leave_out(missing)


class OnCpu:
    def __init__(self, assets):
        self.scene = tandem.Scene(assets, threads=4)

    def put(self, asset, pose, pairs):
        return tandem.instances(asset, pose[:, :3], pose[:, 3]), pairs

    def contacts(self, instances, pairs):
        found = self.scene.place(instances).contacts(pairs=pairs)
        return found.pairs, found.contacts

    def calls(self, instances, pairs):
        return {"instances": lambda: self.contacts(instances, pairs)}


class OnGpu:
    """By arrays that a library makes: array(numpy) is its array on the GPU."""

    def __init__(self, assets, array, stream=None):
        self.array, self.stream = array, stream
        self.query = tandem.cuda.Query(assets)

    def put(self, asset, pose, pairs):
        return (self.array(asset), self.array(pose)), None if pairs is None else self.array(pairs)

    def contacts(self, instances, pairs):
        found = self.query.contacts(asset=instances[0], pose=instances[1], pairs=pairs, sorted=True)
        return (found.pairs.numpy() if pairs is None else None), found.contacts.numpy()

    def calls(self, instances, pairs):
        bodies = self.query.instances(*instances)
        return {"arrays": lambda: self.query.contacts(asset=instances[0], pose=instances[1], pairs=pairs), "instances": lambda: self.query.contacts(bodies, pairs=pairs)}


def door(name):
    """What opens assets."""
    if name == "numpy":
        return OnCpu
    try:
        import tandem.cuda

        if name == "torch":
            import torch

            if not torch.cuda.is_available():
                leave_out("PyTorch finds no GPU")
            return lambda assets: OnGpu(assets, lambda array: torch.from_numpy(array).cuda())
        if name == "cupy":
            import cupy

            if not cupy.cuda.is_available():
                leave_out("CuPy finds no GPU")
            return lambda assets: OnGpu(assets, cupy.asarray)
        import jax

        jax.config.update("jax_enable_x64", True)
        if jax.default_backend() != "gpu":
            leave_out("JAX finds no GPU")
        return lambda assets: OnGpu(assets, jax.numpy.asarray)
    except ImportError as missing:
        leave_out(missing)


def hash_of(pairs, contacts):
    """XXH64 of the pairs, then of the sorted contacts' columns; in a pair of an instance with itself the smaller face is first."""
    itself = pairs["a"] == pairs["b"]
    a, b = contacts["face_a"], contacts["face_b"]
    swapped = itself[contacts["pair"]] & (b < a)
    a, b = np.where(swapped, b, a), np.where(swapped, a, b)
    order = np.lexsort((b, a, contacts["pair"]))
    return xxhash.xxh64_hexdigest(np.concatenate([np.stack([pairs["a"], pairs["b"]], 1).ravel(), contacts["pair"][order], a[order], b[order]]).astype("<u4").tobytes())


def main():
    make = door(sys.argv[1])
    for path in map(Path, sys.argv[2:]):
        with h5py.File(path) as file:
            assets = [tandem.Asset.load(path.parent / name) for name in file["assets"].asstr()[:]]
            asset = file["instances/asset"][:].astype(np.uint32)
            pose = np.concatenate([file["instances/rotation"][:], file["instances/translation"][:][:, None]], axis=1)
            given = np.sort(file["pairs"][:].astype("<u4").view(tandem.PAIR)[:, 0]).view("<u4").reshape(-1, 2) if "pairs" in file else None
        opened = make(assets)
        del assets
        instances, pairs = opened.put(asset, pose, given)
        found_pairs, contacts = opened.contacts(instances, pairs)
        if given is not None:
            found_pairs = given.view(tandem.PAIR)[:, 0]
        print(len(found_pairs), len(contacts), hash_of(found_pairs, contacts))
        for name, call in opened.calls(instances, pairs).items() if "TANDEM_REPEAT" in os.environ else ():
            taken = []
            for _ in range(int(os.environ["TANDEM_REPEAT"])):
                begin = time.perf_counter()
                call()
                taken.append(time.perf_counter() - begin)
            print(f"{1e6 * statistics.median(taken):.2f} us with {name}")


if __name__ == "__main__":
    main()
