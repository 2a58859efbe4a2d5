// Configurations: what is accepted is written with every value, and read back to the same text.

#include "config/config_file.h"
#include "fuzz/target.h"

using namespace splat;

namespace {

/// Text for config.json of a run; nothing for a configuration that is refused.
std::string merged(const Result<Config>& read) {
    if (!read.ok()) return {};
    const auto settings = config::settings_of(read.value());
    return settings.ok() ? config::merged_config_text(settings.value()) : std::string();
}

}  // namespace

SPLAT_FUZZ_TARGET(io::Bytes file) {
    const std::string text(io::as_text(file));
    const std::string values = merged(read_config(text, "x"));
    if (!values.empty()) fuzz::require(merged(read_config(values, "x")) == values);
    const std::string one = text.substr(0, text.find('\n'));
    static_cast<void>(merged(config::with_values(Config("x"), std::span(&one, 1))));
}
