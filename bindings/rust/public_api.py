#!/usr/bin/env python3
"""The public API of the crate splat as a list, from rustdoc's pages, compared with public_api.txt.

    public_api.py <folder of the crate's pages> [--write]

A line is an item, a field, a variant, a constant, a function with its types, or a trait's implementation. What is new
is added to the list by --write, to be committed. What is gone or other is refused, unless the list's version is of
another series: 0.1 and 0.2, 1 and 2. A field more does not count as other, since structs are made by Default.
Send and Sync, the traits of features and splat-sys have tests of their own."""

import html
import re
import sys
from pathlib import Path
from typing import List, Optional, Tuple

HERE = Path(__file__).resolve().parent
LIST = HERE / "public_api.txt"
HEADER = r'<h[34] class="code-header[^"]*">(.*?)</h[34]>'
MEMBER = r'id="(?:structfield|variant)\.\w+"[^>]*>(?:<a [^>]*>[^<]*</a>)*<code>(.*?)</code>'


def plain(text: str) -> str:
    """The text of HTML, alike for rustdoc of 1.63 and later."""
    text = html.unescape(re.sub(r"<[^>]*>", "", text)).replace("\u200b", "")
    text = re.sub(r"\s+", " ", text.replace("]pub", "] pub")).strip()
    text = re.sub(r"^(pub const [^=]*) = .*", r"\1", text)
    text = re.sub(r"(\w+)<(.*)> for \2( where .*)?$", r"\1 for \2\3", text)  # PartialEq<X> for X
    return re.sub(r",?(?=(?: where|$)| ?[)}>](?<!->))", "", re.sub(r"\( | (?=\))", lambda m: m[0].strip(), text))


def lines_of(page: str, path: str) -> List[str]:
    """What a page says of the item of a path."""
    kind, name = path.split(" ")[0], re.split("::| ", path)[-1]
    declared = re.search(r'<pre class="rust [^"]*"[^>]*>(.*?)</pre>', page, re.S)
    text = plain(declared[1]) if declared else ""
    found = [re.split(r" ?[{(;]", text)[0] if kind in ("struct", "enum", "trait") else text]
    if kind == "type":
        return [f"{path}: {text}"]
    own = re.split(r'id="(?:deref-methods|trait-implementations|synthetic-|implementors|foreign-impls)', page)[0]
    found += [plain(member) for member in re.findall(MEMBER, own, re.S)]
    headers = [plain(header) for header in re.findall(HEADER, own, re.S)]
    found += [header for header in headers if not header.startswith("impl")]
    traits = re.search(r'id="trait-implementations"(.*?)(id="synthetic-implementations"|$)', page, re.S)
    headers = [plain(header) for header in re.findall(HEADER, traits[1], re.S)] if traits else []
    found += [re.sub(f" for {name}$", "", header) for header in headers
              if header.startswith("impl") and "Structural" not in header]
    return [f"{path}: {line}" for line in found]


def public_api(folder: Path) -> List[str]:
    """The lines of all pages of items, each a path, a colon and what is said of it; the prelude repeats others."""
    found = set()
    for file in sorted(folder.rglob("*.html")):
        match = re.match(r"(struct|enum|trait|fn|type|constant|macro)\.(\w+)\.html$", file.name)
        page = file.read_text(encoding="utf-8")
        place = file.parent.relative_to(folder).parts
        if match and "http-equiv=\"refresh\"" not in page and "prelude" not in place:
            found.update(lines_of(page, f"{match[1]} " + "::".join((*place, match[2]))))
    return sorted(found)


def read_list() -> Tuple[str, List[str]]:
    """The version and the lines of the list, which has a path once, before what is said of it."""
    version, *rows = LIST.read_text(encoding="utf-8").splitlines()
    path, lines = "", []
    for row in rows:
        if row.startswith(" "):
            lines.append(f"{path}: {row.strip()}")
        else:
            path = row
    return version, lines


def write_list(version: str, lines: List[str]) -> None:
    rows, last = [version], ""
    for path, said in (line.split(": ", 1) for line in lines):
        rows += [path] * (path != last) + [f" {said}"]
        last = path
    LIST.write_text("\n".join(rows) + "\n", encoding="utf-8")


def series(version: str) -> str:
    """What of a version changes with an incompatible one."""
    return ".".join(version.split(".")[:2 if version.startswith("0.") else 1])


def judge(listed: List[str], found: List[str], before: str, now: str) -> Optional[str]:
    """Why the API does not fit the list; None if nothing is gone."""
    gone = [line for line in listed if line not in set(found)]
    if gone and series(before) == series(now):
        return f"gone or other since {before}, but the version is {now}:\n  " + "\n  ".join(gone)
    return None


def main() -> str:
    assert judge(["a"], ["a", "b"], "0.1.0", "0.1.0") is None
    assert "a" in (judge(["a"], ["b"], "0.1.0", "0.1.3") or "")
    assert judge(["a"], ["b"], "0.1.0", "0.2.0") is None and judge(["a"], [], "1.2.0", "1.3.0")
    found = public_api(Path(sys.argv[1]))
    assert len(found) > 500, f"{len(found)} lines in {sys.argv[1]}: the pages are not as expected"
    now = re.findall(r'^version = "(.*)"', (HERE / "splat/Cargo.toml").read_text(encoding="utf-8"), re.M)[0]
    before, listed = read_list() if LIST.exists() else (now, [])
    fault = judge(listed, found, before, now)
    if fault:
        return fault
    if "--write" in sys.argv:
        write_list(now, found)
    elif listed != found:
        new = [line for line in found if line not in set(listed)]
        return "not in public_api.txt; run bindings/rust/public_api.py with --write:\n  " + "\n  ".join(new)
    print(f"{len(found)} lines of the public API")
    return ""


if __name__ == "__main__":
    sys.exit(main() or 0)
