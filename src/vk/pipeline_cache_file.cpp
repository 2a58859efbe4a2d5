#include "vk/pipeline_cache_file.h"

#include <unistd.h>
#include <zlib.h>

#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>

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

}  // namespace

std::string pipeline_cache_path(const std::string& folder, const DeviceInfo& info) {
    std::string name = "pipelines-";
    for (const std::uint8_t byte : info.cache_uuid) name += format("%02x", byte);
    return folder + "/" + name + ".bin";
}

std::optional<std::vector<std::byte>> read_pipeline_cache(const std::string& path,
                                                          const DeviceInfo& info) {
    std::ifstream file(path, std::ios::binary);
    Header header{};
    if (!file.read(reinterpret_cast<char*>(&header), sizeof header) || header.bytes > kMaxBytes)
        return std::nullopt;
    std::error_code failed;
    if (std::filesystem::file_size(path, failed) != sizeof header + header.bytes || failed)
        return std::nullopt;
    std::vector<std::byte> data(header.bytes);
    if (!file.read(reinterpret_cast<char*>(data.data()), static_cast<std::streamsize>(data.size())))
        return std::nullopt;
    const Header expected = header_for(info, data);
    if (std::memcmp(&header, &expected, sizeof header) != 0) return std::nullopt;
    return data;
}

bool write_pipeline_cache(const std::string& path, const DeviceInfo& info,
                          const std::vector<std::byte>& data) {
    std::error_code failed;
    std::filesystem::create_directories(std::filesystem::path(path).parent_path(), failed);
    if (failed) return false;
    const std::string part = path + "." + std::to_string(getpid()) + ".tmp";
    struct Cleanup {  // also when memory runs out; after the rename there is nothing to remove
        const std::string& name;
        ~Cleanup() { std::remove(name.c_str()); }
    } const cleanup{part};
    const Header header = header_for(info, data);
    std::ofstream file(part, std::ios::binary | std::ios::trunc);
    file.write(reinterpret_cast<const char*>(&header), sizeof header);
    file.write(reinterpret_cast<const char*>(data.data()),
               static_cast<std::streamsize>(data.size()));
    file.close();
    return !file.fail() && std::rename(part.c_str(), path.c_str()) == 0;
}

}  // namespace splat::vk
