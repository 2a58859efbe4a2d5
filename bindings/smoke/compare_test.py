"""Tests of compare.py: programs that print other lines, none, too many, or fail are refused."""

import json
import stat
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from typing import List

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
sys.dont_write_bytecode = True

from compare import CASES  # noqa: E402

LINES = [json.dumps({"case": case, "hash": "00"}, separators=(",", ":")) for case in CASES]


class Compare(unittest.TestCase):
    """Each test compares a right program with another one."""

    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def program(self, name: str, lines: List[str], status: int = 0) -> str:
        """A program that prints the lines, as NAME=COMMAND."""
        path = self.folder / name
        printed = "".join(f"echo '{line}'\n" for line in lines)
        path.write_text(f"#!/bin/sh\n{printed}exit {status}\n", encoding="utf-8")
        path.chmod(path.stat().st_mode | stat.S_IXUSR)
        return f"{name}={path}"

    def compare(self, *programs: str) -> "subprocess.CompletedProcess[str]":
        """compare.py on programs; `true` stands for vkrun."""
        return subprocess.run(
            [sys.executable, str(HERE / "compare.py"), "--vkrun", "true", "--folder",
             str(self.folder / "data"), *programs], capture_output=True, text=True, check=False)

    def other(self, lines: List[str], status: int = 0) -> "subprocess.CompletedProcess[str]":
        """A right program, and one that prints the lines."""
        return self.compare(self.program("one", LINES), self.program("other", lines, status))

    def test_same_lines(self) -> None:
        result = self.other(LINES)
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertTrue((self.folder / "data" / "config.json").exists())

    def test_another_hash(self) -> None:
        changed = [line.replace("00", "01") if "render" in line else line for line in LINES]
        result = self.other(changed)
        self.assertEqual(result.returncode, 1)
        self.assertIn("other, case render: expected", result.stderr)

    def test_missing_and_surplus_lines(self) -> None:
        self.assertIn("other, case order: missing", self.other(LINES[:-1]).stderr)
        self.assertIn("a line too many", self.other(LINES + LINES[:1]).stderr)

    def test_both_wrong_alike(self) -> None:
        """Lines that are the same everywhere, but not those of the list, are refused."""
        wrong = ["no JSON"] * len(CASES)
        result = self.compare(self.program("one", wrong), self.program("other", wrong))
        self.assertEqual(result.returncode, 1)
        self.assertIn("not a line of the list", result.stderr)

    def test_failed_program(self) -> None:
        result = self.other(LINES, status=1)
        self.assertEqual(result.returncode, 1)
        self.assertIn("other: exit status 1", result.stderr)

    def test_absent_program(self) -> None:
        """It is named and left out; with one program left there is nothing to compare."""
        result = self.compare(self.program("one", LINES), f"other={self.folder / 'absent'}")
        self.assertEqual(result.returncode, 77)
        self.assertIn("other: not there", result.stdout)


if __name__ == "__main__":
    unittest.main(verbosity=2)
