"""Text and bytes that functions write to a buffer, and arguments that are text."""
import json
import os
from ctypes import byref, c_size_t, create_string_buffer
from typing import Any, Callable, Optional, Tuple, Type, Union

from . import _native
from ._errors import InvalidArgument, direct, kind_of

PathLike = Union[str, "os.PathLike[str]"]
Call = Callable[..., int]


def bytes_from(function: Call, *arguments: Any, call: Call = direct) -> bytes:
    """The bytes of a function that takes (..., buffer, capacity, needed)."""
    needed, capacity = c_size_t(), 0
    buffer = None
    while True:
        code = call(function, *arguments, buffer, capacity, byref(needed))
        if code != _native.Result.INCOMPLETE and buffer is not None:
            return bytes(memoryview(buffer)[:needed.value])
        capacity = max(needed.value, 1)  # the object may have grown since
        buffer = create_string_buffer(capacity)


def text_from(function: Call, *arguments: Any, call: Call = direct) -> str:
    """The text of such a function."""
    return bytes_from(function, *arguments, call=call).rstrip(b"\0").decode("utf-8", "replace")


def json_from(function: Call, *arguments: Any, call: Call = direct) -> Any:
    """The JSON of such a function."""
    return json.loads(text_from(function, *arguments, call=call))


def encoded(text: Optional[str], what: str) -> Optional[bytes]:
    """UTF-8 of an argument; None stays."""
    if text is None:
        return None
    if not isinstance(text, str):
        raise InvalidArgument(f"{what} is {kind_of(text)}, expected text")
    if "\0" in text:
        raise InvalidArgument(f"{what} has a NUL character, which no text may have")
    try:
        return text.encode("utf-8", "surrogateescape")
    except UnicodeEncodeError:
        raise InvalidArgument(f"{what} has a lone surrogate, {ascii(text)}, which no text may "
                              "have") from None


def path_of(path: Optional[PathLike], what: str = "path") -> Optional[bytes]:
    """The bytes of a path; None stays."""
    if path is None:
        return None
    try:
        given = os.fspath(path)
    except TypeError:
        raise InvalidArgument(f"{what} is {kind_of(path)}, expected a path") from None
    return encoded(given, what)


def json_of(value: Union[None, str, "dict[str, Any]"], what: str) -> Optional[bytes]:
    """The bytes of a text, or of the JSON of a dict; None stays."""
    return encoded(json.dumps(value) if isinstance(value, dict) else value, what)


def choice(kind: Type[Any], value: Union[None, int, str], what: str) -> int:
    """The number of an enumeration's member, which may be named: "gsplat" is Convention.GSPLAT.

    None is 0, the default of the library.
    """
    if value is None:
        return 0
    if isinstance(value, int):
        return int(value)
    members = kind.__members__
    name = value.upper() if isinstance(value, str) else ""
    for each in (name, f"{kind.__name__.upper()}_{name}"):
        if each in members:
            return int(members[each])
    names = ", ".join(member.replace(f"{kind.__name__.upper()}_", "").lower() for member in members)
    raise InvalidArgument(f"{what} is {value!r}, expected one of {names}")


def flags_of(*pairs: Tuple[object, int]) -> int:
    """The sum of the bits whose condition holds: flags_of((depth, RasterizerFlags.DEPTH))."""
    return sum(int(bit) for wanted, bit in pairs if wanted)
