#!/bin/sh
# Usage: tests/interop/gltf_validator.sh COMPARE_SCENES
#
# Validates our .gltf and .glb with Khronos' validator, which does not know KHR_gaussian_splatting: gltf_validator.mjs
# has the codes that this gives, and no other one may come. Needs node 18 or newer and npm, which fetches the pinned
# package; set GLTF_VALIDATOR to the folder of an installed one to fetch nothing. Exit status 77: skipped, with the
# reason.
set -eu

package=gltf-validator@2.0.0-dev.3.10
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT INT TERM

skip() {
    echo "skipped: $*"
    exit 77
}

command -v node >/dev/null 2>&1 || skip "node is not installed"
validator=${GLTF_VALIDATOR:-}
if [ -z "$validator" ]; then
    command -v npm >/dev/null 2>&1 || skip "npm is not installed"
    npm install --prefix "$work/client" --ignore-scripts --no-audit --no-fund "$package" >"$work/npm.log" 2>&1 ||
        skip "npm could not install $package: $(tail -n 1 "$work/npm.log")"
    validator="$work/client/node_modules/gltf-validator"
fi
"$1" write "$work"
node "$(dirname "$0")/gltf_validator.mjs" "$validator" "$work/ours.glb" "$work/ours.gltf"
