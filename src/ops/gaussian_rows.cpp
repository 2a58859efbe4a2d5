#include "ops/gaussian_rows.h"

#include "ops/strided_copy.h"

namespace splat::ops {
namespace {

using gaussians::kGaussianFloats;

/// Copy each attribute that is present to its place in the set, or back.
Status copy_rows(vk::Recorder& recorder, const gaussians::SetDesc& desc, const GaussianRows& rows,
                 const gaussians::SetViews& set, bool pack, bool accumulate) {
    const struct {
        const vk::BufferView& view;
        std::uint32_t channels;
        const vk::BufferView& packed;
        Stride layout;
    } attributes[] = {
        {rows.means, 3, set.gaussians, {kGaussianFloats, 0}},
        {rows.opacities, 1, set.gaussians, {kGaussianFloats, 3}},
        {rows.scales, 3, set.gaussians, {kGaussianFloats, 4}},
        {rows.rotations, 4, set.gaussians, {kGaussianFloats, 8}},
        {rows.colors, desc.color_floats(), set.colors, {4 * desc.color_quads(), 0}},
    };
    for (const auto& a : attributes) {
        if (a.view.buffer == VK_NULL_HANDLE) continue;
        const Stride dense{a.channels, 0};
        const StridedCopyDesc copy{desc.gaussians, a.channels, pack ? dense : a.layout,
                                   pack ? a.layout : dense, accumulate};
        SPLAT_TRY(strided_copy(recorder, copy, pack ? a.view : a.packed, pack ? a.packed : a.view));
    }
    return {};
}

}  // namespace

Status pack_rows(vk::Recorder& recorder, const gaussians::SetDesc& desc, const GaussianRows& from,
                 const gaussians::SetViews& to) {
    return copy_rows(recorder, desc, from, to, true, false);
}

Status unpack_rows(vk::Recorder& recorder, const gaussians::SetDesc& desc,
                   const gaussians::SetViews& from, const GaussianRows& to, bool accumulate) {
    return copy_rows(recorder, desc, to, from, false, accumulate);
}

}  // namespace splat::ops
