#pragma once

#include <vector>

#include "vk/device.h"

namespace splat::vk {

/// Say in `passed_over` of each usable device that is not the first choice why. Conformant drivers come
/// first among GPUs and among CPUs, Dozen last, and each GPU, known by its UUID, counts once: by the first of its best
/// drivers.
void pass_over(std::vector<DeviceInfo>& infos);

/// Indices of the devices to open, in the order of trying: one, or all usable ones for DeviceSelect::kBest, GPUs
/// before CPUs. Of equal drivers the kind decides, then the index. Errors: kNoDevice if none fits (lists all),
/// kUnsupported if the one that fits is not usable.
Result<std::vector<std::uint32_t>> devices_to_try(const DeviceDesc& desc,
                                                  const std::vector<DeviceInfo>& infos);

/// 32 digits.
std::string uuid_text(const std::array<std::uint8_t, VK_UUID_SIZE>& uuid);

}  // namespace splat::vk
