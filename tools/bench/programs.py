"""Running the project's programs for other scripts of this folder: deadlines, what they take, tests by layer, hashes."""

import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
from xml.etree import ElementTree

PROGRAMS = {"vk_test": "vk", "ops_test": "ops", "nn_test": "nn", "raster_test": "raster", "model_test": "model",
            "api_test": "api", "api_raster_test": "api"}


def run(command, environment, timeout=3600, given=None):
    """Exit status (124 after the timeout, 127 if it cannot be started), standard output and error. What the command
    started ends with it, also where this program is interrupted."""
    try:
        process = subprocess.Popen(list(map(str, command)), env=environment, text=True, errors="replace",
                                   start_new_session=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   stdin=subprocess.PIPE if given is not None else subprocess.DEVNULL)
    except OSError as problem:
        return 127, "", str(problem)
    try:
        output, errors = process.communicate(given, timeout=timeout)
        return process.returncode, output, errors
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        try:
            output, errors = process.communicate(timeout=5)
        except subprocess.TimeoutExpired:  # it hangs in its driver
            return 124, "", "it cannot be killed: the device may be lost"
        return 124, output, errors
    except BaseException:
        os.killpg(process.pid, signal.SIGKILL)
        raise


# The system starts a child's peak with that of the program that starts it, so this small one does.
MEASURE = """import os, sys, time
begin = time.monotonic()
child = os.posix_spawnp(sys.argv[1], sys.argv[1:], os.environ)
_, status, used = os.wait4(child, 0)
print(time.monotonic() - begin, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024, file=sys.stderr)
sys.exit(os.waitstatus_to_exitcode(status) != 0)"""


def measured(command):
    """Seconds, seconds of the CPUs and peak MiB of a command, which ends the script if it fails."""
    command = list(map(str, command))
    done = subprocess.run([sys.executable, "-S", "-c", MEASURE, *command], stdout=subprocess.DEVNULL,
                          stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)} failed: {done.stderr}")
    return [float(number) for number in done.stderr.splitlines()[-1].split()]


def last_line(text):
    """What a program said last; of vkrun its sentence, before the advice."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    return next((line for line in lines if line.startswith("vkrun: ")), lines[-1] if lines else "nothing was said")


def listed_tests(build):
    """Tests of PROGRAMS as [{name, labels, program, arguments, environment}], of ctest, or of tests.json of a packed
    build, where there is no ctest."""
    packed = pathlib.Path(build) / "tests.json"
    if packed.exists():
        return json.loads(packed.read_text(encoding="utf-8"))
    listed = json.loads(subprocess.run(["ctest", "--show-only=json-v1"], cwd=build, stdout=subprocess.PIPE, text=True,
                                       check=True).stdout)["tests"]
    found = []
    for test in listed:
        properties = {p["name"]: p["value"] for p in test["properties"]}
        if "command" not in test or pathlib.Path(test["command"][0]).name not in PROGRAMS:
            continue
        found.append({"name": test["name"], "labels": properties["LABELS"],
                      "program": os.path.relpath(test["command"][0], build), "arguments": test["command"][1:],
                      "environment": dict(pair.split("=", 1) for pair in properties.get("ENVIRONMENT", []))})
    return found


def test_outcome(build, test, environment, timeout=3600):
    """{passed, failed: [names], skipped: {reason: [names]}} of a test's cases. One that does not end has failed."""
    row = {"passed": 0, "failed": [], "skipped": {}}
    with tempfile.NamedTemporaryFile(suffix=".xml") as report:
        status, output, _ = run([pathlib.Path(build) / test["program"], *test["arguments"],
                                 f"--gtest_output=xml:{report.name}"], test["environment"] | environment, timeout)
        text = report.read()
    if not text:
        row["passed"] = len(re.findall(r"^\[       OK \]", output, re.M))
        row["failed"].append(f"{test['name']} did not end in time" if status == 124
                             else f"{test['name']} ended with {status}")
        return row
    for case in ElementTree.fromstring(text).iter("testcase"):
        name, skipped = f"{case.get('classname')}.{case.get('name')}", case.find("skipped")
        if case.find("failure") is not None:
            row["failed"].append(name)
        elif skipped is not None:
            row["skipped"].setdefault(skipped.get("message").splitlines()[-1], []).append(name)
        elif case.get("status") == "run":
            row["passed"] += 1
    return row


def hash_lines(build, kind, environment, timeout=3600):
    """The lines of op_hashes ("ops") or raster_hashes ("raster"), one for each operator or scene and set of kernels;
    None if the program failed."""
    command = {"ops": ["tests/ops/op_hashes"], "raster": ["tests/raster/raster_hashes", "1"]}[kind]
    status, output, _ = run([pathlib.Path(build) / command[0], *command[1:]], environment, timeout)
    return output.splitlines() if status == 0 else None
