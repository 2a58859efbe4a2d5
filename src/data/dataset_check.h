#pragma once

#include "data/depth_range.h"

namespace splat::data {

/// The result of reading all of an object. Problems: unreadable files, invalid poses, sizes that differ.
/// Warnings: duplicate images or poses, images of one colour.
struct ObjectCheck {
    std::vector<std::string> problems;
    std::vector<std::string> warnings;
    std::uint64_t hash = 0;  ///< hash of cameras and decoded images; equal for equal objects
    std::uint32_t width = 0;
    DepthRange depths;
};

/// Checks an object of a data set opened with `lenient`. Thread-safe. Errors: kInvalidArgument if there is
/// no such object.
Result<ObjectCheck> check_object(const Dataset& dataset, std::uint32_t object);

/// JSON: {"name", "views", "width", "hash", "problems": [], "warnings": [], "depths": {"from" ("points" or "cameras"),
/// "near", "far", "znear", "zfar" (that hold them)}, without "depths" where they are not known}.
Result<std::string> check_text(const Dataset& dataset, std::uint32_t object);

}  // namespace splat::data
