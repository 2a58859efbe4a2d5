#!/bin/sh
# Usage: tests/tables/vkrun_tables.sh VKRUN FOLDER
#
# Tables through the command line: a training from tables gives the weights of one from folders, images and meshes go
# to tables and back unchanged, and an import that is killed goes on. Needs DuckDB's library. Exit status 77: skipped.
set -u
vkrun=$1
work=$2

fail() {
    echo "vkrun_tables: $*" >&2
    exit 1
}

[ -e "${SPLAT_DUCKDB_LIBRARY:-}" ] || {
    echo "skipped: no DuckDB library: SPLAT_DUCKDB_LIBRARY names no file"
    exit 77
}
rm -rf "$work"
mkdir -p "$work"
cd "$work" || exit 1

"$vkrun" data synth data --objects 3 --val 1 --test 1 --views 4 --test-views 4 --size 16 || fail "no data"
"$vkrun" data export data tables || fail "no tables"
"$vkrun" data export tables back --to srn || fail "no folders"
sums() { (cd "$1" && find . -name '*.png' -o -name '*.txt' | LC_ALL=C sort | xargs cksum); }
[ "$(sums data/srn_cars)" = "$(sums back/srn_cars)" ] || fail "files differ after tables"

# Meshes that are drawn as tables, twice.
mkdir meshes
for i in 1 2; do
    printf 'v 0 0 0\nv 1 0 0\nv 0 0 1\nv 0 %d 0\nf 1 2 3\nf 1 2 4\nf 2 3 4\nf 3 1 4\n' "$i" >"meshes/corner$i.obj"
done
for _ in once again; do
    "$vkrun" data render meshes --out drawn --format tables --views 3 --test-views 2 --size 16 --splits 1,1,0 ||
        fail "meshes are no tables"
done
"$vkrun" data export drawn drawn_back --to srn --class objects || fail "no folders of meshes"
[ "$(sums drawn/renders/srn_objects)" = "$(sums drawn_back/srn_objects)" ] || fail "renders differ after tables"

# Eight steps with depth and normals, from folders, tables and a store.
"$vkrun" data import tables store || fail "no store"
for data in data tables store; do
    "$vkrun" train --data $data --out "run_$data" --set data.training_resolution=16 --set model.base_dim=8 \
        --set model.num_blocks=1 --set 'model.channel_mult=[1,2]' --set 'model.attention_resolutions=[8]' \
        --set data.use_pred_depth=true --set data.use_pred_normal=true --set opt.batch_size=2 \
        --set opt.imgs_per_obj=2 --set opt.iterations=8 >"$data.log" 2>&1 ||
        fail "training from $data: $(tail -n 3 "$data.log")"
done
for data in tables store; do
    cmp run_data/weights_last.safetensors "run_$data/weights_last.safetensors" ||
        fail "the weights of a training from $data differ"
done
"$vkrun" eval run_tables/weights_last.safetensors --data tables --split test --out eval >eval.log 2>&1 ||
    fail "eval: $(tail -n 3 eval.log)"

# A larger import, killed three times.
"$vkrun" data synth large --objects 12 --views 60 --size 256 >/dev/null || fail "no large data"
"$vkrun" data export large large_tables --split train >/dev/null || fail "no large tables"
"$vkrun" data import large_tables whole --split train || fail "no whole import"
for delay in 0.05 0.2 0.4; do
    "$vkrun" data import large_tables killed --split train &
    sleep $delay
    kill -9 $! 2>/dev/null
    wait $! 2>/dev/null
done
"$vkrun" data import large_tables killed --split train || fail "the import does not go on"
for file in whole/train/*.npy whole/train/store.json; do
    cmp "$file" "killed/train/${file##*/}" || fail "the import that was killed differs"
done

# What it says when it cannot.
"$vkrun" data import tables other --duckdb /nowhere.so 2>error.log && fail "no library, no error"
grep -q 'npm pack @duckdb/node-bindings' error.log || fail "no remedy in: $(cat error.log)"
"$vkrun" data import back other --format tables 2>error.log && fail "folders are no tables"
grep -q 'lacks tables' error.log || fail "no reason in: $(cat error.log)"
"$vkrun" data import tables other --size 8 2>error.log && fail "tables of another size"
grep -q 'tables are imported as they are' error.log || fail "no reason in: $(cat error.log)"
"$vkrun" data export data tables --size 8 2>error.log && fail "two exports in one folder"
grep -q 'holds another export' error.log || fail "no reason in: $(cat error.log)"
"$vkrun" data split data parts --val 0.34 --test 0 --seed 3 --to srn || fail "no split"
[ "$(ls parts/srn_cars/cars_train | wc -l)" = 2 ] && [ "$(ls parts/srn_cars/cars_val | wc -l)" = 1 ] ||
    fail "3 objects are not dealt 2 to 1"
rm -rf "$work"
