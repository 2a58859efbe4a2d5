#!/bin/sh
# Usage: tests/interop/splat_transform.sh COMPARE_SCENES
#
# Checks that PlayCanvas' splat-transform and this library read each other's files, within the quantisation
# of each format, and that both read the .ksplat of GaussianSplats3D alike. Needs node 18 or newer and npm, which
# fetches the pinned packages; set SPLAT_TRANSFORM to an installed .bin/splat-transform, with the others beside
# it, to fetch nothing. Exit status 77: skipped, with the reason.
set -eu

# A newer three has no CommonJS, which GaussianSplats3D asks for.
packages="@playcanvas/splat-transform@2.7.1 @mkkellogg/gaussian-splats-3d@0.4.7 three@0.160.1"
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
    # shellcheck disable=SC2086
    npm install --prefix "$work/client" --ignore-scripts --no-audit --no-fund $packages >"$work/npm.log" 2>&1 ||
        skip "npm could not install $packages: $(tail -n 1 "$work/npm.log")"
    client="$work/client/node_modules/.bin/splat-transform"
fi

failed=""

# agree <title> <file> <format> [<reference>]
agree() {
    echo "$1"
    "$compare" "$work/${4:-reference.ply}" "$2" "$3" || failed="$failed '$1'"
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
for file in reference.ply:ply ours.splat:splat ours-v3.spz:spz ours-v4.spz:spz \
    ours.compressed.ply:compressed ours.sog:sog; do
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

convert "$work/reference.ply" "$work/theirs.glb"
agree "we read its .glb" "$work/theirs.glb" glb
cat >"$work/ksplat.mjs" <<'END'
import fs from "node:fs";
globalThis.window = globalThis;
const [, , modules, folder] = process.argv;
const { PlyLoader } = await import(`${modules}/@mkkellogg/gaussian-splats-3d/build/gaussian-splats-3d.module.js`);
const ply = new Uint8Array(fs.readFileSync(`${folder}/degree2.ply`)).buffer;
for (const level of [0, 1, 2]) {
    const made = await PlyLoader.loadFromFileData(ply, 0, level, true, 2);
    fs.writeFileSync(`${folder}/level${level}.ksplat`, Buffer.from(made.bufferData));
}
END
node "$work/ksplat.mjs" "$(cd "$(dirname "$client")/.." && pwd)" "$work"
for level in 0 1 2; do
    convert "$work/level$level.ksplat" "$work/level$level.csv"
    agree "we read the .ksplat of GaussianSplats3D, level $level" "$work/level$level.ksplat" ksplat degree2.ply
    agree "splat-transform reads level $level alike" "$work/level$level.csv" ply "level$level.ksplat"
done
# A palette joins Gaussians: both programs read the same file, and must find the same values.
convert "$work/reference.ply" "$work/theirs.sog" -g cpu
convert "$work/theirs.sog" "$work/theirs-sog.ply"
agree "we read its .sog as it does" "$work/theirs.sog" ply theirs-sog.ply

[ -z "$failed" ] || {
    echo "FAILED:$failed"
    exit 1
}
echo "all agree"
