#!/bin/sh
# Usage: tests/mutation/run.sh [pattern]
#
# Applies each seeded bug of mutants.txt whose name or file matches the pattern to a copy of the sources, builds the
# programs of the tests that its line names, runs these tests, and expects them to fail. Before that they must
# pass. The last line counts the results; exit status 0 if all were caught. Takes about half a minute per bug.
# SPLAT_MUTATION_DIR names a folder for the copy, which is kept: the next run builds only what has changed.
set -eu

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
pattern=${1:-.}
work=${SPLAT_MUTATION_DIR:-}
if [ -z "$work" ]; then
    work=$(mktemp -d)
    trap 'rm -rf "$work"' EXIT INT TERM
fi
mkdir -p "$work"
work=$(cd "$work" && pwd)

cd "$root"
git ls-files -z --cached --others --exclude-standard | WORK=$work perl -MFile::Compare -MFile::Copy=copy \
    -MFile::Basename -MFile::Path=make_path -0ne '
        chomp;
        next unless -f;
        my $to = "$ENV{WORK}/$_";
        next if -f $to && compare($_, $to) == 0;
        make_path(dirname($to));
        copy($_, $to) or die "$to: $!\n";
        chmod((stat)[2] & 07777, $to);'
# Real data lies beside the repository, not beside its copy.
if [ -d "$root/../shared/real" ]; then export SPLAT_REAL_DIR="${SPLAT_REAL_DIR:-$root/../shared/real}"; fi
cd "$work"

export GTEST_FAIL_FAST=1

# The lines of mutants.txt that are wanted: name@file@text@replacement@tests.
grep -v -e '^#' -e '^ *$' "$here/mutants.txt" | awk -F@ -v pattern="$pattern" '($1 $2) ~ pattern' >wanted.txt
[ -s wanted.txt ] || {
    echo "no seeded bug matches '$pattern'"
    exit 1
}

# Builds what the tests that match $1 name: their programs, or files of the build in their arguments and environment.
build() {
    ctest --test-dir build/dev -N -R "$1" -E Golden | sed -n 's/^ *Test *#[0-9]*: \(.*\)$/([=[\1]=]/p' >tests.txt
    [ -s tests.txt ] || {
        echo "no test matches '$1'" | tee build.log
        return 1
    }
    find build/dev -name CTestTestfile.cmake -exec grep -h -F -f tests.txt {} + |
        grep -o "$work/build/dev/[^\"; ]*" | sed "s|$work/build/dev/||" | sort -u | comm -12 - targets.txt >programs.txt
    xargs ninja -C build/dev -j2 <programs.txt >build.log 2>&1
}

# True if the tests that match $1 pass.
tests_pass() {
    ctest --test-dir build/dev -R "$1" -E Golden --stop-on-failure --no-tests=error </dev/null >test.log 2>&1
}

cmake --preset dev >build.log 2>&1 || {
    tail -n 20 build.log
    exit 1
}
ninja -C build/dev -t targets all | sed 's/: .*//' | sort -u >targets.txt
sed 's/.*@//; s/ //g' wanted.txt | sort -u | while read -r tests; do
    if ! build "$tests"; then
        tail -n 20 build.log
        exit 1
    elif ! tests_pass "$tests"; then
        tail -n 20 test.log
        echo "'$tests' fails without a seeded bug"
        exit 1
    fi
done

caught=0
missed=0
while IFS='@' read -r name file text replacement tests; do
    name=$(echo "$name" | sed 's/ *$//')
    file=$(echo "$file" | tr -d ' ')
    tests=$(echo "$tests" | tr -d ' ')
    FILE=$file TEXT=$text REPLACEMENT=$replacement perl -0777 -e '
        my ($text, $new) = map { s/^ | $//gr } @ENV{qw(TEXT REPLACEMENT)};
        open my $in, "<", $ENV{FILE} or die; my $all = <$in>; close $in;
        my $count = () = $all =~ /\Q$text\E/g;
        $count == 1 or die "the text occurs $count times in $ENV{FILE}\n";
        $all =~ s/\Q$text\E/$new/; rename $ENV{FILE}, "saved";
        open my $out, ">", $ENV{FILE}; print $out $all;' || {
        echo "NOT APPLICABLE: $name"
        missed=$((missed + 1))
        continue
    }
    begin=$(date +%s)
    result=caught
    build "$tests" || result="DOES NOT BUILD"
    if [ "$result" != caught ]; then
        tail -n 5 build.log
    elif tests_pass "$tests"; then
        result=MISSED
    fi
    if [ "$result" = caught ]; then caught=$((caught + 1)); else missed=$((missed + 1)); fi
    echo "$result: $name ($file, $(($(date +%s) - begin)) s)"
    mv saved "$file"
    touch "$file"
done <wanted.txt
echo "mutation: $caught caught, $missed missed"
[ "$missed" -eq 0 ] && [ "$caught" -gt 0 ]
