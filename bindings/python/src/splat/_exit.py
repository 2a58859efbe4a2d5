"""The end of the interpreter, beside daemon threads that still compute.

The end of a process takes the driver's memory away, whatever its threads do. So before that, other
threads may begin no call of the library any more, and the calls that run are cancelled and waited for.
"""
import atexit
import threading
import time
import weakref
from ctypes import byref, c_void_p, sizeof
from typing import Any, Callable, List

from . import _calls, _native
from ._library import lib

# Handles of the devices that are open.
devices: "weakref.WeakSet[Any]" = weakref.WeakSet()


def _gate(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function for the main thread; other threads stay inside until the process ends."""

    def call(*arguments: Any) -> Any:
        while threading.current_thread() is not threading.main_thread():
            time.sleep(1e6)
        return function(*arguments)

    return call


def _wait_for(device: int) -> None:
    """Wait for the calls of other threads on a device: a new tensor comes behind them."""
    desc = _native.splat_tensor_desc(struct_size=sizeof(_native.splat_tensor_desc))
    tensor = c_void_p()
    lib.splat_device_cancel(device)
    if lib.splat_tensor_create(device, byref(desc), byref(tensor)) == 0:
        lib.splat_tensor_destroy(tensor)


def _end() -> None:
    if not any(thread is not threading.main_thread() for thread in threading.enumerate()):
        return
    _calls.direct_only()
    for name, *_ in _native.FUNCTIONS:
        setattr(lib, name, _gate(getattr(lib, name)))
    handles: List[int] = [device.handle for device in devices if not device.closed]
    for handle in handles * 2:  # a call may have passed the gate before it closed
        _wait_for(handle)


# Finalizers destroy the devices at the end. They register their own hook with the first of them, and
# hooks run in reverse order.
weakref.finalize(lib, int)
atexit.register(_end)
