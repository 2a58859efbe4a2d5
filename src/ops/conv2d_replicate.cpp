#include "core/checked_math.h"
#include "ops/conv2d_stages.h"
#include "ops/images/pad2d.h"

namespace splat::ops {
namespace {

using vk::BufferView;

/// One pixel on each side.
Pad2dDesc border_of(const Conv2dDesc& desc, std::uint32_t channels, bool replicate) {
    return {desc.n, channels, desc.height, desc.width, 1, 1, 1, 1, replicate};
}

struct WideSpaces {
    BufferView grad_y;  ///< with zeros around it
    BufferView x;       ///< with its border, or the gradient of that
    BufferView rest;    ///< workspace of the convolution
    std::uint64_t end = 0;
};

WideSpaces wide_spaces(const vk::Recorder& recorder, const Conv2dDesc& desc,
                       const BufferView& view) {
    const Conv2dDesc wide = conv2d_widened(desc);
    WideSpaces at;
    const auto next = [&](std::uint64_t bytes, const Shape& shape) {
        BufferView part = present(view) ? view.part(at.end, bytes) : view;
        part.shape = shape;
        at.end = round_up(at.end + bytes, recorder.device().limits.offset_alignment);
        return part;
    };
    const auto images = [&](std::uint32_t channels) {
        return next(ceil_div(channels, 4) * conv2d_pixels(wide) * 16,
                    {wide.n, channels, wide.height, wide.width});
    };
    at.grad_y = images(wide.out_channels);
    at.x = images(wide.in_channels);
    at.rest = next(std::max(conv2d_backward_input_bytes(recorder, wide),
                            conv2d_backward_weight_bytes(recorder, wide)),
                   {});
    return at;
}

}  // namespace

Conv2dDesc conv2d_widened(const Conv2dDesc& desc) {
    Conv2dDesc wide = desc;
    if (!desc.replicate) return wide;
    wide.replicate = false;
    wide.height += 2;
    wide.width += 2;
    return wide;
}

std::uint64_t replicate_backward_bytes(const vk::Recorder& recorder, const Conv2dDesc& desc) {
    return wide_spaces(recorder, desc, {}).end;
}

Status replicate_backward(vk::Recorder& recorder, const Conv2dDesc& desc, const BufferView& weight,
                          const OpViews& v) {
    const Conv2dDesc wide = conv2d_widened(desc);
    const WideSpaces spaces = wide_spaces(recorder, desc, v.workspace);
    const Pad2dDesc around_x = border_of(desc, desc.in_channels, true);
    SPLAT_TRY(pad2d_forward(recorder, border_of(desc, desc.out_channels, false), v.grad_outputs[0],
                            spaces.grad_y));
    SPLAT_TRY(conv2d_backward_begin(recorder, wide, spaces.grad_y, spaces.rest));
    if (present(v.grad_inputs[0])) {
        SPLAT_TRY(
            conv2d_backward_input(recorder, wide, weight, spaces.grad_y, spaces.x, spaces.rest));
        SPLAT_TRY(pad2d_backward(recorder, around_x, spaces.x, v.grad_inputs[0]));
    }
    if (!present(v.grad_inputs[1])) return {};
    SPLAT_TRY(pad2d_forward(recorder, around_x, v.inputs[0], spaces.x));
    return conv2d_backward_weight(recorder, wide, spaces.x, spaces.grad_y, v.grad_inputs[1],
                                  spaces.rest, v.accumulate);
}

}  // namespace splat::ops
