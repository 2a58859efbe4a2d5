#include "vk/pipeline_cache_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

namespace splat::vk {
namespace {

constexpr char kCacheMagic[8] = {'S', 'P', 'L', 'A', 'T', 'P', 'C', '1'};
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
    int descriptor;
    ~File() {
        if (descriptor >= 0) ::close(descriptor);
    }
};

bool read_all(const File& file, void* to, std::size_t bytes) {
    auto* at = static_cast<char*>(to);
    while (bytes > 0) {
        const ssize_t got = ::read(file.descriptor, at, bytes);
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
        const ssize_t put = ::write(file.descriptor, at, bytes);
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
    // Does not wait for the writer of a FIFO.
    const File file{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
    struct stat info_of_file {};
    Header header{};
    if (file.descriptor < 0 || ::fstat(file.descriptor, &info_of_file) != 0 ||
        !S_ISREG(info_of_file.st_mode) || !read_all(file, &header, sizeof header) ||
        header.bytes > kMaxBytes ||
        static_cast<std::uint64_t>(info_of_file.st_size) != sizeof header + header.bytes)
        return std::nullopt;
    std::vector<std::byte> data(header.bytes);
    if (!read_all(file, data.data(), data.size())) return std::nullopt;
    const Header expected = header_for(info, data);
    if (std::memcmp(&header, &expected, sizeof header) != 0) return std::nullopt;
    return data;
}

bool write_pipeline_cache(const std::string& path, const DeviceInfo& info,
                          const std::vector<std::byte>& data) {
    std::error_code failed;
    std::filesystem::create_directories(std::filesystem::path(path).parent_path(), failed);
    if (failed) return false;
    // A name of its own: processes in two containers, and two threads, may have the same number.
    std::string part = path + ".XXXXXX";
    const File file{::mkostemp(part.data(), O_CLOEXEC)};
    if (file.descriptor < 0) return false;
    static_cast<void>(::fchmod(file.descriptor, 0644));  // others may share the folder
    struct Cleanup {  // acts if memory runs out, too; after the rename there is nothing to remove
        const std::string& name;
        ~Cleanup() { std::remove(name.c_str()); }
    } const cleanup{part};
    const Header header = header_for(info, data);
    return write_all(file, &header, sizeof header) && write_all(file, data.data(), data.size()) &&
           std::rename(part.c_str(), path.c_str()) == 0;
}

}  // namespace splat::vk
