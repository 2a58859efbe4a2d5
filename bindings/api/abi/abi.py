"""The ABI of the headers: a stub with debug information, and what libabigail reads from it.

The release library has no debug information, so the types of its functions cannot be read from it.
A stub has every function of the header with its parameters, and enums of its own that functions of
the stub take, because libabigail sees only what a function's type reaches:
  - the enumerators of each enum of the header, which its functions take as plain integers
  - the place and type of each member of each struct. The rule that lets a struct grow hides other
    changes of members from libabigail; here they are another value or another name.
"""

import lzma
import re
import subprocess
import sys
from pathlib import Path
from typing import Any, Dict, List

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
sys.dont_write_bytecode = True

from parse import read_header, run_clang  # noqa: E402

DUMP = HERE / "libsplat.abi.xml.xz"  # abidiff 2.2 reads no compressed files
INCLUDE = HERE.parents[2] / "include"


def run(*command: str, folder: Path) -> "subprocess.CompletedProcess[str]":
    """Run a tool in a folder; its status is the caller's to judge."""
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def growing_structs(include: Path) -> List[str]:
    """Names of the structs that may grow at the end: those that begin with struct_size."""
    structs = read_header(include / "splat.h", include)["structs"]
    return [s["name"] for s in structs if s["fields"][0]["name"] == "struct_size"]


def member_places(struct: Dict[str, Any]) -> Dict[str, str]:
    """The offset of each member, in C, by a name with its type; a reserved one may get a name."""
    places = {}
    for field in struct["fields"]:
        if field["name"].startswith("reserved"):
            continue
        kind = field["type"]
        words = ["const"] * kind["const"] + [kind["base"]] + ["pointer"] * kind["pointers"]
        words += [] if kind["count"] is None else [str(kind["count"])]
        key = re.sub(r"\W", "_", "_".join([struct["name"], field["name"], "is", *words]))
        places[key] = f"offsetof({struct['name']}, {field['name']})"
    return places


def stub_text(include: Path) -> str:
    """C definitions of all functions and enums of include/splat.h."""
    lines = ['#include "splat.h"', ""]
    for node in run_clang(include / "splat.h", include)["inner"]:
        if node["kind"] != "FunctionDecl" or not node["name"].startswith("splat_"):
            continue
        parameters = [n for n in node.get("inner", []) if n["kind"] == "ParmVarDecl"]
        arguments = ", ".join(f"{p['type']['qualType']} {p['name']}" for p in parameters)
        returns = node["type"]["qualType"].split("(")[0].strip()
        body = "".join(f"(void){p['name']}; " for p in parameters)
        lines.append(f"{returns} {node['name']}({arguments or 'void'}) {{ {body}return 0; }}")
    api = read_header(include / "splat.h", include)
    groups = {}
    for enum in api["enums"]:
        names = [value["name"] for value in enum["values"]]
        groups[names[0]] = dict(zip(names, names))
    groups.update({c["name"]: {c["name"]: c["name"]} for c in api["constants"]
                   if "VERSION" not in c["name"]})
    groups.update({s["name"]: member_places(s) for s in api["structs"]})
    for name, values in groups.items():
        tag = f"values_of_{name}"  # the first enumerator stays when others are added
        body = ", ".join(f"value_of_{key} = {value}" for key, value in values.items())
        lines.append(f"enum {tag} {{ {body} }};")
        lines.append(f"void {tag}(enum {tag} value) {{ (void)value; }}")
    for struct in api["structs"]:  # even those that only other structs hold
        lines.append(f"void takes_{struct['name']}({struct['name']}* value) {{ (void)value; }}")
    return "\n".join(lines) + "\n"


def soname(include: Path) -> str:
    """libsplat.so.0.MINOR, from 1.0 on libsplat.so.MAJOR: the rule of CONTRIBUTING.md."""
    text = (include / "splat" / "core.h").read_text(encoding="utf-8")
    found = dict(re.findall(r"#define SPLAT_VERSION_(MAJOR|MINOR) (\d+)", text))
    assert len(found) == 2, "core.h lacks SPLAT_VERSION_MAJOR or SPLAT_VERSION_MINOR"
    return f"libsplat.so.{found['MAJOR']}" + (f".{found['MINOR']}" if found["MAJOR"] == "0" else "")


def build_stub(include: Path, text: str, folder: Path) -> str:
    """Compile a stub against the headers. Returns the compiler's messages, empty on success."""
    (folder / "stub.c").write_text(text, encoding="utf-8")
    result = run("gcc", "-std=c99", "-g", "-O0", "-shared", "-fPIC", "-I", str(include),
                 f"-Wl,-soname,{soname(include)}", "stub.c", "-o", "stub.so", folder=folder)
    return result.stderr if result.returncode else ""


def dump(folder: Path) -> str:
    """The stub's ABI as XML, without paths and lines."""
    result = run("abidw", "--no-corpus-path", "--no-comp-dir-path", "--no-show-locs",
                 "--type-id-style", "hash", "stub.so", folder=folder)
    if result.returncode:
        raise RuntimeError(f"abidw ends with {result.returncode}: {result.stderr}")
    return result.stdout


def read_dump() -> str:
    """The checked-in dump."""
    return lzma.decompress(DUMP.read_bytes()).decode("utf-8")


def write_dump(text: str) -> None:
    """Renew the checked-in dump."""
    DUMP.write_bytes(lzma.compress(text.encode("utf-8"), preset=9 | lzma.PRESET_EXTREME))


def suppressions(names: List[str]) -> str:
    """The changes that are allowed: members appended to the named structs."""
    return "".join(
        f"[suppress_type]\n  type_kind = struct\n  name = {name}\n"
        "  has_data_member_inserted_at = end\n  has_size_change = yes\n\n" for name in names)


def compare(growing: List[str], folder: Path) -> str:
    """abidiff's report on the checked-in dump and the stub in a folder; empty if they fit.

    growing: names of the structs that may have grown.
    """
    (folder / "growth.suppr").write_text(suppressions(growing), encoding="utf-8")
    (folder / "released.abi.xml").write_text(read_dump(), encoding="utf-8")
    result = run("abidiff", "--no-added-syms", "--suppressions", "growth.suppr",
                 "released.abi.xml", "stub.so", folder=folder)
    if result.returncode & 3:  # 1 and 2: it did not run; 4 and 8: changes
        raise RuntimeError(f"abidiff ends with {result.returncode}: {result.stderr}")
    return result.stdout if result.returncode else ""
