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

"$vkrun" data import data store >/dev/null || fail "no store"
shards data import data store_of_shards
for split in train val test; do
    for file in store/$split/*.npy store/$split/store.json; do
        cmp "$file" "store_of_shards/$split/${file##*/}" || fail "the stores differ"
    done
done

"$vkrun" train --data data --out run --set data.training_resolution=16 --set model.base_dim=8 --set model.num_blocks=1 \
    --set 'model.channel_mult=[1,2]' --set 'model.attention_resolutions=[8]' --set opt.batch_size=2 \
    --set opt.imgs_per_obj=2 --set opt.iterations=2 >train.log 2>&1 || fail "no weights: $(tail -n 3 train.log)"
"$vkrun" eval run/weights_last.safetensors --data data --out eval >/dev/null || fail "no scores"
shards eval run/weights_last.safetensors --data data --out eval_of_shards
grep -q '^5 objects of' out.log || fail "no shard merged the five objects: $(cat out.log)"
cmp eval/scores.txt eval_of_shards/scores.txt || fail "the scores differ"
# All but the times, which are the last two columns.
cut -d , -f 1-9 eval/per_object.csv >whole.csv
cut -d , -f 1-9 eval_of_shards/per_object.csv >merged.csv
cmp whole.csv merged.csv || fail "the tables differ"
grep -v _per_second eval/results.json >whole.json
grep -v _per_second eval_of_shards/results.json >merged.json
cmp whole.json merged.json || fail "the results differ"
"$vkrun" compare eval eval_of_shards >/dev/null || fail "the merged scores cannot be compared"

# A shard alone says what is missing; scores of other data do not merge.
"$vkrun" eval run/weights_last.safetensors --data data --out alone --shard 1/3 >out.log 2>&1 || fail "$(cat out.log)"
grep -q 'shard 1 of 3 is scored; not yet: 0, 2' out.log || fail "$(cat out.log)"
[ ! -e alone/results.json ] || fail "one of three shards wrote the results"
mkdir -p alone/shard_0_of_3 && cp alone/shard_1_of_3/objects.json alone/shard_0_of_3/
sed 's/"split": "test"/"split": "val"/' alone/shard_1_of_3/objects.json >alone/shard_0_of_3/objects.json
"$vkrun" eval run/weights_last.safetensors --data data --out alone --shard 2/3 >out.log 2>&1
[ $? -eq 4 ] || fail "scores of another split merged: $(cat out.log)"
grep -q "has scores of split 'val', expected 'test'" out.log || fail "$(cat out.log)"
"$vkrun" eval run/weights_last.safetensors --data data --out alone --shard 3/3 >out.log 2>&1
[ $? -eq 2 ] || fail "there is no shard 3 of 3: $(cat out.log)"
rm -rf "$work"
