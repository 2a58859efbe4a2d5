#!/bin/sh
# Usage: tests/interop/viewer.sh VKRUN TEMP [speed]
#
# Runs viewer.mjs, the test of the pages of vkrun view, with Debian's Chromium; CHROMIUM names another. Needs node 18
# or newer. Exit status 77: skipped, with the reason.
set -eu

. "$(dirname "$0")/browser.sh"
exec node "$(dirname "$0")/viewer.mjs" "$chromium" "$@"
