#include "vk/pipeline_cache_file.h"

#include <zlib.h>

#include <cerrno>
#include <cstring>

#include "core/os/file.h"
#include "core/os/path.h"

namespace splat::vk {
namespace {

constexpr char kCacheMagic[8] = {'S', 'P', 'L', 'A', 'T', 'P', 'C', '1'};
constexpr int kMostNames = 100;
constexpr std::uint64_t kMaxBytes = std::uint64_t{256} << 20;

struct Header {
    char magic[8];
    std::uint8_t uuid[VK_UUID_SIZE];
    std::uint32_t driver_version;
    std::uint32_t crc;
    std::uint64_t bytes;
};
static_assert(sizeof(Header) == 40);

std::uint32_t crc_of(const std::vector<std::byte>& data) {
    return static_cast<std::uint32_t>(
        crc32_z(0, reinterpret_cast<const unsigned char*>(data.data()), data.size()));
}

Header header_for(const DeviceInfo& info, const std::vector<std::byte>& data) {
    Header header{};
    std::memcpy(header.magic, kCacheMagic, sizeof kCacheMagic);
    std::memcpy(header.uuid, info.cache_uuid.data(), VK_UUID_SIZE);
    header.driver_version = info.driver_version;
    header.crc = crc_of(data);
    header.bytes = data.size();
    return header;
}

struct File {
    os::Handle handle;
    ~File() {
        if (handle != os::kNoHandle) os::close(handle);
    }
};

bool read_all(const File& file, void* to, std::size_t bytes) {
    auto* at = static_cast<char*>(to);
    while (bytes > 0) {
        const std::int64_t got = os::read(file.handle, at, bytes, {});
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return false;
        at += got;
        bytes -= static_cast<std::size_t>(got);
    }
    return true;
}

bool write_all(const File& file, const void* from, std::size_t bytes) {
    const auto* at = static_cast<const char*>(from);
    while (bytes > 0) {
        const std::int64_t put = os::write(file.handle, at, bytes, {});
        if (put < 0 && errno == EINTR) continue;
        if (put <= 0) return false;
        at += put;
        bytes -= static_cast<std::size_t>(put);
    }
    return true;
}

}  // namespace

std::string pipeline_cache_path(const std::string& folder, const DeviceInfo& info) {
    std::string name = format("pipelines-%04x-%04x-", info.vendor_id, info.device_id);
    for (const std::uint8_t byte : info.cache_uuid) name += format("%02x", byte);
    return folder + "/" + name + ".bin";
}

std::optional<std::vector<std::byte>> read_pipeline_cache(const std::string& path,
                                                          const DeviceInfo& info) {
    const File file{os::open(path, os::Open::kRead)};
    os::FileInfo info_of_file;
    Header header{};
    if (file.handle == os::kNoHandle || os::examine(file.handle, info_of_file) != 0 ||
        info_of_file.kind != os::FileKind::kFile || !read_all(file, &header, sizeof header) ||
        header.bytes > kMaxBytes || info_of_file.bytes != sizeof header + header.bytes)
        return std::nullopt;
    std::vector<std::byte> data(header.bytes);
    if (!read_all(file, data.data(), data.size())) return std::nullopt;
    const Header expected = header_for(info, data);
    if (std::memcmp(&header, &expected, sizeof header) != 0) return std::nullopt;
    return data;
}

bool write_pipeline_cache(const std::string& path, const DeviceInfo& info,
                          const std::vector<std::byte>& data) {
    if (os::make_folders(os::folder_of(path)) != 0) return false;
    // Processes in two containers may have the same number, and a killed one leaves its file.
    std::string part;
    File file{os::kNoHandle};
    for (int i = 0; file.handle == os::kNoHandle && i < kMostNames; ++i)
        file.handle = os::open(part = os::temporary_name(path), os::Open::kCreate);
    if (file.handle == os::kNoHandle) return false;
    os::set_permissions(file.handle, 0644);  // others may share the folder
    struct Cleanup {  // acts if memory runs out, too; after the rename there is nothing to remove
        const std::string& name;
        ~Cleanup() { os::remove(name); }
    } const cleanup{part};
    const Header header = header_for(info, data);
    return write_all(file, &header, sizeof header) && write_all(file, data.data(), data.size()) &&
           os::rename(part, path) == 0;
}

}  // namespace splat::vk
