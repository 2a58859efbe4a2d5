"""Weights: named tensors in files and in memory."""
from ctypes import byref, c_uint32, c_uint64, c_void_p, sizeof
from typing import Any, Dict, Iterator, List, Mapping, Optional, Union

import numpy as np

from . import _native
from ._arrays import ArrayLike, File, Floats, address, file_of, floats, frozen, same, set_dims
from ._errors import InvalidArgument, MissingName, NotFound, check, direct
from ._handle import Handle, made
from ._dlpack import Memory
from ._library import lib
from ._records import WeightsInfo
from ._text import PathLike, bytes_from, choice, encoded, flags_of, json_from, path_of, text_from


def builtin_weights(name: Optional[str] = None) -> str:
    """The path of weights that come with the library; None: "cars64". Raises NotFound."""
    return text_from(lib.splat_builtin_weights, encoded(name, "name"))


class Weights(Handle, Mapping[str, Floats]):
    """Named float32 arrays of a network, which never change: a Mapping, like a read-only dict.

    Names are in the order of the file. A missing one is a MissingName, which is a KeyError.

    arrays  by their names; float32, copied
    """

    __slots__ = ()
    _kind = "weights"

    def __init__(self, arrays: Mapping[str, ArrayLike]) -> None:
        raw = (_native.splat_named_array * len(arrays))()
        kept: List[Floats] = []
        for each, (name, values) in zip(raw, arrays.items()):
            array = floats(values, None, f"'{name}'")
            kept.append(array)
            each.name = encoded(name, "a name")
            each.values, each.value_count = address(array), array.size
            set_dims(each, array.shape, f"'{name}'")
        self._own(made("weights", direct, lib.splat_weights_from_arrays, raw, len(raw)))

    def close(self) -> None:
        """Give the weights back to the library; where there are views, with the last of them."""
        self._keeper = None

    @classmethod
    def load(cls, source: File, *, copy: bool = False) -> "Weights":
        """Read a .safetensors, .pth (no code of its pickle is run) or .npz file, its bytes, or an
        open file.

        source  also the name of weights that come with the library, such as "cars64"

        copy  leave no file open; else values of large .safetensors files stay mapped, and the file
              must not be written in place
        Raises NotFound, IoError, FormatError, Unsupported.
        """
        data, path = file_of(source, "source")
        if data is not None:
            return cls._of(made("weights", direct, lib.splat_weights_load_memory,
                                data.ctypes.data, data.size))
        flags = flags_of((copy, _native.WeightsFlags.COPY))
        return cls._of(made("weights", direct, lib.splat_weights_load, path,
                            flags))

    def save(self, path: PathLike, *, half: bool = False) -> None:
        """Write .safetensors, .pth or .npz, whole or not at all.

        half  as float16; InvalidArgument for finite values beyond its range
        """
        check(lib.splat_weights_save(self.handle, path_of(path),
                                     flags_of((half, _native.WeightsFlags.HALF))))

    def to_bytes(self, format: Union[int, _native.WeightsFormatName] = "safetensors", *, half: bool = False) -> bytes:
        """The bytes of such a file, "safetensors", "pth" or "npz"."""
        return bytes_from(lib.splat_weights_save_memory, self.handle,
                          choice(_native.WeightsFormat, format, "format"),
                          flags_of((half, _native.WeightsFlags.HALF)))

    def fold(self, adapters: "Optional[Weights]" = None, *, alpha: float,
             out: bool = False) -> "Weights":
        """New weights with low-rank adapters folded in: W + alpha / rank * (B A).

        adapters  None: those among these weights
        out       take folded ones out again
        Raises ShapeMismatch, InvalidArgument (no adapters, half a pair, a missing layer).
        """
        return Weights._of(made("weights", direct, lib.splat_weights_fold, self.handle,
                                None if adapters is None else adapters.handle, alpha,
                                flags_of((out, _native.FoldFlags.OUT))))

    @property
    def report(self) -> Dict[str, Any]:
        """Format, metadata and warnings of the file; the published configurations that it fits."""
        found: Dict[str, Any] = json_from(lib.splat_weights_report, self.handle)
        return found

    def __len__(self) -> int:
        count = c_uint32()
        check(lib.splat_weights_count(self.handle, byref(count)))
        return count.value

    def _describe(self, index: int) -> WeightsInfo:
        info = _native.splat_weights_info(struct_size=sizeof(_native.splat_weights_info))
        with self._lent() as kept:
            check(lib.splat_weights_get_info(kept.handle, index, byref(info)))
            return WeightsInfo.of(info)

    def _index(self, name: str) -> int:
        index = c_uint32()
        try:
            text = encoded(name, "name")
        except InvalidArgument as error:  # a Mapping has no other error of a key
            raise MissingName(error.message) from None
        try:
            check(lib.splat_weights_find(self.handle, text, byref(index)))
        except NotFound as error:
            raise MissingName(error.message, int(error.code)) from None
        return index.value

    def info(self, name: str) -> WeightsInfo:
        """Shape and stored type of an array. Raises MissingName."""
        return self._describe(self._index(name))

    def __iter__(self) -> Iterator[str]:
        return iter([self._describe(index).name for index in range(len(self))])

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Mapping):
            return NotImplemented
        return self.keys() == other.keys() and all(same(self[name], other[name]) for name in self)

    def __contains__(self, name: object) -> bool:
        try:
            text = encoded(name, "name") if isinstance(name, str) else None
        except InvalidArgument:  # no text of the library
            text = None
        handle = self.handle
        if text is None:
            return False
        code = lib.splat_weights_find(handle, text, byref(c_uint32()))
        return code != _native.Result.ERROR_NOT_FOUND and check(code) == 0

    def __getitem__(self, name: str) -> Floats:
        """A copy of an array that cannot be written, as float32 whatever its type in the file.

        Raises MissingName.
        """
        index = self._index(name)
        values = np.empty(self._describe(index).shape, np.float32)
        check(lib.splat_weights_read(self.handle, index, values.ctypes.data, values.nbytes))
        return frozen(values)

    def view(self, name: str) -> Floats:
        """The same without a copy, read only; it keeps the memory."""
        index = self._index(name)
        shape = self._describe(index).shape
        pointer, count = c_void_p(), c_uint64()
        with self._lent() as kept:
            check(lib.splat_weights_data(kept.handle, index, byref(pointer), byref(count)))
            if not pointer.value:
                return np.empty(shape, np.float32)
            return np.asarray(Memory(pointer.value, shape, np.dtype(np.float32), True, kept))

    def __repr__(self) -> str:
        return "Weights(closed)" if self.closed else f"Weights({len(self)} arrays)"
