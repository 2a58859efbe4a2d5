#!/bin/sh
# Usage: tests/interop/splat_transform.sh COMPARE_SCENES
#
# Checks that PlayCanvas' splat-transform and this library read each other's files, within the quantisation
# of each format. Needs node 18 or newer and npm, which fetches the pinned package; set
# SPLAT_TRANSFORM to an installed program to fetch nothing. Exit status 77: skipped, with the reason.
set -eu

package=@playcanvas/splat-transform@2.7.1
compare=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT INT TERM

skip() {
    echo "skipped: $*"
    exit 77
}

client=${SPLAT_TRANSFORM:-}
if [ -z "$client" ]; then
    command -v node >/dev/null 2>&1 && command -v npm >/dev/null 2>&1 || skip "node and npm are not installed"
    npm install --prefix "$work/client" --ignore-scripts --no-audit --no-fund "$package" >"$work/npm.log" 2>&1 ||
        skip "npm could not install $package: $(tail -n 1 "$work/npm.log")"
    client="$work/client/node_modules/.bin/splat-transform"
fi

failed=""

# agree <title> <file> <format>
agree() {
    echo "$1"
    "$compare" "$work/reference.ply" "$2" "$3" || failed="$failed '$1'"
}

# convert <input> <output> [<option>...]
convert() {
    from=$1
    to=$2
    shift 2
    "$client" -q -w "$@" "$from" "$to" >"$work/client.log" 2>&1 || {
        cat "$work/client.log"
        echo "FAILED: splat-transform does not read $from"
        exit 1
    }
}

"$compare" write "$work"
for file in reference.ply:ply ours.splat:splat ours-v3.spz:spz ours-v4.spz:spz; do
    name=${file%:*}
    convert "$work/$name" "$work/$name.csv"
    agree "splat-transform reads our $name" "$work/$name.csv" "${file#*:}"
done
convert "$work/reference.ply" "$work/theirs.ply"
agree "we read its .ply" "$work/theirs.ply" ply
convert "$work/reference.ply" "$work/theirs.compressed.ply"
agree "we read its .compressed.ply" "$work/theirs.compressed.ply" compressed
for version in 3 4; do
    convert "$work/reference.ply" "$work/theirs-v$version.spz" --spz-version $version
    agree "we read its .spz version $version" "$work/theirs-v$version.spz" spz
done

[ -z "$failed" ] || {
    echo "FAILED:$failed"
    exit 1
}
echo "all agree"
