"""Tests of generate: what is checked in is what it writes, and it refuses what it must."""

import ast
import copy
import ctypes
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, Tuple

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
sys.path.insert(0, str(HERE))

from merge import merge  # noqa: E402
from parse import ApiError, find_clang, read_header  # noqa: E402

HEADER = """
#include <stdint.h>
#define SPLAT_VERSION_MAJOR 1
#define SPLAT_VERSION_MINOR 2
#define SPLAT_VERSION_PATCH 3
#define SPLAT_API
typedef int32_t splat_result;
enum { SPLAT_OK = 0 };

/* ---- Thing ----------------------------------------------------------------------------------- */

/* A thing. */

typedef struct splat_thing_s* splat_thing;

/* A place. Frozen. */
typedef struct splat_place {
    double x; /* pixels */
    double y;
} splat_place;

/* Make a thing at places. */
SPLAT_API splat_result splat_thing_create(const splat_place* places, uint32_t count,
                                          splat_thing* thing);

/* Destroy a thing. */
SPLAT_API splat_result splat_thing_destroy(splat_thing thing);
"""

NOTES: Dict[str, Any] = {
    "macros": ["SPLAT_API"],
    "enums": {},
    "handles": {"splat_thing": {"threads": "safe", "section": "Thing"}},
    "callbacks": {},
    "words": {},
    "structs": {"splat_place": {"x": "in", "y": "in"}},
    "functions": {
        "splat_thing_create": {"threads": "safe", "parameters": {
            "places": "in null [count]", "count": "in", "thing": "out new"}},
        "splat_thing_destroy": {"threads": "safe", "parameters": {"thing": "in null"}},
    },
}

# What the examples in the headers' comments leave to the reader.
AROUND_EXAMPLES = """
#include <splat.h>
#include <stdio.h>
extern splat_device device;
extern void* user;
extern splat_group_send_receive send_receive;
extern splat_group_broadcast broadcast;
extern splat_group_barrier barrier;
extern splat_scene scene;
extern splat_camera camera;
extern splat_rasterizer rasterizer;
extern splat_model model;
extern splat_predictor predictor;
extern splat_tensor offset, grad_offset;
extern splat_dataset dataset;
extern splat_trainer trainer;
extern splat_trainer_info info;
extern splat_batches batches;
extern splat_run run;
extern splat_optimizer optimizer;
extern uint32_t count, rank;
extern uint64_t seed;
extern splat_image picture, mask, predicted, truth;
extern const char *config, *text;
extern float pixels[512 * 512 * 3];
extern uint8_t bytes[512 * 512 * 4];
extern void *instance, *physical, *features;
extern void vkGetInstanceProcAddr(void);
extern splat_vulkan_desc vulkan;
extern splat_rasterizer_desc raster;
extern splat_vulkan_target target;
extern splat_vulkan_frame frame;
"""

# The lines of an example: indented, behind an empty line of a comment.
EXAMPLE = re.compile(r"^ \*\n((?: \*   .*\n)+)", re.M)

Note = Callable[[Dict[str, Any]], object]


def api_of(header: str, notes: Dict[str, Any]) -> Dict[str, Any]:
    """The description of a header of that text, which is called sample.h."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "sample.h"
        path.write_text(header, encoding="utf-8")
        return merge(read_header(path, Path(folder)), notes)


# Names of the environment, which all languages have.
ENVIRONMENT = {"SPLAT_UNKNOWN_RESULT", "SPLAT_DUCKDB_LIBRARY", "SPLAT_ONNXRUNTIME_LIBRARY", "SPLAT_PRIORS_DIR",
               "SPLAT_SELF_TEST", "SPLAT_TIMEOUT_SCALE", "SPLAT_KERNELS", "SPLAT_MAX_SUBMIT_MS"}


def python_texts(text: str) -> Iterator[Tuple[str, str]]:
    """Each record and enumeration with its title, each of their fields and values with its text."""
    for node in ast.parse(text).body:
        if isinstance(node, ast.ClassDef) and node.bases and ast.unparse(node.bases[0]) in (
                "Record", "IntFlag", "OpenEnum"):
            doc = ast.get_docstring(node) or ""
            yield node.name, doc.split("\n\n")[0]
            for line in node.body:
                target = line.target if isinstance(line, ast.AnnAssign) else (
                    line.targets[0] if isinstance(line, ast.Assign) else None)
                if isinstance(target, ast.Name):
                    row = re.search(rf"^{target.id} +((?:.|\n )*)", doc.partition("\n\n")[2], re.M)
                    yield f"{node.name}.{target.id}", row[1] if row else ""


def texts_in_front(text: str, declared: str) -> Iterator[Tuple[str, str]]:
    """What matches `declared`, and the comment in front of it: in C# and Rust."""
    doc = ""
    for line in text.split("\n"):
        line = line.strip()
        if line.startswith("///"):
            doc += line[3:]
            continue
        beside = re.match(r"/\*\* (.*?) \*/ ", line)
        found = re.match(declared, line[beside.end():] if beside else line)
        if found:
            yield found[1], re.sub("</?summary>", "", beside[1] if beside else doc).strip()
        if not line.startswith(("#[", "[")):
            doc = ""


CSHARP = r"(public (?:sealed class|enum) \w+|public [\w\[\]]+ \w+(?= \{ get)|\w+ = \d+,)"
RUST = r"((?:pub )?\w+(?:: .*|\(\w+\) = \w+ \{| = SPLAT_\w+|(?: = \w+\(raw\))? \{|\((?=own)).*)"


def run_generate(*arguments: object, folder: Path = HERE) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, str(folder / "generate"), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def c_type(item: Dict[str, Any]) -> str:
    """The type of a parameter or field as C spells it; an enum is its integer."""
    type_ = item["type"]
    stars = "*" * type_["pointers"]
    librarys = "offset" in item and item["ownership"]  # an array that a struct's field names
    if stars == "**" and type_["const"] and (item["direction"] == "in" or librarys):
        stars = "* const*"
    base = str(type_["base"]).replace("callback ", "")
    return ("const " if type_["const"] else "") + base + stars


class CheckedIn(unittest.TestCase):
    """The files in the repository."""

    api: Dict[str, Any] = json.loads((HERE / "api.json").read_text(encoding="utf-8"))

    def test_all_files_are_what_generate_writes_now(self) -> None:
        run = run_generate("--check")
        self.assertEqual((run.returncode, run.stdout, run.stderr), (0, "", ""))

    def test_documentation_names_what_is_declared(self) -> None:
        known = {each["name"] for each in self.api["constants"]} | {
            value["name"] for enum in self.api["enums"] for value in enum["values"]} | {
            "SPLAT_MAKE_VERSION", *ENVIRONMENT}
        docs = re.findall(r'"doc": "((?:[^"\\]|\\.)*)"', json.dumps(self.api))
        named = set(re.findall(r"\bSPLAT_[A-Z0-9_]*[A-Z0-9]\b(?![_*])", " ".join(docs)))
        self.assertGreater(len(named), 50)
        # A prefix stands for the values that begin with it.
        self.assertEqual([name for name in sorted(named - known)
                          if not any(each.startswith(name + "_") for each in known)], [])

    def untold(self, texts: "Iterator[Tuple[str, str]]", least: int) -> None:
        told = list(texts)
        self.assertGreater(len(told), least)
        wrong = [(name, text) for name, text in told if not text or text == name
                 or set(re.findall(r"\b(?:splat|SPLAT)_\w+|\bNULL\b|\bstruct_size\b", text)) - ENVIRONMENT]
        self.assertEqual(wrong, [])

    def test_records_and_enumerations_are_told_in_the_words_of_each_language(self) -> None:
        texts = {name: (HERE.parent / name).read_text(encoding="utf-8") for name in (
            "python/src/libsplat/_native.py", "python/src/libsplat/_records.py", "csharp/src/Infos.cs",
            "csharp/src/Enums.cs", "rust/splat/src/values.rs")}
        for name, text in texts.items():
            with self.subTest(name):
                self.untold(python_texts(text) if name.endswith("py") else texts_in_front(
                    text.partition("OwnWords")[0], CSHARP) if name.endswith("cs") else texts_in_front(
                    text[text.index("codes!"):text.index("pub(crate) const WORDS")], RUST), 200)

    def test_a_text_that_is_missing_or_foreign_is_found(self) -> None:
        wrong = [
            python_texts('class A(Record):\n    """A thing."""\n\n    one: int\n'),
            python_texts('class A(Record):\n    """See splat_a."""\n'),
            python_texts('class A(OpenEnum):\n    """A thing.\n\n    ONE  SPLAT_ONE\n    """\n    ONE = 1\n'),
            texts_in_front("/// <summary>A thing.</summary>\npublic enum A\n{\nOne = 1,\n}\n", CSHARP),
            texts_in_front("/** <summary>NULL</summary> */ public int One { get; }\n", CSHARP),
            texts_in_front("/// A thing.\nA = a(raw) {\n/** of splat_a */ one: u32 = raw.one,\n", RUST),
            texts_in_front("A {\n/** one */ ONE = SPLAT_ONE,\n", RUST)]
        for texts in wrong:
            with self.assertRaises(AssertionError):
                self.untold(texts, 0)

    def test_check_finds_a_changed_file_and_leaves_it(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            copied = Path(folder) / "bindings" / "api"
            shutil.copytree(HERE, copied, ignore=shutil.ignore_patterns("emit_*", "abi"))
            shutil.copytree(ROOT / "include", Path(folder) / "include")
            self.assertEqual(run_generate("--check", folder=copied).returncode, 0)
            text = (copied / "api.json").read_text(encoding="utf-8")
            changed = text.replace('"splat_device_count"', '"splat_device_number"')
            (copied / "api.json").write_text(changed, encoding="utf-8")
            run = run_generate("--check", folder=copied)
            self.assertEqual(run.returncode, 1)
            self.assertIn('+  {"name": "splat_device_count"', run.stdout)
            self.assertIn("1 of 1 files differ", run.stderr)
            self.assertEqual((copied / "api.json").read_text(encoding="utf-8"), changed)
            self.assertEqual(run_generate(folder=copied).returncode, 0)
            self.assertEqual((copied / "api.json").read_text(encoding="utf-8"), text)

    def test_c_compiler_sees_the_same_types_values_and_signatures(self) -> None:
        lines = ["#include <splat.h>", "#include <stddef.h>"]
        equal = "_Static_assert({} == {}, \"{}\");".format
        for struct in self.api["structs"]:
            name = struct["name"]
            for field in struct["fields"]:
                stars = "" if field["count"] is None else f"[{field['count']}]"
                lines.append(f"void at_{name}_{field['name']}({name}* s) {{ "
                             f"{c_type(field)} (*p){stars} = &s->{field['name']}; "
                             "(void)p; }")
        for constant in self.api["constants"]:
            lines.append(equal(constant["name"], constant["value"], constant["name"]))
        for enum in self.api["enums"]:
            for value in enum["values"]:
                lines.append(equal(value["name"], value["value"], value["name"]))
        for function in self.api["functions"]:
            types = ", ".join(map(c_type, function["parameters"])) or "void"
            name, returns = function["name"], c_type({"type": function["returns"]})
            lines.append(f"{returns} (*const check_{name})({types}) = {name};")
        clang = find_clang()
        assert clang is not None
        run = subprocess.run(
            [clang, "-std=c11", "-Werror", "-fsyntax-only", "-I", str(ROOT / "include"), "-x",
             "c", "-"], input="\n".join(lines), capture_output=True, text=True, check=False)
        self.assertEqual((run.returncode, run.stderr), (0, ""))

    def test_examples_in_comments_compile_without_a_warning(self) -> None:
        lines = [AROUND_EXAMPLES]
        for header in sorted((ROOT / "include" / "splat").glob("*.h")):
            text = header.read_text(encoding="utf-8")
            for found in EXAMPLE.finditer(text):
                if ";" not in found[1]:
                    continue
                lines.append(f"void example_{len(lines)}(void) {{")
                lines.append(f'#line {text.count(chr(10), 0, found.start(1)) + 1} "{header.name}"')
                lines += [line[5:] for line in found[1].replace("*/", "").replace("...", "")
                          .split("\n")]
                lines.append("}")
        self.assertGreater(sum(line == "}" for line in lines), 9)
        for compiler in filter(None, (find_clang(), shutil.which("gcc"))):
            run = subprocess.run(
                [compiler, "-std=gnu99", "-Wall", "-Wextra", "-Wno-unused", "-Werror",
                 "-fsyntax-only", "-I", str(ROOT / "include"), "-x", "c", "-"],
                input="\n".join(lines), capture_output=True, text=True, check=False)
            self.assertEqual((run.returncode, run.stderr), (0, ""))

    def test_library_has_the_same_functions_structs_and_version(self) -> None:
        path = os.environ.get("SPLAT_LIBRARY")
        if not path:
            self.skipTest("SPLAT_LIBRARY does not name a library")
        library = ctypes.CDLL(path)
        for function in self.api["functions"]:
            self.assertTrue(hasattr(library, function["name"]), function["name"])
        library.splat_build_info.restype = ctypes.c_char_p
        info = json.loads(library.splat_build_info())
        self.assertEqual(info["structs"], {s["name"]: s["size"] for s in self.api["structs"]})
        self.assertEqual(info["version"], ".".join(map(str, self.api["version"])))


class Refused(unittest.TestCase):
    """Headers and annotations that do not fit together, in small samples."""

    def refuse(self, sentence: str, *, header: str = HEADER, note: Note = lambda notes: None,
               ) -> None:
        notes = copy.deepcopy(NOTES)
        note(notes)
        with self.assertRaises(ApiError) as caught:
            api_of(header, notes)
        self.assertIn(sentence, str(caught.exception))

    def change(self, old: str, new: str) -> str:
        self.assertIn(old, HEADER)
        return HEADER.replace(old, new)

    def create(self, **words: str) -> Note:
        """Changes words of splat_thing_create."""
        return lambda n: n["functions"]["splat_thing_create"]["parameters"].update(words)

    def test_sample_itself_is_accepted(self) -> None:
        api = api_of(HEADER, NOTES)
        self.assertEqual(api["version"], [1, 2, 3])
        places = api["functions"][0]["parameters"][0]
        self.assertEqual(places, {
            "name": "places", "direction": "in", "nullable": True, "nullable_items": False,
            "type": {"base": "struct splat_place", "pointers": 1, "const": True},
            "length": "count", "enum": None, "ownership": None})
        self.assertEqual(api["structs"][0]["fields"][0]["doc"], "pixels")
        self.assertEqual(api["handles"][0]["doc"], "A thing.")
        self.assertEqual(api["functions"][0]["doc"], "Make a thing at places.")

    def test_words_for_what_is_not_there(self) -> None:
        self.refuse('"words" of annotations.json: nothing is called splat_thing_gone',
                    note=lambda n: n["words"].update(splat_thing_gone={"python": "gone"}))

    def test_function_without_annotation_through_the_program(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            extra = Path(folder) / "extra.h"
            extra.write_text('#include "splat.h"\n/* Add. */\n'
                             "SPLAT_API splat_result splat_extra(splat_device device);\n",
                             encoding="utf-8")
            run = run_generate("--header", extra)
        self.assertEqual((run.returncode, run.stdout), (1, ""))
        self.assertIn('extra.h: splat_extra has no annotation; add "splat_extra": {"threads": '
                      '"safe|caller|signal", "parameters": {...}} to "functions" of '
                      "annotations.json", run.stderr)

    def test_parameter_without_annotation(self) -> None:
        header = self.change("uint32_t count,", "uint32_t count, uint32_t more,")
        self.refuse('sample.h: splat_thing_create: the parameter more has no annotation; add '
                    '"more": "in"', header=header)

    def test_field_without_annotation(self) -> None:
        header = self.change("double y;", "double y;\n    double z;")
        self.refuse("sample.h: the field splat_place.z has no annotation", header=header)

    def test_struct_and_handle_without_annotation(self) -> None:
        self.refuse("sample.h: splat_place has no annotation",
                    note=lambda n: n["structs"].pop("splat_place"))
        self.refuse("sample.h: splat_thing has no annotation",
                    note=lambda n: n["handles"].pop("splat_thing"))

    def test_enum_without_name(self) -> None:
        header = HEADER + "enum { SPLAT_BIT = 1u << 0 };\n"
        self.refuse("sample.h: the enum that begins with SPLAT_BIT has no name", header=header)

    def test_macro_that_is_no_integer(self) -> None:
        self.refuse("the macro SPLAT_PI is no integer", header=HEADER + "#define SPLAT_PI 3.14\n")

    def test_values_that_clash_and_flags_that_are_no_bits(self) -> None:
        header = HEADER + "typedef int32_t splat_x;\nenum { SPLAT_X1 = 1, SPLAT_X2 = 1 };\n"
        self.refuse("SPLAT_X2 of splat_x has the value 1 of SPLAT_X1", header=header)
        header = HEADER + "enum { SPLAT_BIT = 3 };\n"
        self.refuse("SPLAT_BIT is 3, not one bit", header=header, note=lambda n: n["enums"].update(
            splat_bit_flags={"first": "SPLAT_BIT", "flags": True}))

    def test_annotations_of_nothing(self) -> None:
        def add(kind: str, name: str) -> Note:
            return lambda n: n[kind].update({name: {"threads": "safe", "parameters": {}}})

        for kind in ("functions", "structs", "handles", "callbacks"):
            self.refuse(f"annotations.json: {kind}: splat_gone is declared in no header",
                        note=add(kind, "splat_gone"))
        self.refuse("splat_thing_create has no parameter gone; it has places, count, thing",
                    note=self.create(gone="in"))
        self.refuse("splat_place has no field gone",
                    note=lambda n: n["structs"]["splat_place"].update(gone="in"))
        self.refuse("no enum begins with SPLAT_GONE", note=lambda n: n["enums"].update(
            splat_gone_flags={"first": "SPLAT_GONE", "flags": True}))

    def test_lengths(self) -> None:
        self.refuse("the length 'number' names number, which does not stand beside it; name one "
                    "of count, thing", note=self.create(places="in [number]"))
        self.refuse("names gone, which", note=self.create(places="in [gone.rank]"))
        self.refuse("names thing, which is a splat_thing, not an integer",
                    note=self.create(places="in [thing]"))
        self.refuse("the pointer needs a [length]", note=self.create(places="in"))
        self.refuse("only a pointer has a length", note=self.create(count="in [1]"))

    def test_words_that_cannot_be_true(self) -> None:
        self.refuse("cannot read 'both'", note=self.create(count="both"))
        self.refuse("there is no enum splat_gone", note=self.create(count="in enum:splat_gone"))
        self.refuse("may be null", note=self.create(count="in null"))
        self.refuse("cannot write through a pointer to const",
                    note=self.create(places="out [count]"))
        self.refuse("needs new or borrowed until", note=self.create(thing="out"))
        self.refuse("threads is one of safe, caller, signal",
                    note=lambda n: n["functions"]["splat_thing_destroy"].update(threads="any"))
        header = self.change("uint32_t count", "uint32_t flags")
        self.refuse("flags need enum:", header=header, note=lambda n: n["functions"].update(
            splat_thing_create={"threads": "safe", "parameters": {
                "places": "in [2]", "flags": "in", "thing": "out new"}}))

    def test_declarations_that_not_every_language_has(self) -> None:
        self.refuse("there is padding before splat_place.y",
                    header=self.change("double x;", "float x;"))
        self.refuse("splat_place ends with padding", header=self.change("double y;", "float y;"))
        self.refuse("a parameter of splat_thing_destroy has no name",
                    header=self.change("(splat_thing thing)", "(splat_thing)"))
        self.refuse("splat_thing_destroy has no comment in front of it",
                    header=self.change("/* Destroy a thing. */", ""))
        self.refuse("has the type 'long'", header=self.change("double x;", "long x;"))
        self.refuse("declares splat_global, a VarDecl", header=HEADER + "int splat_global;\n")




if __name__ == "__main__":
    if find_clang() is None:
        print("skipped: clang is not installed; generate reads the headers with it")
        sys.exit(77)
    unittest.main()
