#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace vkrun {

/// The first argument of a shell that asks what may stand at the cursor: `vkrun --complete WORD... CURRENT`.
constexpr const char* kCompleteOption = "--complete";

/// What may replace the last of `words`, which follow the program's name: a line "word<tab>sentence" each. The line
/// ":files" or ":folders" means that the shell completes names itself. Behind an unknown command there is nothing.
std::string candidates(CLI::App& app, std::vector<std::string> words);

}  // namespace vkrun
