"""Names of C in the library's sentences, and what another language says instead.

The sentences are those of src/. Languages name methods, classes and values by rules of their own; what
follows no rule is in annotations.json, under "words".
"""
import re
from functools import lru_cache
from pathlib import Path
from typing import Any, Callable, Dict, List, Set, Tuple

SOURCES = Path(__file__).resolve().parents[2] / "src"
NAME = re.compile(r"\b(?:splat|SPLAT)_\w+|\b\w+_count\b")


@lru_cache(maxsize=1)
def mentioned() -> Set[str]:
    """All words of the strings of src/ that look like names of C."""
    names: Set[str] = set()
    for path in sorted(SOURCES.rglob("*")):
        if path.suffix in (".cpp", ".h"):
            text = re.sub(r"//[^\n]*|#include[^\n]*", "", path.read_text(encoding="utf-8"))
            for string in re.findall(r'"(?:[^"\\\n]|\\.)*"', text):
                names.update(NAME.findall(string))
    return names


def call_of(api: Dict[str, Any], name: str) -> Tuple[str, str]:
    """The object and the method of a function: ("splat_tensor", "unmap"), ("", "version")."""
    owners = [each["name"] for each in api["handles"] if name.startswith(each["name"] + "_")]
    owner = max(owners, key=len, default="")
    return owner, name[len(owner or "splat") + 1:]


def wrapped(items: List[str], indent: str, width: int = 116) -> List[str]:
    """Items with commas between them, in lines that fit."""
    lines, line = [], indent
    for item in items:
        if line.strip() and len(line) + len(item) + 2 > width:
            lines.append(line.rstrip())
            line = indent
        line += item + ", "
    return lines + [line.rstrip()] if line.strip() else lines


def words(api: Dict[str, Any], language: str, class_of: Callable[[str], str],
          method_of: Callable[[str, str], str],
          value_of: Callable[[Dict[str, Any], Dict[str, Any]], str],
          number_of: str = "the number of {}") -> List[Tuple[str, str]]:
    """Pairs of a name of C and the words of a language, in the order of the names, without those of most structs.

    class_of   the class of a handle
    method_of  class and method to a call
    value_of   enumeration and value
    number_of  the length of an array, which C gives as a count
    """
    used = mentioned()
    own = {each["name"]: class_of(each["name"]) for each in api["handles"]}
    for holder in [*api["structs"], *api["functions"]]:
        for item in holder.get("fields", holder.get("parameters")):
            if (item["length"] or "").endswith("_count") and item["length"] in used:
                own.setdefault(item["length"], number_of.format(item["name"]))
    for function in api["functions"]:
        owner, method = call_of(api, function["name"])
        if function["name"] in used and owner:
            own[function["name"]] = method_of(own[owner], method)
    for enum in api["enums"]:
        own.update((value["name"], value_of(enum, value)) for value in enum["values"]
                   if value["name"] in used and enum["name"] != "splat_result")  # codes are in no sentence
    own.update((name, each[language]) for name, each in api["words"].items() if language in each)
    return sorted(own.items())
