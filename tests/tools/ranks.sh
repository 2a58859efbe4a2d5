#!/bin/sh
# ranks.sh <case> <kind> <vkrun> <rank_calls> <disk_faults> <folder>: vkrun under mpirun of an MPI, openmpi or mpich.
#
#   calls      the calls of the plugin
#   training   one and two ranks have the same bits; what is refused
#   resuming   1, 2 and 4 ranks have the same bits, also of adapters, and after a run of other ranks was interrupted
#   endings    a full disk, a rank that hangs, a folder in use, ranks that differ
#   kills      20 kills of a random rank at a random moment
#
# Exit status 77: skipped, with the reason.
set -u
kind=$2
vkrun=$3
rank_calls=$4
faults=$5
temp=$6
scale=$(awk "BEGIN { print int(${SPLAT_TIMEOUT_SCALE:-1} + 1) }") # multiplies waits
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
# Ranks share the cores: more threads each would only wait for each other.
export LP_NUM_THREADS=1

fail() {
    echo "ranks: $*" >&2
    exit 1
}

plugin=$(dirname "$vkrun")/libvkrun-mpi-$kind.so
[ -e "$plugin" ] || {
    echo "skipped: vkrun was built without $kind (apt-get install libopenmpi-dev openmpi-bin libmpich-dev mpich)"
    exit 77
}
case $kind in openmpi) says="Open MPI" ;; mpich) says=HYDRA ;; esac
mpirun=
for program in "mpirun.$kind" mpirun; do
    if [ -z "$mpirun" ] && "$program" --version 2> /dev/null | grep -q "$says"; then mpirun=$program; fi
done
[ -n "$mpirun" ] || {
    echo "skipped: there is no mpirun of $kind"
    exit 77
}
[ "$kind" = mpich ] || mpirun="$mpirun --oversubscribe"
rm -rf "$temp"
mkdir -p "$temp"

# ranks COUNT COMMAND...: its output is in $temp/log.
ranks() {
    count=$1
    shift
    # shellcheck disable=SC2086  # a list of words
    timeout $((120 * scale)) $mpirun -n "$count" "$@" > "$temp/log" 2>&1
}

# expect STATUS SENTENCE: what the last ranks had and said.
expect() {
    [ "$got" -eq "$1" ] || fail "status $got, expected $1: $(cat "$temp/log")"
    grep -q -e "$2" "$temp/log" || fail "no '$2' in: $(cat "$temp/log")"
}

calls() {
    ranks 4 "$rank_calls" "$plugin" exchange broadcast barrier
    got=$?
    expect 0 "^barrier: 4 ranks by "
    ranks 4 "$rank_calls" "$plugin" timeout
    got=$?
    expect 7 "^timeout: no answer within 1 s (--rank-timeout)"
    ranks 4 "$rank_calls" "$plugin" end_all
    got=$?
    expect 7 "^rank 1 ends all"
}

# Dropout, terms of scales and averages: what ranks must not do differently. Steps have four slices.
make_data() {
    "$vkrun" data synth "$temp/data" --objects 6 --val 1 --test 0 --views 3 --size 16 > "$temp/log" || fail "no data"
}
options="--data $temp/data --set data.training_resolution=16 --set model.base_dim=8 --set model.num_blocks=1
    --set model.channel_mult=[1,2] --set model.attention_resolutions=[8] --set model.dropout=0.1
    --set model.opacity_bias=0 --set opt.batch_size=4 --set opt.micro_batch=1 --set opt.imgs_per_obj=2
    --set opt.base_lr=1e-3 --set opt.scale_terms=true --set opt.ema.update_every=1 --set opt.ema.update_after_step=2
    --set logging.val_log=0 --set logging.val_views=2"

# train COUNT FOLDER STEPS ARGUMENT...
train() {
    count=$1
    folder=$temp/$2
    steps=$3
    shift 3
    # shellcheck disable=SC2086  # a list of words
    ranks "$count" "$vkrun" train $options --out "$folder" --set "opt.iterations=$steps" "$@"
    got=$?
}

# same FOLDER FOLDER
same() {
    cmp "$temp/$1/weights_last.safetensors" "$temp/$2/weights_last.safetensors" ||
        fail "$1 and $2 have other weights: $(cat "$temp/log")"
    for folder in "$1" "$2"; do
        sed -n 's/.*"step":\([0-9]*\),"loss":\([^,]*\),.*/\1 \2/p' "$temp/$folder/metrics.jsonl" |
            sort -n -u > "$temp/$folder.losses"
    done
    [ -s "$temp/$1.losses" ] || fail "no losses in $1"
    cmp "$temp/$1.losses" "$temp/$2.losses" || fail "$1 and $2 have other losses"
}

training() {
    make_data
    # shellcheck disable=SC2086
    "$vkrun" train $options --out "$temp/one" --set opt.iterations=4 > "$temp/log" 2>&1 || fail "$(cat "$temp/log")"
    train 2 two 4
    expect 0 "^2 ranks by .*, 2 of them on this machine, on device 0, which they share$"
    same one two
    [ "$(grep -c '^last weights: ' "$temp/log")" = 1 ] || fail "not told by one rank: $(cat "$temp/log")"
    [ "$(grep -c 'exchange' "$temp/two/metrics.jsonl")" -gt 0 ] || fail "no exchange in metrics.jsonl"
    train 3 three 4
    expect 2 "3 ranks, expected 1, 2, 4... up to"
    [ ! -e "$temp/three" ] || fail "three ranks made a folder"
    ranks 2 "$vkrun" train --out "$temp/none"
    got=$?
    expect 2 "no data: name its folder with --data"
    ranks 1 "$vkrun" train --show
    got=$?
    expect 0 '"batch_size"'

    # alone VARIABLE=VALUE...: a process that a launcher seems to have started, by a vkrun without plugins.
    cp "$vkrun" "$temp/vkrun"
    alone() {
        # shellcheck disable=SC2086
        env "$@" "$temp/vkrun" train $options --out "$temp/alone" > "$temp/log" 2>&1
        got=$?
        expect 2 "--ranks none"
        [ ! -e "$temp/alone" ] || fail "$*: a run was begun"
    }
    alone OMPI_COMM_WORLD_SIZE=2
    expect 2 "plugin for Open MPI, and there is no '$temp/libvkrun-mpi-openmpi.so', '.*': install"
    alone PMI_SIZE=2
    expect 2 "plugin for MPICH or Open MPI, and there is no '$temp/libvkrun-mpi-mpich.so', '"
    alone SLURM_STEP_NUM_TASKS=2
    expect 2 "plugin for Open MPI or MPICH"
    alone RANK=1 WORLD_SIZE=2 LOCAL_RANK=1
    expect 2 "torchrun started 2 processes (WORLD_SIZE)"
    cp "$plugin" "$temp"
    alone SLURM_STEP_NUM_TASKS=2
    expect 2 "^vkrun: srun started 2 processes, but .* sees 1: choose its kind of MPI, such as srun --mpi=pmix"
    echo none > "$temp/other.so"
    "$vkrun" train --data "$temp/data" --ranks "$temp/other.so" > "$temp/log" 2>&1
    got=$?
    expect 2 "cannot load the plugin '$temp/other.so': "
    "$vkrun" train --data "$temp/data" --rank-timeout 0 > "$temp/log" 2>&1
    got=$?
    expect 2 "--rank-timeout is 0, expected "
}

# What each rank is started by: its process is in a file; rank FAULTY_RANK has another disk, OTHER_RANK another rate.
write_wrapper() {
    cat > "$temp/rank" << END
#!/bin/sh
rank=\${OMPI_COMM_WORLD_RANK:-\$PMI_RANK}
echo \$\$ > "$temp/process.\$rank"
if [ "\$rank" = "\${OTHER_RANK:-}" ]; then set -- "\$@" --set opt.base_lr=0.5; fi
if [ "\$rank" = "\${FAULTY_RANK:-}" ]; then export LD_PRELOAD="$faults"; fi
exec "$vkrun" "\$@"
END
    chmod +x "$temp/rank"
}

# begin COUNT FOLDER ARGUMENT...: ranks in the background, as $launched; what they print is in $temp/log.
begin() {
    count=$1
    folder=$temp/$2
    shift 2
    rm -f "$temp"/process.*
    # shellcheck disable=SC2086
    $mpirun -n "$count" "$temp/rank" train $options --out "$folder" "$@" > "$temp/log" 2>&1 &
    launched=$!
    for _ in $(seq $((600 * scale))); do
        started=$(find "$temp" -name 'process.*' -size +0 | wc -l)
        if [ "$started" -eq "$count" ] || ! kill -0 "$launched" 2> /dev/null; then return; fi
        sleep 0.1
    done
}

# wait_for SENTENCE
wait_for() {
    for _ in $(seq $((600 * scale))); do
        grep -q -e "$1" "$temp/log" && return
        kill -0 "$launched" 2> /dev/null || fail "the ranks ended: $(cat "$temp/log")"
        sleep 0.1
    done
    fail "no '$1' in: $(cat "$temp/log")"
}

# signal SIGNAL RANK
signal() {
    kill "-$1" "$(cat "$temp/process.$2")"
}

# ended SECONDS: the status of the ranks, which end within that time.
ended() {
    since=$(date +%s.%N)
    wait "$launched"
    got=$?
    for _ in $(seq 20); do # mpirun does not wait for the last system call of each
        left=
        for file in "$temp"/process.*; do
            if kill -0 "$(cat "$file")" 2> /dev/null; then left=$file; fi
        done
        [ -n "$left" ] || break
        sleep 0.1
    done
    [ -z "$left" ] || fail "$left goes on: $(cat "$temp/log")"
    seconds=$(echo "$since $(date +%s.%N)" | awk '{ print $2 - $1 }')
    echo "ended after $seconds s, status $got"
    awk -v seconds="$seconds" -v most="$1" 'BEGIN { exit seconds > most }' || fail "ended after $seconds s"
}

resuming() {
    make_data
    write_wrapper
    options="$options --set opt.iterations=50 --set logging.loss_log=1 --set logging.val_log=20"
    for count in 1 2 4; do
        begin "$count" "whole_$count"
        ended 1000
        [ "$got" = 0 ] || fail "$count ranks: $(cat "$temp/log")"
        same whole_1 "whole_$count"
        begin "$count" "adapters_$count" --set opt.lora_finetune=true --set opt.lora_rank=2 --set opt.lora_dropout=0.2
        ended 1000
        [ "$got" = 0 ] || fail "adapters, $count ranks: $(cat "$temp/log")"
        same adapters_1 "adapters_$count"
    done
    # SIGTERM for each rank, and other counts.
    for turn in 2:10:0 4:20:3 1:30:0 2:40:1 4:50:; do
        count=${turn%%:*}
        rank=${turn##*:}
        step=${turn%:*}
        step=${step#*:}
        resume=
        [ ! -e "$temp/parts" ] || resume=--resume
        begin "$count" parts $resume
        if [ -n "$rank" ]; then
            wait_for "^step $step/"
            signal TERM "$rank"
        fi
        ended $((60 * scale))
        if [ -n "$rank" ]; then expect 130 "^interrupted after step "; else expect 0 "^last weights: "; fi
    done
    same whole_1 parts
}

endings() {
    make_data
    write_wrapper
    options="$options --set logging.loss_log=1 --set opt.iterations=6 --set logging.ckpt_iterations=2"
    begin 2 whole
    ended 1000
    [ "$got" = 0 ] || fail "$(cat "$temp/log")"

    # A disk that is full at each of many writes of rank 0.
    export FAULTY_RANK=0
    failures=0
    for n in 5 10 15 20 30 40 60 80; do
        rm -rf "$temp/full"
        export DISK_FAULTS="full:$n:$temp/full"
        begin 2 full
        ended $((60 * scale))
        [ "$got" != 0 ] || continue
        failures=$((failures + 1))
        expect 1 "No space left on device"
        [ "$(grep -c 'No space left on device' "$temp/log")" -lt 3 ] || fail "told by all: $(cat "$temp/log")"
    done
    [ "$failures" -gt 3 ] || fail "the disk was full $failures times"
    unset FAULTY_RANK DISK_FAULTS
    begin 2 full --overwrite
    ended 1000
    [ "$got" = 0 ] || fail "$(cat "$temp/log")"
    same whole full

    # Another configuration on a rank.
    export OTHER_RANK=1
    begin 2 other
    ended $((60 * scale))
    expect 2 "rank 1: .*opt.base_lr"
    [ ! -e "$temp/other" ] || fail "ranks that differ made a folder"
    unset OTHER_RANK

    # A folder in use, a rank that hangs, a rank that is killed.
    options="$options --set opt.iterations=1000000 --rank-timeout 3"
    begin 2 long
    wait_for "^step 2/"
    mv "$temp/log" "$temp/first"
    first=$launched
    mkdir "$temp/seconds"
    cp "$temp"/process.* "$temp/seconds"
    begin 2 long --resume
    ended $((60 * scale))
    expect 2 "a run of process .* is open in it"
    launched=$first
    mv "$temp/seconds"/* "$temp"
    mv "$temp/first" "$temp/log"
    signal STOP 1
    ended 15
    expect 1 "no answer within 3 s (--rank-timeout)"
    begin 4 long --resume
    wait_for "^step "
    signal STOP 0
    ended 15
    expect 1 "^vkrun: rank [123]: .*no answer within 3 s (--rank-timeout)"
}

kills() {
    make_data
    write_wrapper
    kills=20
    options="$options --set opt.iterations=$((3 * kills)) --set logging.ckpt_iterations=1"
    begun=$(date +%s.%N)
    begin 4 whole
    ended 1000
    longest=$(echo "$begun $(date +%s.%N)" | awk '{ print $2 - $1 }')
    [ "$got" = 0 ] || fail "$(cat "$temp/log")"
    (cd "$temp/whole" && sha256sum weights_last.safetensors) > "$temp/sums"
    killed=0
    ran=0
    resumed=0
    # shellcheck disable=SC2046  # a list of words
    set -- $(awk -v count=$((10 * kills)) -v longest="$longest" 'BEGIN {
        srand(60)
        for (i = 0; i < count; ++i) print longest * rand() ":" int(4 * rand())
    }')
    while [ "$killed" -lt "$kills" ]; do
        [ "$#" -gt 0 ] || fail "most runs ended before they were killed"
        state=$(find "$temp/killed/checkpoints" -name 'step_*.state.safetensors' 2> /dev/null | sort | tail -n 1)
        how=--overwrite
        [ -z "$state" ] || how=--resume
        begin 4 killed $how
        sleep "${1%:*}"
        signal KILL "${1#*:}" 2> /dev/null
        shift
        ended 10
        if [ -n "$state" ] && grep -q '^resumed from' "$temp/log"; then
            resumed=$((resumed + 1))
            grep '^resumed from' "$temp/log" | grep -q "$(basename "$state")" ||
                fail "not from $state: $(cat "$temp/log")"
        fi
        if [ "$got" = 0 ]; then
            (cd "$temp/killed" && sha256sum -c "$temp/sums") > "$temp/check" 2>&1 || fail "other weights"
            ran=$((ran + 1))
            rm -rf "$temp/killed"
        else
            killed=$((killed + 1))
        fi
    done
    begin 4 killed --resume
    ended 1000
    [ "$got" = 0 ] || fail "$(cat "$temp/log")"
    (cd "$temp/killed" && sha256sum -c "$temp/sums") || fail "other weights"
    [ "$resumed" -gt 0 ] || fail "nothing was resumed"
    echo "ranks: $killed kills, $resumed resumed, $ran runs to their end, with the same weights"
}

case $1 in
calls | training | resuming | endings | kills) "$1" ;;
*) fail "unknown case $1" ;;
esac
