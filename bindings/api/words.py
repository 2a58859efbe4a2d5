"""Names of C in the library's sentences and in the headers, and what another language says instead.

The sentences are those of src/. Languages name methods, classes and values by rules of their own; what
follows no rule is in annotations.json, under "words".
"""
import re
from functools import lru_cache
from pathlib import Path
from typing import Any, Callable, Dict, List, Set, Tuple

SOURCES = Path(__file__).resolve().parents[2] / "src"
NAME = re.compile(r"\b(?:splat|SPLAT)_\w+|\b\w+_count\b")
# A name in a text of the headers, with what says that it is the beginning of names.
TOLD = re.compile(r"`?\b((?:splat|SPLAT)_\w+|NULL\b)\*?`?( bits| flags| warnings)?")
# What only C has: how long memory lives, and structs that do not grow.
LIVES = re.compile(r"; (?:the library's )?lives\b[^;.]*|\s+Frozen\.|\s+Pointers are valid[^.]*\.")
# The beginning of the text of a number that is 1 or 0.
TRUTH = re.compile(r"1(?=:|, or 0\b| while\b)")


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


def wrapped(items: List[str], indent: str, between: str = ", ", width: int = 118) -> List[str]:
    """Items in lines that fit, which end with what is between them."""
    lines, line = [], indent
    for item in items:
        if line.strip() and len(line) + len(item) + 2 > width:
            lines.append(line.rstrip(" ;"))
            line = indent
        line += item + between
    return lines + [line.rstrip(" ;")] if line.strip() else lines


def words(api: Dict[str, Any], language: str, class_of: Callable[[str], str],
          method_of: Callable[[str, str], str],
          value_of: Callable[[Dict[str, Any], Dict[str, Any]], str],
          structs: bool = False, everything: bool = False,
          number_of: str = "the number of {}") -> List[Tuple[str, str]]:
    """Pairs of a name of C and the words of a language, in the order of the names.


    class_of   the class of a handle
    method_of  class and method to a call
    value_of   enumeration and value
    structs    the language has them; else that of Scene is told as Scene
    everything also names that no sentence has, and structs, which sentences name by a rule
    number_of  the length of an array, which C gives as a count
    """
    used = mentioned()
    if everything:
        used = used.union(each["name"] for kind in ("structs", "functions") for each in api[kind])
        used.update(value["name"] for enum in api["enums"] for value in enum["values"])
    own = {each["name"]: class_of(each["name"]) for each in api["handles"]}
    for struct in api["structs"] if everything else ():
        made = struct["name"].replace("_desc", "")
        if structs or made in own:
            own[struct["name"]] = class_of(struct["name"] if structs else made)
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


def is_truth(field: Dict[str, Any]) -> bool:
    """True for a number whose text says what 1 means."""
    return field["type"]["base"] == "uint32_t" and bool(TRUTH.match(field["doc"] or ""))


class Told:
    """Texts of the headers with the names of a language."""

    def __init__(self, api: Dict[str, Any], own: List[Tuple[str, str]],
                 enum_of: Callable[[Dict[str, Any]], str], *, none: str, truths: Tuple[str, str]) -> None:
        """`own` is of words(), `enum_of` gives the name of an enumeration; `truths` are said for 0 and 1."""
        self.own = {**dict(own), **{each["name"]: str(each["value"]) for each in api["constants"]}, "NULL": none}
        self.enums = {enum["name"]: enum_of(enum) for enum in api["enums"]}
        self.begins = {"_".join(value["name"].split("_")[:count]) + "_": self.enums[enum["name"]]
                       for enum in api["enums"] for value in enum["values"]
                       for count in range(2, len(value["name"].split("_")))}
        self.own.update(self.enums)
        self.truths = truths

    def text(self, text: str, enum: str = "", truth: bool = False) -> str:
        """`enum` is that of a field, to which the beginning of a name belongs."""
        def said(match: "re.Match[str]") -> str:
            name, kind = match[1], match[2] or ""
            if name.endswith("_"):
                word = self.enums.get(enum) or self.begins.get(name)
                return match[0] if word is None else f"bits of `{word}`" if kind else f"`{word}`"
            word = self.own.get(name)
            return match[0] if word is None else word + kind if word.lstrip("-").isdigit() else f"`{word}`{kind}"

        text = TOLD.sub(said, LIVES.sub("", text))
        if truth:
            text = re.sub(r"(?<=or )0\b|(?<=; )0(?=:)", self.truths[0], TRUTH.sub(self.truths[1], text, count=1))
        return text
