#!/bin/sh
# process.sh <vkrun> <folder>: closed descriptors, closed pipes and terminals, and FIFOs in the place of files.
set -u
vkrun=$1
temp=$2
scale=$(awk "BEGIN { print int(${SPLAT_TIMEOUT_SCALE:-1} + 1) }") # multiplies waits

fail() {
    echo "process: $*" >&2
    exit 1
}

rm -rf "$temp"
mkdir -p "$temp"
"$vkrun" data synth "$temp/data" --objects 2 --val 1 --test 0 --views 3 --size 16 > "$temp/log" || fail "no data"
options="--data $temp/data --set data.training_resolution=16 --set model.base_dim=8 --set model.num_blocks=1
    --set model.channel_mult=[1,2] --set model.attention_resolutions=[8] --set opt.batch_size=1
    --set opt.imgs_per_obj=2 --set logging.ckpt_iterations=0 --set model.opacity_bias=0"

# What is printed goes nowhere, and not into a file that got the number of a closed descriptor.
# shellcheck disable=SC2086  # a list of words
"$vkrun" train $options --out "$temp/closed" --set opt.iterations=3 <&- >&- 2>&- || fail "closed: status $?"
for file in metrics.jsonl log.txt run.json; do
    [ -s "$temp/closed/$file" ] || fail "no $file"
    grep -q '^step 1/' "$temp/closed/$file" && fail "progress in $file: $(cat "$temp/closed/$file")"
done
grep -v '^{.*}$' "$temp/closed/metrics.jsonl" && fail "metrics.jsonl holds more than JSON"
grep -a -l '^step 1/' "$temp"/closed/tb/* 2> /dev/null && fail "progress among the events"

# wait_for_step FILE PROCESS
wait_for_step() {
    for _ in $(seq $((600 * scale))); do
        grep -q '^step 1/' "$1" && return
        kill -0 "$2" 2> /dev/null || fail "the run ended: $(cat "$1")"
        sleep 0.1
    done
}

# A closed terminal.
# shellcheck disable=SC2086
"$vkrun" train $options --out "$temp/hup" --set opt.iterations=100000 > "$temp/hup.log" 2>&1 &
process=$!
wait_for_step "$temp/hup.log" "$process"
kill -HUP "$process"
wait "$process"
got=$?
[ "$got" -eq 130 ] || fail "SIGHUP: status $got: $(tail -n 3 "$temp/hup.log")"
ls "$temp"/hup/checkpoints/step_*.state.safetensors > "$temp/log" || fail "SIGHUP: no state"
# shellcheck disable=SC2086
(trap '' HUP; exec "$vkrun" train $options --out "$temp/nohup" --set opt.iterations=100000) > "$temp/nohup.log" 2>&1 &
process=$!
wait_for_step "$temp/nohup.log" "$process"
kill -HUP "$process"
sleep 0.5
grep -q 'location.reload' "$temp/nohup/report.html" || fail "the page of a running training does not load itself"
kill -INT "$process" 2> /dev/null || fail "SIGHUP ended a run that ignored it"
wait "$process"

# A closed pipe.
# shellcheck disable=SC2086
(timeout $((60 * scale)) "$vkrun" train $options --out "$temp/pipe" --set opt.iterations=100000 2>&1
 echo $? > "$temp/pipe.status") | head -n 1 > "$temp/log"
got=$(cat "$temp/pipe.status")
[ "$got" -eq 130 ] || fail "SIGPIPE: status $got"
ls "$temp"/pipe/checkpoints/step_*.state.safetensors > "$temp/log" || fail "SIGPIPE: no state"
sh -c "trap '' PIPE; sleep 0.5; exec \"$vkrun\" --help" 2> "$temp/help.err" | true
[ -s "$temp/help.err" ] && fail "a closed pipe: $(cat "$temp/help.err")"

# FIFOs without a writer.
mkfifo "$temp/fifo" "$temp/fifo.ply" "$temp/fifo.png" "$temp/fifo.yaml" "$temp/fifo.safetensors" "$temp/fifo.csv"
refused() {
    timeout $((10 * scale)) "$vkrun" "$@" > "$temp/log" 2>&1
    got=$?
    case $got in
        1 | 2 | 4) grep -q 'not a regular file' "$temp/log" || fail "$*: $(cat "$temp/log")" ;;
        *) fail "$*: status $got: $(cat "$temp/log")" ;;
    esac
}
refused inspect "$temp/fifo.ply"
refused convert "$temp/fifo.ply" "$temp/out.ply"
refused weights show "$temp/fifo.safetensors"
refused predict "$temp/fifo.png" --out "$temp/predicted"
refused train "$temp/fifo.yaml" --data "$temp/data" --out "$temp/other"
refused compare "$temp/fifo.csv" "$temp/fifo.csv"
echo "process: descriptors, SIGHUP, SIGPIPE, FIFOs"
