#include "vkrun/cli/path_name.h"

#include "vkrun/cli/json.h"

namespace vkrun {

PathName::PathName(const std::string& name)
    : text_(library_text([&name](char* buffer, std::size_t capacity, std::size_t* needed) {
          return splat_path_name(name.c_str(), buffer, capacity, needed);
      })) {}

}  // namespace vkrun
