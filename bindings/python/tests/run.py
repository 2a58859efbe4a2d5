"""Runs one file of tests; exits with 77 after a sentence where NumPy or PyTorch is missing, or all were skipped.

    python3 bindings/python/tests/run.py test_tensor
"""
import sys
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "src")]

try:
    import numpy  # noqa: F401
except ImportError:
    print(f"skipped: {sys.executable} has no NumPy; apt-get install python3-numpy")
    sys.exit(77)

if __name__ == "__main__":
    try:
        result = unittest.main(module=sys.argv[1], argv=sys.argv[1:], verbosity=2, exit=False).result
    except unittest.SkipTest as reason:
        print(f"skipped: {reason}")
        sys.exit(77)
    if not result.wasSuccessful():
        sys.exit(1)
    if result.skipped and result.testsRun <= len(result.skipped):  # a skipped class runs no test
        print("skipped: " + result.skipped[0][1])
        sys.exit(77)
