"""Arrays of the caller: what is taken, and how it is checked."""
import operator
import os
from ctypes import c_float, c_void_p
from typing import TYPE_CHECKING, Any, ClassVar, Dict, Optional, Protocol, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._errors import InvalidArgument, ShapeMismatch, kind_of
from ._text import PathLike, path_of

# What functions take for arrays: NumPy's, and anything with the buffer protocol,
# __array_interface__ or __dlpack__; nested sequences of numbers are converted.
if TYPE_CHECKING:
    class _Array(Protocol):
        def __array__(self) -> Any: ...

    class _Interface(Protocol):
        @property
        def __array_interface__(self) -> Dict[str, Any]: ...

    class _Dlpack(Protocol):
        def __dlpack_device__(self) -> Tuple[Any, Any]: ...

    _Numbers = Union[float, _Array, Sequence["_Numbers"]]
    ArrayLike = Union[_Array, _Interface, _Dlpack, memoryview, bytearray, bytes, Sequence[_Numbers]]
else:
    ArrayLike = Any
Floats = NDArray[np.float32]

DLPACK_HOST = (1, 3, 11, 13)  # kDLCPU, and host memory of CUDA, ROCm and CUDA's unified one


def _is_plain(data: Any) -> bool:
    """Numbers and sequences of them, which have no type of their own."""
    return isinstance(data, (int, float, list, tuple, range))


def _refuse_masks(data: Any, what: str) -> None:
    """Refuse an array with a mask of NumPy, or a sequence with one, as it would be dropped."""
    if isinstance(data, (list, tuple)):
        for each in data:
            _refuse_masks(each, what)
    elif isinstance(data, np.ma.MaskedArray):
        raise InvalidArgument(f"{what} is a masked array, whose mask would be lost: give one "
                              "without, as with .filled(0)")


def host_array(data: Any, what: str) -> NDArray[Any]:
    """The array of an object, without a copy where that is possible. It may have any layout.

    Raises InvalidArgument for memory of another device, and for what is no array of numbers.
    """
    if isinstance(data, np.ndarray):
        _refuse_masks(data, what)
        return data
    device = getattr(data, "__dlpack_device__", None)
    if device is not None and int(device()[0]) not in DLPACK_HOST:
        raise InvalidArgument(f"{what} is in the memory of a device of DLPack's type "
                              f"{int(device()[0])}, expected host memory: copy it there first, "
                              "as with .cpu()")
    interfaces = ("__array_interface__", "__array__", "__array_struct__")
    try:
        if device is not None and not any(hasattr(data, name) for name in interfaces):
            array: NDArray[Any] = np.from_dlpack(data)
        else:
            array = np.asanyarray(data)
    except Exception as error:
        raise InvalidArgument(f"{what} cannot be read as an array: {error}") from error
    if array.dtype.kind not in "fiub":
        kind = f"of the type {array.dtype}" if _is_plain(data) else kind_of(data)
        raise InvalidArgument(f"{what} is {kind}, expected numbers in an array")
    _refuse_masks(array, what)
    _refuse_masks(data, what)
    return np.asarray(array)


def typed_array(data: ArrayLike, dtype: Any, what: str) -> NDArray[Any]:
    """The array of an object whose type must be `dtype`; sequences of numbers are converted."""
    array = host_array(data, what)
    wanted = np.dtype(dtype)
    if array.dtype != wanted:
        if not _is_plain(data):
            raise InvalidArgument(f"{what} has the type {array.dtype}, expected {wanted.name}: "
                                  f"convert it with .astype('{wanted.name}')")
        array = converted(array, wanted, what)
    return array


def converted(array: NDArray[Any], dtype: "np.dtype[Any]", what: str) -> NDArray[Any]:
    """Numbers of a sequence as another type. Raises InvalidArgument for those beyond its range."""
    with np.errstate(all="ignore"):
        found = array.astype(dtype)
        lost = np.isfinite(array) & ~np.isfinite(found) if dtype.kind == "f" else found != array
    if lost.any():
        raise InvalidArgument(f"{what} has {array[lost][0].item()!r}, which {dtype.name} cannot hold")
    return found


def shape_text(shape: Sequence[Optional[int]]) -> str:
    """"[3,n]"."""
    return "[" + ",".join("n" if size is None else str(size) for size in shape) + "]"


def check_shape(array: NDArray[Any], shape: Sequence[Optional[int]], what: str) -> None:
    """Refuse another shape; None stands for any size."""
    if len(array.shape) != len(shape) or any(
            wanted is not None and size != wanted for size, wanted in zip(array.shape, shape)):
        raise ShapeMismatch(f"{what} has the shape {shape_text(array.shape)}, "
                            f"expected {shape_text(shape)}")


def floats(data: ArrayLike, shape: Optional[Sequence[Optional[int]]], what: str) -> Floats:
    """A row-major float32 array, a copy only if the given one has another layout.

    shape  None: any
    Raises InvalidArgument (type, device), ShapeMismatch.
    """
    array = typed_array(data, np.float32, what)
    if shape is not None:
        check_shape(array, shape, what)
    return np.ascontiguousarray(array).reshape(array.shape)


def doubles(data: ArrayLike, shape: Sequence[Optional[int]], what: str) -> NDArray[np.float64]:
    """A row-major float64 array of any real numbers, for cameras and placements."""
    array = host_array(data, what)
    if array.dtype.kind not in "fiub":  # NumPy would drop or read a part of others
        raise InvalidArgument(f"{what} has the type {array.dtype}, expected numbers")
    check_shape(array, shape, what)
    return np.ascontiguousarray(array, np.float64)


def same(a: Any, b: Any) -> bool:
    """Whether two values are equal, also arrays, and sequences with arrays, of one type and shape."""
    arrays = [hasattr(each, "__array__") for each in (a, b)]  # NumPy's, PyTorch's
    if any(arrays):
        if not all(arrays):
            return False
        a, b = np.asarray(a), np.asarray(b)
        return (a.dtype == b.dtype and a.shape == b.shape
                and bool(((a == b) | ((a != a) & (b != b))).all()))
    if isinstance(a, (list, tuple)) and type(a) is type(b):
        return len(a) == len(b) and all(map(same, a, b))
    return bool(a == b)


class ByValue:
    """A dataclass whose fields, arrays among them, tell whether two of one class are equal."""

    __slots__ = ()
    __dataclass_fields__: ClassVar[Dict[str, Any]]

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        return all(same(getattr(self, name), getattr(other, name))
                   for name in self.__dataclass_fields__)

    __hash__ = None  # type: ignore[assignment]  # arrays have none


def frozen(array: NDArray[Any]) -> NDArray[Any]:
    """The same array, which NumPy lets no one write any more."""
    if array.base is not None:
        array = array.copy()  # what owns its memory could be written by way of it
    array.flags.writeable = False
    return array.view()


def as_numpy_asks(array: NDArray[Any], dtype: Any, copy: Optional[bool]) -> NDArray[Any]:
    """What `__array__` of an object with this array gives; see NumPy's protocol.

    copy  None: only if the type differs
    Raises ValueError where a copy is forbidden and needed.
    """
    wanted = array.dtype if dtype is None else np.dtype(dtype)
    if copy is False and wanted != array.dtype:
        raise ValueError(f"an array of {array.dtype} cannot become {wanted} without a copy")
    return array.astype(wanted, copy=bool(copy))


def whole_shape(shape: Any, what: str) -> Tuple[int, ...]:
    """A shape of one or more whole numbers; one number stands for one dimension."""
    try:
        return (operator.index(shape),)
    except TypeError:
        pass
    try:
        return tuple(map(operator.index, shape))
    except TypeError:
        raise InvalidArgument(f"{what} has the shape {shape!r}, expected whole numbers") from None


def set_dims(raw: Any, shape: Any, what: str) -> None:
    """Write a shape to the fields `dims` and `rank` of a struct."""
    shape = whole_shape(shape, what)
    if len(shape) > _native.SPLAT_MAX_RANK:
        raise InvalidArgument(f"{what} has {len(shape)} dimensions, expected at most "
                              f"{_native.SPLAT_MAX_RANK}")
    for size in shape:
        if not -1 << 63 <= size < 1 << 63:  # ctypes would keep the low bits of others
            raise InvalidArgument(f"{what} has the shape {shape_text(shape)}, beyond 64 bits")
    raw.dims[:len(shape)] = shape
    raw.rank = len(shape)


def set_arrays(raw: Any, **given: Optional[ArrayLike]) -> "list[Floats]":
    """Write addresses and sizes of float32 arrays to fields `name` and `name`_count of a struct.

    Returns the arrays, which the struct keeps. Those that are None are left out.
    """
    kept: "list[Floats]" = []
    raw.kept = kept
    for name, data in given.items():
        if data is not None:
            kept.append(floats(data, None, name))
            setattr(raw, name, address(kept[-1]))
            setattr(raw, f"{name}_count", kept[-1].size)
    return kept


class Address(c_void_p):
    """Where an array begins. As an argument of a call it keeps the array as long as the call runs."""

    array: Any


def address(array: Optional[NDArray[Any]]) -> Optional[Address]:
    """Where an array begins; None for none and for an empty one."""
    if array is None or array.size == 0:
        return None
    place = Address(array.__array_interface__["data"][0])
    place.array = array
    return place


def background_of(color: Optional[ArrayLike]) -> Any:
    """Three floats of a colour; None: the library's default."""
    if color is None:
        return None
    values = doubles(color, (3,), "background")
    return (c_float * 3)(*values)


PIXELS = {np.dtype(np.uint8): _native.Pixel.U8, np.dtype(np.float16): _native.Pixel.F16,
          np.dtype(np.float32): _native.Pixel.F32}


def pixel_array(data: ArrayLike, what: str) -> NDArray[Any]:
    """Pixels [height,width] or [height,width,channels] of uint8, float16 or float32."""
    array = host_array(data, what)
    if array.dtype not in PIXELS:
        raise InvalidArgument(f"{what} has the type {array.dtype}, expected uint8 (0 to 255), "
                              "float16 or float32 (0 to 1)")
    if array.ndim not in (2, 3) or (array.ndim == 3 and not 1 <= array.shape[2] <= 4):
        raise ShapeMismatch(f"{what} has the shape {shape_text(array.shape)}, expected "
                            "[height,width] or [height,width,channels] with 1 to 4 channels")
    if array.size == 0:
        raise ShapeMismatch(f"{what} has the shape {shape_text(array.shape)}, which has no pixels")
    if any(stride < 0 for stride in array.strides):
        array = np.ascontiguousarray(array)
    return array


def image_struct(array: NDArray[Any]) -> _native.splat_image:
    """Describe pixels to the library, in their own layout. The array must outlive the struct."""
    image = _native.splat_image()
    rows, columns = array.shape[:2]
    channels = array.shape[2] if array.ndim == 3 else 1
    strides: Tuple[int, ...] = array.strides if array.ndim == 3 else (*array.strides,
                                                                      array.itemsize)
    image.pixels, image.kept = address(array), array  # kept as long as a call runs
    image.bytes = array.itemsize + sum(stride * (size - 1) for stride, size in
                                       zip(strides, (rows, columns, channels)))
    image.type = int(PIXELS[array.dtype])
    image.width, image.height, image.channels = columns, rows, channels
    image.row_stride, image.pixel_stride, image.channel_stride = strides
    return image


def planes_struct(planes: NDArray[Any]) -> _native.splat_image:
    """The same for float32 [channels,height,width]."""
    return image_struct(planes.transpose(1, 2, 0))


class Opened(Protocol):
    """A file that is open for reading bytes, such as a BytesIO."""

    def read(self) -> bytes: ...


# What functions that read a file take: its path, its bytes, or the open file.
File = Union[PathLike, bytes, bytearray, memoryview, Opened]


def file_of(source: File, what: str) -> Tuple[Optional[NDArray[np.uint8]], Optional[bytes]]:
    """The bytes of a file in memory, or of an open one from where it stands; else its path."""
    if isinstance(source, (str, os.PathLike)):
        return None, path_of(source, what)
    read = getattr(source, "read", None)
    data: Any = source if read is None else read()
    _refuse_masks(data, what)
    try:
        view = memoryview(data)
        return np.frombuffer(view if view.c_contiguous else bytes(view), np.uint8), None
    except (TypeError, ValueError) as error:
        given = kind_of(data) if read is None else f"a file that gives {kind_of(data)}"
        raise InvalidArgument(f"{what} is {given}, expected a path, bytes, or a file that is open for "
                              "reading bytes, as with 'rb'") from error
