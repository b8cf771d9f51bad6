"""What stands for arrays and streams of a GPU where there is none."""
import ctypes


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
