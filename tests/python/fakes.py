"""What stands for arrays, streams and queries of a GPU where there is none."""
import ctypes
import types

import numpy as np

import tandem


class Tensor(ctypes.Structure):
    """DLManagedTensor of DLPack."""
    _fields_ = [("data", ctypes.c_void_p), ("device", 2 * ctypes.c_int32), ("ndim", ctypes.c_int32), ("code", ctypes.c_uint8), ("bits", ctypes.c_uint8),
                ("lanes", ctypes.c_uint16), ("shape", ctypes.POINTER(ctypes.c_int64)), ("strides", ctypes.POINTER(ctypes.c_int64)), ("byte_offset", ctypes.c_uint64),
                ("context", ctypes.c_void_p), ("deleter", ctypes.CFUNCTYPE(None, ctypes.c_void_p))]


class Producer:
    """Hands out an array of uint32 by DLPack, said to lie on a GPU, and counts how often it comes back."""

    def __init__(self, shape, strides, *, code=1, device=0):
        self.device, self.given_back = device, 0
        self.lengths = [(ctypes.c_int64 * len(shape))(*numbers) for numbers in (shape, strides)]
        self.tensor = Tensor(None, (2, device), len(shape), code, 32, 1, *self.lengths, 0, None, Tensor._fields_[-1][1](self.delete))

    def delete(self, _):
        self.given_back += 1

    def __dlpack_device__(self):
        return 2, self.device

    def __dlpack__(self, **_):
        make = ctypes.pythonapi.PyCapsule_New
        make.restype, make.argtypes = ctypes.py_object, (ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p)
        return make(ctypes.addressof(self.tensor), b"dltensor", None)


class Interface:
    """An array by the array interface alone, with what is told of it; an empty one of uint32, (0, 2), otherwise."""

    def __init__(self, **told):
        self.__cuda_array_interface__ = {"shape": (0, 2), "typestr": "<u4", "data": (0, False), "version": 3, "strides": None} | told


class OwnStream:
    """A stream that lives as long as this object, as CuPy's do."""

    def __init__(self, number):
        self.ptr = number


class Cuda:
    """The parts of tandem.cuda that a door to a simulator takes, for arrays in CPU memory: a scene of the CPU answers."""

    class TooLittleRoom(Exception):
        def __init__(self, **needed):
            super().__init__(needed)
            vars(self).update({"undecided": 0} | needed)

    @staticmethod
    def Filter(*, device, stream, **columns):
        return tandem.Filter(**{name: None if column is None else np.asarray(column) for name, column in columns.items()})

    class Query:
        def __init__(self, assets, *, device, contents, stream):
            self.assets, self.reserved = assets, []

        def instances(self, asset, pose, *, stream):
            return Bodies(asset, pose)

        def reserve(self, **room):
            self.reserved.append(room)

        def enqueue(self, bodies, *, pairs, filter, stream):
            pose, room = bodies.pose.numpy(), self.reserved[-1]
            scene = tandem.Scene(self.assets, asset=bodies.asset.numpy(), rotation=pose[:, :9].reshape(-1, 3, 3), translation=pose[:, 9:], filter=filter)
            found = scene.contacts(pairs=None if pairs is None else pairs.numpy())
            made = scene.manifolds(most_points=room["most_points"], match_previous=room["match_previous"])
            needed = {"pairs": len(found.pairs), "contacts": len(found.contacts), "manifolds": len(made.manifolds), "points": len(made.points)}
            return Queued(found.pairs, made, room, needed)


class Bodies:
    def __init__(self, asset, pose):
        self.asset, self.pose = asset, pose

    def __len__(self):
        return len(self.asset)


class Room:
    """Rows in room for more."""

    def __init__(self, rows, count):
        self.rows = np.zeros(count, rows.dtype)
        self.rows[:len(rows)] = rows[:count]
        self.words = types.SimpleNamespace(pointer=self.rows.ctypes.data)

    def __len__(self):
        return len(self.rows)


class Queued:
    def __init__(self, pairs, made, room, needed):
        self.needed, self.fits = needed, all(needed[name] <= room[name] for name in needed)
        report = np.zeros(1, [("status", "u4"), ("complete", "u4"), ("needed", "u4", 6), ("manifolds", "u4"), ("points", "u4"), ("counters", "u8", 6)])
        report["complete"], report["manifolds"], report["points"] = self.fits, needed["manifolds"] if self.fits else 0, needed["points"] if self.fits else 0
        self.pairs, self.manifold_report = Room(pairs, room["pairs"]), Room(report, 1)
        self.manifolds, self.points = Room(made.manifolds, room["manifolds"]), Room(made.points, room["points"])

    def wait(self, stream=None):
        if not self.fits:
            raise Cuda.TooLittleRoom(**self.needed)
