"""Tensors: arrays of numbers on a device, in and out of NumPy and DLPack."""
import ctypes
import gc
import sys
import weakref
from ctypes import byref, c_int64, c_size_t, c_void_p, sizeof
from typing import Any, ContextManager, Iterator, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _dlpack, _native
from ._arrays import (ArrayLike, address, as_numpy_asks, check_shape, converted, frozen, host_array, set_dims,
                      shape_text, typed_array, whole_shape)
from ._dlpack import CudaArray, ExternalMemory
from ._errors import InvalidArgument, Unsupported, check, direct
from ._handle import Handle, Keeper, made
from ._library import lib
from ._records import TensorInfo, TensorStats
from ._text import choice, encoded
from .device import Device, whole

DTYPES = {_native.Dtype.F32: np.dtype(np.float32), _native.Dtype.I32: np.dtype(np.int32),
          _native.Dtype.U32: np.dtype(np.uint32)}
CODES = {dtype: code for code, dtype in DTYPES.items()}


# The type of a block's array behind the block: NumPy refuses its use, and tells this name.
ENDED = np.dtype([("the block of Tensor.map has ended", "V1")])

# Whether NumPy frees the formats that memoryviews of an array have when the array gets another state.
FREES_FORMATS = tuple(map(int, np.__version__.split(".")[:2])) >= (2, 5)


def _has_formats(array: NDArray[Any]) -> bool:
    """Whether a memoryview of an array was made. NumPy keeps the formats behind the array's weak references."""
    return c_void_p.from_address(id(array) + np.ndarray.__weakrefoffset__ + sizeof(c_void_p)).value is not None


def _end(keeper: Keeper, copy: Optional[NDArray[Any]], pointer: int) -> None:
    """Unmap a tensor, after its elements were copied back from `copy`."""
    if copy is not None:
        ctypes.memmove(pointer, copy.ctypes.data, copy.nbytes)
    try:
        check(lib.splat_tensor_unmap(keeper.handle))
    finally:
        keeper.lent.pop()


def _nothing(_: object) -> None:
    """Let a finalizer keep its argument until its object is gone."""


class Mapping:
    """Maps a tensor within a `with` block.

    The array of the block is a view of a hidden one, and NumPy lets views of it refer to the hidden
    one, too. So counts of references tell whether anything but one name still refers to the memory.
    They do not tell what that one is. So the memory outlives every array: it is the tensor's own,
    kept by way of DLPack, or a copy where memory is not unified.
    """

    __slots__ = ("_tensor", "_access", "_root", "_array", "_counts", "_ends")

    def __init__(self, tensor: Handle, shape: Tuple[int, ...], dtype: "np.dtype[Any]",
                 access: int) -> None:
        self._tensor, self._access = tensor, access
        self._root: Any = (shape, dtype)
        self._array: NDArray[Any]
        self._counts: Tuple[int, int]
        self._ends: Any

    def _map(self, keeper: Keeper) -> Any:
        """Map the tensor. Returns the array's memory, whose end is the mapping's at the latest."""
        shape, dtype = self._root
        memory: Any = None
        reads = self._access == _native.Access.READ
        pointer, size, copy = c_void_p(), c_size_t(), None
        try:
            memory = _dlpack.Shared(keeper.handle)
        except Unsupported:
            copy = np.empty(shape, dtype)
        check(lib.splat_tensor_map(keeper.handle, self._access, byref(pointer), byref(size)))
        keeper.lent.append(None)
        if copy is not None:
            ctypes.memmove(copy.ctypes.data, pointer, copy.nbytes)
            memory = _dlpack.Memory(copy.ctypes.data, shape, dtype, reads, copy)
        self._ends = weakref.finalize(memory, _end, keeper, None if reads else copy,
                                      pointer.value or 0)
        self._ends.atexit = False  # arrays may be used until the end
        return memory

    def __enter__(self) -> NDArray[Any]:
        self._root = np.asarray(self._map(self._tensor._kept()))
        if self._access == _native.Access.READ:
            self._root.flags.writeable = False
        self._array = self._root.view()
        self._counts = self._references()
        return self._array

    def _references(self) -> Tuple[int, int]:
        return sys.getrefcount(self._root), sys.getrefcount(self._array)

    def __exit__(self, kind: object, *_: object) -> None:
        more = [now - before for now, before in zip(self._references(), self._counts)]
        root, array, ends = self._root, self._array, self._ends
        del self._root, self._array, self._ends
        if kind is None and (more[0] > 0 or more[1] > 1):  # one is the name of the block
            raise BufferError("something still refers to the memory of the tensor, which stays "
                              "mapped until it is gone: within the block, copy what must live "
                              "longer, and delete other names of the array and of its parts")
        weakref.finalize(array, _nothing, root).atexit = False
        state: Any = (1, (), ENDED, False, bytes(1))  # type hints of NumPy 2 want its own bool, which has no int
        # Only an array with formats is worth the walk over all objects that get_referrers is.
        if not (FREES_FORMATS and _has_formats(array)
                and any(type(each).__name__ == "managedbuffer" for each in gc.get_referrers(array))):
            array.__setstate__(state)
        array.flags.writeable = False
        ends()


def _desc(shape: Sequence[int], dtype: Any, name: Optional[str]) -> _native.splat_tensor_desc:
    desc = _native.splat_tensor_desc(struct_size=sizeof(_native.splat_tensor_desc))
    try:
        wanted = np.dtype(dtype)
    except TypeError as error:
        raise InvalidArgument(f"dtype is {dtype!r}: {error}") from error
    if wanted not in CODES:
        raise InvalidArgument(f"dtype is {wanted}, expected float32, int32 or uint32: convert the "
                              "array with .astype()")
    desc.name = encoded(name, "name")
    desc.dtype = int(CODES[wanted])
    set_dims(desc, shape, "the tensor")
    return desc


def _strides(array: NDArray[Any], writing: bool) -> Tuple[NDArray[Any], Any]:
    """An array whose strides the library takes, and these in elements; None: row-major."""
    if array.flags.c_contiguous:
        return array, None
    usable = all(stride >= 0 and stride % array.itemsize == 0 for stride in array.strides)
    if not usable or not array.flags.aligned:
        if writing:
            raise InvalidArgument("the strides of the array to fill are negative or no multiples of "
                                  "its elements; give a row-major one")
        return np.ascontiguousarray(array), None
    return array, (c_int64 * array.ndim)(*(each // array.itemsize for each in array.strides))


def _span(array: NDArray[Any]) -> int:
    """Bytes from the first element of an array to the end of its last one."""
    return int(array.itemsize + sum((size - 1) * stride
                                    for size, stride in zip(array.shape, array.strides)))


class Tensor(Handle):
    """An array of float32, int32 or uint32 numbers on a device.

    data   NumPy array, or anything with __dlpack__, __array_interface__ or the buffer protocol, of
           one of these types; sequences of numbers become float32
    name   used in messages
    Raises InvalidArgument (type, memory of another device), Unsupported (too large for the device).
    """

    __slots__ = ()
    _kind = "tensor"

    def __init__(self, device: Device, data: Union[ArrayLike, float], *, name: Optional[str] = None) -> None:
        array = host_array(data, "data")
        if isinstance(data, (int, float, list, tuple, range)):
            array = converted(array, np.dtype(np.float32), "data")
        desc = _desc(array.shape, array.dtype, name)
        if array.size == 0:
            raise InvalidArgument(f"data has the shape {shape_text(array.shape)}: a tensor has at "
                                  "least one element")
        array, strides = _strides(array, False)
        self._own(made("tensor", direct, lib.splat_tensor_from_host, device.handle, byref(desc),
                       address(array), _span(array), strides), device)

    @classmethod
    def zeros(cls, device: Device, shape: Union[int, Sequence[int]], dtype: Any = "float32", *,
              name: Optional[str] = None, exportable: bool = False) -> "Tensor":
        """A tensor of zeros.

        exportable  in an allocation of its own, for `export` and `cuda`; Unsupported where the device
                    has no FeatureFlags.EXTERNAL_MEMORY
        """
        desc = _desc(whole_shape(shape, "the tensor"), dtype, name)
        desc.flags = int(_native.TensorFlags.EXPORTABLE) if exportable else 0
        return cls._of(made("tensor", direct, lib.splat_tensor_create, device.handle, byref(desc)),
                       device)

    @classmethod
    def from_memory(cls, device: Device, memory: ExternalMemory, shape: Union[int, Sequence[int]],
                    dtype: Any = "float32", *, name: Optional[str] = None) -> "Tensor":
        """A tensor in memory that `export`, another process or another API exported on the same device and driver.

        memory  may be closed when this returns. What others do there must have ended before a call uses the tensor.
        Raises InvalidArgument (a handle of no memory of the device, UUIDs of another, too little memory),
        Unsupported (the device has no FeatureFlags.EXTERNAL_MEMORY).
        """
        raw = _native.splat_external_memory(struct_size=sizeof(_native.splat_external_memory))
        raw.handle = whole(memory.handle, "handle", 63)
        raw.memory_bytes = whole(memory.memory_bytes, "memory_bytes", 64)
        raw.offset, raw.memory_type = whole(memory.offset, "offset", 64), whole(memory.memory_type, "memory_type")
        for field, uuid in ((raw.device_uuid, memory.device_uuid), (raw.driver_uuid, memory.driver_uuid)):
            if len(uuid) not in (0, 16):
                raise InvalidArgument(f"a UUID of the memory has {len(uuid)} bytes, expected 16 or none")
            field[:len(uuid)] = uuid
        desc = _desc(whole_shape(shape, "the tensor"), dtype, name)
        return cls._of(made("tensor", direct, lib.splat_tensor_import, device.handle, byref(desc), byref(raw)), device)

    def export(self) -> ExternalMemory:
        """A handle of the tensor's memory for other processes and APIs, with what they must know to open it.

        The caller closes it by os.close, unless an API takes it. It keeps the memory alive, also after the
        tensor was closed and the process has ended. The library's calls have ended on the device when they return.
        Raises InvalidState (not exportable, imported itself, mapped).
        """
        raw = _native.splat_external_memory(struct_size=sizeof(_native.splat_external_memory))
        check(lib.splat_tensor_export(self.handle, byref(raw)))
        return ExternalMemory(raw.handle, raw.memory_bytes, raw.offset, raw.memory_type, bytes(raw.device_uuid),
                              bytes(raw.driver_uuid))

    def cuda(self) -> CudaArray:
        """The memory of an exportable tensor for libraries that use CUDA, without a copy.

        torch.as_tensor(tensor.cuda()) by __cuda_array_interface__, torch.from_dlpack(tensor.cuda()) by DLPack.
        Before the next call that uses the tensor, wait for what was done there: torch.cuda.synchronize().
        Raises InvalidState (not exportable), Unsupported (no driver of CUDA, or the device is none of its own).
        """
        return CudaArray(self)

    @property
    def device(self) -> Device:
        """The device whose memory it uses."""
        assert self._device is not None
        return self._device

    @property
    def info(self) -> TensorInfo:
        """Shape, type, size and name."""
        info = _native.splat_tensor_info(struct_size=sizeof(_native.splat_tensor_info))
        check(lib.splat_tensor_get_info(self.handle, byref(info)))
        return TensorInfo.of(info)

    @property
    def shape(self) -> Tuple[int, ...]:
        """Elements along each dimension, outermost first."""
        return self.info.shape

    @property
    def dtype(self) -> "np.dtype[Any]":
        """The type of the elements."""
        return DTYPES[self.info.dtype]

    @property
    def ndim(self) -> int:
        """How many dimensions it has."""
        return self.info.rank

    @property
    def size(self) -> int:
        """How many elements it has."""
        return self.info.elements

    def numpy(self, out: Optional[NDArray[Any]] = None) -> NDArray[Any]:
        """A copy in host memory.

        out  filled instead: an array of the same shape and type, in any layout without overlaps
        Raises InvalidArgument (type, layout, read-only), ShapeMismatch, InvalidState (mapped).
        """
        info = self.info
        if out is None:
            out = np.empty(info.shape, DTYPES[info.dtype])
        if not isinstance(out, np.ndarray) or not out.flags.writeable:
            raise InvalidArgument("out must be a NumPy array that can be written")
        typed_array(out, DTYPES[info.dtype], "out")
        check_shape(out, info.shape, "out")
        array, strides = _strides(out, True)
        check(lib.splat_tensor_read(self.handle, address(array), _span(array), strides))
        return out

    def write(self, data: ArrayLike) -> None:
        """Replace all elements by those of an array of the same shape and type.

        Raises InvalidArgument (type), ShapeMismatch, InvalidState (mapped).
        """
        info = self.info
        array = typed_array(data, DTYPES[info.dtype], "data")
        check_shape(array, info.shape, "data")
        array, strides = _strides(array, False)
        check(lib.splat_tensor_write(self.handle, address(array), _span(array), strides))

    @property
    def array(self) -> NDArray[Any]:
        """The tensor's own memory as an array, without a copy; it may outlive the tensor.

        No call may use the tensor on another thread while the array is read or written.
        Raises Unsupported on devices whose memory is not unified: use `map` or `numpy` there.
        """
        return np.asarray(_dlpack.Shared(self.handle))

    def map(self, access: Union[int, _native.AccessName] = "read_write") -> ContextManager[NDArray[Any]]:
        """The elements as an array within a `with` block: with tensor.map() as array.

        access  "read", "write" (contents undefined until written) or "read_write"
        Behind the block NumPy refuses every use of the array. Raises InvalidState (mapped already),
        and BufferError at the end of the block if anything else refers to the array or to a part of
        it: the tensor then stays mapped, and all of them usable, until the last of them is gone. An
        exception of the block goes on and ends the mapping.
        """
        info = self.info
        return Mapping(self, info.shape, DTYPES[info.dtype],
                       choice(_native.Access, access, "access"))

    def check(self) -> TensorStats:
        """Counts of NaN and infinities, and the range of a float32 tensor's finite elements."""
        stats = _native.splat_tensor_stats(struct_size=sizeof(_native.splat_tensor_stats))
        self._run(lib.splat_tensor_check, self.handle, byref(stats))
        return TensorStats.of(stats)

    def __dlpack__(self, *, stream: Optional[int] = None,
                   max_version: Optional[Tuple[int, int]] = None,
                   dl_device: Optional[Tuple[int, int]] = None,
                   copy: Optional[bool] = None) -> Any:
        """A capsule of DLPack on kDLCPU without a copy: versioned if max_version is 1.0 or more.

        Raises BufferError for another device or a forced copy, Unsupported as `array`.
        """
        if dl_device is not None and tuple(dl_device) != (1, 0):
            raise BufferError(f"DLPack's device {dl_device} is asked for, only (1, 0) is there")
        if copy:
            raise BufferError("a copy is asked for: make one with .numpy()")
        return _dlpack.capsule(self.handle, max_version is not None and max_version[0] >= 1)

    def __dlpack_device__(self) -> Tuple[int, int]:
        return (1, 0)

    def __array__(self, dtype: Any = None, copy: Optional[bool] = None) -> NDArray[Any]:
        if copy is not False:
            return as_numpy_asks(self.numpy(), dtype, None)
        try:
            return as_numpy_asks(self.array, dtype, copy)
        except Unsupported as error:
            raise ValueError(f"a tensor cannot become an array without a copy: {error}") from error

    def __getitem__(self, index: Any) -> Any:
        """A part of a copy of the elements; it cannot be written: use `write`, `map` or `array`."""
        part = self.numpy()[index]
        return frozen(part) if isinstance(part, np.ndarray) else part

    def __iter__(self) -> Iterator[Any]:
        return iter(self[...])  # NumPy refuses an array without dimensions

    def __float__(self) -> float:
        if self.size != 1:
            raise TypeError(f"a tensor of the shape {shape_text(self.shape)} is no number: only one "
                            "with a single element is")
        return float(self.numpy().item())

    def __len__(self) -> int:
        shape = self.shape
        if not shape:
            raise TypeError("a tensor of one number has no length")
        return shape[0]

    def __repr__(self) -> str:
        if self.closed:
            return "Tensor(closed)"
        info = self.info
        return f"Tensor({info.name!r}, {shape_text(info.shape)}, {DTYPES[info.dtype].name})"


def tensor_of(value: Any, device: Device, what: str) -> Tensor:
    """A float32 tensor of a device: the given one, or a new one of an array."""
    if isinstance(value, Tensor):
        return value
    return Tensor(device, typed_array(value, np.float32, what), name=what)
