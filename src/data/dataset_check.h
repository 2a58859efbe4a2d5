#pragma once

#include "data/dataset.h"

namespace splat::data {

/// What is found by reading all of an object: files that cannot be read, poses that are none, sizes that
/// differ (problems); images or poses that come twice, images of one colour (warnings).
struct ObjectCheck {
    std::vector<std::string> problems;
    std::vector<std::string> warnings;
    std::uint64_t hash = 0;  ///< of cameras and decoded images: equal objects have equal ones
    std::uint32_t width = 0;
};

/// Of a data set opened with `lenient`. Thread-safe. Errors: kInvalidArgument for an object that is none.
Result<ObjectCheck> check_object(const Dataset& dataset, std::uint32_t object);

/// JSON: {"name", "views", "width", "hash", "problems": [], "warnings": []}.
Result<std::string> check_text(const Dataset& dataset, std::uint32_t object);

}  // namespace splat::data
