"""The block of `Tensor.map`: a tensor's elements as an array, and what may outlive the block."""
import ctypes
import sys
import weakref
from ctypes import byref, c_size_t, c_void_p
from typing import Any, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from . import _dlpack, _native
from ._errors import Unsupported, check
from ._handle import Handle, Keeper
from ._library import lib

# The type of a block's array behind the block: NumPy refuses its use, and tells this name.
ENDED = np.dtype([("the block of Tensor.map has ended", "V1")])


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
        reads = self._access == _native.Access.READ
        pointer, size, copy = c_void_p(), c_size_t(), None
        try:
            memory: _dlpack.Memory = _dlpack.Shared(keeper.handle)
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
        array.__setstate__(state)
        array.flags.writeable = False
        ends()
