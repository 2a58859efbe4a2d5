"""DLPack, CUDA: tensors in the memory of both libraries.

The library exports version 1 of the struct, whose deleter is C. NumPy before 2.1 and PyTorch before
2.6 know the older, unversioned struct only. It is built here around the versioned one, with a deleter
in Python. At the end of the interpreter that deleter gives way to a function of C that does nothing,
because arrays may be freed later than Python can run.

CUDA's driver is looked for when a tensor's memory is to be in its address space.
"""
import atexit
import ctypes
import os
import weakref
from ctypes import (CFUNCTYPE, POINTER, Structure, addressof, byref, c_char_p, c_int, c_int32, c_int64, c_uint,
                    c_uint8, c_uint16, c_uint32, c_uint64, c_void_p, cast, py_object)
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Dict, Optional, Sequence, Tuple

import numpy as np

from ._errors import Unsupported, check
from ._library import lib

if TYPE_CHECKING:
    from .tensor import Tensor

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


# The unversioned structs that are alive, by their address, and the versioned ones inside, or who owns their memory.
_alive: Dict[int, Tuple[Unversioned, Any]] = {}


def _release_unversioned(address: int) -> None:
    found = _alive.pop(address, None)
    if found is not None and isinstance(found[1], int):
        release(found[1])


_deleter = DELETER(_release_unversioned)


def _unversioned(managed: int) -> int:
    return _kept(Versioned.from_address(managed).dl_tensor, managed)


def _kept(array: DLTensor, owner: Any) -> int:
    struct = Unversioned()
    struct.dl_tensor = array
    struct.deleter = cast(_deleter, c_void_p)
    _alive[addressof(struct)] = (struct, owner)
    return addressof(struct)


_nothing = cast(lib.splat_version, c_void_p)  # functions of the library are replaced at the end


@atexit.register
def _leave_to_the_system() -> None:
    """Let structs that outlive the interpreter be freed by the end of the process."""
    for struct, _ in list(_alive.values()):
        struct.deleter = _nothing
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


def _new(struct: int, name: bytes) -> Any:
    new = ctypes.pythonapi["PyCapsule_New"]
    new.argtypes, new.restype = (c_void_p, c_char_p, c_void_p), py_object
    return new(struct, name, cast(_destructor, c_void_p))


def capsule(tensor: int, versioned: bool) -> Any:
    """A capsule for `from_dlpack` of other libraries."""
    managed = export(tensor)
    return _new(managed, b"dltensor_versioned") if versioned else _new(_unversioned(managed), b"dltensor")


def capsule_of(owner: object, pointer: int, shape: Sequence[int], dtype: "np.dtype[Any]",
               device: Tuple[int, int]) -> Any:
    """An unversioned capsule of row-major elements on a device, which `owner` keeps."""
    sizes = (c_int64 * len(shape))(*shape)
    array = DLTensor(pointer, *device, len(shape), "iuf".index(dtype.kind), 8 * dtype.itemsize, 1, sizes)
    return _new(_kept(array, (owner, sizes)), b"dltensor")


# ---- CUDA ----------------------------------------------------------------------------------------

COPY = "copy the elements with .numpy() instead"
CUDA = 2  # DLPack's number of such devices


@dataclass(frozen=True)
class ExternalMemory:
    """Memory of a device, as one API or process gives it to another.

    handle        a file descriptor, on Windows (never tried) an NT handle
    memory_bytes  bytes of the whole allocation
    offset        bytes from its start to the first element
    memory_type   1 + Vulkan's index of its type of memory; 0: not known
    device_uuid   Vulkan's, on NVIDIA also CUDA's; empty: not checked
    driver_uuid   Vulkan's; empty: not checked
    """

    handle: int
    memory_bytes: int
    offset: int = 0
    memory_type: int = 0
    device_uuid: bytes = b""
    driver_uuid: bytes = b""


class HandleDesc(Structure):
    """CUDA_EXTERNAL_MEMORY_HANDLE_DESC; the handle is a union of 16 bytes."""

    _fields_ = [("type", c_int), ("handle", c_uint64), ("name", c_void_p), ("size", c_uint64), ("flags", c_uint),
                ("reserved", c_uint * 16)]


class BufferDesc(Structure):
    """CUDA_EXTERNAL_MEMORY_BUFFER_DESC."""

    _fields_ = [("offset", c_uint64), ("size", c_uint64), ("flags", c_uint), ("reserved", c_uint * 16)]


def find_driver() -> Any:
    """CUDA's driver. Raises Unsupported."""
    try:
        return ctypes.CDLL("nvcuda.dll" if os.name == "nt" else "libcuda.so.1")
    except OSError as error:
        raise Unsupported(f"CUDA's driver is not there ({error}): {COPY}") from error


class Driver:
    """Calls of CUDA's driver on one device, in the context that other libraries use there."""

    def __init__(self, uuid: bytes) -> None:
        self.library = find_driver()
        self.call("cuInit", c_uint(0))
        count = c_int()
        self.call("cuDeviceGetCount", byref(count))
        self.index = next((index for index in range(count.value) if self._uuid(index) == uuid), -1)
        if self.index < 0:
            raise Unsupported(f"the device is none of CUDA's {count.value} devices, by its UUID {uuid.hex()}: {COPY}")
        self.device, self.context = self._device(self.index), c_void_p()
        self.call("cuDevicePrimaryCtxRetain", byref(self.context), self.device)

    def _device(self, index: int) -> c_int:
        device = c_int()
        self.call("cuDeviceGet", byref(device), c_int(index))
        return device

    def _uuid(self, index: int) -> bytes:
        uuid = (c_uint8 * 16)()
        self.call("cuDeviceGetUuid", uuid, self._device(index))
        return bytes(uuid)

    def call(self, name: str, *arguments: Any) -> None:
        """Call a function. Raises Unsupported with the driver's name of the error."""
        code = getattr(self.library, name)(*arguments)
        if code != 0:
            text = c_char_p()
            self.library.cuGetErrorName(c_int(code), byref(text))
            raise Unsupported(f"{name} failed with {(text.value or b'an unknown error').decode()}: {COPY}")

    def __enter__(self) -> "Driver":
        self.call("cuCtxPushCurrent_v2", self.context)
        return self

    def __exit__(self, *_: object) -> None:
        self.call("cuCtxPopCurrent_v2", byref(c_void_p()))

    def open(self, memory: ExternalMemory) -> Tuple[c_void_p, c_uint64]:
        """Memory whose descriptor the driver takes, and where it is mapped."""
        opened, pointer = c_void_p(), c_uint64()
        what = HandleDesc(type=2 if os.name == "nt" else 1, handle=memory.handle, size=memory.memory_bytes)
        where = BufferDesc(offset=memory.offset, size=memory.memory_bytes - memory.offset)
        with self:
            try:
                self.call("cuImportExternalMemory", byref(opened), byref(what))
            except Unsupported:
                os.close(memory.handle)
                raise
            try:
                self.call("cuExternalMemoryGetMappedBuffer", byref(pointer), opened, byref(where))
            except Unsupported:
                self.call("cuDestroyExternalMemory", opened)
                raise
        return opened, pointer

    def free(self, memory: c_void_p, pointer: c_uint64) -> None:
        """End what `open` made, and the use of the context."""
        with self:
            self.call("cuMemFree_v2", pointer)
            self.call("cuDestroyExternalMemory", memory)
        self.release()

    def release(self) -> None:
        """End the use of the context."""
        self.call("cuDevicePrimaryCtxRelease_v2", self.device)


class CudaArray:
    """The elements of a tensor for libraries that use CUDA, such as torch.as_tensor(array) or cupy.asarray(array).

    It and what other libraries made of it keep the memory alive, also after the tensor was closed. The
    library's calls have ended on the device when they return; what was done through this array must have
    ended before the next call that uses the tensor: torch.cuda.synchronize().
    """

    __slots__ = ("shape", "dtype", "_driver", "_pointer", "__weakref__")

    def __init__(self, tensor: "Tensor") -> None:
        info = tensor.info
        self.shape, self.dtype = info.shape, tensor.dtype
        self._driver = driver = Driver(tensor.device.info.uuid)
        try:
            opened, pointer = driver.open(tensor.export())
        except BaseException:
            driver.release()
            raise
        self._pointer = pointer.value
        weakref.finalize(self, driver.free, opened, pointer).atexit = False  # arrays may be used until the end

    @property
    def __cuda_array_interface__(self) -> Any:
        return {"shape": self.shape, "typestr": self.dtype.str, "data": (self._pointer, False), "strides": None,
                "stream": None, "version": 3}

    def __dlpack__(self, *, stream: Optional[int] = None, max_version: Optional[Tuple[int, int]] = None,
                   dl_device: Optional[Tuple[int, int]] = None, copy: Optional[bool] = None) -> Any:
        """A capsule of DLPack on kDLCUDA. Raises BufferError for another device or a forced copy."""
        if dl_device is not None and tuple(dl_device) != self.__dlpack_device__():
            raise BufferError(f"DLPack's device {dl_device} is asked for, only {self.__dlpack_device__()} is there")
        if copy:
            raise BufferError("a copy is asked for: make one of what is made of this array")
        return capsule_of(self, self._pointer, self.shape, self.dtype, self.__dlpack_device__())

    def __dlpack_device__(self) -> Tuple[int, int]:
        return (CUDA, self._driver.index)

    def __repr__(self) -> str:
        return f"CudaArray({list(self.shape)}, {self.dtype.name}, cuda:{self._driver.index})"
