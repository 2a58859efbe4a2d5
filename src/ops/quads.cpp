#include "ops/quads.h"

#include "params/quads_params.h"

namespace splat::ops {
namespace {

Status convert(vk::Recorder& recorder, const char* name, const vk::BufferView& x,
               const vk::BufferView& y) {
    SPLAT_ASSIGN(const QuadDims dims, quad_dims(x.shape, 1));
    return record_each(recorder,
                       {.kernel = name,
                        .items = dims.quads(),
                        .accesses = {vk::read(x), vk::write(y)},
                        .work = {.flops = 0, .bytes = 2.0 * static_cast<double>(dims.bytes())}},
                       [&](std::uint32_t groups_x) {
                           return params::QuadsParams{dims.n, dims.c, dims.p, groups_x};
                       });
}

}  // namespace

Result<QuadDims> quad_dims(const Shape& shape, std::uint32_t least) {
    if (shape.rank() < least)
        return error(Code::kShape, "a tensor of shape %s has no channels; expected [N, C, ...]",
                     shape.text().c_str());
    if (shape.rank() == 1) return QuadDims{1, shape[0], 1};
    QuadDims dims{shape[0], shape[1], 1};
    for (std::uint32_t axis = 2; axis < shape.rank(); ++axis) dims.p *= shape[axis];
    return dims;
}

Status quads_pack(vk::Recorder& recorder, const vk::BufferView& x, const vk::BufferView& y) {
    return convert(recorder, "quads_pack", x, y);
}

Status quads_pack_levels(vk::Recorder& recorder, const vk::BufferView& x, const vk::BufferView& y) {
    return convert(recorder, "quads_pack_levels", x, y);
}

Status quads_unpack(vk::Recorder& recorder, const vk::BufferView& x, const vk::BufferView& y) {
    return convert(recorder, "quads_unpack", x, y);
}

}  // namespace splat::ops
