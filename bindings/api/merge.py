"""Join the declarations of the headers with annotations.json into the description of the API.

An annotation is a few words, in this order, most of them optional:
  in | out | inout | none   who writes: the caller, the library, both; none: must be 0
  null                      the pointer may be NULL, the handle 0
  [length]                  elements of the array (bytes of a void*): numbers and names of
                            parameters or fields beside it, with * and / between them; desc.rank,
                            tensor.rank are properties of such a parameter; [1] is one object, no
                            array; [0] is passed on, never followed
  [length null]             the same; elements of the array may be NULL
  enum:name                 the values or flags of an integer
  new                       a handle or an object that the caller owns afterwards
  borrowed until TEXT       how long the library's memory that a pointer names is valid; last
"""

import re
from typing import Any, Dict, List, Optional, Set

from parse import POINTER_BYTES, SCALARS, ApiError

WORDS = re.compile(
    r"(?P<direction>in|out|inout|none)(?P<null> null)?"
    r"(?: \[(?P<length>[\w.]+(?: [*/] [\w.]+)*)(?P<items> null)?\])?"
    r"(?: enum:(?P<enum>\w+))?(?P<new> new)?(?: (?P<borrowed>borrowed until .+))?"
)
LENGTH_NAME = re.compile(r"(?<![\w.])[A-Za-z_]\w*(?![\w.])")  # bytes, but not desc.rank
OWNER_NAME = re.compile(r"(?<![\w.])([A-Za-z_]\w*)\.")
THREADS = ("safe", "caller", "signal")
INTEGERS = ("uint32_t", "uint64_t", "size_t")


def parse_words(words: str, where: str) -> Dict[str, Any]:
    """An annotation as a record, see the top of this file."""
    match = WORDS.fullmatch(words)
    if match is None:
        raise ApiError(f"annotations.json: {where}: cannot read '{words}'; merge.py says the words")
    return {
        "direction": match["direction"],
        "nullable": bool(match["null"]),
        "length": match["length"],
        "nullable_items": bool(match["items"]),
        "enum": match["enum"],
        "ownership": "new" if match["new"] else match["borrowed"],
    }


class Merger:
    """Joins declarations and annotations; any disagreement is an ApiError."""

    def __init__(self, declared: Dict[str, Any], notes: Dict[str, Any]) -> None:
        self.declared = declared
        self.notes = notes
        self.enums: Dict[str, Dict[str, Any]] = {}
        self.handles = {h["name"] for h in declared["handles"]}
        self.callbacks = {c["name"] for c in declared["callbacks"]}
        self.structs = {s["name"]: s for s in declared["structs"]}
        self.growing = {"struct " + s["name"] for s in declared["structs"]
                        if s["fields"][0]["name"] == "struct_size"}  # never in arrays
        self.layouts: Dict[str, Dict[str, int]] = {}

    def notes_of(self, kind: str, declared: Set[str]) -> Dict[str, Any]:
        """The annotations of one kind, which name declarations that exist."""
        notes: Dict[str, Any] = self.notes[kind]
        for name in notes:
            if name not in declared:
                raise ApiError(f"annotations.json: {kind}: {name} is declared in no header; "
                               "remove it, or correct its name")
        return notes

    def note_of(self, kind: str, item: Dict[str, Any], example: str) -> Any:
        """The annotation of a declaration."""
        if item["name"] not in self.notes[kind]:
            raise ApiError(f"{item['header']}.h: {item['name']} has no annotation; add "
                           f'"{item["name"]}": {example} to "{kind}" of annotations.json')
        return self.notes[kind][item["name"]]

    def base(self, name: str, where: str) -> str:
        """The base of a type as the description writes it."""
        if name in self.enums:
            return str(self.enums[name]["type"])
        if name in SCALARS or name == "void" or name in self.handles:
            return name
        if name in self.callbacks:
            return "callback " + name
        plain = name.replace("struct ", "")
        if plain in self.structs or plain in self.declared["opaque"]:
            return "struct " + plain
        raise ApiError(f"{where} has the type '{name}', which the API may not have; use a type of "
                       "fixed width, a handle, an enum or a struct of the headers")

    def value(
        self, item: Dict[str, Any], words: str, where: str, beside: List[Dict[str, Any]]
    ) -> Dict[str, Any]:
        """A parameter or a field: its type joined with its annotation.

        beside  all parameters or fields of the same declaration
        """
        raw = item["type"]
        note = parse_words(words, where)
        type_ = {"base": self.base(raw["base"], where), "pointers": raw["pointers"],
                 "const": raw["const"]}
        if raw["base"] in self.enums:
            if note["enum"]:
                raise ApiError(f"annotations.json: {where}: the type says its enum; remove enum:")
            note["enum"] = raw["base"]
        wrong = self.wrong_pointer(type_, note) or self.wrong_enum(item, note)
        if wrong:
            raise ApiError(f"annotations.json: {where}: {wrong}")
        self.check_length(note, where, [b for b in beside if b is not item])
        if note["length"] in ("0", "1"):
            note["length"] = None
        return {"name": item["name"], "type": type_, **note}

    def wrong_enum(self, item: Dict[str, Any], note: Dict[str, Any]) -> str:
        """What is wrong with the enum of an annotation; empty: nothing."""
        if note["enum"] and note["enum"] not in self.enums:
            return f"there is no enum {note['enum']}"
        if item["name"].endswith("flags") and not note["enum"] and note["direction"] != "none":
            return "flags need enum: with the name of their group, or none if they must be 0"
        return ""

    def wrong_pointer(self, type_: Dict[str, Any], note: Dict[str, Any]) -> str:
        """What cannot be true of a type in an annotation; empty: nothing."""
        pointers, base = type_["pointers"], type_["base"]
        written = note["direction"] in ("out", "inout")
        if pointers == 0:
            if note["length"] or note["ownership"]:
                return "only a pointer has a length or an owner"
            if note["nullable"] and base not in self.handles and not base.startswith("callback "):
                return "only a pointer, a handle or a callback may be null"
            return ""
        if written and type_["const"] and pointers == 1 and not note["ownership"]:
            return "the library cannot write through a pointer to const"
        if written and not note["ownership"] and (pointers == 2 or base in self.handles):
            return "what is given out needs new or borrowed until"
        text = base == "char" and type_["const"] and pointers == 1
        single = base in self.growing or base[len("struct "):] in self.declared["opaque"]
        outputs = written and (pointers == 2 or base in self.handles)
        if not (text or single or outputs or note["length"] or note["direction"] == "none"):
            return "the pointer needs a [length]; [1] for one object"
        return ""

    @staticmethod
    def check_length(note: Dict[str, Any], where: str, beside: List[Dict[str, Any]]) -> None:
        """Refuse a length of names that do not stand beside it or are no integers."""
        length = note["length"] or ""
        types = {item["name"]: item["type"] for item in beside}
        names = LENGTH_NAME.findall(length)
        for name in names + OWNER_NAME.findall(length):
            if name not in types:
                raise ApiError(f"annotations.json: {where}: the length '{length}' names {name}, "
                               f"which does not stand beside it; name one of {', '.join(types)}")
        for name in names:
            if types[name]["base"] not in INTEGERS:
                raise ApiError(f"annotations.json: {where}: the length '{length}' names {name}, "
                               f"which is a {types[name]['base']}, not an integer")

    def merge_enums(self) -> List[Dict[str, Any]]:
        """Enums with their names; those without typedef are named by their first value."""
        first = {note["first"]: (name, note) for name, note in self.notes["enums"].items()}
        for enum in self.declared["enums"]:
            start = enum["values"][0]["name"]
            if enum["name"] is None:
                if start not in first:
                    raise ApiError(
                        f"{enum['header']}.h: the enum that begins with {start} has no name; add "
                        f'"splat_..._flags": {{"first": "{start}", "flags": true}} to "enums" of '
                        "annotations.json, or put a typedef in front of it")
                name, note = first.pop(start)
                enum["name"], enum["flags"] = name, note["flags"]
            else:
                enum["flags"] = False
            used: Dict[int, str] = {}
            for value in enum["values"]:
                label, number = value["name"], value["value"]
                if number in used:
                    raise ApiError(f"{enum['header']}.h: {label} of {enum['name']} has the value "
                                   f"{number} of {used[number]}; give each its own")
                used[number] = label
                if enum["flags"] and number & (number - 1):
                    raise ApiError(f"{enum['header']}.h: {label} is {number}, not one bit; flags "
                                   "are 1u << n")
            if enum["name"] in self.enums:
                raise ApiError(f"{enum['header']}.h: there are two enums of the name "
                               f"{enum['name']}; choose another in annotations.json")
            self.enums[str(enum["name"])] = enum
        if first:
            raise ApiError(f"annotations.json: enums: no enum begins with {next(iter(first))}; "
                           "correct first, or remove the entry")
        keys = ("name", "typedef", "flags", "type", "header", "doc", "values")
        return [{key: enum[key] for key in keys} for enum in self.declared["enums"]]

    def merge_handles(self) -> List[Dict[str, Any]]:
        self.notes_of("handles", self.handles)
        functions = {f["name"] for f in self.declared["functions"]}
        handles = []
        for handle in self.declared["handles"]:
            name = handle["name"]
            note = self.note_of("handles", handle, '{"threads": "safe", "section": "..."}')
            doc: Optional[str] = note.get("doc")
            if "section" in note:
                texts = [s.section(note["section"]) for s in self.declared["sources"]]
                doc = next((t for t in texts if t is not None), None)
            if doc is None:
                raise ApiError(f"annotations.json: handles: {name}: no header has its section; "
                               "name the heading that its description follows, or give doc")
            if note["threads"] not in THREADS or name + "_destroy" not in functions:
                raise ApiError(f"annotations.json: handles: {name}: threads is one of "
                               f"{', '.join(THREADS)}, and {name}_destroy must exist")
            handles.append({"name": name, "destroy": name + "_destroy",
                            "threads": note["threads"], "header": handle["header"], "doc": doc})
        return handles

    def parameters(self, function: Dict[str, Any], notes: Dict[str, str]) -> List[Dict[str, Any]]:
        """The parameters of a function or a callback, each with its annotation."""
        names = [p["name"] for p in function["parameters"]]
        place = f"{function['header']}.h: {function['name']}"
        for name in notes:
            if name not in names:
                raise ApiError(f"annotations.json: {function['name']} has no parameter {name}; "
                               f"it has {', '.join(names) or 'none'}")
        merged = []
        for parameter in function["parameters"]:
            name = parameter["name"]
            if name not in notes:
                raise ApiError(f"{place}: the parameter {name} has no annotation; add "
                               f'"{name}": "in", or what merge.py lists, to it in annotations.json')
            merged.append(self.value(parameter, notes[name], f"{function['name']}: {name}",
                                     function["parameters"]))
        return merged

    def function(self, function: Dict[str, Any], note: Dict[str, Any]) -> Dict[str, Any]:
        where = f"{function['header']}.h: {function['name']}"
        returns = dict(function["returns"])
        del returns["count"]
        enum = returns["base"] if returns["base"] in self.enums else None
        returns["base"] = self.base(returns["base"], where)
        if (returns["pointers"] > 0) != ("returns" in note):
            raise ApiError(f'{where} returns a pointer or not, and "returns" of its annotation '
                           'says otherwise; "returns": "borrowed until ..." goes with pointers')
        if not function["doc"]:
            raise ApiError(f"{where} has no comment in front of it; say what it does")
        return {"name": function["name"], "header": function["header"], "doc": function["doc"],
                "returns": returns, "returns_enum": enum,
                "returns_ownership": note.get("returns"), "threads": note.get("threads"),
                "parameters": self.parameters(function, note["parameters"])}

    def merge_functions(self) -> List[Dict[str, Any]]:
        self.notes_of("functions", {f["name"] for f in self.declared["functions"]})
        merged = []
        for function in self.declared["functions"]:
            note = self.note_of("functions", function, '{"threads": "safe|caller|signal", '
                                '"parameters": {...}}')
            if note.get("threads") not in THREADS:
                raise ApiError(f"annotations.json: {function['name']}: threads is one of "
                               f"{', '.join(THREADS)}")
            merged.append(self.function(function, note))
        return merged

    def merge_callbacks(self) -> List[Dict[str, Any]]:
        self.notes_of("callbacks", self.callbacks)
        merged = []
        for callback in self.declared["callbacks"]:
            note = self.note_of("callbacks", callback, '{"parameters": {...}}')
            item = self.function(callback, note)
            del item["threads"]
            merged.append(item)
        return merged

    def size_of(self, field: Dict[str, Any]) -> Dict[str, int]:
        """Bytes and alignment of one element of a field."""
        type_ = field["type"]
        base = type_["base"]
        if type_["pointers"] or base in self.handles or base.startswith("callback "):
            return {"size": POINTER_BYTES, "align": POINTER_BYTES}
        if base.startswith("struct "):
            return self.layouts[base[len("struct "):]]
        return {"size": SCALARS[base], "align": SCALARS[base]}

    def merge_structs(self) -> List[Dict[str, Any]]:
        self.notes_of("structs", set(self.structs))
        merged = []
        for struct in self.declared["structs"]:
            name = struct["name"]
            notes = self.note_of("structs", struct, "{each field: its words}")
            names = [f["name"] for f in struct["fields"]]
            for field in notes:
                if field not in names:
                    raise ApiError(f"annotations.json: {name} has no field {field}")
            offset, align, fields = 0, 1, []
            for field in struct["fields"]:
                where = f"{name}.{field['name']}"
                if field["name"] not in notes:
                    raise ApiError(f"{struct['header']}.h: the field {where} has no annotation; "
                                   f'add "{field["name"]}": "in", or what merge.py lists, to '
                                   f'"{name}" in "structs" of annotations.json')
                value = self.value(field, notes[field["name"]], where, struct["fields"])
                count = field["type"]["count"]
                layout = self.size_of(value)
                if offset % layout["align"]:
                    raise ApiError(f"{struct['header']}.h: there is padding before {where}; put a "
                                   "reserved field there")
                size = layout["size"] * (count or 1)
                fields.append({**value, "offset": offset, "size": size, "count": count,
                               "doc": field["doc"]})
                offset += size
                align = max(align, layout["align"])
            if offset % align:
                raise ApiError(f"{struct['header']}.h: {name} ends with padding; put a reserved "
                               "field there")
            self.layouts[name] = {"size": offset, "align": align}
            merged.append({"name": name, "frozen": names[0] != "struct_size", "size": offset,
                           "align": align, "header": struct["header"], "doc": struct["doc"],
                           "fields": fields})
        return merged


def merge(declared: Dict[str, Any], notes: Dict[str, Any]) -> Dict[str, Any]:
    """The description of the API: see README.md for its shape.

    declared  what parse.read_header gives
    notes     the content of annotations.json
    Throws ApiError where one lacks what the other has.
    """
    merger = Merger(declared, notes)
    for macro in declared["macros"]:
        if macro not in notes["macros"]:
            raise ApiError(f"the macro {macro} is no integer, so no language gets it; make it one, "
                           'or add it to "macros" of annotations.json')
    number = {c["name"]: c["value"] for c in declared["constants"]}
    enums = merger.merge_enums()
    merged = {
        "version": [number["SPLAT_VERSION_" + part] for part in ("MAJOR", "MINOR", "PATCH")],
        "constants": declared["constants"],
        "enums": enums,
        "handles": merger.merge_handles(),
        "opaque": declared["opaque"],
        "callbacks": merger.merge_callbacks(),
        "structs": merger.merge_structs(),
        "functions": merger.merge_functions(),
        "words": notes["words"],
    }
    fields = [each for kind in ("structs", "functions") for holder in declared[kind]
              for each in holder.get("fields", holder.get("parameters"))]
    known = ["NULL"] + [each["name"] for each in fields]
    known += [each["name"] for kind in ("enums", "structs", "functions") for each in declared[kind] if each["name"]]
    known += [value["name"] for enum in declared["enums"] for value in enum["values"]]
    for name in notes["words"]:
        if not any(each == name or name.endswith("_") and each.startswith(name) for each in known):
            raise ApiError(f'"words" of annotations.json: nothing is called {name}')
    return merged
