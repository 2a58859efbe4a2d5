#!/bin/sh
# completion_test.sh <vkrun> <shell> <folder> [cmake]: the shell completes command lines of vkrun by the script that
# `vkrun completion` prints. PowerShell is checked by its brackets where there is none. "pages": each command has a
# manual page that man reads. Exit status 77: skipped, with the reason.
set -eu
vkrun=$1
shell=$2
temp=$3

die() {
    echo "completion_test: $shell: $*" >&2
    exit 1
}

# candidates WORD...: the first words of what vkrun offers, on one line
candidates() {
    "$vkrun" --complete "$@" | cut -f 1 | tr '\n' ' '
}

# offers EXPECTED WORD...
offers() {
    expected=$1
    shift
    found=$(candidates "$@")
    [ "$found" = "$expected" ] || die "vkrun $*: '$found', expected '$expected'"
}

# What the words are, whatever the shell.
words() {
    offers "predict " pre
    offers "render report " -v --decode-scale 2 re
    offers "ops raster model start dispatch " bench ""
    offers "png npy " render a.ply --format ""
    offers "npy " render a.ply --format = n
    offers "--format=png --format=npy " render --format=
    offers "discrete " render --device d
    offers "RDF RUB RUF RDB " convert a b --frame R
    offers "rgb " render --outputs r
    offers ":files " predict ""
    offers ":folders " data show ""
    offers ":folders " fit a.mp4 --out ""
    offers "bash fish powershell zsh " completion ""
    offers ":files " convert -- --
    offers "--json " bench ops --json
    offers "" nonsense ""
    offers "" predict --views ""
    "$vkrun" --complete pre | grep -q "^predict	Turn a picture into a scene.$" || die "no sentence"
    "$vkrun" --complete >/dev/null || die "no words: status $?"
    for command in $(candidates ""); do
        # What --help lists is offered.
        for option in $("$vkrun" "$command" --help | sed -n 's/^  \(-., *\)\{0,1\}\(--[a-z0-9-]*\).*/\2/p'); do
            "$vkrun" --complete "$command" -- | cut -f 1 >"$temp/options"
            "$vkrun" --complete "$command" "$option" | cut -f 1 | grep -qx -e "$option" || die "$command lacks $option"
        done
    done
}

# Bash: the functions of completion, with readline's variables as it sets them.
in_bash() {
    "$vkrun" completion bash >"$temp/script"
    cat >"$temp/run" <<'END'
. "$1"
shift
[ "$(complete -p vkrun)" = "complete -F _vkrun vkrun" ] || { echo "registered: $(complete -p vkrun)"; exit 1; }
compopt() { printf '<%s> ' "$2"; }
COMP_WORDS=(vkrun "$@")
COMP_CWORD=$#
_vkrun vkrun "${!#}" "${COMP_WORDS[COMP_CWORD-1]}"
printf '%s ' "${COMPREPLY[@]}"
END
    gives() {
        expected=$1
        shift
        found=$(bash --norc "$temp/run" "$temp/script" "$@") || die "$found"
        [ "$found" = "$expected" ] || die "vkrun $*: '$found', expected '$expected'"
    }
    gives "predict " pre
    gives "raster " bench ra
    gives "png npy " render "a b.ply" --format ""
    gives "<default>  " predict ""
    gives "<dirnames>  " data show ""
}

in_zsh() {
    "$vkrun" completion zsh >"$temp/_vkrun"
    cat >"$temp/run" <<'END'
compdef() { print "compdef $*" }
_files() { print "<files $*>" }
compset() { }
_describe() { print -l "${(@P)2}" }
source $1
words=(vkrun "${@[2,-1]}")
CURRENT=$#words
PREFIX=$words[-1]
_vkrun
END
    gives() {
        expected=$1
        shift
        found=$(zsh -f "$temp/run" "$temp/_vkrun" "$@" 2>&1 | tr '\n' '|')
        [ "$found" = "compdef _vkrun vkrun|$expected" ] || die "vkrun $*: '$found', expected '$expected'"
    }
    gives "predict:Turn a picture into a scene.|" pre
    gives "png:|npy:|" render "a\ b.ply" --format ""
    gives "<files >|" predict ""
    gives "<files -/>|" data show ""
    # compinit loads the file from a folder, at the first use.
    zsh -f -c 'fpath=($1 $fpath); autoload -Uz compinit; compinit -D -u; print $_comps[vkrun]' zsh "$temp" \
        >"$temp/found"
    grep -qx _vkrun "$temp/found" || die "compinit: $(cat "$temp/found")"
}

in_fish() {
    "$vkrun" completion fish >"$temp/script"
    touch "$temp/photo.png"
    mkdir "$temp/folder"
    gives() {
        found=$(cd "$temp" && XDG_CONFIG_HOME="$temp" XDG_DATA_HOME="$temp" fish --no-config -c \
            'source script; complete --do-complete $argv[1]' "$1" | cut -f 1 | LC_ALL=C sort | tr '\n' ' ')
        [ "$found" = "$2" ] || die "$1: '$found', expected '$2'"
    }
    gives "vkrun pre" "predict "
    gives "vkrun render 'a b.ply' --format " "npy png "
    gives "vkrun predict ph" "photo.png "
    gives "vkrun data show fo" "folder/ "
    gives "vkrun render --format=p" "--format=png "
}

in_powershell() {
    "$vkrun" completion powershell >"$temp/script.ps1"
    for pair in '{ }' '( )' '[ ]'; do
        # shellcheck disable=SC2086  # two words
        set -- $pair
        [ "$(tr -cd "$1" <"$temp/script.ps1" | wc -c)" = "$(tr -cd "$2" <"$temp/script.ps1" | wc -c)" ] ||
            die "the script's $1 and $2 are not in pairs"
    done
    [ "$(grep -c "^Register-ArgumentCompleter -Native -CommandName vkrun -ScriptBlock {\$" "$temp/script.ps1")" = 1 ] ||
        die "the script registers nothing"
    offers "doctor devices predict demo render view inspect convert data fit train config eval compare report priors \
weights completion bench stress " '""'
    command -v pwsh >/dev/null || return 0
    pwsh -NoProfile -Command ". '$temp/script.ps1'; (TabExpansion2 'vkrun pre' 9).CompletionMatches.CompletionText" \
        >"$temp/found"
    grep -qx predict "$temp/found" || die "pwsh: $(cat "$temp/found")"
}

# check_pages FOLDER
check_pages() {
    for command in "" $(candidates ""); do
        page=$1/vkrun${command:+-$command}.1
        [ -s "$page" ] || { echo "no page $page"; return; }
        grep -q "^vkrun.* .- [A-Z3]" "$page" || echo "$page has no summary"
        "$vkrun" ${command:+$command} --help | sed -n 's/^  [-h,]*--\([a-z-]*\).*/\1/p' | while read -r option; do
            sed 's/\\-/-/g' "$page" | grep -q -e "--$option" || echo "$page lacks --$option"
        done
        case $command in bench | config | data | priors | weights)
            for below in $(candidates "$command" ""); do
                sed 's/\\-/-/g' "$page" | grep -qi "^.SH VKRUN $command $below$" || echo "$page lacks $below"
            done ;;
        esac
    done
}

in_pages() {
    "$1" -DPROGRAM="$vkrun" -DVERSION=1.2.3 -DOUT="$temp" -P "$(dirname "$0")/../../cmake/ManPage.cmake"
    found=$(check_pages "$temp/man")
    [ -z "$found" ] || die "$found"
    rm "$temp/man/vkrun-fit.1"
    [ -n "$(check_pages "$temp/man")" ] || die "a missing page is not seen"
    ! command -v groff >/dev/null || groff -man -ww -z "$temp"/man/*.1 2>"$temp/found"
    [ ! -s "$temp/found" ] || die "$(head -n 3 "$temp/found")"
}

rm -rf "$temp"
mkdir -p "$temp"
temp=$(cd "$temp" && pwd)
PATH=$(dirname "$vkrun"):$PATH
export PATH
shift 3
case $shell in
words | pages) ;;
powershell) ;;
*) command -v "$shell" >/dev/null || { echo "skipped: there is no $shell"; exit 77; } ;;
esac
case $shell in words) words ;; *) "in_$shell" "$@" ;; esac
