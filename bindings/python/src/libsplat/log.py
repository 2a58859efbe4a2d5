"""Settings of the whole process: the log, without which the library is silent, and limits of files."""
import atexit
import functools
import threading
from ctypes import byref, c_void_p, cast, sizeof
from typing import Any, Callable, Optional, Union

from . import _native
from ._errors import check
from ._library import lib
from ._text import choice
from .device import whole

Callback = Callable[[_native.LogLevel, str], object]

NONE = cast(c_void_p(), _native.splat_log_callback)

_guard = threading.Lock()
_set: Any = NONE  # the function that the library may call; it must live as long


def _wrapped(callback: Callback) -> Any:
    """The callback as a function of C. ctypes gives its exceptions to sys.unraisablehook."""

    @functools.wraps(callback, updated=())  # what the hook tells
    def call(user: Any, level: int, message: bytes) -> None:
        callback(_native.LogLevel(level), message.decode("utf-8", "replace"))

    return _native.splat_log_callback(call)


def set_log(callback: Optional[Callback], min_level: Union[int, _native.LogLevelName] = "warning") -> None:
    """Send the library's messages to `callback(level, text)`; None: silence.

    It is called on the thread that caused the message, at the end of the call. When this function
    returns, no thread runs the callback before. Do not call it holding a lock that one takes.
    What it raises goes to sys.unraisablehook, also what a signal raises in it, such as Ctrl-C. The
    hook's `object` has the callback as `__wrapped__`.
    min_level  "debug", "info", "warning" or "error"
    """
    global _set
    function = NONE if callback is None else _wrapped(callback)
    level = choice(_native.LogLevel, min_level, "min_level")
    with _guard:
        check(lib.splat_log_set_callback(function, None, level))
        _set = function


def set_decode_limits(*, bytes_times_file: int = 0, bytes_besides: int = 0, items: int = 0,
                      jpeg_scans: int = 0) -> None:
    """Limit what a file may cost when it is read, from now on and on all threads; () sets the defaults.

    bytes_times_file  bytes of memory for each byte of the file; 0: 64
    bytes_besides     bytes on top of that; 0: 64 MiB
    items             tensors or files of an archive; 0: 10^6
    jpeg_scans        of one image; 0: 100
    Reading a file beyond them raises FormatError. Raises InvalidArgument: no such number.
    """
    limits = _native.splat_decode_limits(struct_size=sizeof(_native.splat_decode_limits))
    limits.bytes_times_file = whole(bytes_times_file, "bytes_times_file", 64)
    limits.bytes_besides = whole(bytes_besides, "bytes_besides", 64)
    limits.items = whole(items, "items", 64)
    limits.jpeg_scans = whole(jpeg_scans, "jpeg_scans")
    check(lib.splat_decode_set_limits(byref(limits)))


# No thread may enter Python when the interpreter has ended.
atexit.register(set_log, None)
