#!/bin/sh
# tests/fuzz/run.sh [--build DIR] [--work DIR] EXECUTIONS [PATTERN]
#
# Fuzzes each parser whose name matches the pattern (grep -E; all without one) for so many executions, and prints a
# row for each. Inputs that reach new code are kept in WORK/<parser>/, where the next call begins. An input that
# crashes, leaks, takes more than 256 MB or 1 s is in WORK/<parser>-<problem>-<hash>; then the exit status is 1.
set -u
cd "$(dirname "$0")/../.." || exit 1
build=build/fuzz work=
while :; do
    case ${1-} in
    --build) build=$2 && shift 2 ;;
    --work) work=$2 && shift 2 ;;
    *) break ;;
    esac
done
executions=${1:?usage: tests/fuzz/run.sh [--build DIR] [--work DIR] EXECUTIONS [PATTERN]}
pattern=${2-.}
work=${work:-$build/fuzz_work}
# ASan's default contexts and quarantine take most of the time of short executions. A finding that is run again
# without these options tells where its memory came from.
export ASAN_OPTIONS="malloc_context_size=0:quarantine_size_mb=1:thread_local_quarantine_size_kb=16:max_redzone=16"
ASAN_OPTIONS=$ASAN_OPTIONS:detect_stack_use_after_return=0
export UBSAN_OPTIONS=print_stacktrace=1

# The clock of the wall finds an input slow on a busy machine: the fastest of three runs counts.
is_slow() {
    for _ in 1 2 3; do
        "$1" "$2" 2>&1 | grep -qE " in [0-9]{1,3} ms$" && return 1
    done
    return 0
}

status=0 found=0
echo "| parser | executions | per second | edges | features | MB | findings |"
echo "|---|---|---|---|---|---|---|"
for source in tests/fuzz/*_fuzz.cpp tests/fuzz/by_path/*_fuzz.cpp; do
    name=$(basename "$source" _fuzz.cpp)
    echo "$name" | grep -qE "$pattern" || continue
    found=1
    program=$build/tests/fuzz/${name}_fuzz
    [ -x "$program" ] || { echo "'$program' is missing: build fuzz_targets" >&2; exit 1; }
    mkdir -p "$work/$name"
    log=$work/$name.log
    length=4096
    [ "$name" = ksplat ] && length=8192  # headers alone are 5120
    "$program" -runs="$executions" -max_len=$length -timeout=60 -report_slow_units=1 -rss_limit_mb=512 \
        -malloc_limit_mb=256 -print_final_stats=1 -artifact_prefix="$work/$name-" \
        "$work/$name" "tests/fuzz/corpora/$name" >"$log" 2>&1
    code=$?
    slow=0
    for input in "$work/$name"-slow-unit-*; do
        [ -e "$input" ] || continue
        if is_slow "$program" "$input"; then slow=$((slow + 1)); else rm "$input"; fi
    done
    awk -v name="$name" -v code="$code" -v slow="$slow" '
        { for (i = 1; i < NF; ++i) if ($i == "cov:") edges = $(i + 1); else if ($i == "ft:") features = $(i + 1) }
        $1 == "stat::number_of_executed_units:" { runs = $2 }
        $1 == "stat::average_exec_per_sec:" { speed = $2 }
        $1 == "stat::peak_rss_mb:" { memory = $2 }
        END {
            findings = code ? "FAILED, exit status " code : slow ? slow " slow" : "none"
            printf "| %s | %s | %s | %s | %s | %s | %s |\n", name, runs, speed, edges, features, memory, findings
        }' "$log"
    [ "$code" = 0 ] && [ "$slow" = 0 ] || status=1
done
[ $found = 1 ] || { echo "no parser matches '$pattern'" >&2; exit 1; }
exit $status
