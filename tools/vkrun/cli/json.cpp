#include "vkrun/cli/json.h"

#include <cstdio>

#include "vkrun/cli/handles.h"

namespace vkrun {

std::string json_text(const Json& json) {
    return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

void print_json(const Json& json) {
    std::printf("%s\n", json_text(json).c_str());
}

std::string library_text(const std::function<splat_result(char*, std::size_t, std::size_t*)>& get,
                         ExitCode blame) {
    std::size_t needed = 0;
    std::string text(std::size_t{1} << 16U, '\0');  // mostly enough: each call may read a file
    check(get(text.data(), text.size(), &needed), blame);
    if (needed > text.size()) {
        text.resize(needed);
        check(get(text.data(), text.size(), &needed), blame);
    }
    text.resize(text.find('\0'));
    return in_own_words(std::move(text));
}

}  // namespace vkrun
