#pragma once

#include <span>
#include <string>

#include "config/config_keys.h"

namespace splat::config {

/// CO3D: each view has its own focal lengths, and depths are relative to the distance of the origin.
bool is_co3d_category(const std::string& category);

/// Put the values that a category (data.category) implies into `settings`, which has the defaults of all
/// keys; nothing for an unknown category. Source: the data-set files of Splatter Image and of its fork.
void take_category_defaults(const std::string& category, Settings& settings);

/// The keys that take_category_defaults() may set.
std::span<const char* const> category_keys();

}  // namespace splat::config
