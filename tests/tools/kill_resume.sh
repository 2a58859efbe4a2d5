#!/bin/sh
# kill_resume.sh <vkrun> <folder> [train|fit [kills]]: runs that are killed repeatedly, at random moments of steps and
# of saving, must end with the results of an uninterrupted one.
set -u
vkrun=$1
temp=$2
task=${3:-train}
kills=${4:-20}

fail() {
    echo "kill_resume: $*" >&2
    exit 1
}

rm -rf "$temp"
mkdir -p "$temp"
if [ "$task" = train ]; then
    "$vkrun" data synth "$temp/data" --objects 3 --views 4 --size 16 || fail "no data"
    # Twelve steps per kill, and a state after each, so that many kills hit one being written.
    options="--data $temp/data --set data.training_resolution=16 --set model.base_dim=8 --set model.num_blocks=1
        --set model.channel_mult=[1,2] --set model.attention_resolutions=[8] --set opt.batch_size=2
        --set opt.imgs_per_obj=2 --set opt.iterations=$((12 * kills)) --set logging.ckpt_iterations=1"
    results=weights_last.safetensors
else
    awk 'BEGIN {
        print "ply\nformat ascii 1.0\nelement vertex 40"
        split("x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3", names)
        for (i = 1; i <= 14; ++i) print "property float " names[i]
        print "end_header"
        for (i = 0; i < 40; ++i)
            print sin(i), sin(2.7 * i), cos(1.9 * i), sin(3 * i), cos(5 * i), sin(7 * i), 2, -2, -1.6, -2.2, 1, 0, 1, 0
    }' > "$temp/scene.ply"
    "$vkrun" render "$temp/scene.ply" --orbit 16 --size 66x50 --out "$temp/data" --convention gsplat > "$temp/log" ||
        fail "no data"
    # A state after each fifth, with growth in between.
    options="$temp/data --steps 600 --max-gaussians 1500"
    results="gaussians_last.safetensors scene.ply"
fi
begun=$(date +%s.%N)
# shellcheck disable=SC2086  # a list of words
"$vkrun" "$task" $options --out "$temp/whole" > "$temp/whole.log" 2>&1 || fail "the whole run failed"
longest=$(echo "$begun $(date +%s.%N)" | awk '{ print $2 - $1 }')
# shellcheck disable=SC2086
(cd "$temp/whole" && sha256sum $results) > "$temp/sums"

begin() {
    if ls "$temp"/killed/checkpoints/step_*.state.safetensors > /dev/null 2>&1; then
        "$vkrun" "$task" --out "$temp/killed" --resume >> "$temp/killed.log" 2>&1 &
    else # killed before its first state
        # shellcheck disable=SC2086
        "$vkrun" "$task" $options --out "$temp/killed" --overwrite >> "$temp/killed.log" 2>&1 &
    fi
}
ended() {
    (cd "$temp/killed" && sha256sum -c "$temp/sums") > "$temp/log" 2>&1 || fail "other results: $(cat "$temp/log")"
    runs=$((runs + 1))
}

runs=0
done=0
# shellcheck disable=SC2046  # a list of words
set -- $(awk -v count=$((10 * kills)) -v longest="$longest" 'BEGIN {
    srand(54)
    for (i = 0; i < count; ++i) print longest * rand() # starting takes about a second
}')
while [ "$done" -lt "$kills" ]; do
    [ "$#" -gt 0 ] || fail "most runs ended before they were killed"
    begin
    sleep "$1"
    shift
    kill -9 $! 2> /dev/null
    wait $! 2> /dev/null
    status=$?
    case $status in
        137) done=$((done + 1)) ;;
        0)
            ended
            rm -rf "$temp/killed"
            ;;
        *) fail "status $status: $(tail -n 3 "$temp/killed.log")" ;;
    esac
done
begin
wait $! || fail "the last run failed: $(tail -n 3 "$temp/killed.log")"
ended
resumed=$(grep -c '^resumed from' "$temp/killed.log")
[ "$resumed" -gt 0 ] || fail "nothing was resumed"
echo "kill_resume: $done kills, $resumed resumed, $runs runs to their end, with the same results"
