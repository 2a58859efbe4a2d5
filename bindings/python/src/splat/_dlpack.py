"""DLPack: tensors in the memory of both libraries.

The library exports version 1 of the struct, whose deleter is C. NumPy before 2.1 and PyTorch before
2.6 know the older, unversioned struct only. It is built here around the versioned one, with a deleter
in Python. At the end of the interpreter that deleter gives way to a function of C that does nothing,
because arrays may be freed later than Python can run.
"""
import atexit
import ctypes
import weakref
from ctypes import (CFUNCTYPE, POINTER, Structure, addressof, byref, c_char_p, c_int, c_int32, c_int64,
                    c_uint8, c_uint16, c_uint32, c_uint64, c_void_p, cast, py_object)
from typing import Any, Dict, Sequence, Tuple

import numpy as np

from ._errors import check
from ._library import lib

DELETER = CFUNCTYPE(None, c_void_p)
READ_ONLY = 1


class DLTensor(Structure):
    """The array of both structs."""

    _fields_ = [
        ("data", c_void_p), ("device_type", c_int32), ("device_id", c_int32), ("ndim", c_int32),
        ("code", c_uint8), ("bits", c_uint8), ("lanes", c_uint16), ("shape", POINTER(c_int64)),
        ("strides", POINTER(c_int64)), ("byte_offset", c_uint64),
    ]


class Versioned(Structure):
    """DLManagedTensorVersioned."""

    _fields_ = [("major", c_uint32), ("minor", c_uint32), ("manager_ctx", c_void_p),
                ("deleter", c_void_p), ("flags", c_uint64), ("dl_tensor", DLTensor)]


class Unversioned(Structure):
    """DLManagedTensor."""

    _fields_ = [("dl_tensor", DLTensor), ("manager_ctx", c_void_p), ("deleter", c_void_p)]


def export(tensor: int) -> int:
    """The address of the library's struct for a tensor; its deleter must be called once."""
    managed = c_void_p()
    check(lib.splat_tensor_to_dlpack(tensor, byref(managed)))
    return managed.value or 0


def release(managed: int) -> None:
    """Call the deleter of such a struct."""
    deleter = Versioned.from_address(managed).deleter
    if deleter:
        DELETER(deleter)(managed)


class Memory:
    """Memory of the library, in the form that NumPy reads."""

    def __init__(self, pointer: int, shape: Sequence[int], dtype: "np.dtype[Any]",
                 read_only: bool, owner: object = None) -> None:
        self.owner = owner  # lives as long as arrays on this memory
        self.__array_interface__ = {"shape": tuple(shape), "typestr": dtype.str,
                                    "data": (pointer, read_only), "version": 3}


class Shared(Memory):
    """The memory of a tensor, which lives until this object is collected."""

    def __init__(self, tensor: int) -> None:
        managed = export(tensor)
        weakref.finalize(self, release, managed).atexit = False  # arrays may be read until the end
        array = Versioned.from_address(managed).dl_tensor
        kind = {0: "i", 1: "u", 2: "f"}[array.code]
        super().__init__((array.data or 0) + array.byte_offset, array.shape[:array.ndim],
                         np.dtype(f"{kind}{array.bits // 8}"), False)


# The unversioned structs that are alive, by their address, and the versioned ones inside.
_alive: Dict[int, Tuple[Unversioned, int]] = {}


def _release_unversioned(address: int) -> None:
    found = _alive.pop(address, None)
    if found is not None:
        release(found[1])


_deleter = DELETER(_release_unversioned)


def _unversioned(managed: int) -> int:
    struct = Unversioned()
    struct.dl_tensor = Versioned.from_address(managed).dl_tensor
    struct.deleter = cast(_deleter, c_void_p)
    _alive[addressof(struct)] = (struct, managed)
    return addressof(struct)


@atexit.register
def _leave_to_the_system() -> None:
    """Let structs that outlive the interpreter be freed by the end of the process."""
    nothing = cast(lib.splat_version, c_void_p)
    for struct, _ in list(_alive.values()):
        struct.deleter = nothing
    ctypes.pythonapi.Py_IncRef(py_object(_alive))


def _drop_capsule(capsule: int) -> None:
    """The destructor of capsules: frees what no one took. A taken one has another name."""
    valid = ctypes.pythonapi["PyCapsule_IsValid"]
    valid.argtypes, valid.restype = (c_void_p, c_char_p), c_int
    pointer = ctypes.pythonapi["PyCapsule_GetPointer"]
    pointer.argtypes, pointer.restype = (c_void_p, c_char_p), c_void_p
    if valid(capsule, b"dltensor"):
        _release_unversioned(pointer(capsule, b"dltensor"))
    elif valid(capsule, b"dltensor_versioned"):
        release(pointer(capsule, b"dltensor_versioned"))


_destructor = DELETER(_drop_capsule)


def capsule(tensor: int, versioned: bool) -> Any:
    """A capsule for `from_dlpack` of other libraries."""
    new = ctypes.pythonapi["PyCapsule_New"]
    new.argtypes, new.restype = (c_void_p, c_char_p, c_void_p), py_object
    managed = export(tensor)
    destructor = cast(_destructor, c_void_p)
    if versioned:
        return new(managed, b"dltensor_versioned", destructor)
    return new(_unversioned(managed), b"dltensor", destructor)
