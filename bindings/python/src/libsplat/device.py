"""Devices: the machine's Vulkan devices, and those that are open."""
import atexit
import operator
import os
import threading
import time
import weakref
from ctypes import byref, c_uint32, c_void_p, sizeof
from typing import Any, Callable, Dict, List, Optional, Tuple, Union

from . import _calls, _native
from ._errors import InvalidArgument, check, direct, is_number, kind_of
from ._handle import Handle, made
from ._library import lib
from ._records import DeviceInfo, MemoryInfo
from ._text import PathLike, choice, flags_of, json_from, path_of, text_from


def devices() -> List[DeviceInfo]:
    """All Vulkan devices of this machine, usable or not. Raises NoDevice without a driver."""
    count = c_uint32()
    check(lib.splat_device_count(byref(count)))
    return [describe(index) for index in range(count.value)]


def describe(index: int) -> DeviceInfo:
    """A device of this machine, without opening it. Raises InvalidArgument for no such number."""
    info = _native.splat_device_info(struct_size=sizeof(_native.splat_device_info))
    check(lib.splat_device_describe(whole(index, "index"), byref(info)))
    return DeviceInfo.of(info)


def whole(value: Any, what: str, bits: int = 32) -> int:
    """Check that a number fits an unsigned field: ctypes keeps only the low bits of others."""
    try:
        number = operator.index(value)
    except TypeError:
        raise InvalidArgument(f"{what} is {value!r}, expected a whole number") from None
    if not 0 <= number < 1 << bits:
        raise InvalidArgument(f"{what} is {number}, expected 0 to {(1 << bits) - 1}")
    return number


def real(value: Any, what: str) -> float:
    """Check that a value is a number."""
    if not is_number(value):
        raise TypeError(f"{what} is {kind_of(value)}, expected a number")
    return float(value)


class Device(Handle):
    """An open Vulkan device. Calls of several threads run one after the other.

    index, uuid, kind  which device; at most one of them, else the best there is
    kernels            which shaders it runs: "auto", "plain", "cpu" or "gpu"
    validation         let Khronos' layer check every call; its messages go to the log
    profile            time every dispatch, see `profile`
    max_bytes          budget of device memory; 0: the device's own
    timeout            seconds that one piece of work may take; 0: 60
    cache_folder       of compiled shaders; None: in the user's cache folder, "": none
    max_submit         longest time of a piece of work, in seconds; 0: 0.1, on CPU devices 0.25
    Raises NoDevice (with a list of the devices), Unsupported (the device lacks a feature).
    """

    __slots__ = ()
    _kind = "device"

    def __init__(self, index: Optional[int] = None, *, uuid: Optional[bytes] = None,
                 kind: Union[None, int, _native.DeviceKindName] = None, kernels: Union[int, _native.KernelsName] = 0,
                 validation: bool = False, profile: bool = False, max_bytes: int = 0,
                 timeout: float = 0.0, cache_folder: Optional[PathLike] = None, max_submit: float = 0.0) -> None:
        desc = _native.splat_device_desc(struct_size=sizeof(_native.splat_device_desc))
        if sum(each is not None for each in (index, uuid, kind)) > 1:
            raise InvalidArgument("index, uuid and kind exclude each other: give one of them")
        if index is not None:
            desc.select = int(_native.DeviceSelect.BY_INDEX)
            desc.index = whole(index, "index")
        if uuid is not None:
            if len(uuid) != 16:
                raise InvalidArgument(f"uuid has {len(uuid)} bytes, expected 16")
            desc.select = int(_native.DeviceSelect.BY_UUID)
            desc.uuid[:] = bytes(uuid)
        if kind is not None:
            desc.select = int(_native.DeviceSelect.BY_KIND)
            desc.kind = choice(_native.DeviceKind, kind, "kind")
        for name, seconds in (("timeout", timeout), ("max_submit", max_submit)):
            if not 0 <= seconds < 1e9:
                raise InvalidArgument(f"{name} is {seconds}, expected seconds from 0 to 1e9")
        desc.kernels = choice(_native.Kernels, kernels, "kernels")
        desc.flags = flags_of((validation, _native.DeviceFlags.VALIDATION),
                              (profile, _native.DeviceFlags.PROFILE))
        desc.max_device_bytes = whole(max_bytes, "max_bytes", 64)
        desc.timeout_ns = int(timeout * 1e9)
        desc.max_submit_ns = int(max_submit * 1e9)
        desc.cache_folder = path_of(cache_folder, "cache_folder")
        self._own(made("device", direct, lib.splat_device_create, byref(desc)))
        _devices.add(self)

    def _run(self, function: Any, *arguments: Any) -> int:
        return self._call(function, *arguments)

    @property
    def info(self) -> DeviceInfo:
        """What the device is and what it can do; `kernels` is what it runs."""
        info = _native.splat_device_info(struct_size=sizeof(_native.splat_device_info))
        check(lib.splat_device_get_info(self.handle, byref(info)))
        return DeviceInfo.of(info)

    @property
    def memory(self) -> MemoryInfo:
        """Device memory: used, live, highest so far, and the budget, in bytes."""
        info = _native.splat_memory_info(struct_size=sizeof(_native.splat_memory_info))
        check(lib.splat_device_get_memory(self.handle, byref(info)))
        return MemoryInfo.of(info)

    def cancel(self) -> None:
        """End the calls that run on the device now, on any threads; they raise Cancelled.

        So a call of asyncio.to_thread, or of an executor, ends, which cancelling its task does not do.
        """
        check(lib.splat_device_cancel(self.handle))

    def profile(self) -> Dict[str, Any]:
        """Times of every kind of dispatch. Raises InvalidState without `profile`."""
        times: Dict[str, Any] = json_from(lib.splat_device_profile_json, self.handle)
        return times

    def profile_table(self) -> str:
        """The same as a table for people."""
        return text_from(lib.splat_device_profile_table, self.handle)

    def reset_profile(self) -> None:
        """Forget the times measured so far."""
        check(lib.splat_device_profile_reset(self.handle))

    def __repr__(self) -> str:
        return "Device(closed)" if self.closed else f"Device({self.info.name!r})"


_default: Tuple[Optional[Device], ...] = (None,)


def _forget_default() -> None:
    """A forked child opens a device of its own."""
    global _default
    _default = (None,)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_default)


def default_device() -> Device:
    """The best device, opened at the first call and shared by functions that are given none."""
    global _default
    device = _default[0]
    if device is None or device.closed:
        device = Device()
        _default = (device,)
    return device


# The end of the interpreter, beside daemon threads that still compute: the end of a process takes the driver's memory
# away, whatever its threads do. So before that, other threads may begin no call of the library any more, and the
# calls that run are cancelled and waited for.

# Handles of the devices that are open.
_devices: "weakref.WeakSet[Any]" = weakref.WeakSet()


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
    handles: List[int] = [device.handle for device in _devices if not device.closed]
    for handle in handles * 2:  # a call may have passed the gate before it closed
        _wait_for(handle)


# Finalizers destroy the devices at the end. They register their own hook with the first of them, and
# hooks run in reverse order.
weakref.finalize(lib, int)
atexit.register(_end)
