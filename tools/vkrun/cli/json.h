#pragma once

#include <splat.h>

#include <functional>
#include <nlohmann/json.hpp>
#include <string>

#include "vkrun/cli/failure.h"

namespace vkrun {

using Json = nlohmann::ordered_json;  ///< keeps the order in which keys are written

/// The text, indented by two; bytes that are not UTF-8 (names of drivers) are replaced.
std::string json_text(const Json& json);

/// Print json_text() on standard output.
void print_json(const Json& json);

/// The text of a library function that takes (buffer, capacity, needed). Throws a Failure, with `blame` as
/// check() takes it.
std::string library_text(const std::function<splat_result(char*, std::size_t, std::size_t*)>& get,
                         ExitCode blame = kFailed);

/// The JSON that `get(arguments..., buffer, capacity, needed)` writes, such as splat_model_report.
template <class Get, class... Arguments>
Json library_json(Get get, Arguments... arguments) {
    return Json::parse(library_text([&](char* buffer, std::size_t capacity, std::size_t* needed) {
        return get(arguments..., buffer, capacity, needed);
    }));
}

}  // namespace vkrun
