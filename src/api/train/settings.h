#pragma once

#include <span>
#include <string>

#include "config/config_keys.h"
#include "config/effects.h"

namespace splat::api {

/// Network and training of a configuration's text, NULL: the defaults, with changes "key=value". Errors: those
/// of config::model_config() and train_config().
Result<config::Settings> settings_of(const char* text, std::span<const std::string> changes);

/// The same of a training. Warns of what it would leave out. Errors: also those of
/// config::training_warnings().
Result<config::Settings> training_settings_of(const char* text, config::VectorsFrom vectors);

/// The texts of a caller's array. Errors: kInvalidArgument for NULL.
Result<std::vector<std::string>> texts_of(const char* const* values, std::size_t count);

}  // namespace splat::api
