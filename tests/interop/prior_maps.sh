#!/bin/sh
# prior_maps.sh <vkrun> <write_onnx_samples> <folder>: maps of pictures and of a data set by sample models, stopped and
# resumed, in shards, and what is refused. ONNX Runtime is in SPLAT_ONNXRUNTIME_LIBRARY (onnx.sh).
set -u
vkrun=$1
samples=$2
temp=$3

fail() {
    echo "prior_maps: $*" >&2
    exit 1
}

# expect <exit status> <part of the output> <argument>...
expect() {
    status=$1
    part=$2
    shift 2
    "$vkrun" priors "$@" >"$temp/out" 2>&1
    got=$?
    [ "$got" -eq "$status" ] || fail "vkrun priors $*: exit status $got, expected $status: $(cat "$temp/out")"
    grep -q -- "$part" "$temp/out" || fail "vkrun priors $*: no '$part' in: $(cat "$temp/out")"
}

rm -rf "$temp"
mkdir -p "$temp/models" "$temp/photos"
"$samples" "$temp/models" u2net isnet-general-use midas-small-hub moge-2-vits || fail "no models"
"$vkrun" data synth "$temp/data" --objects 2 --val 1 --views 6 --test-views 4 --size 32 >/dev/null || fail "no data"
cp "$temp"/data/srn_cars/cars_train/*/rgb/000000.png "$temp/photos/a.png" 2>/dev/null ||
    cp "$(find "$temp/data" -path '*rgb*' -name 000000.png | head -n 1)" "$temp/photos/a.png"
cp "$temp/photos/a.png" "$temp/photos/b.png"

# A picture, a folder, every map in one pass, each format.
expect 0 "maps of 1 pictures made" mask "$temp/photos/a.png" --out "$temp/one" --model "$temp/models/u2net.onnx"
[ -f "$temp/one/mask/a.png" ] || fail "no mask"
expect 0 "maps of 2 pictures made" depth "$temp/photos" --out "$temp/all" --preset moge-2-vits --all \
    --model "$temp/models/moge-2-vits.onnx"
for map in depth normal mask; do [ -f "$temp/all/$map/b.png" ] || fail "no $map"; done
for format in png16 npy; do
    expect 0 "maps of 2 pictures made" normal "$temp/photos" --out "$temp/$format" --preset moge-2-vits \
        --model "$temp/models/moge-2-vits.onnx" --format "$format"
done
od -An -tu1 -j 24 -N 1 "$temp/png16/normal/a.png" | grep -q 16 || fail "png16 has no 16 bits"
head -c 6 "$temp/npy/normal/a.npy" | grep -q NUMPY || fail "npy is none"

# A data set: killed at any moment, then repeated, it is the same as without a kill.
make="depth $temp/data/srn_cars --preset midas-small-hub --model $temp/models/midas-small-hub.onnx
    --batch 1 --threads 1"
# shellcheck disable=SC2086  # a list of words
expect 0 "maps of 16 pictures made, 0 kept" $make --out "$temp/whole"
kills=0
while [ $kills -lt 6 ]; do
    # shellcheck disable=SC2086
    "$vkrun" priors $make --out "$temp/killed" >/dev/null 2>&1 &
    random=$(od -An -N1 -tu1 /dev/urandom | tr -d ' ')
    sleep "0.$((random % 9))"
    kill -9 $! 2>/dev/null
    wait $! 2>/dev/null
    # What is there is whole.
    for file in $(find "$temp/killed" -name '*.png' 2>/dev/null); do
        cmp -s "$file" "$temp/whole/${file#"$temp/killed/"}" || fail "$file is a part of a map"
    done
    kills=$((kills + 1))
done
# shellcheck disable=SC2086
expect 0 "pictures made" $make --out "$temp/killed"
# shellcheck disable=SC2086
expect 0 "maps of 0 pictures made, 16 kept" $make --out "$temp/killed"
for i in 0 1 2; do
    # shellcheck disable=SC2086
    expect 0 "pictures made" $make --out "$temp/shards" --shard $i/3
done
diff -r "$temp/whole" "$temp/killed" || fail "the resumed maps differ"
diff -r "$temp/whole" "$temp/shards" || fail "the maps of shards differ"
# Into the data set itself, where they replace the exact ones; the set stays valid.
# shellcheck disable=SC2086
expect 0 "maps of 0 pictures made, 16 kept" $make --out "$temp/data/srn_cars"
# shellcheck disable=SC2086
expect 0 "maps of 16 pictures made" $make --out "$temp/data/srn_cars" --overwrite
"$vkrun" data check "$temp/data" >"$temp/out" 2>&1 || fail "the data set is broken: $(cat "$temp/out")"

# A prediction whose object the network cuts out: without alpha, by option and by environment.
# predict <expected mask> <argument>...
predict() {
    mask=$1
    shift
    rm -rf "$temp/scene"
    "$vkrun" predict "$@" --views 1 --out "$temp/scene" >"$temp/out" 2>&1 || fail "vkrun predict $*: $(cat "$temp/out")"
    grep -q "<th>Object found by</th><td>$mask</td>" "$temp/scene/report.html" ||
        fail "vkrun predict $*: not cut out by $mask"
}
predict "network u2net" "$temp/photos/a.png" --mask-preset u2net --mask-model "$temp/models/u2net.onnx"
SPLAT_MASK_MODEL=$temp/models/u2net.onnx
export SPLAT_MASK_MODEL
predict "network u2net" "$temp/photos/a.png"
unset SPLAT_MASK_MODEL
predict "border" "$temp/photos/a.png"
# An alpha of 255 everywhere finds nothing: a blue rectangle on white, with four channels.
echo "iVBORw0KGgoAAAANSUhEUgAAACAAAAAgCAYAAABzenr0AAAANklEQVR42u3VsQkAQAgDwOy/tD+CIMiDXCBdiuuS+pwAAAAAALSDzAoA
AABwB+ALAAAAALbzAPLR2ev1YCSgAAAAAElFTkSuQmCC" | base64 -d >"$temp/opaque.png"
predict "border" "$temp/opaque.png"
predict "network u2net" "$temp/opaque.png" --mask-model "$temp/models/u2net.onnx"
# A mask of everything is left out: the sample model sees but one red pixel on green, beside a blue rectangle.
echo "iVBORw0KGgoAAAANSUhEUgAAACAAAAAgCAIAAAD8GO2jAAAAMUlEQVR42mNg+M9AWzRqwagFoxYMawuIN2PUgmFlAUh4NIiGkQWjhd2o
BaMWjFoARwCtAvwuoklFjQAAAABJRU5ErkJggg==" | base64 -d >"$temp/green.png"
predict "border" "$temp/green.png" --mask-model "$temp/models/u2net.onnx"
grep -q "warning: the mask of the network u2net was not used: 99[.0-9]* % of the picture" "$temp/out" ||
    fail "no warning: $(cat "$temp/out")"
# A model that is where 'vkrun priors where' says is used unasked; without ONNX Runtime there is a warning instead.
SPLAT_PRIORS_DIR=$temp/at_hand
export SPLAT_PRIORS_DIR
mkdir "$temp/at_hand"
predict "border" "$temp/photos/a.png"
cp "$temp/models/moge-2-vits.onnx" "$temp/at_hand/moge-2-vits-normal.onnx" # no mask of the object
predict "border" "$temp/photos/a.png"
cp "$temp/models/u2net.onnx" "$temp/at_hand/"
predict "network u2net" "$temp/photos/a.png"
(
    SPLAT_ONNXRUNTIME_LIBRARY=/nowhere/ort.so
    export SPLAT_ONNXRUNTIME_LIBRARY
    predict "border" "$temp/photos/a.png"
    grep -q "mask model u2net is at hand, but was not used: " "$temp/out" || fail "no warning: $(cat "$temp/out")"
) || exit 1
unset SPLAT_PRIORS_DIR
"$vkrun" predict "$temp/photos/a.png" --whole --mask-preset u2net --out "$temp/scene" >"$temp/out" 2>&1 &&
    fail "--whole and --mask-preset go together"
grep -q "without --mask and --whole" "$temp/out" || fail "$(cat "$temp/out")"

# Refused, with a sentence.
expect 2 "name a model" depth "$temp/photos" --out "$temp/none"
expect 2 "makes no depth maps" depth "$temp/photos" --out "$temp/none" \
    --model "$temp/models/u2net.onnx"
expect 2 "the maps there are others" mask "$temp/photos/a.png" --out "$temp/one" --preset isnet-general-use \
    --model "$temp/models/isnet-general-use.onnx"
cp "$temp/models/u2net.onnx" "$temp/models/renamed.onnx"
expect 2 "the maps there are others" mask "$temp/photos/a.png" --out "$temp/one" --preset u2net \
    --model "$temp/models/renamed.onnx"
expect 2 "expected I/N" mask "$temp/photos" --out "$temp/none" --shard 3/3
expect 7 "a.png' to '.*output 'y' is " mask "$temp/photos" --out "$temp/nan" --preset u2net \
    --model "$temp/models/nan.onnx"
expect 4 "expects 320 x 320 pixels" mask "$temp/photos" --out "$temp/none" --preset u2net \
    --model "$temp/models/isnet-general-use.onnx"
head -c 200 "$temp/models/u2net.onnx" >"$temp/models/cut.onnx"
expect 4 "ONNX Runtime refuses the model" mask "$temp/photos" --out "$temp/none" --preset u2net \
    --model "$temp/models/cut.onnx"
# One picture of two is damaged: the other gets its mask.
head -c 100 "$temp/photos/b.png" >"$temp/photos/b.part" && mv "$temp/photos/b.part" "$temp/photos/b.png"
expect 4 "maps of 1 pictures made, 0 kept, 1 failed" mask "$temp/photos" --out "$temp/half" --preset u2net \
    --model "$temp/models/u2net.onnx"
grep -q "b.png" "$temp/out" || fail "the damaged picture is not named"
export SPLAT_ONNXRUNTIME_LIBRARY=/nowhere/ort.so
expect 4 "SPLAT_ONNXRUNTIME_LIBRARY is '/nowhere/ort.so'" mask "$temp/photos" --out "$temp/none" --preset u2net \
    --model "$temp/models/u2net.onnx"
echo "prior_maps: all as expected"
