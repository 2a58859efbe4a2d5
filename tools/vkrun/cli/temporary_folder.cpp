#include "vkrun/cli/temporary_folder.h"

#include <stdlib.h>

#include <cerrno>
#include <cstring>

#include "vkrun/cli/failure.h"

namespace vkrun {

namespace fs = std::filesystem;

TemporaryFolder::TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "vkrun-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr)
        throw Failure(kFailed, "cannot make a folder like '" + name + "': " + std::strerror(errno) +
                                   "; set TMPDIR to another place");
    path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
}

}  // namespace vkrun
