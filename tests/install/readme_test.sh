#!/bin/sh
# Compile and run the first C program of README.md.
#
#   readme_test.sh <README.md> <include folder> <folder of libsplat.so> <cc>
#
# CFLAGS and LDFLAGS apply to the program.
set -eu
readme=$1
include_dir=$2
lib_dir=$3
cc=$4

temp=$(mktemp -d)
trap 'rm -rf "$temp"' EXIT

# shellcheck disable=SC2016  # the backquotes are those of Markdown
sed -n '/^```c$/,/^```$/{/^```/d;p;}' "$readme" >"$temp/first.c"
if ! grep -q 'int main' "$temp/first.c"; then
    echo "readme_test: no C program between \`\`\`c and \`\`\` in $readme" >&2
    exit 1
fi
# shellcheck disable=SC2086  # lists of words
"$cc" -std=c99 -pedantic -Wall -Wextra -Wconversion -Werror ${CFLAGS:-} -I"$include_dir" \
    "$temp/first.c" -L"$lib_dir" -lsplat -lm ${LDFLAGS:-} -o "$temp/first"
LD_LIBRARY_PATH="$lib_dir" "$temp/first"
