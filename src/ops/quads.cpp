#include "ops/quads.h"

#include "params/quads_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

Status convert(vk::Recorder& recorder, const char* name, const vk::BufferView& x,
               const vk::BufferView& y) {
    SPLAT_ASSIGN(const QuadDims dims, quad_dims(x.shape));
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups = vk::groups_for(recorder.device(), dims.quads(), size);
    return recorder.dispatch({
        .op = name,
        .shader = name,
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params::QuadsParams{dims.n, dims.c, dims.p, groups[0]},
        .accesses = {vk::read(x), vk::write(y)},
        .groups = groups,
        .work = {.flops = 0, .bytes = 2.0 * static_cast<double>(dims.bytes())},
    });
}

}  // namespace

Result<QuadDims> quad_dims(const Shape& shape) {
    if (shape.rank() < 2)
        return error(Code::kShape, "a tensor of shape %s has no channels; expected [N, C, ...]",
                     shape.text().c_str());
    QuadDims dims{shape[0], shape[1], 1};
    for (std::uint32_t axis = 2; axis < shape.rank(); ++axis) dims.p *= shape[axis];
    return dims;
}

Status quads_pack(vk::Recorder& recorder, const vk::BufferView& x, const vk::BufferView& y) {
    return convert(recorder, "quads_pack", x, y);
}

Status quads_unpack(vk::Recorder& recorder, const vk::BufferView& x, const vk::BufferView& y) {
    return convert(recorder, "quads_unpack", x, y);
}

}  // namespace splat::ops
