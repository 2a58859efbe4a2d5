#pragma once

#include <ostream>

#include "vk/device.h"

/// Limits of classes of devices, and what each gets. Limits that decide are from reports and sources of drivers; one
/// that no report tells is a like device's.
namespace splat::test {

enum class Subgroups { kBasic, kShuffle, kArithmetic };  ///< each with those before

struct DeviceRow {
    const char* name;
    vk::DeviceKind kind;
    std::uint32_t lanes;
    Subgroups subgroups;
    std::uint32_t storage_buffers;  ///< bindings of one shader
    std::uint32_t invocations;      ///< in a workgroup
    std::uint32_t shared_kib;
    std::uint64_t binding_bytes;
    std::uint64_t allocation_bytes;  ///< the smaller of it and maxBufferSize
    std::uint64_t texels;
    const char* kernels;  ///< kernels_text
    const char* no_networks =
        nullptr;  ///< part of the sentence that refuses networks; nullptr: they are made
    const char* no_rendering = nullptr;  ///< the same for all that draws
};

inline std::ostream& operator<<(std::ostream& to, const DeviceRow& row) {
    return to << row.name;
}

namespace rows {

using enum vk::DeviceKind;
using enum Subgroups;

inline constexpr std::uint64_t kMiB = 1 << 20, kGiB = kMiB << 10;
inline constexpr std::uint64_t kMost = 4 * kGiB - 1;  ///< in a binding: its range has 32 bits
inline constexpr std::uint32_t kMany = 1 << 20;
inline constexpr std::uint64_t kTexels = 1 << 27;
inline constexpr const char* kPartly = "network plain, sort plain, blend gpu";

inline constexpr DeviceRow kDeviceRows[] = {
    {"NVIDIA", kDiscrete, 32, kArithmetic, kMany, 1024, 48, kMost, kMost, kTexels, "gpu"},
    {"NVK", kDiscrete, 32, kArithmetic, kMany, 1024, 48, kMost, 2 * kGiB, kTexels, "gpu"},
    {"RADV", kDiscrete, 64, kArithmetic, kMany, 1024, 64, kMost, kMost, kTexels, "gpu"},
    {"AMD, Windows", kDiscrete, 64, kArithmetic, kMany, 1024, 32, kMost, 2 * kGiB, kTexels, "gpu"},
    {"ANV", kIntegrated, 32, kArithmetic, kMany, 1024, 64, kMost, kMost, kTexels, "gpu"},
    {"ANV, Mesa 23.0", kIntegrated, 32, kArithmetic, kMany, 1024, 64, kGiB, kGiB, kTexels, "gpu"},
    {"Intel, Windows", kIntegrated, 32, kArithmetic, kMany, 1024, 32, kGiB, kMost, kTexels, "gpu"},
    {"MoltenVK, Apple", kIntegrated, 32, kArithmetic, 31, 1024, 32, kMost, kMost, kTexels, "gpu"},
    {"MoltenVK, no subgroups", kDiscrete, 32, kBasic, 31, 1024, 32, kMost, kMost, kTexels, kPartly},
    {"KosmicKrisp", kIntegrated, 32, kShuffle, 31, 1024, 32, kMost, 2 * kGiB, kTexels, "gpu"},
    {"Honeykrisp", kIntegrated, 32, kArithmetic, kMany, 1024, 32, 2 * kGiB - 1, kMost, kTexels,
     "gpu"},
    {"Turnip", kIntegrated, 64, kArithmetic, kMany, 1024, 32, 128 * kMiB, kMost, kTexels, "gpu"},
    {"PanVK", kIntegrated, 16, kArithmetic, kMany, 1024, 32, kGiB, kGiB, 65536, "gpu"},
    {"Mali, Arm", kIntegrated, 16, kArithmetic, 35, 1024, 32, kGiB, kGiB, kTexels, "gpu"},
    {"V3DV, Raspberry Pi 5", kIntegrated, 16, kArithmetic, 8, 256, 16, kGiB, kGiB, kTexels, "gpu"},
    {"V3DV, Raspberry Pi 4", kIntegrated, 16, kBasic, 8, 256, 16, kGiB, kGiB, kTexels, kPartly},
    {"Dozen", kDiscrete, 8, kArithmetic, 64, 1024, 32, 128 * kMiB, kMost, kTexels, "gpu"},
    {"lavapipe, x86", kCpu, 8, kArithmetic, 32, 1024, 32, 128 * kMiB, 2 * kGiB, kTexels, "cpu"},
    {"lavapipe, Arm", kCpu, 4, kArithmetic, 32, 1024, 32, 128 * kMiB, 2 * kGiB, kTexels, "plain"},
    {"SwiftShader", kCpu, 4, kArithmetic, 16, 256, 16, kGiB, kGiB, 65536, "plain"},
    // No driver is known that reports these; Vulkan allows them.
    {"workgroups of 128", kOther, 4, kBasic, 16, 128, 16, 128 * kMiB, kGiB, 65536, "plain", nullptr,
     "workgroups of 128 invocations, expected at least 256"},
    {"4 storage buffers", kOther, 4, kBasic, 4, 256, 16, 128 * kMiB, kGiB, 65536, kPartly,
     "storage buffers", "storage buffers"},
};

}  // namespace rows

using rows::kDeviceRows;

}  // namespace splat::test
