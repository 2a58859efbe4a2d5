"""The base of all classes that own an object of the library."""
import threading
import weakref
from contextlib import contextmanager
from ctypes import byref, c_void_p
from functools import partial
from typing import TYPE_CHECKING, Any, Callable, ClassVar, Iterator, List, Optional, Type, TypeVar

from ._calls import run
from ._errors import InvalidHandle, check
from ._library import lib

if TYPE_CHECKING:
    from .device import Device

Own = TypeVar("Own", bound="Handle")


def _destroy(function: Callable[[int], object], handle: int, needs: Any) -> None:
    function(handle)


class Keeper:
    """Keeps an object of the library, which is destroyed at the latest when nobody refers to this."""

    def __init__(self, kind: str, handle: int, needs: Any = None) -> None:
        """needs  lives until the object is destroyed"""
        self.handle = handle
        self.lent: List[None] = []  # one for each block of `Handle._lent`
        self.destroy = weakref.finalize(self, _destroy, getattr(lib, f"splat_{kind}_destroy"), handle, needs)


class Handle:
    """Owns an object of the library, until `close`, the end of a `with` block, or its collection.

    Objects may be closed and collected in any order: the library keeps what others need.
    """

    # Every class below has them as well, so that no object takes an attribute that is misspelt.
    __slots__ = ("_device", "_keeper", "_lock", "__weakref__")

    _kind: ClassVar[str] = ""  # splat_<kind>_destroy ends it
    _device: Optional["Device"]
    _keeper: Optional[Keeper]  # None: closed
    _lock: Optional[threading.RLock]  # for objects whose calls the caller must serialise

    def __new__(cls: Type[Own], *_: Any, **__: Any) -> Own:
        made = object.__new__(cls)
        made._device = made._keeper = made._lock = None
        return made

    def _own(self, value: int, device: Optional["Device"] = None, needs: Any = None) -> None:
        """Take an object that the library made, and what must live as long."""
        self._device = device
        self._keeper = Keeper(self._kind, value, needs)

    @classmethod
    def _of(cls: Type[Own], value: int, device: Optional["Device"] = None) -> Own:
        """A new Python object for an object that the library made."""
        made = cls.__new__(cls)
        made._own(value, device)
        made._begin()
        return made

    def _begin(self) -> None:
        """Set the attributes that every object of the class has, however it was made."""

    def _kept(self) -> Keeper:
        keeper = self._keeper
        if keeper is None:
            raise InvalidHandle(f"this {type(self).__name__} was closed; make a new one")
        return keeper

    @property
    def handle(self) -> int:
        """The library's handle, for calls of `splat._native`."""
        return self._kept().handle

    @property
    def closed(self) -> bool:
        """True if the object was given back to the library."""
        return self._keeper is None

    def close(self) -> None:
        """Give the object back to the library. A second call does nothing."""
        keeper, self._keeper = self._keeper, None
        if keeper is not None and not keeper.lent:
            keeper.destroy()

    @contextmanager
    def _lent(self) -> Iterator[Keeper]:
        """A block that copies what the library lends, such as names that live as long as the object.

        If another thread closes the object meanwhile, it is destroyed at the end of the block: `close`
        looks at `lent` after it has taken the keeper away, and a call behind that is refused.
        """
        keeper = self._kept()
        keeper.lent.append(None)
        try:
            yield keeper
        finally:
            keeper.lent.pop()

    def _run(self, function: Callable[..., int], *arguments: Any) -> int:
        """Call a function that may take long; see `splat._calls`."""
        keeper = None if self._device is None else self._device._keeper
        cancel = None if keeper is None else partial(lib.splat_device_cancel, keeper.handle)
        return run(cancel, self._lock, function, *arguments)

    def _call(self, function: Callable[..., int], *arguments: Any) -> int:
        """Call a function that is soon done."""
        if self._lock is None:
            return check(function(*arguments))
        with self._lock:
            return check(function(*arguments))

    def __enter__(self: Own) -> Own:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __reduce__(self) -> Any:
        raise TypeError(f"a libsplat.{type(self).__name__} cannot be copied or pickled")


def made(kind: str, call: Callable[..., int], function: Callable[..., int], *arguments: Any) -> int:
    """Call a function whose last argument receives a new object, and return its handle.

    kind   of the object, which is destroyed if the call was made but an exception goes on, as when
           Ctrl-C comes at its end
    call   `check` of the result, or a method `_run` or `_call`
    """
    handle = c_void_p()
    try:
        call(function, *arguments, byref(handle))
    except BaseException:
        if handle.value is not None:
            getattr(lib, f"splat_{kind}_destroy")(handle)
        raise
    assert handle.value is not None
    return handle.value

