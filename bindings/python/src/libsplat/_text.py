"""Arguments: their kinds, and those that are text; text and bytes that functions write to a buffer.

`checked` refuses arguments of other kinds before a call begins, by the annotations of the functions
themselves. It knows this package's classes, numbers, callables, and sequences and mappings of them.
Functions refuse what may also be text, a path, a whole number or an array by sentences of their own.
"""
import collections.abc as abc
import functools
import inspect
import json
import os
import typing
from ctypes import byref, c_size_t, create_string_buffer
from enum import Enum
from typing import Any, Callable, Dict, List, Optional, Tuple, Type, TypeVar, Union

from . import _native
from ._errors import InvalidArgument, direct, is_number, kind_of
from ._handle import Handle

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


Function = TypeVar("Function", bound=Callable[..., Any])
Test = Callable[[Any, str], Optional[str]]  # (value, its name): what is wrong with it

Checks = List[Tuple[int, str, Test]]  # place, name and test of an argument


def _is_sequence(value: object) -> bool:
    return (hasattr(value, "__len__") and hasattr(value, "__getitem__")
            and not isinstance(value, (str, bytes, abc.Mapping, Handle)))


def _plain(fits: Callable[[Any], bool], words: str) -> Tuple[Test, str]:
    return lambda value, what: (None if fits(value) else
                                f"{what} is {kind_of(value)}, expected {words}"), words


def _of_items(items: Optional[Tuple[Test, str]]) -> Tuple[Test, str]:
    words = "a sequence" if items is None else f"a sequence, each {items[1]}"

    def test(value: Any, what: str) -> Optional[str]:
        if not _is_sequence(value):
            return f"{what} is {kind_of(value)}, expected {words}"
        found = () if items is None else (items[0](each, f"{what}[{index}]")
                                          for index, each in enumerate(value))
        return next(filter(None, found), None)

    return test, words


def _of_union(parts: "List[Tuple[Test, str]]") -> Tuple[Test, str]:
    words = " or ".join(each[1] for each in parts)

    def test(value: Any, what: str) -> Optional[str]:
        problems = [each[0](value, what) for each in parts]
        if None in problems:
            return None
        inside = [each for each in problems if each is not None and each.startswith(f"{what}[")]
        return inside[0] if inside else f"{what} is {kind_of(value)}, expected {words}"

    return test, words


def _test_of(hint: Any, scope: Dict[str, Any]) -> Optional[Tuple[Test, str]]:
    """The test of a type and what it expects in words; None: left to the function."""
    hint = getattr(hint, "__forward_arg__", hint)
    if isinstance(hint, str):
        try:
            hint = eval(hint, scope)
        except NameError:  # imported by another module, as of a path
            return None
    origin, parts = typing.get_origin(hint), typing.get_args(hint)
    if origin is typing.Union:
        tests = [_test_of(each, scope) for each in parts]
        known = [each for each in tests if each is not None]
        return _of_union(known) if len(known) == len(tests) else None
    if hint is type(None):
        return _plain(lambda value: value is None, "None")
    if hint is float:
        return _plain(is_number, "a number")
    if origin is abc.Callable:
        return _plain(callable, "a function")
    if origin is abc.Mapping:
        return _plain(lambda value: isinstance(value, abc.Mapping), "a mapping, such as a dict")
    if origin is abc.Sequence:
        return _of_items(_test_of(parts[0], scope))
    if inspect.isclass(hint) and hint.__module__.startswith("libsplat") and not issubclass(hint, Enum):
        return _plain(lambda value: isinstance(value, hint), f"a {hint.__name__}")
    return None


def _checks(function: Callable[..., Any]) -> Checks:
    tests = ((place, each.name, _test_of(each.annotation, function.__globals__))
             for place, each in enumerate(inspect.signature(function).parameters.values())
             if each.kind not in (each.VAR_POSITIONAL, each.VAR_KEYWORD))
    return [(place, name, test[0]) for place, name, test in tests if test is not None]


def checked(function: Function, name: str = "") -> Function:
    """The function, which refuses arguments of wrong kinds by a TypeError with their names.

    name  told in messages; empty: the function's
    """
    checks: Optional[Checks] = None  # the annotations are read at the first call

    @functools.wraps(function)
    def call(*given: Any, **named: Any) -> Any:
        nonlocal checks
        if checks is None:
            checks = _checks(function)
        for place, what, test in checks:
            if place < len(given) or what in named:
                problem = test(given[place] if place < len(given) else named[what], what)
                if problem is not None:
                    raise TypeError(f"{name or function.__name__}(): {problem}")
        return function(*given, **named)

    return typing.cast(Function, call)


def check_class(kind: type) -> None:
    """Let all public methods of a class, and its making, check their arguments."""
    for name, member in list(vars(kind).items()):
        told = kind.__name__ if name == "__init__" else f"{kind.__name__}.{name}"
        if name.startswith("_") and name != "__init__":
            continue
        if isinstance(member, (classmethod, staticmethod)):
            setattr(kind, name, type(member)(checked(member.__func__, told)))
        elif inspect.isfunction(member):
            setattr(kind, name, checked(member, told))
