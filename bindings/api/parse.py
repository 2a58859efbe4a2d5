"""Read the declarations of the headers, with their docstrings, from clang's syntax tree.

read_header() returns the declarations as they stand in C, without what C cannot say (lengths,
directions, ownership, threads): that comes from annotations.json, see merge.py.
"""

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any, Dict, Iterator, List, Optional, Tuple

CLANG_NAMES = ("clang-14", "clang")
SCALARS = {  # bytes, which are also the alignment
    "char": 1, "int8_t": 1, "uint8_t": 1, "int16_t": 2, "uint16_t": 2, "int32_t": 4,
    "uint32_t": 4, "int64_t": 8, "uint64_t": 8, "size_t": 8, "float": 4, "double": 8,
}
POINTER_BYTES = 8

COMMENT = re.compile(r"/\*.*?\*/", re.S)
HEADING = re.compile(r"/\* -{4} (.+?) -+ \*/$")
MACRO = re.compile(r"^#define[ \t]+(SPLAT_\w+)(\([^)]*\))?[ \t]*(.*?)(?:/\*.*)?$", re.M)
INTEGER = re.compile(r"\(?(-?\d+)\)?$")


class ApiError(Exception):
    """A sentence on what is wrong with the headers or the annotations, and what to do."""


class Source:
    """The text of one header and its comments."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.stem = path.stem
        # clang counts bytes, and so does the text
        self.text = path.read_bytes().decode("latin-1")
        self.comments = [(m.start(), m.end()) for m in COMMENT.finditer(self.text)]

    def clean(self, begin: int, end: int, keep_lines: bool) -> str:
        """The words of a comment, without its frame."""
        body = self.text[begin + 2 : end - 2].encode("latin-1").decode("utf-8")
        lines = [re.sub(r"^\s*\* ?", "", line).rstrip() for line in body.split("\n")]
        lines[0] = lines[0].strip()
        if not keep_lines:
            return " ".join(" ".join(lines).split())
        return "\n".join(lines).strip()

    def is_trailing(self, begin: int) -> bool:
        """True if the comment stands behind code on its line."""
        line = self.text[self.text.rfind("\n", 0, begin) + 1 : begin]
        return line.strip() != ""

    def doc_before(self, offset: int) -> str:
        """The comment directly in front of the declaration whose name is at offset."""
        ended = [c for c in self.comments if c[1] <= offset]
        if not ended or self.is_trailing(ended[-1][0]):
            return ""
        between = self.text[ended[-1][1] : offset]
        if re.search(r"[;{}]|\n[ \t]*\n|^#", between, re.M):
            return ""
        if HEADING.match(self.text[ended[-1][0] : ended[-1][1]]):
            return ""
        return self.clean(*ended[-1], keep_lines=True)

    def member_docs(self, offsets: List[int], begin: int, end: int) -> List[str]:
        """The comments in front of and beside each member of a body begin..end."""
        owners: List[List[str]] = [[] for _ in offsets]
        line_end = self.text.find("\n", end)
        for first, last in self.comments:
            if first < begin or first > line_end:
                continue
            if self.is_trailing(first):
                index = max((i for i, o in enumerate(offsets) if o < first), default=None)
            else:
                index = min((i for i, o in enumerate(offsets) if o > first), default=None)
            if index is not None and first >= begin:
                owners[index].append(self.clean(first, last, keep_lines=False))
        for i in range(len(offsets) - 1, 0, -1):  # "double a, b; /* of both */"
            if re.fullmatch(r"\w+, *", self.text[offsets[i - 1] : offsets[i]]):
                owners[i - 1] = owners[i - 1] or owners[i]
        return ["; ".join(texts) for texts in owners]

    def section(self, name: str) -> Optional[str]:
        """The comment that follows the heading of a section; None: no such heading."""
        for i, (begin, end) in enumerate(self.comments):
            heading = HEADING.match(self.text[begin:end])
            if heading and heading.group(1) == name:
                return self.clean(*self.comments[i + 1], keep_lines=True)
        return None


def find_clang() -> Optional[str]:
    """The name of clang on this machine; None: not installed."""
    return next((name for name in CLANG_NAMES if shutil.which(name)), None)


def run_clang(header: Path, include: Path) -> Dict[str, Any]:
    """The syntax tree of a header as clang prints it."""
    clang = find_clang()
    if clang is None:
        raise ApiError(f"none of {', '.join(CLANG_NAMES)} is installed; install the package clang")
    options = ["-x", "c", "-std=c99", "-Xclang", "-ast-dump=json", "-fsyntax-only"]
    run = subprocess.run([clang, *options, "-I", str(include), str(header)], capture_output=True,
                         check=False)
    if run.returncode != 0:
        raise ApiError(f"{header} does not compile:\n{run.stderr.decode()}")
    tree: Dict[str, Any] = json.loads(run.stdout)
    return tree


def fill_files(node: Any, state: Dict[str, Any]) -> None:
    """Give each location its file: clang names a file only where it differs from the last one."""
    if isinstance(node, list):
        for item in node:
            fill_files(item, state)
        return
    if not isinstance(node, dict):
        return
    if "offset" in node and "tokLen" in node:
        state["file"] = node.get("file", state["file"])
        node["file"] = state["file"]
    for key, value in node.items():
        if key != "includedFrom":
            fill_files(value, state)


def place(node: Dict[str, Any]) -> Tuple[str, int]:
    """File and offset of the name of a declaration."""
    location = node.get("loc", {})
    location = location.get("expansionLoc", location)
    return location.get("file", ""), location.get("offset", 0)


def parse_type(text: str) -> Dict[str, Any]:
    """'const char *const *' to base, pointers and const; 'uint8_t[16]' also to count."""
    array = re.search(r"\[(\d+)\]$", text)
    element = text[: array.start()] if array else text
    base = element.split("*")[0]
    return {
        "base": " ".join(word for word in base.split() if word != "const"),
        "pointers": element.count("*"),
        "const": "const" in base.split(),
        "count": int(array.group(1)) if array else None,
    }


class Reader:
    """Collects the declarations of the project's headers from a syntax tree."""

    def __init__(self, header: Path, include: Path) -> None:
        self.roots = {include.resolve(), header.resolve().parent}
        self.sources: Dict[str, Optional[Source]] = {}
        self.typedefs: List[Tuple[Source, int, Dict[str, Any]]] = []
        self.enums: List[Tuple[Source, int, Dict[str, Any]]] = []
        self.records: Dict[str, Tuple[Source, int, Dict[str, Any]]] = {}
        self.functions: List[Dict[str, Any]] = []
        tree = run_clang(header, include)
        fill_files(tree, {"file": ""})
        for node in tree["inner"]:
            self.add(node)

    def source(self, file: str) -> Optional[Source]:
        """The header of that name; None for those of the system."""
        if file not in self.sources:
            path = Path(file).resolve()
            ours = bool(file) and any(root in path.parents for root in self.roots)
            self.sources[file] = Source(path) if ours else None
        return self.sources[file]

    def add(self, node: Dict[str, Any]) -> None:
        file, offset = place(node)
        source = self.source(file)
        if source is None or node.get("isImplicit"):
            return
        kind = node["kind"]
        if kind == "TypedefDecl":
            self.typedefs.append((source, offset, node))
        elif kind == "EnumDecl":
            self.enums.append((source, node["range"]["begin"]["offset"], node))
        elif kind == "RecordDecl" and (node.get("completeDefinition") or "name" in node):
            if node["name"] not in self.records or node.get("completeDefinition"):
                self.records[node["name"]] = (source, offset, node)
        elif kind == "FunctionDecl":
            self.functions.append(self.function(source, offset, node))
        elif kind != "EmptyDecl":
            raise ApiError(
                f"{source.path.name} declares {node.get('name', 'something')}, a {kind}, which "
                "bindings/api/parse.py does not know; use another kind of declaration"
            )

    @staticmethod
    def function(source: Source, offset: int, node: Dict[str, Any]) -> Dict[str, Any]:
        parameters = [n for n in node.get("inner", []) if n["kind"] == "ParmVarDecl"]
        if any("name" not in p for p in parameters):
            raise ApiError(f"{source.path.name}: a parameter of {node['name']} has no name; add it")
        return {
            "name": node["name"],
            "header": source.stem,
            "doc": source.doc_before(offset),
            "returns": parse_type(node["type"]["qualType"].split("(")[0]),
            "parameters": [
                {"name": p["name"], "type": parse_type(p["type"]["qualType"])} for p in parameters
            ],
        }


def enumerators(source: Source, node: Dict[str, Any]) -> List[Dict[str, Any]]:
    """Name, value and docstring of each enumerator."""
    constants = [n for n in node["inner"] if n["kind"] == "EnumConstantDecl"]
    bounds = node["range"]["begin"]["offset"], node["range"]["end"]["offset"]
    docs = source.member_docs([place(n)[1] for n in constants], *bounds)
    values = []
    for constant, doc in zip(constants, docs):
        expression = next(find_values(constant), None)
        if expression is None:
            raise ApiError(f"{source.path.name}: {constant['name']} has no value; write = number")
        values.append({"name": constant["name"], "value": int(expression), "doc": doc})
    return values


def find_values(node: Dict[str, Any]) -> Iterator[str]:
    """The values of the constant expressions below a node."""
    if node["kind"] == "ConstantExpr" and "value" in node:
        yield node["value"]
    for child in node.get("inner", []):
        yield from find_values(child)


def callback(source: Source, offset: int, name: str, doc: str) -> Dict[str, Any]:
    """A typedef of a function pointer; clang keeps no names of its parameters, the text does."""
    match = re.compile(
        r"typedef\s+([\w \t*]+?)\s*\(\*" + name + r"\)\(([^)]*)\)"
    ).search(source.text, source.text.rfind("typedef", 0, offset))
    if match is None:
        raise ApiError(f"{source.path.name}: {name} is not written as typedef R (*{name})(...)")
    parameters = []
    for text in " ".join(match.group(2).split()).split(",") if match.group(2) != "void" else []:
        parameter = text.split()[-1].lstrip("*")
        spelling = text.strip()[: -len(parameter)].strip()
        parameters.append({"name": parameter, "type": parse_type(spelling)})
    return {"name": name, "header": source.stem, "doc": doc,
            "returns": parse_type(match.group(1)), "parameters": parameters}


def struct(source: Source, offset: int, node: Dict[str, Any]) -> Dict[str, Any]:
    """A struct with its fields, without layout."""
    members = [n for n in node.get("inner", []) if n["kind"] == "FieldDecl"]
    bounds = node["range"]["begin"]["offset"], node["range"]["end"]["offset"]
    docs = source.member_docs([place(n)[1] for n in members], *bounds)
    fields = [
        {"name": n["name"], "type": parse_type(n["type"]["qualType"]), "doc": doc}
        for n, doc in zip(members, docs)
    ]
    return {"name": node["name"], "header": source.stem, "doc": source.doc_before(offset),
            "fields": fields}


def constants(sources: List[Source]) -> Tuple[List[Dict[str, Any]], List[str]]:
    """Macros that are integers, and the names of all others except include guards."""
    integers: List[Dict[str, Any]] = []
    others: List[str] = []
    for source in sources:
        for match in MACRO.finditer(source.text):
            name, arguments, value = match.groups()
            number = INTEGER.match(value.strip())
            if number and not arguments:
                doc = source.doc_before(match.start(1)) or ""
                integers.append({"name": name, "value": int(number.group(1)),
                                 "header": source.stem, "doc": doc})
            elif value and name not in others:
                others.append(name)
    return integers, others


def read_header(header: Path, include: Path) -> Dict[str, Any]:
    """All declarations of a header and of those that it includes from the same folders.

    Throws ApiError for a header that does not compile and for declarations of unknown kinds.
    """
    reader = Reader(header, include)
    sources = [s for s in reader.sources.values() if s is not None]
    api: Dict[str, Any] = {"enums": [], "handles": [], "callbacks": [], "structs": [],
                           "functions": reader.functions, "sources": sources}
    named: List[Tuple[Source, int, Dict[str, Any]]] = []
    for source, offset, node in reader.typedefs:
        spelling = node["type"]["qualType"]
        name = node["name"]
        handle = re.fullmatch(r"struct (\w+)_s \*", spelling)
        if "(*)" in spelling:
            api["callbacks"].append(callback(source, offset, name, source.doc_before(offset)))
        elif handle:
            api["handles"].append({"name": name, "header": source.stem})
        elif spelling in SCALARS:
            named.append((source, offset, node))
        elif not spelling.startswith("struct "):
            raise ApiError(f"{source.path.name}: {name} stands for '{spelling}', which "
                           "bindings/api/parse.py does not know; use a struct or an integer")
    for source, offset, node in reader.enums:
        typedef = [t for t in named if t[0] is source and t[1] < offset
                   and not source.text[t[1] + len(t[2]["name"]) : offset].strip("; \t\n")]
        doc = source.doc_before(typedef[0][1] if typedef else offset)
        values = enumerators(source, node)
        api["enums"].append({
            "name": typedef[0][2]["name"] if typedef else None,
            "type": typedef[0][2]["type"]["qualType"] if typedef else "uint32_t",
            "typedef": bool(typedef), "header": source.stem, "doc": doc, "values": values,
        })
    found = {e["name"] for e in api["enums"]}
    for source, _, node in named:
        if node["name"] not in found:
            raise ApiError(f"{source.path.name}: {node['name']} is an integer without an enum "
                           "directly behind it; add its values there")
    handles = {h["name"] for h in api["handles"]}
    for name, (source, offset, node) in reader.records.items():
        if node.get("completeDefinition"):
            api["structs"].append(struct(source, offset, node))
    api["opaque"] = [n for n, r in reader.records.items()
                     if not r[2].get("completeDefinition") and n[:-2] not in handles]
    api["constants"], api["macros"] = constants(sources)
    return api
