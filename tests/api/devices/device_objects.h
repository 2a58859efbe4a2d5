#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "api/api_calls.h"
#include "self_test/self_test.h"

namespace splat::test {

/// What a module needs beyond Vulkan 1.2 and these features, as in "capability 11, extension SPV_KHR_x"; empty if
/// nothing.
std::string needed_beyond(std::span<const std::uint32_t> words, const vk::DeviceFeatures& features);

/// Every module that the device loads from now on and that needs more than its features is a failure of the test.
/// One device at a time.
Device open_watched(const vk::ContextDesc& desc);

/// One object of each kind, made and run. They return the first failure.
splat_result run_operator(splat_device device);
splat_result run_module(splat_device device);
splat_result run_model(splat_device device);
splat_result run_predictor(splat_device device);
splat_result run_rasterizer(splat_device device);
splat_result render_scene(splat_device device);
splat_result run_trainer(splat_device device);
splat_result run_fit(splat_device device);
splat_result run_lpips(splat_device device);

inline constexpr std::uint32_t kObjectSide = 24;  ///< pixels of what is drawn

}  // namespace splat::test
