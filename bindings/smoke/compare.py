"""Run the smoke programs on one data set and compare what they print with the first one's lines.

    compare.py --vkrun VKRUN --folder FOLDER NAME=COMMAND...

FOLDER is emptied first. A program that is not built, or whose tool is missing, is named and left
out. Exit status: 0 the same lines, 1 different or failed, 77 fewer than two programs.
"""

import argparse
import json
import shlex
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Dict, List, Optional, Tuple

HERE = Path(__file__).resolve().parent
CASES = ("version", "presets", "device", "render", "gradient", "predict", "judge", "maps", "data",
         "error", "handle", "cancel", "busy", "order")


def make_data(vkrun: str, folder: Path) -> None:
    """A small data set with the configuration of a training on it."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    options = "--objects 2 --views 4 --size 16 --seed 1".split()
    subprocess.run([vkrun, "data", "synth", str(folder), *options], check=True,
                   stdout=subprocess.DEVNULL)
    shutil.copy(HERE / "config.json", folder)


def run(command: str, folder: Path) -> Tuple[Optional[List[str]], str]:
    """The lines that a program prints, None if it is not there, and a remark."""
    words = shlex.split(command)
    for word in words:
        if shutil.which(word) is None and not Path(word).exists():
            return None, f"not there: {word}"
    start = time.monotonic()
    result = subprocess.run([*words, str(folder)], capture_output=True, check=False)
    remark = f"{time.monotonic() - start:.1f} s"
    if result.returncode != 0:
        remark = f"exit status {result.returncode}: {result.stderr.decode().strip()}"
    return result.stdout.decode().splitlines(), remark


def complaint(line: Optional[str], expected: Optional[str], case: str) -> str:
    """What is wrong with a program's line of a case; empty: nothing."""
    if line is None:
        return "missing"
    try:
        if json.loads(line)["case"] != case:
            return f"expected case {case}, got {line}"
    except (ValueError, KeyError, TypeError):
        return f"not a line of the list: {line}"
    return "" if line == expected else f"expected {expected}, got {line}"


def judge(printed: Dict[str, List[str]]) -> List[str]:
    """Sentences on all differences, and a table on standard output."""
    first = next(iter(printed.values()))
    wrong = []
    print(f"{'case':<10}" + "".join(f"{name:>10}" for name in printed))
    for i, case in enumerate(CASES):
        cells = []
        for name, lines in printed.items():
            line, expected = (text[i] if i < len(text) else None for text in (lines, first))
            problem = complaint(line, expected, case)
            cells.append("differs" if problem else "same")
            wrong += [f"{name}, case {case}: {problem}"] if problem else []
        print(f"{case:<10}" + "".join(f"{cell:>10}" for cell in cells))
    for name, lines in printed.items():
        wrong += [f"{name}: a line too many: {line}" for line in lines[len(CASES):]]
    return wrong


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--vkrun", required=True)
    parser.add_argument("--folder", type=Path, required=True)
    parser.add_argument("programs", nargs="+", metavar="NAME=COMMAND")
    arguments = parser.parse_args()
    make_data(arguments.vkrun, arguments.folder)
    printed: Dict[str, List[str]] = {}
    wrong = []
    for program in arguments.programs:
        name, command = program.split("=", maxsplit=1)
        lines, remark = run(command, arguments.folder)
        print(f"{name}: {remark}")
        if lines is not None:
            printed[name] = lines
        if remark.startswith("exit status"):
            wrong.append(f"{name}: {remark}")
    if len(printed) < 2 and not wrong:
        print("skipped: nothing to compare; install the tools of another language")
        return 77
    wrong += judge(printed)
    for line in next(iter(printed.values())):
        print(line)
    for sentence in wrong:
        print(f"compare: {sentence}", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
