"""Scene files (HDF5) and the hash of contacts that bvhbench prints (docs/json.md)."""
import h5py
import numpy as np
import xxhash

import tandem


def hash_of(pairs, contacts):
    """Of object pairs, and the faces of contacts, sorted; within a body the lower face comes first."""
    face_a, face_b = contacts["face_a"].copy(), contacts["face_b"].copy()
    of = pairs[contacts["pair"]]
    swapped = (of["a"] == of["b"]) & (face_b < face_a)
    face_a[swapped], face_b[swapped] = face_b[swapped], face_a[swapped]
    order = np.lexsort((face_b, face_a, contacts["pair"]))
    words = [pairs.view("<u4"), contacts["pair"][order], face_a[order], face_b[order]]
    return xxhash.xxh64(np.concatenate(words).astype("<u4").tobytes()).hexdigest()
