#include "vkrun/cli/shard.h"

#include <CLI/CLI.hpp>
#include <charconv>

#include "vkrun/cli/failure.h"

namespace vkrun {

void add_shard_option(CLI::App& command, std::string& text, const std::string& what) {
    command.add_option("--shard", text, "Only part I of N of " + what + ", from 0")
        ->type_name("I/N");
}

Shard parse_shard(const std::string& text) {
    Shard shard;
    if (text.empty()) return shard;
    const char* const end = text.data() + text.size();
    const auto first = std::from_chars(text.data(), end, shard.index);
    if (first.ec == std::errc() && first.ptr != end && *first.ptr == '/') {
        const auto second = std::from_chars(first.ptr + 1, end, shard.count);
        if (second.ec == std::errc() && second.ptr == end && shard.index < shard.count)
            return shard;
    }
    throw Failure(kUsageError, "--shard is '" + text + "', expected I/N with I from 0 to N - 1");
}

}  // namespace vkrun
