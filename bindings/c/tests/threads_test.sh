#!/bin/sh
# Run threads.c on a new data set.
#
#   threads_test.sh <program> <vkrun> <config.json>
set -eu
temp=$(mktemp -d)
trap 'rm -rf "$temp"' EXIT
"$2" data synth "$temp" --objects 2 --views 4 --size 16 --seed 1 >"$temp/synth.log"
cp "$3" "$temp/config.json"
"$1" "$temp"
