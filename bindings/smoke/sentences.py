"""Sentences that the tests of misuse provoke in C, in the words of each language, without names of C.

    sentences.py <file of SPLAT_SENTENCES> <language>=<command>...

A command tells the sentences of SPLAT_SENTENCES in its language, each after "> "; this program without arguments
does so for Python. Fails where one has a name of C, or of an argument that the language does not have.
"""
import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Dict, List, Set

BINDINGS = Path(__file__).resolve().parents[1]
QUOTED = re.compile(r"(?<!\w)'.*?'(?!\w)|\"\w*\"")
NAMES = re.compile(r"\b(?:splat_[a-z]|SPLAT_[A-Z])\w*|\bNULL\b|(?<!::)\b_?[A-Z]+_[A-Z_]+\b")
# Every binding writes these itself, and passes each pointer of a call.
ITS_OWN = re.compile(r"\b(struct_size|reserved|next) is |^[\w.\[\]]+ is (NULL|None|null)\b")
# What callers see: declarations, whose names of arguments count in every spelling.
PUBLIC = {"python": (r"(?s:\bdef .*?:\n)|^    [a-z_]\w*:", "python/src/libsplat/[!_]*.py"),
          "rust": (r"\bpub [^{;]*[{;,]|\w+: .* = own", "rust/splat/src/**/*.rs"),
          "csharp": (r"\bpublic [^{;=]*", "csharp/src/[!N]*.cs")}


def spelled(name: str) -> str:
    """A name without what spellings differ in."""
    return name.replace("_", "").lower()


def arguments() -> Set[str]:
    """Names of parameters and fields of C that are no plain words."""
    api = json.loads((BINDINGS / "api" / "api.json").read_text("utf-8"))
    return {item["name"] for holder in [*api["structs"], *api["functions"]]
            for item in holder.get("fields", holder.get("parameters")) if "_" in item["name"]} | {"desc"}


def public(language: str) -> Set[str]:
    """Names of what callers of a language see."""
    pattern, files = PUBLIC[language]
    return {spelled(name) for path in BINDINGS.glob(files)
            for part in re.findall(pattern, path.read_text("utf-8"), re.MULTILINE)
            for name in re.findall(r"\w+", part)}


def foreign(sentence: str, names: Set[str]) -> List[str]:
    """Names of C outside quotes."""
    own = QUOTED.sub("", sentence)
    found = NAMES.findall(own)
    if not ITS_OWN.search(sentence):
        found += [name for name in re.findall(r"(?<![\w/-])(?<!\w\.|, )[a-z]\w*(?![\w:,])", own) if name in names]
    return found


def tell() -> None:
    """Python's words."""
    from libsplat._errors import in_python
    for line in Path(os.environ["SPLAT_SENTENCES"]).read_text("utf-8").splitlines():
        print(">", in_python(line))


def compare() -> int:
    """Status of this program with arguments."""
    commands = [each.split("=", 1) for each in sys.argv[2:]]
    lines = Path(sys.argv[1]).read_bytes().decode("utf-8", "ignore").split("\n")
    said = sorted(set(lines) - {""})
    file = sys.argv[1] + ".sorted"
    Path(file).write_text("\n".join(said), "utf-8")
    before = sum(bool(NAMES.search(QUOTED.sub("", line))) for line in said)
    failed = len(said) < 1500
    for language, command in commands:
        done = subprocess.run(shlex.split(command), stdout=subprocess.PIPE, check=False,
                              env={**os.environ, "SPLAT_SENTENCES": file})
        if done.returncode == 77:
            print(f"{language}: skipped, its tools are missing")
            continue
        told = re.findall("> (.*)", done.stdout.decode())
        snake = language != "csharp"
        lacked = {name for name in arguments() if not snake or spelled(name) not in public(language)}
        left: Dict[str, List[str]] = {line: found for line in told if (found := foreign(line, lacked))}
        print(f"{language}: {len(told)} sentences, {before} with names of C before, {len(left)} after")
        print("".join(f"  {names}: {line}\n" for line, names in left.items()), end="")
        failed |= bool(left) or len(told) != len(said)
    return int(failed)


if __name__ == "__main__":
    sys.exit(compare() if sys.argv[1:] else tell())
