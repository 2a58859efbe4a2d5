"""Errors of the library as exceptions.

Each error code has a class below `Error`, which is also the usual class of Python where there is
one: `except FileNotFoundError` catches `NotFound`, `except ValueError` catches `InvalidArgument`.
"""
import errno
import re
from typing import Any, Callable, Dict, Tuple, Type

from . import _native
from ._library import lib


class Error(Exception):
    """What the library refused or could not do.

    code     a `Result`, such as `Result.ERROR_NOT_FOUND`
    message  what failed and where, what was expected, what was got, and what to do
    """

    usual = _native.Result.ERROR_INTERNAL

    def __init__(self, message: str, code: int = 0) -> None:
        super().__init__(message)  # OSError would take two for its errno and strerror
        self.code = _native.Result(code) if code else self.usual
        self.message = message

    @property
    def name(self) -> str:
        """The name of the code in the headers, such as "SPLAT_ERROR_NOT_FOUND"."""
        return str(lib.splat_result_name(int(self.code)).decode())

    def __str__(self) -> str:
        return self.message

    def __reduce__(self) -> Tuple[Any, ...]:
        return (type(self), (self.message, int(self.code)))


class InvalidArgument(Error, ValueError):
    """An argument outside its documented range."""

    usual = _native.Result.ERROR_INVALID_ARGUMENT


class InvalidHandle(Error, ValueError):
    """An object that was closed."""

    usual = _native.Result.ERROR_INVALID_HANDLE


class InvalidState(Error, RuntimeError):
    """A call that does not fit the state of the object."""

    usual = _native.Result.ERROR_INVALID_STATE


class ShapeMismatch(Error, ValueError):
    """Arrays whose shapes do not fit together."""

    usual = _native.Result.ERROR_SHAPE_MISMATCH


class Unsupported(Error, NotImplementedError):
    """Beyond a limit or a feature of this device or build."""

    usual = _native.Result.ERROR_UNSUPPORTED


class NoDevice(Error, RuntimeError):
    """No Vulkan loader, no driver, or no device that fits the request."""

    usual = _native.Result.ERROR_NO_DEVICE


class OutOfMemory(Error, MemoryError):
    """An allocation failed, on the host or on the device."""

    usual = _native.Result.ERROR_OUT_OF_HOST_MEMORY


class OutOfHostMemory(OutOfMemory):
    """An allocation on the host failed."""


class OutOfDeviceMemory(OutOfMemory):
    """An allocation on the device failed, or its budget is used up."""

    usual = _native.Result.ERROR_OUT_OF_DEVICE_MEMORY


class Timeout(Error, TimeoutError):
    """The device did not finish in time; it may still be working."""

    usual = _native.Result.ERROR_TIMEOUT
    errno = errno.ETIMEDOUT


class DeviceLost(Error, RuntimeError):
    """The device is gone: close it and open it again."""

    usual = _native.Result.ERROR_DEVICE_LOST


class InternalError(Error, RuntimeError):
    """A defect in the library or the driver; please report the message."""


class NotFound(Error, FileNotFoundError):
    """No such file or folder, or no entry of that name."""

    usual = _native.Result.ERROR_NOT_FOUND
    errno = errno.ENOENT


class MissingName(NotFound, KeyError):
    """No array of that name, in what works like a dict."""


class IoError(Error, OSError):
    """The system refused to read or write."""

    usual = _native.Result.ERROR_IO


class FormatError(Error, ValueError):
    """Damaged or truncated bytes, or bytes of another format."""

    usual = _native.Result.ERROR_FORMAT


class Cancelled(Error, RuntimeError):
    """The call was cancelled; its results are undefined."""

    usual = _native.Result.CANCELLED


CLASSES: Dict[int, Type[Error]] = {
    int(each.usual): each
    for each in (InvalidArgument, InvalidHandle, InvalidState, ShapeMismatch, Unsupported, NoDevice,
                 OutOfHostMemory, OutOfDeviceMemory, Timeout, DeviceLost, InternalError, NotFound,
                 IoError, FormatError, Cancelled)}


def in_python(message: str) -> str:
    """A message of the library with Python's words for the names of its headers.

    What stands in quotes is the caller's: names of files, tensors and keys.
    """
    def own(found: "re.Match[str]") -> str:
        name = found[1] or found[3] or found[4] or ""
        if found[2] == ".":  # fields of structs are arguments here: "flags" for "splat_scene_desc.flags"
            return ""
        if name.startswith("grad_") and hasattr(_native.splat_gradients_desc, name):
            return name[len("grad_"):]
        struct = name.replace("_desc", "") if hasattr(_native, name) else ""
        made = "".join(map(str.capitalize, struct.split("_")[1:]))
        return str(_native.WORDS.get(name) or _native.WORDS.get(struct) or made or found[0])

    return re.sub(r"(?<!\w)'.*?'(?!\w)|(?<![\w/.])((?:splat|SPLAT)_\w+|NULL\b|desc(?=\.))(\.(?=[a-z])|(?<=_)\*)?|"
                  r"(?<![\w/])((?!splat)[a-z]+_\w+)|^(bytes)(?= is )", own, message)


def kind_of(value: object) -> str:
    """The type of an object for a sentence: "a str", "None"."""
    if value is None:
        return "None"
    kind = type(value)
    place = "" if kind.__module__.split(".")[0] in ("builtins", "libsplat") else f"{kind.__module__}."
    name = place + kind.__qualname__
    return f"{'an' if name[0] in 'aeiouAEIOU' else 'a'} {name}"


def is_number(value: Any) -> bool:
    """Whether C takes a value as a number, which has no text's type."""
    try:
        float(value)
    except (TypeError, ValueError, OverflowError):
        return False
    return not isinstance(value, (str, bytes, bytearray))


def last_error(code: int) -> Error:
    """The exception of an error code, with the text of the calling thread's last error."""
    message = lib.splat_last_error_message().decode("utf-8", "replace")
    return CLASSES.get(code, Error)(in_python(message), code)


def check(code: int) -> int:
    """Pass a result that is no error on."""
    if code < 0:
        raise last_error(code)
    return code


def direct(function: Callable[..., int], *arguments: Any) -> int:
    """Call a function of the library that is soon done, and check its result."""
    return check(function(*arguments))
