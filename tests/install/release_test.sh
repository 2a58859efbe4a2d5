#!/bin/sh
# release_test.sh SOURCES FOLDER: two drafts of a release, each of what can be made here, have the same bytes, and their
# checksums are right.
set -eu
rm -rf "$2"
for run in first second; do
    "$1/tools/release" --draft --no-abi --out "$2/$run" 2>"$2.log" || cat "$2.log"
    (cd "$2/$run" && sha256sum --quiet --check SHA256SUMS)
    [ "$(wc -l <"$2/$run/SHA256SUMS")" -gt 2 ] || { echo "release_test: nothing was made" >&2; exit 1; }
done
diff -r "$2/first" "$2/second"
cat "$2/first/SHA256SUMS"
