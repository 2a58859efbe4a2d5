#!/bin/sh
# disk_faults.sh <vkrun> <disk_faults.so> <folder> <cache>: everything that vkrun writes, on a disk that takes parts of
# what it is given, whose calls are interrupted, that is full, or that fails.
set -u
vkrun=$1
faults=$2
temp=$3
export XDG_CACHE_HOME=$4

fail() {
    echo "disk_faults: $*" >&2
    exit 1
}

# faulty KIND:N FOLDER ARGUMENT...: vkrun while writes below the folder fail; its output is in $temp/log.
faulty() {
    where=$1:$2
    shift 2
    LD_PRELOAD=$faults DISK_FAULTS=$where "$vkrun" "$@" > "$temp/log" 2>&1
}

# good ARGUMENT...
good() {
    "$vkrun" "$@" > "$temp/log" 2>&1 || fail "vkrun $*: $(cat "$temp/log")"
}

no_temporaries() {
    left=$(find "$1" -name '*.tmp*' -o -name '*.part')
    [ -z "$left" ] || fail "$2 left $left"
}

# A file is replaced as a whole or not at all: writes_file FILE ARGUMENT... where the arguments write the file.
writes_file() {
    file=$1
    shift
    folder=$(dirname "$file")
    rm -rf "$folder" "$temp/want"
    mkdir -p "$folder"
    good "$@"
    mv "$file" "$temp/want"
    faulty rough:0 "$folder" "$@" || fail "parts and signals: $*: $(cat "$temp/log")"
    cmp "$file" "$temp/want" || fail "parts and signals: another $file"
    for kind in full error; do
        failures=0
        for n in 1 2 3 4 5 6 7 8 9 10 11 12; do
            echo "the earlier file" > "$file"
            if faulty $kind:$n "$folder" "$@"; then
                cmp "$file" "$temp/want" || fail "$kind:$n: another $file"
                break
            fi
            failures=$((failures + 1))
            [ "$(cat "$file")" = "the earlier file" ] || fail "$kind:$n: $file is no longer the earlier one"
            grep -q "$(basename "$file")" "$temp/log" || fail "$kind:$n: no $file in: $(cat "$temp/log")"
            no_temporaries "$folder" "$kind:$n"
        done
        [ "$failures" -gt 0 ] || fail "$kind: $* did not fail"
    done
    echo "$(basename "$file"): whole after parts and signals, whole or the earlier one on a bad disk"
}

# A folder is complete after $AGAIN, or the same command with $ANEW, has run: writes_folder FOLDER FILES ARGUMENT...
# where FILES, a pattern, are those that depend on the arguments only. A command may also warn of a file and go on.
writes_folder() {
    folder=$1
    files=$2
    shift 2
    rm -rf "$folder" "$temp/want"
    good "$@"
    mv "$folder" "$temp/want"
    faulty rough:0 "$folder" "$@" || fail "parts and signals: $*: $(cat "$temp/log")"
    same "parts and signals"
    for kind in full error; do
        failures=0
        for n in $COUNTS; do
            rm -rf "$folder"
            if ! faulty $kind:$n "$folder" "$@"; then
                failures=$((failures + 1))
                grep -q "$folder/" "$temp/log" || fail "$kind:$n: no file is named in: $(cat "$temp/log")"
                no_temporaries "$folder" "$kind:$n"
                # shellcheck disable=SC2086  # lists of words
                [ -n "$AGAIN" ] && "$vkrun" $AGAIN > "$temp/log" 2>&1 || good "$@" $ANEW
            elif ! same "" && ! grep -q "warning: .*$folder" "$temp/log"; then
                fail "$kind:$n: a file is missing, and no error says so: $(cat "$temp/log")"
            fi
            no_temporaries "$folder" "$kind:$n"
            same "$kind:$n"
        done
        [ "$failures" -gt 0 ] || fail "$kind: $* did not fail"
    done
    echo "$(basename "$folder"): complete when repeated after a bad disk"
}

# same WHAT: the files that were made are those that were wanted. Without WHAT it only says so.
same() {
    for want in $(cd "$temp/want" && find . -path "./$files" -type f); do
        cmp -s "$temp/want/$want" "$folder/$want" && continue
        [ -z "$1" ] && return 1
        fail "$1: $want differs or is missing"
    done
}

rm -rf "$temp"
mkdir -p "$temp"
{
    echo 'ply
format ascii 1.0
element vertex 300'
    for name in x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3; do
        echo "property float $name"
    done
    echo end_header
    awk 'BEGIN { for (i = 0; i < 300; ++i) print i % 7, i % 11, i % 13, 0.1, 0.2, 0.3, 1, -2, -2, -2, 1, 0, 0, 0 }'
} > "$temp/scene.ply"
weights=$(dirname "$0")/../golden/net/ckpt.pth
out=$temp/out

for name in scene.ply scene.splat scene.spz; do
    writes_file "$out/$name" convert "$temp/scene.ply" "$out/$name" --overwrite
done
for name in state.safetensors state.npz state.pth; do
    writes_file "$out/$name" weights convert "$weights" "$out/$name" --overwrite
done
cp "$temp/scene.ply" "$temp/view.ply"
writes_file "$out/page.html" view "$temp/view.ply" --out "$out/page.html" --overwrite --stills 0

COUNTS="1 2 5 11 23" AGAIN= ANEW=
writes_folder "$out/data" '*' data synth "$out/data" --objects 1 --val 0 --test 1 --views 2 --test-views 2 --size 8
mv "$temp/want" "$temp/data"
writes_folder "$out/maps" '*' priors edges "$temp/data/srn_cars" --format npy --out "$out/maps"
writes_folder "$out/store" '*' data import "$temp/data" "$out/store"

writes_folder "$out/images" '*' data export "$temp/data" "$out/images" --to images --split test

COUNTS="1 2 3 5 9 17 33" AGAIN="train --out $out/run --resume" ANEW=--overwrite
writes_folder "$out/run" '*.safetensors' train --data "$temp/data" --out "$out/run" --set data.training_resolution=8 \
    --set model.base_dim=8 --set model.num_blocks=1 --set "model.channel_mult=[1]" \
    --set "model.attention_resolutions=[8]" --set opt.batch_size=1 --set opt.imgs_per_obj=1 --set opt.iterations=2 \
    --set model.opacity_bias=0 --set logging.ckpt_iterations=1 --set logging.val_views=1
mv "$temp/want" "$temp/run"
faulty full:1 "$temp/run" train --out "$temp/run" --resume --set opt.iterations=4
[ $? -eq 1 ] || fail "a training on a full disk: another status than 1: $(cat "$temp/log")"
[ -z "$(grep -v '^{.*}$' "$temp/run/metrics.jsonl")" ] || fail "metrics.jsonl holds more than JSON"

"$vkrun" render "$temp/scene.ply" --orbit 6 --size 24x16 --out "$temp/photos" --convention gsplat > "$temp/log" 2>&1 ||
    fail "no photographs: $(cat "$temp/log")"
COUNTS="2 9" AGAIN="fit --out $out/run --resume" ANEW=--overwrite
writes_folder "$out/run" '*.safetensors' fit "$temp/photos" --out "$out/run" --steps 20 --max-gaussians 300

COUNTS="1 2 3 4 5" AGAIN= ANEW=
writes_folder "$out/eval" '*.txt' eval "$temp/run/weights_last.safetensors" --data "$temp/data" --out "$out/eval"
writes_folder "$out/predict" '*.ply' predict --data "$temp/data" --split test --views 1 --out "$out/predict" \
    --weights "$temp/run/weights_last.safetensors"
writes_folder "$out/orbit" '*' render "$temp/scene.ply" --orbit 2 --size 16x16 --out "$out/orbit" --overwrite
for kind in png gif webp; do
    writes_file "$out/orbit.$kind" render "$temp/scene.ply" --orbit 2 --size 16x16 --out "$temp/orbit" --overwrite \
        --animate "$out/orbit.$kind"
done

# Without a place for its compiled kernels a command works, only slower, and leaves nothing half.
for disk in rough:0 full:1 full:2 error:1; do
    rm -rf "$out"
    mkdir -p "$out"
    XDG_CACHE_HOME=$out faulty $disk "$out/libsplat" render "$temp/scene.ply" --orbit 1 --size 16x16 \
        --out "$temp/cached" --overwrite || fail "the cache, $disk: $(cat "$temp/log")"
    left=$(find "$out/libsplat" -type f ! -name '*.bin' ! -name '*.tested')
    [ -z "$left" ] || fail "the cache, $disk, left $left"
    [ $disk = rough:0 ] || continue
    ls "$out"/libsplat/*.bin > "$temp/log" || fail "no cache after parts and signals"
done
echo "the pipeline cache: whole or none"
