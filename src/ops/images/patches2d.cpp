#include "ops/images/patches2d.h"

#include "core/checked_math.h"
#include "params/images_params.h"

namespace splat::ops {
namespace {

/// From images to patches, or back.
Status record(vk::Recorder& recorder, const Patches2dDesc& desc, bool back, const vk::BufferView& x,
              const vk::BufferView& y) {
    SPLAT_TRY(patches2d_check(desc));
    SPLAT_ASSIGN(const QuadDims dims, quad_dims(y.shape));
    EachItem item = {.kernel = back ? "patches2d_backward" : "patches2d_forward",
                     .items = dims.quads(),
                     .accesses = {vk::read(x), vk::write(y)},
                     .work = {.flops = 0, .bytes = 2.0 * static_cast<double>(dims.bytes())}};
    if (back && desc.size == 2 && recorder.kernels() != vk::Kernels::kPlain) {
        item.constants.push_back({params::kPatches2dPairsId, 1});
        item.items /= 4;
    }
    return record_each(recorder, std::move(item), [&](std::uint32_t groups_x) {
        return params::Patches2dParams{
            desc.n, desc.c, desc.height / desc.size, desc.width / desc.size, desc.size, groups_x};
    });
}

}  // namespace

Status patches2d_check(const Patches2dDesc& desc) {
    if (desc.height % desc.size != 0 || desc.width % desc.size != 0)
        return error(Code::kShape,
                     "patches2d: an image of %u x %u, expected multiples of the patch of %u",
                     desc.height, desc.width, desc.size);
    const std::uint64_t each = std::uint64_t{desc.size} * desc.size;
    const auto channels = checked_mul(desc.c, each);
    const auto elements =
        !channels ? channels
                  : checked_mul(std::max(round_up(*channels, 4), each * round_up(desc.c, 4)),
                                std::uint64_t{desc.height} * desc.width / each);
    const auto all = elements ? checked_mul(*elements, desc.n) : elements;
    if (!all || *all > kMaxElements)
        return unsupported("patches2d: [%u, %u, %u, %u] in patches of %u has 2^31 elements or more",
                           desc.n, desc.c, desc.height, desc.width, desc.size);
    return {};
}

namespace {

constexpr Attribute kPatches2dAttributes[] = {
    {"size", "integer", "2", "pixels of a patch along each axis; 1 to 1024"},
    {"up", "boolean", "false", "from channels to pixels"},
};

Result<Patches2dDesc> patches2d_desc(const Attributes& attributes, const Shape& x) {
    constexpr std::int64_t kMaxSize = 1024;
    SPLAT_TRY(expect_images("patches2d", "x", x));
    const std::int64_t size = attributes.integer("size");
    if (size < 1 || size > kMaxSize)
        return invalid("patches2d: size is %lld, expected 1 to %lld", lld(size), lld(kMaxSize));
    const auto each = static_cast<std::uint32_t>(size);
    if (!attributes.boolean("up")) return Patches2dDesc{x[0], x[1], x[2], x[3], each};
    if (x[1] % (each * each) != 0)
        return error(Code::kShape, "patches2d: %u channels, expected a multiple of %u x %u pixels",
                     x[1], each, each);
    if (x[2] > kMaxElements / each || x[3] > kMaxElements / each)
        return unsupported("patches2d: %u x %u patches of %u have 2^31 pixels or more", x[2], x[3],
                           each);
    return Patches2dDesc{x[0], x[1] / (each * each), x[2] * each, x[3] * each, each};
}

Result<OpPlan> patches2d_plan(const vk::Recorder&, const Attributes& attributes,
                              std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const Patches2dDesc desc, patches2d_desc(attributes, inputs[0]));
    SPLAT_TRY(patches2d_check(desc));
    if (attributes.boolean("up"))
        return OpPlan{.outputs = {Shape{desc.n, desc.c, desc.height, desc.width}}};
    return OpPlan{.outputs = {Shape{desc.n, desc.c * desc.size * desc.size, desc.height / desc.size,
                                    desc.width / desc.size}}};
}

Status patches2d_row_forward(vk::Recorder& recorder, const Attributes& attributes,
                             const OpViews& v) {
    SPLAT_ASSIGN(const Patches2dDesc desc, patches2d_desc(attributes, v.inputs[0].shape));
    return record(recorder, desc, attributes.boolean("up"), v.inputs[0], v.outputs[0]);
}

Status patches2d_row_backward(vk::Recorder& recorder, const Attributes& attributes,
                              const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const Patches2dDesc desc, patches2d_desc(attributes, v.inputs[0].shape));
    return record(recorder, desc, !attributes.boolean("up"), v.grad_outputs[0], v.grad_inputs[0]);
}

}  // namespace

const OpRow kPatches2dRow = {
    .name = "patches2d",
    .equation = "y[(c*size + r)*size + s, i, j] = x[c, i*size + r, j*size + s]; up: the inverse",
    .inputs = kInputX,
    .outputs = kOutputY,
    .attributes = kPatches2dAttributes,
    .plan = patches2d_plan,
    .forward = patches2d_row_forward,
    .backward = patches2d_row_backward,
    .backward_reads = no_backward_reads};

}  // namespace splat::ops
