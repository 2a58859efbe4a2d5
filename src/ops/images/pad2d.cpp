#include "ops/images/pad2d.h"

#include <algorithm>

#include "core/checked_math.h"
#include "params/images_params.h"

namespace splat::ops {
namespace {

/// An invocation of the backward pass adds up the copies of a pixel; those of a corner are the square. lavapipe ends
/// loops after 65535 turns.
constexpr std::int32_t kMaxReplicated = 64;

std::uint32_t sum(std::uint32_t size, std::int32_t before, std::int32_t after) {
    return static_cast<std::uint32_t>(std::int64_t{size} + before + after);
}

Status record(vk::Recorder& recorder, const char* kernel, const Pad2dDesc& desc,
              const vk::BufferView& x, const vk::BufferView& y) {
    SPLAT_TRY(pad2d_check(desc));
    SPLAT_ASSIGN(const QuadDims dims, quad_dims(y.shape));
    return record_each(recorder,
                       {.kernel = kernel,
                        .items = dims.quads(),
                        .accesses = {vk::read(x), vk::write(y)},
                        .work = {.flops = 0, .bytes = 2.0 * static_cast<double>(dims.bytes())},
                        .constants = {{params::kPad2dReplicateId, desc.replicate ? 1U : 0U}}},
                       [&](std::uint32_t groups_x) {
                           return params::Pad2dParams{(desc.c + 3) / 4 * desc.n,
                                                      desc.height,
                                                      desc.width,
                                                      sum(desc.height, desc.top, desc.bottom),
                                                      sum(desc.width, desc.left, desc.right),
                                                      desc.top,
                                                      desc.left,
                                                      groups_x};
                       });
}

}  // namespace

Status pad2d_check(const Pad2dDesc& desc) {
    const auto rest = [](std::uint32_t size, std::int32_t before, std::int32_t after) {
        return std::int64_t{size} + std::min(before, 0) + std::min(after, 0);
    };
    if (rest(desc.height, desc.top, desc.bottom) < 1 || rest(desc.width, desc.left, desc.right) < 1)
        return error(Code::kShape,
                     "pad2d: top %d, bottom %d, left %d and right %d leave nothing of an image of "
                     "%u x %u",
                     desc.top, desc.bottom, desc.left, desc.right, desc.height, desc.width);
    const std::int32_t most = std::max({desc.top, desc.bottom, desc.left, desc.right});
    if (desc.replicate && most > kMaxReplicated)
        return unsupported(
            "pad2d: %d rows or columns of the nearest pixel, expected at most %d on each side",
            most, kMaxReplicated);
    const auto elements = [&](std::uint64_t height, std::uint64_t width) {
        const auto pixels = checked_mul(height * width, round_up(desc.c, 4));
        return pixels ? checked_mul(*pixels, desc.n) : pixels;
    };
    const auto before = elements(desc.height, desc.width);
    const auto after =
        elements(sum(desc.height, desc.top, desc.bottom), sum(desc.width, desc.left, desc.right));
    if (!before || !after || std::max(*before, *after) > kMaxElements)
        return unsupported("pad2d: [%u, %u, %u, %u] or its result has 2^31 elements or more",
                           desc.n, desc.c, desc.height, desc.width);
    return {};
}

Status pad2d_forward(vk::Recorder& recorder, const Pad2dDesc& desc, const vk::BufferView& x,
                     const vk::BufferView& y) {
    return record(recorder, "pad2d_forward", desc, x, y);
}

Status pad2d_backward(vk::Recorder& recorder, const Pad2dDesc& desc, const vk::BufferView& grad_y,
                      const vk::BufferView& grad_x) {
    return record(recorder, "pad2d_backward", desc, grad_y, grad_x);
}

namespace {

constexpr Attribute kPad2dAttributes[] = {
    {"left", "integer", "0", "columns to add; to cut off where negative"},
    {"right", "integer", "0", "columns to add; to cut off where negative"},
    {"top", "integer", "0", "rows to add; to cut off where negative"},
    {"bottom", "integer", "0", "rows to add; to cut off where negative"},
    {"replicate", "boolean", "false", "what is added is the nearest pixel, else 0"},
};

Result<Pad2dDesc> pad2d_desc(const Attributes& attributes, const Shape& x) {
    SPLAT_TRY(expect_images("pad2d", "x", x));
    Pad2dDesc desc{x[0], x[1], x[2], x[3]};
    desc.replicate = attributes.boolean("replicate");
    const struct {
        const char* name;
        std::int32_t* value;
    } sides[] = {
        {"left", &desc.left}, {"right", &desc.right}, {"top", &desc.top}, {"bottom", &desc.bottom}};
    constexpr std::int64_t kMost = 1 << 24;
    for (const auto& side : sides) {
        const std::int64_t value = attributes.integer(side.name);
        if (value < -kMost || value > kMost)
            return invalid("pad2d: %s is %lld, expected %lld to %lld", side.name, lld(value),
                           lld(-kMost), lld(kMost));
        *side.value = static_cast<std::int32_t>(value);
    }
    return desc;
}

Result<OpPlan> pad2d_plan(const vk::Recorder&, const Attributes& attributes,
                          std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const Pad2dDesc desc, pad2d_desc(attributes, inputs[0]));
    SPLAT_TRY(pad2d_check(desc));
    return OpPlan{.outputs = {Shape{desc.n, desc.c, sum(desc.height, desc.top, desc.bottom),
                                    sum(desc.width, desc.left, desc.right)}}};
}

Status pad2d_row_forward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    SPLAT_ASSIGN(const Pad2dDesc desc, pad2d_desc(attributes, v.inputs[0].shape));
    return pad2d_forward(recorder, desc, v.inputs[0], v.outputs[0]);
}

Status pad2d_row_backward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const Pad2dDesc desc, pad2d_desc(attributes, v.inputs[0].shape));
    return pad2d_backward(recorder, desc, v.grad_outputs[0], v.grad_inputs[0]);
}

}  // namespace

const OpRow kPad2dRow = {
    .name = "pad2d",
    .equation = "y[i,j] = x[i - top, j - left], outside of x 0, or the nearest pixel if replicate",
    .inputs = kInputX,
    .outputs = kOutputY,
    .attributes = kPad2dAttributes,
    .plan = pad2d_plan,
    .forward = pad2d_row_forward,
    .backward = pad2d_row_backward,
    .backward_reads = no_backward_reads};

}  // namespace splat::ops
