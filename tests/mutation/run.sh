#!/bin/sh
# Usage: tests/mutation/run.sh [pattern]
#
# Applies each seeded bug of mutants.txt whose name matches the pattern to a copy of the sources, builds, runs
# the tests that its line names, and expects them to fail. The last line counts the results; exit status 0 if all
# were caught. Takes about half a minute per bug.
set -eu

here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../.." && pwd)
pattern=${1:-.}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT INT TERM

(cd "$root" && git ls-files -z --cached --others --exclude-standard) |
    (cd "$root" && xargs -0 -I{} cp --parents {} "$work")
cd "$work"
cmake --preset dev -DSPLAT_BUILD_TOOLS=OFF >build.log 2>&1
cmake --build --preset dev >>build.log 2>&1 || {
    tail -n 20 build.log
    exit 1
}

# Whether the tests that match $1 pass.
tests_pass() {
    ctest --test-dir build/dev -R "$1" -E Golden --stop-on-failure --no-tests=error >test.log 2>&1
}

caught=0
missed=0
while IFS='@' read -r name file text replacement tests; do
    case $name in '#'* | '') continue ;; esac
    name=$(echo "$name" | sed 's/ *$//')
    echo "$name" | grep -q -- "$pattern" || continue
    FILE=$(echo "$file" | tr -d ' ') TEXT=$text REPLACEMENT=$replacement perl -0777 -e '
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
    target=$(echo "$file" | tr -d ' ')
    if ! cmake --build --preset dev >build.log 2>&1; then
        echo "does not build:  $name"
        tail -n 5 build.log
        missed=$((missed + 1))
    elif tests_pass "$(echo "$tests" | tr -d ' ')"; then
        echo "MISSED:          $name"
        missed=$((missed + 1))
    else
        echo "caught:          $name"
        caught=$((caught + 1))
    fi
    mv saved "$target"
    touch "$target"
done <"$here/mutants.txt"
echo "mutation: $caught caught, $missed missed"
[ "$missed" -eq 0 ] && [ "$caught" -gt 0 ]
