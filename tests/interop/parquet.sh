#!/bin/sh
# Usage: tests/interop/parquet.sh VKRUN
#
# Checks that hyparquet and parquet-wasm (arrow-rs) read our tables, and that we read those of parquet-wasm. Needs
# DuckDB's library, node 18 or newer, and npm, which fetches the pinned packages. Exit status 77: skipped, with the
# reason.
set -eu

packages="hyparquet@1.33.0 parquet-wasm@0.8.0 apache-arrow@21.2.0"
vkrun=$1
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT INT TERM

skip() {
    echo "skipped: $*"
    exit 77
}

fail() {
    echo "parquet: $*" >&2
    exit 1
}

[ -e "${SPLAT_DUCKDB_LIBRARY:-}" ] || skip "no DuckDB library: SPLAT_DUCKDB_LIBRARY names no file"
command -v node >/dev/null 2>&1 && command -v npm >/dev/null 2>&1 || skip "node and npm are not installed"
# shellcheck disable=SC2086  # a list of words
npm install --prefix "$work" --ignore-scripts --no-audit --no-fund $packages >"$work/npm.log" 2>&1 ||
    skip "npm could not install $packages: $(tail -n 1 "$work/npm.log")"

cd "$work"
"$vkrun" data synth data --objects 3 --views 4 --size 16 >/dev/null
"$vkrun" data export data tables --split train >/dev/null
"$vkrun" data import tables store --split train >/dev/null
node "$here/parquet_clients.mjs" read tables store/train
node "$here/parquet_clients.mjs" write store/train theirs
"$vkrun" data import theirs store_of_theirs --split train >/dev/null
for file in store/train/*.npy; do
    cmp "$file" "store_of_theirs/train/${file##*/}" || fail "our reading of parquet-wasm's tables differs"
done
echo "we read what parquet-wasm writes"
