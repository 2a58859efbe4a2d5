#!/bin/sh
# Usage: tests/interop/onnx.sh FOLDER COMMAND...
#
# Runs a command with ONNX Runtime in SPLAT_ONNXRUNTIME_LIBRARY. Needs npm, which fetches the pinned package into FOLDER
# once; set SPLAT_ONNXRUNTIME_LIBRARY to fetch nothing. Exit status 77: skipped, with the reason.
set -eu

folder=$1
shift
here=$(dirname "$0")

skip() {
    echo "skipped: $*"
    exit 77
}
. "$here/npm_file.sh"

if [ -z "${SPLAT_ONNXRUNTIME_LIBRARY:-}" ]; then
    case $(uname -m) in
    x86_64) processor=x64 hash=ffb75a925ba05e47b235bb66e3e3911714a80b328a9c9425539feb204aa32a23 ;;
    aarch64) processor=arm64 hash= ;;
    *) skip "onnxruntime-node has no library for $(uname -m)" ;;
    esac
    SPLAT_ONNXRUNTIME_LIBRARY=$folder/libonnxruntime.so.1
    npm_file onnxruntime-node@1.30.0 "bin/napi-v6/linux/$processor/libonnxruntime.so.1" "$hash" \
        "$SPLAT_ONNXRUNTIME_LIBRARY"
    export SPLAT_ONNXRUNTIME_LIBRARY
fi
exec "$@"
