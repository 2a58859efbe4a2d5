"""Reads the notices of other projects in THIRD-PARTY.md, for copyright files and lists of what packages bundle."""
import re
from pathlib import Path
from typing import Dict, List, NamedTuple

ROOT = Path(__file__).resolve().parent.parent


class Project(NamedTuple):
    """A row of the table: what is compiled into libsplat or vkrun, or both."""
    name: str
    url: str
    parts: List[str]
    licence: str
    copyright: str


def projects(text: str) -> List[Project]:
    """The rows of the table."""
    rows = re.findall(r"^\| \[([^]]+)\]\(([^)]+)\) \| ([^|]+) \| ([^|]+) \| ([^|]+) \|$", text, re.MULTILINE)
    if not rows:
        raise SystemExit("notices: THIRD-PARTY.md has no table of projects")
    return [Project(name, url, parts.split(", "), licence, holder) for name, url, parts, licence, holder in rows]


def licence_texts(text: str) -> Dict[str, str]:
    """The text below each heading that names a licence."""
    sections = re.split(r"^## (.+)\n", text, flags=re.MULTILINE)[1:]
    return {name: body.strip() for name, body in zip(sections[::2], sections[1::2])}


def debian_copyright(root: Path = ROOT) -> str:
    """A copyright file in Debian's format (DEP-5)."""
    text = (root / "THIRD-PARTY.md").read_text("utf-8")
    own = re.search(r"^Copyright \(c\) (.+)$", (root / "LICENSE").read_text("utf-8"), re.MULTILINE)
    if own is None:
        raise SystemExit("notices: LICENSE has no line 'Copyright (c) ...'")
    lines = ["Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/",
             "Upstream-Name: libsplat", "", "Files: *", f"Copyright: {own.group(1)}", "License: MIT"]
    found = projects(text)
    texts = licence_texts(text)
    for project in found:
        if project.licence not in texts:
            raise SystemExit(f"notices: THIRD-PARTY.md has no text of {project.licence}, the licence of {project.name}")
        lines += ["", f"Files: third-party/{project.url.rsplit('/', 1)[-1]}/*",
                  "Copyright: " + project.copyright.replace("; ", "\n           "), f"License: {project.licence}",
                  f"Comment: {project.name}, {project.url}",
                  f" Compiled into {' and '.join(project.parts)}, from the headers of its package."]
    for name in sorted({"MIT", *(project.licence for project in found)}):
        body = texts[name].split("\n")
        lines += ["", f"License: {name}", *(f" {line}" if line.strip() else " ." for line in body)]
    return "\n".join(lines) + "\n"
