#!/bin/sh
# Usage: tests/interop/onnx_slots.sh FOLDER PROGRAM
#
# Checks the places of ONNX Runtime's functions that PROGRAM prints ("name place" a line) against the list of another
# project, which npm fetches into FOLDER once. Exit status 77: skipped, with the reason.
set -eu

list=$1/NativeMethods.shared.cs
skip() {
    echo "skipped: $*"
    exit 77
}
. "$(dirname "$0")/npm_file.sh"
npm_file com.github.asus4.onnxruntime@0.4.9 Runtime/NativeMethods.shared.cs "" "$list"

# The struct OrtApi there has a line for each function, in order; OrtApiBase before it has two.
theirs=$(sed -n '/struct OrtApi *$/,/^ *}/s/.*public IntPtr \([A-Za-z0-9_]*\);.*/\1/p' "$list" |
    awk '{print $1, NR - 1}')
[ "$(echo "$theirs" | wc -l)" -gt 100 ] || { echo "FAILED: no list of functions in $list"; exit 1; }
"$2" | {
    count=0
    while read -r name place; do
        echo "$theirs" | grep -qx "$name $place" ||
            { echo "FAILED: $name is at place $place, expected $(echo "$theirs" | grep "^$name ")"; exit 1; }
        count=$((count + 1))
    done
    [ "$count" -gt 20 ] || { echo "FAILED: only $count functions"; exit 1; }
    echo "$count functions agree"
}
