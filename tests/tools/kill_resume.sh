#!/bin/sh
# kill_resume.sh <vkrun> <folder> [kills]: a training that is killed repeatedly, at random moments of
# steps and of saving, must end with the weights of an uninterrupted one.
set -u
vkrun=$1
temp=$2
kills=${3:-20}

fail() {
    echo "kill_resume: $*" >&2
    exit 1
}

rm -rf "$temp"
mkdir -p "$temp"
"$vkrun" data synth "$temp/data" --objects 3 --views 4 --size 16 || fail "no data"
# Twelve steps per kill, and a state after each, so that many kills hit one being written.
steps=$((12 * kills))
options="--data $temp/data --set data.training_resolution=16 --set model.base_dim=8 --set model.num_blocks=1
    --set model.channel_mult=[1,2] --set model.attention_resolutions=[8] --set opt.batch_size=2
    --set opt.imgs_per_obj=2 --set opt.iterations=$steps --set logging.ckpt_iterations=1"
# shellcheck disable=SC2086  # a list of words
"$vkrun" train $options --out "$temp/whole" > "$temp/whole.log" 2>&1 || fail "the whole run failed"

# shellcheck disable=SC2086
"$vkrun" train $options --out "$temp/killed" > "$temp/killed.log" 2>&1 &
done=0
while [ "$done" -lt "$kills" ]; do
    process=$!
    random=$(od -An -N2 -tu2 /dev/urandom | tr -d ' ')
    sleep "$((random % 4)).$random" # starting takes about a second
    kill -9 "$process" 2> /dev/null || break
    wait "$process" 2> /dev/null
    done=$((done + 1))
    # Killed before its first state, it has to start again.
    if ls "$temp"/killed/checkpoints/step_*.state.safetensors > /dev/null 2>&1; then
        "$vkrun" train --out "$temp/killed" --resume >> "$temp/killed.log" 2>&1 &
    else
        # shellcheck disable=SC2086
        "$vkrun" train $options --out "$temp/killed" --overwrite >> "$temp/killed.log" 2>&1 &
    fi
done
wait $! || fail "the last run failed: $(tail -n 3 "$temp/killed.log")"
resumed=$(grep -c '^resumed from' "$temp/killed.log")
[ "$resumed" -gt 0 ] || fail "nothing was resumed"
cmp "$temp/whole/weights_last.safetensors" "$temp/killed/weights_last.safetensors" ||
    fail "the weights differ after $done kills"
echo "kill_resume: $done kills, $resumed resumed, the same weights after $steps steps"
