#!/bin/sh
# train_guards.sh <vkrun> <folder>: a run belongs to one process at a time, may be resumed only with the
# configuration that its numbers depend on, and fails if it draws nothing.
set -u
vkrun=$1
temp=$2
scale=$(awk "BEGIN { print int(${SPLAT_TIMEOUT_SCALE:-1} + 1) }") # multiplies waits

fail() {
    echo "train_guards: $*" >&2
    exit 1
}

# expect STATUS SENTENCE ARGUMENT...: the status of 'vkrun train ARGUMENT...', and what it prints.
expect() {
    status=$1
    sentence=$2
    shift 2
    "$vkrun" train "$@" > "$temp/log" 2>&1
    got=$?
    [ "$got" -eq "$status" ] || fail "train $*: status $got, expected $status: $(tail -n 3 "$temp/log")"
    grep -q -e "$sentence" "$temp/log" || fail "train $*: no '$sentence' in: $(cat "$temp/log")"
}

rm -rf "$temp"
mkdir -p "$temp"
"$vkrun" data synth "$temp/data" --objects 2 --val 0 --test 0 --views 3 --size 16 > "$temp/log" || fail "no data"
options="--data $temp/data --set data.training_resolution=16 --set model.base_dim=8 --set model.num_blocks=1
    --set model.channel_mult=[1,2] --set model.attention_resolutions=[8] --set opt.batch_size=1
    --set opt.imgs_per_obj=2 --set logging.ckpt_iterations=0"

# shellcheck disable=SC2086  # a list of words
"$vkrun" train $options --out "$temp/run" --set model.opacity_bias=0 --set opt.iterations=100000000 \
    > "$temp/first" 2>&1 &
process=$!
for _ in $(seq $((600 * scale))); do
    grep -q '^note: ' "$temp/first" && break
    kill -0 "$process" 2> /dev/null || fail "the run ended: $(cat "$temp/first")"
    sleep 0.1
done
expect 2 "a run of process $process is open in it" --out "$temp/run" --resume
# shellcheck disable=SC2086
expect 2 "a run of process $process is open in it" $options --out "$temp/run" --overwrite
kill -INT "$process"
wait "$process"
[ $? -eq 130 ] || fail "an interrupted run did not end with 130: $(tail -n 3 "$temp/first")"
# What it said of its length, what it does, and what it left.
grep -q "^note: at [0-9.e-]* s a step, as measured on [0-9]* steps*, the other .* take [0-9]* [hd] " "$temp/first" ||
    fail "no length: $(cat "$temp/first")"
grep -q '^finishing step [0-9]*, saving$' "$temp/first" || fail "no 'finishing step': $(tail -n 3 "$temp/first")"
grep -q "^report: $temp/run/report.html$" "$temp/first" || fail "no report: $(tail -n 3 "$temp/first")"
step=$(sed -n 's/^interrupted after step \([0-9]*\);.*/\1/p' "$temp/first")
[ -n "$step" ] || fail "no 'interrupted after step': $(tail -n 3 "$temp/first")"

expect 2 "'opt.base_lr' is 0.5, but 5e-05 in the run" --out "$temp/run" --resume --set opt.base_lr=0.5
expect 2 "'opt.lora_finetune' is true, but false in the run" --out "$temp/run" --resume \
    --set opt.lora_finetune=true --set opt.lora_rank=2
echo '{"model": {"base_dim": 16}}' > "$temp/other.json"
expect 2 "'data.training_resolution' is 128, but 16 in the run" "$temp/other.json" --out "$temp/run" --resume
expect 0 "^opt.iterations 100000000 -> $((step + 1))$" --out "$temp/run" --resume --set opt.iterations=$((step + 1))
grep -q "^opt.iterations 100000000 -> " "$temp/run/log.txt" || fail "the change is not in log.txt"

# Gaussians that are too transparent to be drawn.
# shellcheck disable=SC2086
expect 7 "200 steps in a row drew nothing" $options --out "$temp/empty" --set model.opacity_bias=-30
grep -q "warning: step 20: 20 steps in a row drew nothing (no Gaussian is visible)" "$temp/log" || fail "no warning"
grep -q '"state": "nothing drawn"' "$temp/empty/run.json" || fail "run.json does not say it"
echo "train_guards: one process, $step steps, the same configuration"
