#include "vkrun/train/tensorboard.h"

#include <array>
#include <chrono>
#include <cstdio>
#include <cstring>

#include "core/os/process.h"
#include "vkrun/cli/failure.h"
#include "vkrun/cli/files.h"

namespace vkrun {
namespace {

/// CRC-32C (Castagnoli), reflected.
std::uint32_t crc32c(const std::string& bytes) {
    static const std::array<std::uint32_t, 256> table = [] {
        std::array<std::uint32_t, 256> made{};
        for (std::uint32_t i = 0; i < 256; ++i) {
            std::uint32_t value = i;
            for (int bit = 0; bit < 8; ++bit)
                value = (value >> 1U) ^ ((value & 1U) != 0 ? 0x82F63B78U : 0U);
            made[i] = value;
        }
        return made;
    }();
    std::uint32_t crc = ~0U;
    for (const char c : bytes)
        crc = (crc >> 8U) ^ table[(crc ^ static_cast<std::uint8_t>(c)) & 0xFFU];
    return ~crc;
}

std::uint32_t masked(const std::string& bytes) {
    const std::uint32_t crc = crc32c(bytes);
    return ((crc >> 15U) | (crc << 17U)) + 0xA282EAD8U;
}

template <class T>
std::string raw(T value) {
    std::string bytes(sizeof value, '\0');
    std::memcpy(bytes.data(), &value, sizeof value);
    return bytes;
}

std::string varint(std::uint64_t value) {
    std::string bytes;
    for (; value >= 0x80; value >>= 7U) bytes += static_cast<char>((value & 0x7FU) | 0x80U);
    return bytes + static_cast<char>(value);
}

/// Field numbers with their wire types: 0 varint, 1 eight bytes, 2 counted bytes, 5 four bytes.
std::string key(unsigned field, unsigned wire) {
    return varint((std::uint64_t{field} << 3U) | wire);
}
std::string counted(unsigned field, const std::string& bytes) {
    return key(field, 2) + varint(bytes.size()) + bytes;
}

std::string event_head(std::uint64_t step) {
    const double now =
        std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
    return key(1, 1) + raw(now) + key(2, 0) + varint(step);
}

}  // namespace

TensorBoard::TensorBoard(const std::string& folder) {
    make_folder(folder);
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(
                             std::chrono::system_clock::now().time_since_epoch())
                             .count();
    path_ = folder + "/events.out.tfevents." + std::to_string(seconds) + "." +
            std::to_string(splat::os::process_id());
    record(event_head(0) + counted(3, "brain.Event:2"));
}

void TensorBoard::scalars(std::uint64_t step,
                          const std::vector<std::pair<std::string, double>>& values) {
    std::string summary;
    for (const auto& [tag, value] : values)
        summary += counted(1, counted(1, tag) + key(2, 5) + raw(static_cast<float>(value)));
    constexpr std::uint64_t kStart = 1;  // START of SessionLog.SessionStatus
    if (!started_) add(event_head(step) + counted(7, key(1, 0) + varint(kStart)));
    started_ = true;
    add(event_head(step) + counted(5, summary));
}

void TensorBoard::add(const std::string& event) {
    try {
        record(event);
    } catch (const Failure& failure) {  // no reason to end a training
        if (!warned_)
            std::fprintf(stderr, "vkrun: warning: events for TensorBoard are missing: %s\n",
                         failure.what());
        warned_ = true;
    }
}

void TensorBoard::record(const std::string& event) {
    const std::string length = raw(static_cast<std::uint64_t>(event.size()));
    append_text(path_, length + raw(masked(length)) + event + raw(masked(event)));
}

}  // namespace vkrun
