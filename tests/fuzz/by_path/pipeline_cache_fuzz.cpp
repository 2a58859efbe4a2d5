// The file of a pipeline cache: what is accepted is the data that its header describes.

#include "vk/pipeline_cache_file.h"

#include "fuzz/by_path/folder.h"

using namespace splat;

namespace {

constexpr std::size_t kHeaderBytes = 40;

}  // namespace

SPLAT_FUZZ_TARGET(io::Bytes file) {
    static const fuzz::Folder folder({"cache"});
    static const vk::DeviceInfo device{};
    folder.write(0, file);
    const auto data = vk::read_pipeline_cache(folder.path("cache"), device);
    if (data) fuzz::require(data->size() + kHeaderBytes == file.size());
}
