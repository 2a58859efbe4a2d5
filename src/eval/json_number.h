#pragma once

#include "core/json_writer.h"

namespace splat::eval {

/// Write the shortest decimal number that parses to `value`, with ".0" for whole ones: the form of
/// results.json since its first version. NaN and infinities become null.
void write_number(JsonWriter& json, double value);

}  // namespace splat::eval
