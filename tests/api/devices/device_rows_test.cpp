// Every object of the API on devices with the limits of each class: made and run, or refused with the right sentence.
#include "api/devices/device_rows.h"

#include <algorithm>

#include "api/devices/device_objects.h"
#include "api/raster_calls.h"

namespace splat::test {
namespace {

void fake(const DeviceRow& row, vk::DeviceInfo& info) {
    info.name = row.name;  // what the self-test finds is kept by it
    info.kind = row.kind;
    info.features.unified_memory = row.kind != vk::DeviceKind::kDiscrete;
    info.features.subgroup_shuffle = row.subgroups != Subgroups::kBasic;
    if (row.subgroups == Subgroups::kBasic) info.features.subgroup_ballot = false;
    info.features.subgroup_arithmetic = row.subgroups == Subgroups::kArithmetic;
    info.features.int64 = row.kind == vk::DeviceKind::kCpu;  // GPUs need none
    vk::DeviceLimits& limits = info.limits;
    // The driver's own lanes are fewer than those of most rows: a kernel that counted on more would compute wrongly.
    limits.subgroup_size = std::min(limits.subgroup_size, row.lanes);
    limits.max_storage_buffers = row.storage_buffers;
    limits.max_group_invocations = row.invocations;
    limits.max_group_size = {row.invocations, row.invocations, 64};
    limits.shared_memory_bytes = row.shared_kib << 10;
    limits.max_storage_buffer_bytes = row.binding_bytes;
    limits.max_allocation_bytes = row.allocation_bytes;
    limits.max_texel_elements = row.texels;
}

Device open_row(const DeviceRow& row) {
    vk::ContextDesc desc;
    desc.device.fake = [&row](vk::DeviceInfo& info) { fake(row, info); };
    return open_watched(desc);
}

class ApiDeviceRows : public testing::TestWithParam<DeviceRow> {
  protected:
    /// `part` of the sentence that refuses the object; nullptr: it is made.
    void expect(const char* object, const char* part, splat_result (*run)(splat_device)) {
        SCOPED_TRACE(object);
        if (part == nullptr)
            EXPECT_DONE(run(device_));
        else
            EXPECT_REFUSED(run(device_), kUnsupported, part);
    }

    const DeviceRow& row_ = GetParam();
    Device device_ = open_row(row_);
};

TEST_P(ApiDeviceRows, FamiliesHaveTheirKernels) {
    vk::DeviceInfo info;
    info.features.subgroup_ballot = true;
    fake(row_, info);
    info.limits.subgroup_size = info.limits.least_lanes = info.limits.most_lanes = row_.lanes;
    EXPECT_EQ(vk::kernels_text(vk::best_kernels(info)), row_.kernels);
}

TEST_P(ApiDeviceRows, NetworksAreMadeOrRefused) {
    expect("model", row_.no_networks, run_model);
    const char* no_predictor =
        row_.no_networks != nullptr ? row_.no_networks : row_.no_rendering;  // it draws, too
    expect("predictor", no_predictor, run_predictor);
    if (row_.no_networks != nullptr)
        return;  // operators and modules ask for fewer buffers, each for its own
    expect("operator", nullptr, run_operator);
    expect("module", nullptr, run_module);
}

TEST_P(ApiDeviceRows, RenderingIsMadeOrRefused) {
    expect("rasterizer", row_.no_rendering, run_rasterizer);
    expect("scene", row_.no_rendering, render_scene);
    expect("trainer", row_.no_rendering, run_trainer);
    expect("fit", row_.no_rendering, run_fit);
}

TEST_P(ApiDeviceRows, LpipsIsMadeOrRefused) {
    expect("LPIPS", row_.no_networks, run_lpips);
}

TEST_P(ApiDeviceRows, WhatIsTooLargeIsRefusedInNumbers) {
    const std::uint64_t most = std::min(row_.binding_bytes, row_.allocation_bytes);
    const splat_tensor_desc wide = tensor_desc({static_cast<std::int64_t>(most / 4 + 1)});
    Tensor tensor;
    EXPECT_REFUSED(splat_tensor_create(device_, &wide, tensor.out()), kUnsupported,
                   "at most " + std::to_string(most));
    if (row_.no_rendering != nullptr) return;
    const std::uint64_t gaussians = most / 48;
    splat_rasterizer_desc many =
        rasterizer_desc(static_cast<std::uint32_t>(gaussians + 1), kObjectSide, kObjectSide);
    many.flags |= SPLAT_RASTERIZER_BACKWARD;  // images alone are drawn in bands
    Rasterizer rasterizer;
    EXPECT_REFUSED(splat_rasterizer_create(device_, &many, rasterizer.out()), kUnsupported,
                   "takes at most " + std::to_string(gaussians) + " in all");
}

/// Kernels for CPUs alone read through texel buffers. 700 Gaussians on each of 64 tiles are 44,800 pairs, more than
/// 65,536 texels hold with their keys.
TEST_P(ApiDeviceRows, FewTexelsDoNotDivideAScene) {
    if (row_.no_rendering != nullptr || row_.kind == vk::DeviceKind::kCpu || row_.texels > 65536)
        return;
    SampleScene sample(700, 0);
    std::ranges::fill(sample.means, 0.0F);
    std::ranges::fill(sample.log_scales, 2.0F);
    std::ranges::fill(sample.opacity_logits, -5.0F);
    const Rasterizer rasterizer = make_rasterizer(device_, rasterizer_desc(700, 128, 128));
    ASSERT_DONE(draw(rasterizer, sample.create(), sample_camera(128, 128)));
    const splat_rasterizer_info info = got(splat_rasterizer_get_info, rasterizer, nullptr);
    EXPECT_EQ(info.pairs, 700U * 64);
    EXPECT_EQ(info.passes, 1U);
}

INSTANTIATE_TEST_SUITE_P(Rows, ApiDeviceRows, testing::ValuesIn(kDeviceRows), [](const auto& row) {
    std::string name = row.param.name;
    std::erase_if(name, [](unsigned char c) { return std::isalnum(c) == 0; });
    return name;
});

}  // namespace
}  // namespace splat::test
