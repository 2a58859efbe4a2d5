#pragma once

#include <cstdint>
#include <string>

namespace CLI {
class App;
}

namespace vkrun {

/// Part `index` of `count` of a work, "I/N" with I from 0 to N - 1.
struct Shard {
    std::uint32_t index = 0, count = 1;
};

/// --shard I/N; `what` is done in parts.
void add_shard_option(CLI::App& command, std::string& text, const std::string& what);

/// The whole for an empty text. Throws a usage Failure.
Shard parse_shard(const std::string& text);

}  // namespace vkrun
