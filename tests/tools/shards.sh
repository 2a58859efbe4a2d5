#!/bin/sh
# Usage: tests/tools/shards.sh VKRUN FOLDER
#
# Four shards of each command that takes --shard, at once by GNU parallel, give what one process gives. Exit status 77:
# skipped, with the reason.
set -u
vkrun=$1
work=$2

fail() {
    echo "shards: $*" >&2
    exit 1
}

command -v parallel >/dev/null 2>&1 || {
    echo "skipped: GNU parallel is not installed (apt-get install parallel)"
    exit 77
}
rm -rf "$work"
mkdir -p "$work"
cd "$work" || exit 1
PARALLEL_HOME=$work
export PARALLEL_HOME

# shards <argument>...: shards 0/4 to 3/4 of a command.
shards() {
    seq 0 3 | parallel -j 4 --halt now,fail=1 "$vkrun" "$@" --shard '{}/4' >out.log 2>&1 ||
        fail "vkrun $*: $(tail -n 3 out.log)"
}

"$vkrun" data synth data --objects 6 --val 1 --test 5 --views 4 --test-views 4 --size 16 >/dev/null || fail "no data"

"$vkrun" priors edges data/srn_cars --out edges >/dev/null || fail "no edges"
shards priors edges data/srn_cars --out edges_of_shards
diff -r edges edges_of_shards || fail "the maps differ"

mkdir meshes
for i in 1 2 3 4 5 6; do
    printf 'v 0 0 0\nv 1 0 0\nv 0 0 1\nv 0 %d 0\nf 1 2 3\nf 1 2 4\nf 2 3 4\nf 3 1 4\n' "$i" >"meshes/corner$i.obj"
done
"$vkrun" data render meshes --out renders --views 3 --test-views 2 --size 16 >/dev/null || fail "no renders"
shards data render meshes --out renders_of_shards --views 3 --test-views 2 --size 16
diff -r renders renders_of_shards || fail "the renders differ"

"$vkrun" data import data store >/dev/null || fail "no store"
shards data import data store_of_shards
for split in train val test; do
    for file in store/$split/*.npy store/$split/store.json; do
        cmp "$file" "store_of_shards/$split/${file##*/}" || fail "the stores differ"
    done
done

# train <folder> <argument>...: a small network.
train() {
    folder=$1
    shift
    "$vkrun" train --data data --out "$folder" --set data.training_resolution=16 --set model.base_dim=8 \
        --set model.num_blocks=1 --set 'model.channel_mult=[1,2]' --set 'model.attention_resolutions=[8]' \
        --set opt.batch_size=2 --set opt.imgs_per_obj=2 --set opt.iterations=2 "$@" >train.log 2>&1 ||
        fail "no weights: $(tail -n 3 train.log)"
}
train run
"$vkrun" eval run/weights_last.safetensors --data data --out eval >/dev/null || fail "no scores"
shards eval run/weights_last.safetensors --data data --out eval_of_shards
grep -q '^5 objects of' out.log || fail "no shard merged the five objects: $(cat out.log)"
cmp eval/scores.txt eval_of_shards/scores.txt || fail "the scores differ"
# All but the times, which are the last two columns.
cut -d , -f 1-9 eval/per_object.csv >whole.csv
cut -d , -f 1-9 eval_of_shards/per_object.csv >merged.csv
cmp whole.csv merged.csv || fail "the tables differ"
cmp eval/per_image.csv eval_of_shards/per_image.csv || fail "the tables of images differ"
page() { sed 's/[0-9.]* ms//g' "$1/report.html"; }
[ "$(page eval)" = "$(page eval_of_shards)" ] || fail "the pages differ"
grep -v _per_second eval/results.json >whole.json
grep -v _per_second eval_of_shards/results.json >merged.json
cmp whole.json merged.json || fail "the results differ"
"$vkrun" compare eval eval_of_shards >/dev/null || fail "the merged scores cannot be compared"

# A shard alone says what is missing; scores of other data or options do not merge.
"$vkrun" eval run/weights_last.safetensors --data data --out alone --shard 1/3 >out.log 2>&1 || fail "$(cat out.log)"
grep -q 'shard 1 of 3 is scored; not yet: 0, 2' out.log || fail "$(cat out.log)"
[ ! -e alone/results.json ] || fail "one of three shards wrote the results"
cp -r alone/shard_1_of_3 alone/shard_0_of_3
sed 's/"split": "test"/"split": "val"/' alone/shard_1_of_3/objects.json >alone/shard_0_of_3/objects.json
"$vkrun" eval run/weights_last.safetensors --data data --out alone --shard 2/3 >out.log 2>&1
[ $? -eq 4 ] || fail "scores of another split merged: $(cat out.log)"
grep -q "has scores of split 'val', expected 'test'" out.log || fail "$(cat out.log)"
# refuse_options <part of the message> <argument>...: shard 1 of 2 with these arguments beside shard 0 without.
refuse_options() {
    expected=$1
    shift
    "$vkrun" eval run/weights_last.safetensors --data data --out options --shard 1/2 "$@" >out.log 2>&1
    [ $? -eq 4 ] || fail "scores with other options than $* merged: $(cat out.log)"
    grep -qF "$expected" out.log || fail "$* gave: $(cat out.log)"
    [ ! -e options/results.json ] || fail "scores of two kinds were put together"
}
"$vkrun" eval run/weights_last.safetensors --data data --out options --shard 0/2 >out.log 2>&1 || fail "$(cat out.log)"
refuse_options "'options/shard_0_of_2' has scores of --views 0, expected 2 as in shard 1" --views 2
refuse_options "'options/shard_0_of_2' has scores of --objects 0, expected 4 as in shard 1" --objects 4
refuse_options "'options/shard_0_of_2' has scores of --set [], expected [\"data.zfar=2\"] as in shard 1" \
    --set data.zfar=2
train adapted --set opt.lora_finetune=true --set opt.ema.use=false
"$vkrun" weights lora-extract adapted/weights_last.safetensors adapters.safetensors \
    --config adapted/config.json >out.log 2>&1 || fail "$(cat out.log)"
refuse_options "'options/shard_0_of_2' has scores of --adapters \"\", expected \"adapters.safetensors\" as in shard 1" \
    --adapters adapters.safetensors
rm options/shard_0_of_2/settings.json
refuse_options "'options/shard_0_of_2/settings.json' has no --adapters: score that shard again"
"$vkrun" eval run/weights_last.safetensors --data data --out options --shard 0/2 >out.log 2>&1 || fail "$(cat out.log)"
[ -e options/results.json ] || fail "two shards with the same options did not merge"

"$vkrun" eval run/weights_last.safetensors --data data --out alone --shard 3/3 >out.log 2>&1
[ $? -eq 2 ] || fail "there is no shard 3 of 3: $(cat out.log)"
rm -rf "$work"
