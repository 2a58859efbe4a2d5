#!/bin/sh
# Usage: tests/interop/gltf_viewers.sh VKRUN NPM_FOLDER TEMP
#
# Runs gltf_viewers.mjs, the test of our .glb in viewers of others, with Debian's Chromium; CHROMIUM names another.
# Needs node 18 or newer and npm, which once fetches the pinned packages into NPM_FOLDER. Exit status 77: skipped, with
# the reason.
set -eu

packages="babylonjs@9.28.0 babylonjs-loaders@9.28.0 three@0.187.0"
client=$2/gltf_viewers

. "$(dirname "$0")/browser.sh"
if [ ! -f "$client/complete" ]; then
    command -v npm >/dev/null 2>&1 || skip "npm is not installed"
    mkdir -p "$client"
    # shellcheck disable=SC2086
    npm install --prefix "$client" --ignore-scripts --no-audit --no-fund $packages >"$client/npm.log" 2>&1 ||
        skip "npm could not install $packages: $(tail -n 1 "$client/npm.log")"
    touch "$client/complete"
fi
exec node "$(dirname "$0")/gltf_viewers.mjs" "$chromium" "$1" "$client" "$3"
