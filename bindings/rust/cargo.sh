# shellcheck shell=sh
# Sourced by the tests, after they set $cargo: they end with 77 where it is missing, and PATH begins with its folder, as
# the compiler beside it is used, not one of another version.
#
#   skip SENTENCE, die SENTENCE   end the test
#   rust                          the folder of this file

rust=$(cd "$(dirname "$0")" && pwd)

skip() {
    echo "$1"
    exit 77
}

die() {
    echo "$(basename "$0" .sh): $*" >&2
    exit 1
}

case $cargo in
*NOTFOUND) skip "no cargo: install the packages rustc and cargo" ;;
esac
PATH=$(dirname "$cargo"):$PATH
export PATH
