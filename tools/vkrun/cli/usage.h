#pragma once

#include <string>

namespace CLI {
class App;
class ParseError;
}  // namespace CLI

namespace vkrun {

/// True if a command was expected where an unknown word stands, as in `vkrun nonsense --help`.
bool has_unknown_command(const CLI::App& app);

/// The message about a refused command line: the problem, the nearest known word, and where the
/// help is.
std::string usage_sentence(const CLI::App& app, const CLI::ParseError& error);

}  // namespace vkrun
