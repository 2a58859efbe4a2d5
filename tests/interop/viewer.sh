#!/bin/sh
# Usage: tests/interop/viewer.sh VKRUN TEMP [speed]
#
# Runs viewer.mjs, the test of the pages of vkrun view, with Debian's Chromium; CHROMIUM names another. Needs node 18
# or newer. Exit status 77: skipped, with the reason.
set -eu

skip() {
    echo "skipped: $*"
    exit 77
}

command -v node >/dev/null 2>&1 || skip "node is not installed"
chromium=${CHROMIUM:-$(command -v chromium || true)}
[ -n "$chromium" ] || skip "chromium is not installed"
exec node "$(dirname "$0")/viewer.mjs" "$chromium" "$@"
