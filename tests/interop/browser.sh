# shellcheck shell=sh
# Sourced by tests in a browser: skip <reason> ends one with status 77; $chromium is Debian's, or that of CHROMIUM.

skip() {
    echo "skipped: $*"
    exit 77
}

command -v node >/dev/null 2>&1 || skip "node is not installed"
chromium=${CHROMIUM:-$(command -v chromium || true)}
[ -n "$chromium" ] || skip "chromium is not installed"
