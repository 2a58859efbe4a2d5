#!/bin/sh
# Usage: tests/tables/fetch_duckdb.sh FOLDER
#
# Puts DuckDB's library into FOLDER/libduckdb.so: that of SPLAT_DUCKDB_LIBRARY, else the pinned package, which npm
# fetches. Exit status 77: skipped, with the reason.
set -eu

folder=$1
version=1.5.6-r.1
case $(uname -m) in
x86_64) package=@duckdb/node-bindings-linux-x64@$version ;;
aarch64) package=@duckdb/node-bindings-linux-arm64@$version ;;
*) package= ;;
esac

skip() {
    echo "skipped: $*"
    exit 77
}

mkdir -p "$folder"
if [ -n "${SPLAT_DUCKDB_LIBRARY:-}" ] && [ "$SPLAT_DUCKDB_LIBRARY" != "$folder/libduckdb.so" ]; then
    ln -sf "$SPLAT_DUCKDB_LIBRARY" "$folder/libduckdb.so"
fi
[ ! -e "$folder/libduckdb.so" ] || exit 0
[ -n "$package" ] || skip "npm has no DuckDB for $(uname -m)"
command -v npm >/dev/null 2>&1 || skip "npm is not installed"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT INT TERM
(cd "$work" && npm pack --silent "$package") >"$work/npm.log" 2>&1 ||
    skip "npm could not fetch $package: $(tail -n 1 "$work/npm.log")"
tar -xzf "$work"/*.tgz -C "$work" package/libduckdb.so
mv "$work/package/libduckdb.so" "$folder/libduckdb.so.tmp"
mv "$folder/libduckdb.so.tmp" "$folder/libduckdb.so"
echo "fetched $package"
