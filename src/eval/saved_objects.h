#pragma once

#include <functional>
#include <optional>

#include "eval/evaluation.h"

namespace splat::eval {

/// Holds all that is known of each object scored, so that evaluations can be put together.
inline constexpr const char* kObjectsFile = "objects.json";

/// The text of objects.json, without a line end.
std::string objects_text(const Evaluation& evaluation);

/// The objects of a folder's objects.json, with the views of its per_image.csv, by their numbers, which `number_of`
/// finds by their names.
/// Errors: kInvalidArgument for another method, other weights or data than those of `like`, and for an object
/// without a number; kFormat for a damaged file; as io::read_file() and
/// read_image_scores().
Result<std::map<std::uint32_t, ObjectScores>> load_objects(
    const std::string& folder, const Evaluation& like,
    const std::function<std::optional<std::uint32_t>(const std::string& name)>& number_of);

}  // namespace splat::eval
