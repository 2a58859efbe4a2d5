#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>

#include "vkrun/cli/command.h"
#include "vkrun/cli/failure.h"
#include "vkrun/cli/options.h"

namespace vkrun {
namespace {

constexpr const char* kFooter = R"(The script asks 'vkrun --complete' for the words at the cursor.

Exit status:
  0  success
  1  standard output cannot be written
  2  wrong usage of the command line

Examples:
  source <(vkrun completion bash)         # in ~/.bashrc; an installed vkrun has it
  source <(vkrun completion zsh)          # in ~/.zshrc, after compinit
  vkrun completion fish | source          # in ~/.config/fish/config.fish
  vkrun completion powershell | Out-String | Invoke-Expression    # in $PROFILE
)";

// A word of the command line that begins with a colon is no candidate, see candidates.h.
const std::map<std::string, const char*> kScripts = {
    {"bash", R"script(# Completion of vkrun in bash.
_vkrun() {
    local line
    COMPREPLY=()
    while IFS= read -r line; do
        case $line in
            :files) compopt -o default ;;
            :folders) compopt -o dirnames ;;
            *) COMPREPLY+=("${line%%$'\t'*}") ;;
        esac
    done < <(vkrun --complete "${COMP_WORDS[@]:1:COMP_CWORD-1}" "$2" 2>/dev/null)
}
complete -F _vkrun vkrun
)script"},
    {"zsh", R"script(#compdef vkrun
# Completion of vkrun in zsh.
_vkrun() {
    local line
    local -a found
    for line in "${(@f)$(vkrun --complete "${(@Q)words[2,CURRENT-1]}" "$PREFIX" 2>/dev/null)}"; do
        case $line in
            :files) compset -P '--*='; _files ;;
            :folders) compset -P '--*='; _files -/ ;;
            ?*) found+=("${line/$'\t'/:}") ;;
        esac
    done
    (( ! $#found )) || _describe vkrun found
}
if [[ $funcstack[1] == _vkrun ]]; then
    _vkrun "$@"
else
    compdef _vkrun vkrun
fi
)script"},
    {"fish", R"script(# Completion of vkrun in fish.
function __vkrun_complete
    set -l words (commandline --current-process --tokenize --cut-at-cursor)
    set -l current (commandline --current-token --cut-at-cursor)
    for line in (vkrun --complete $words[2..] "$current" 2>/dev/null)
        switch $line
            case :files
                __fish_complete_path "$current"
            case :folders
                __fish_complete_directories "$current"
            case '*'
                echo $line
        end
    end
end
complete --command vkrun --no-files --arguments '(__vkrun_complete)'
)script"},
    {"powershell",
     R"script(# Completion of vkrun in PowerShell, which completes files where this has no words.
Register-ArgumentCompleter -Native -CommandName vkrun -ScriptBlock {
    param($current, $line, $cursor)
    $words = @($line.CommandElements | Select-Object -Skip 1 |
        Where-Object { $_.Extent.EndOffset -lt $cursor } | ForEach-Object { $_.ToString() })
    if ($current -eq '') { $current = '""' }
    & vkrun --complete @words $current 2>$null | Where-Object { $_ -notlike ':*' } | ForEach-Object {
        $word, $text = $_ -split "`t", 2
        if (-not $text) { $text = $word }
        [System.Management.Automation.CompletionResult]::new($word, $word, 'ParameterValue', $text)
    }
}
)script"},
};

}  // namespace

void add_completion(CLI::App& app, int& exit_code) {
    CLI::App* command = add_command(
        app, "completion", "Print a script that lets a shell complete command lines.", kFooter);
    auto shell = std::make_shared<std::string>();
    std::vector<std::string> shells;
    for (const auto& [name, script] : kScripts) shells.push_back(name);
    command->add_option("SHELL", *shell, "bash, fish, powershell or zsh")
        ->required()
        ->type_name("")
        ->check(one_of(shells));
    command->callback([shell, &exit_code] {
        std::fputs(kScripts.at(*shell), stdout);
        exit_code = kSuccess;
    });
}

}  // namespace vkrun
