#pragma once

#include "vk/launch.h"

namespace splat::ops {

/// The layout of activations on the device: quads of 4 channels, [ceil(C/4)][N*P], P pixels per
/// image; the channels beyond C in the last quad are zero. So concatenation along channels and the
/// columns of a matrix product are contiguous, for any batch.
///
/// A tensor [N, C, ...] keeps its logical shape in BufferView::shape; rank 2 [rows, features] is N
/// = rows, P = 1, and rank 1, where an operator takes it, C of one row.
struct QuadDims {
    std::uint32_t n = 1;
    std::uint32_t c = 1;
    std::uint32_t p = 1;

    [[nodiscard]] std::uint64_t quads() const { return (std::uint64_t{c} + 3) / 4 * n * p; }
    [[nodiscard]] std::uint64_t bytes() const { return quads() * 16; }
};

/// Errors: kShape for a rank below `least`.
Result<QuadDims> quad_dims(const Shape& shape, std::uint32_t least = 2);

/// Row-major to quads, and back.
///
/// x, y         the same logical shape [N, C, ...] float32; one row-major, the other quads; no
///              aliasing
/// Errors       kShape for rank < 1, kUnsupported beyond the device's binding limits; nothing is
///              recorded on error
/// Precision    exact
/// Determinism  bit-exact for any thread count
/// Source       src/ops/README.md, "Layout"
Status quads_pack(vk::Recorder& recorder, const vk::BufferView& x, const vk::BufferView& y);
Status quads_unpack(vk::Recorder& recorder, const vk::BufferView& x, const vk::BufferView& y);

/// The same from bytes k: y holds the float32 nearest to k / 255.
Status quads_pack_levels(vk::Recorder& recorder, const vk::BufferView& x, const vk::BufferView& y);

/// A kernel with one invocation for each of `items`, such as quads.
struct EachItem {
    const char* kernel;
    std::uint64_t items;
    std::vector<vk::Access> accesses;
    vk::Work work;
    bool may_alias = false;
    std::vector<vk::SpecConstant> constants = {};  ///< besides the size of workgroups
};

/// Record it; `push` makes its push constants from the number of workgroups per row of the dispatch.
template <class Push>
Status record_each(vk::Recorder& recorder, EachItem of, const Push& push) {
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups = vk::groups_for(recorder.device(), of.items, size);
    of.constants.insert(of.constants.begin(), {params::kWorkgroupSizeId, size});
    return recorder.dispatch({.op = of.kernel,
                              .shader = of.kernel,
                              .constants = std::move(of.constants),
                              .push = push(groups[0]),
                              .accesses = std::move(of.accesses),
                              .groups = groups,
                              .work = of.work,
                              .may_alias = of.may_alias});
}

}  // namespace splat::ops
