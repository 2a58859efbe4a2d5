"""The library's log. Without a callback the library is silent."""
import atexit
import sys
import threading
from ctypes import c_void_p, cast
from types import SimpleNamespace
from typing import Any, Callable, Optional, Union

from . import _native
from ._errors import check
from ._library import lib
from ._text import choice

Callback = Callable[[_native.LogLevel, str], object]

NONE = cast(c_void_p(), _native.splat_log_callback)

_guard = threading.Lock()
_set: Any = NONE  # the function that the library may call; it must live as long


def _wrapped(callback: Callback) -> Any:
    """The callback as a function of C. Its exceptions go to sys.unraisablehook."""

    def call(user: Any, level: int, message: bytes) -> None:
        try:
            callback(_native.LogLevel(level), message.decode("utf-8", "replace"))
        except BaseException:
            kind, value, trace = sys.exc_info()
            unraisable: Any = SimpleNamespace(
                exc_type=kind, exc_value=value, exc_traceback=trace,
                err_msg="Exception ignored in a log callback of splat", object=callback)
            sys.unraisablehook(unraisable)

    return _native.splat_log_callback(call)


def set_log(callback: Optional[Callback], min_level: Union[int, str] = "warning") -> None:
    """Send the library's messages to `callback(level, text)`; None: silence.

    It is called on the thread that caused the message, at the end of the call. When this function
    returns, no thread runs the callback before. Do not call it holding a lock that one takes.
    min_level  "debug", "info", "warning" or "error"
    """
    global _set
    function = NONE if callback is None else _wrapped(callback)
    level = choice(_native.LogLevel, min_level, "min_level")
    with _guard:
        check(lib.splat_log_set_callback(function, None, level))
        _set = function


# No thread may enter Python when the interpreter has ended.
atexit.register(set_log, None)
