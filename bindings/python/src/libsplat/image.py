"""Images: files and bytes in and out, scores, and pictures in notebooks."""
from ctypes import byref, sizeof
from typing import Any, Dict, Iterator, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._arrays import (PIXELS, ArrayLike, File, address, as_numpy_asks, file_of, floats, image_struct,
                      pixel_array, planes_struct, same)
from ._errors import InvalidArgument, check
from ._library import lib
from ._records import ImageScores
from ._text import PathLike, bytes_from, choice, path_of
from .device import whole

TYPES: Dict[int, Any] = {int(code): dtype for dtype, code in PIXELS.items()}


class Image:
    """Pixels [height,width] or [height,width,channels], which notebooks show.

    data  uint8 (0 to 255), float16 or float32 (0 to 1), 1 to 4 channels: gray, gray and alpha, RGB,
          RGB and alpha; anything that `Tensor` takes, such as a picture of PIL
    NumPy, PIL and PyTorch take an image as an array; what they make shares its pixels, unless they
    copy. Images are equal if their pixels are, of one type and shape.
    """

    __slots__ = ("_array", "focal", "bits", "__weakref__")

    def __init__(self, data: ArrayLike) -> None:
        self._array: NDArray[Any] = pixel_array(data, "data")
        self.focal = 0.0  # pixels, from the Exif data of a file; 0: not known
        self.bits = 0  # bits per number of the file: 8, 16, or 32 of a .npy; 0: not from a file

    @classmethod
    def load(cls, source: File, *, dtype: Any = None) -> "Image":
        """Read a PNG, JPEG (turned as its Exif data says), WebP or .npy file, its bytes, or an
        open file.

        dtype  of the pixels; None: uint8, or float32 for files with more than 8 bits
        Values are as stored: no gamma, no colour profile.
        Raises NotFound, IoError, FormatError, Unsupported.
        """
        image = _native.splat_image()
        info = _native.splat_image_info(struct_size=sizeof(_native.splat_image_info))
        if dtype is not None:
            if np.dtype(dtype) not in PIXELS:
                raise InvalidArgument(f"dtype is {np.dtype(dtype)}, expected uint8, float16 or "
                                      "float32")
            image.type = int(PIXELS[np.dtype(dtype)])
        place: Tuple[Any, ...]
        data, path = file_of(source, "source")
        if data is not None:
            function, place = lib.splat_image_load_memory, (address(data), data.size)
        else:
            function, place = lib.splat_image_load, (path,)
        check(function(*place, byref(image), byref(info)))
        shape: Tuple[int, ...] = (image.height, image.width, image.channels)
        pixels = np.empty(shape, TYPES[image.type])
        image.pixels = address(pixels)
        check(function(*place, byref(image), byref(info)))
        loaded = cls(pixels if image.channels > 1 else pixels[:, :, 0])
        loaded.focal, loaded.bits = info.focal, info.bits
        return loaded

    def save(self, path: PathLike) -> None:
        """Write a .png (8 bits) or .npy (float32) file, whole or not at all.

        Raises NotFound (the folder), IoError, Unsupported (another extension).
        """
        check(lib.splat_image_save(path_of(path), byref(image_struct(self.array))))

    def to_bytes(self, format: Union[int, _native.ImageFormatName] = "png") -> bytes:
        """The bytes of such a file, "png" or "npy"."""
        code = choice(_native.ImageFormat, format, "format")
        return bytes_from(lib.splat_image_save_memory, byref(image_struct(self.array)), code)

    def _repr_png_(self) -> bytes:
        return self.to_bytes("png")

    @property
    def array(self) -> NDArray[Any]:
        """The pixels themselves."""
        return self._array

    @property
    def shape(self) -> Tuple[int, ...]:
        """(height, width) or (height, width, channels)."""
        return self._array.shape

    @property
    def dtype(self) -> "np.dtype[Any]":
        """The type of a pixel's numbers."""
        return self._array.dtype

    @property
    def ndim(self) -> int:
        """2 or 3."""
        return self._array.ndim

    @property
    def size(self) -> int:
        """How many numbers all pixels have."""
        return self._array.size

    def __getitem__(self, index: Any) -> Any:
        return self._array[index]

    def __iter__(self) -> Iterator[NDArray[Any]]:
        return iter(self._array)

    def __len__(self) -> int:
        return len(self._array)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Image):
            return NotImplemented
        return same(self._array, other._array)

    __hash__ = None  # type: ignore[assignment]  # pixels can change

    @property
    def width(self) -> int:
        """Pixels."""
        return int(self.array.shape[1])

    @property
    def height(self) -> int:
        """Pixels."""
        return int(self.array.shape[0])

    @property
    def channels(self) -> int:
        """1 to 4."""
        return int(self.array.shape[2]) if self.array.ndim == 3 else 1

    def planes(self) -> NDArray[np.float32]:
        """The same as [channels,height,width] float32 from 0 to 1, as scores and networks want."""
        array = self.array if self.array.ndim == 3 else self.array[:, :, None]
        values = array.astype(np.float32)
        if array.dtype == np.uint8:
            values /= 255
        return np.ascontiguousarray(values.transpose(2, 0, 1))

    def __array__(self, dtype: Any = None, copy: Optional[bool] = None) -> NDArray[Any]:
        return as_numpy_asks(self.array, dtype, copy)

    @property
    def __array_interface__(self) -> Dict[str, Any]:
        return {**self._array.__array_interface__, "strides": self._array.strides}

    def tobytes(self) -> bytes:
        """The numbers of all pixels, row-major, as PIL asks for them."""
        return self._array.tobytes()

    def __dlpack__(self, **asked: Any) -> Any:
        return self._array.__dlpack__(**asked)

    def __dlpack_device__(self) -> Tuple[int, int]:
        return (1, 0)

    def __repr__(self) -> str:
        return f"Image({self.width} x {self.height}, {self.channels} channels, {self.array.dtype})"


def _frames(frames: Sequence[ArrayLike]) -> Tuple[Any, Any]:
    """The library's array of images, and the arrays that must live as long."""
    arrays = [pixel_array(frame, f"frame {index}") for index, frame in enumerate(frames)]
    return (_native.splat_image * len(arrays))(*map(image_struct, arrays)), arrays


def save_animation(path: PathLike, frames: Sequence[ArrayLike], milliseconds: int = 40) -> None:
    """Write images of one size as an animation that repeats, .png, .gif or .webp.

    milliseconds  for each frame, 1 to 65535; in a .gif rounded to 10 ms
    """
    images, kept = _frames(frames)
    check(lib.splat_image_save_animation(path_of(path), images, len(kept),
                                         whole(milliseconds, "milliseconds")))


def animation_to_bytes(frames: Sequence[ArrayLike], milliseconds: int = 40,
                       format: Union[int, _native.ImageFormatName] = "gif") -> bytes:
    """The bytes of such a file, "png" or "gif"."""
    images, kept = _frames(frames)
    return bytes_from(lib.splat_image_save_animation_memory, images, len(kept),
                      whole(milliseconds, "milliseconds"),
                      choice(_native.ImageFormat, format, "format"))


def compare_images(a: ArrayLike, b: ArrayLike) -> ImageScores:
    """PSNR and SSIM of two images: `Image` objects, or float32 [channels,height,width] of 0 to 1.

    Raises ShapeMismatch, InvalidArgument (numbers that are not finite).
    """
    first, second = (each.planes() if isinstance(each, Image) else
                     floats(each, (None, None, None), what) for each, what in ((a, "a"), (b, "b")))
    second = floats(second, first.shape, "b")
    scores = _native.splat_image_scores(struct_size=sizeof(_native.splat_image_scores))
    check(lib.splat_image_compare(byref(planes_struct(first)), byref(planes_struct(second)),
                                  byref(scores)))
    return ImageScores.of(scores)
