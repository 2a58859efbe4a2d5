#include "ops/gather_rows.h"

#include "params/optimiser_params.h"
#include "vk/launch.h"

namespace splat::ops {

Status gather_rows(vk::Recorder& recorder, const GatherRowsDesc& desc, const vk::BufferView& index,
                   const vk::BufferView& x, const vk::BufferView& fresh, const vk::BufferView& y) {
    const std::uint64_t words = std::uint64_t{desc.rows} * desc.length;
    const auto expect = [](const char* name, const vk::BufferView& view,
                           std::uint64_t elements) -> Status {
        if (view.bytes / 4 >= elements) return {};
        return error(Code::kShape, "gather_rows: %s has %llu bytes, expected at least %llu", name,
                     llu(view.bytes), llu(4 * elements));
    };
    const bool is_fresh = fresh.block != nullptr;
    SPLAT_TRY(expect("index", index, desc.rows));
    SPLAT_TRY(expect("fresh", is_fresh ? fresh : y, words));
    SPLAT_TRY(expect("y", y, words));
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups = vk::groups_for(recorder.device(), words, size);
    return recorder.dispatch({
        .op = "gather_rows",
        .shader = "gather_rows",
        .constants = {{params::kWorkgroupSizeId, size},
                      {params::kGatherRowsLengthId, desc.length},
                      {params::kGatherRowsFreshId, is_fresh ? 1U : 0U}},
        .push = params::GatherRowsParams{.words = static_cast<std::uint32_t>(words),
                                         .groups_x = groups[0]},
        .accesses = {vk::read(index), vk::read(x), vk::read(is_fresh ? fresh : x), vk::write(y)},
        .groups = groups,
        .work = {.flops = 0, .bytes = 8.0 * static_cast<double>(words)},
    });
}

}  // namespace splat::ops
