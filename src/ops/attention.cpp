#include "ops/attention.h"

#include <algorithm>
#include <cmath>

#include "core/checked_math.h"
#include "ops/gpu_tiles.h"
#include "params/attention_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

using vk::BufferView;
using vk::Kernels;

constexpr std::uint32_t kBlocks = 2;
constexpr std::uint32_t kMaxExtent = 65536;  ///< loops over its quads stay below lavapipe's limit

/// One matrix per image and head, in quads over its rows.
struct Matrix {
    BufferView view;
    std::uint32_t rows = 0;
    std::uint32_t columns = 0;
    std::uint32_t stride = 0;  ///< in quads, like the others
    std::uint32_t head = 0;
    std::uint32_t image = 0;
};

std::uint32_t quads_of(std::uint32_t rows) {
    return (rows + 3) / 4;
}

/// Channels by pixels of an activation of `pixels`.
Matrix activation(const AttentionDesc& desc, const BufferView& view, std::uint32_t pixels) {
    const std::uint32_t channels = desc.c / desc.heads;
    const std::uint32_t stride = desc.n * pixels;
    return {view, channels, pixels, stride, channels / 4 * stride, pixels};
}

/// A workspace of n * heads consecutive matrices.
Matrix scratch(const AttentionDesc& desc, const BufferView& view, std::uint32_t rows,
               std::uint32_t columns) {
    const std::uint32_t size = quads_of(rows) * columns;
    return {view, rows, columns, columns, size, desc.heads * size};
}

std::uint64_t scratch_bytes(const AttentionDesc& desc, std::uint32_t rows, std::uint32_t columns) {
    return std::uint64_t{desc.n} * desc.heads * quads_of(rows) * columns * 16;
}

params::AttentionParams params_of(const AttentionDesc& desc, const Matrix& s, const Matrix& y) {
    params::AttentionParams params{};
    params.heads = desc.heads;
    params.s_stride = s.stride;
    params.s_head = s.head;
    params.s_image = s.image;
    params.y_stride = y.stride;
    params.y_head = y.head;
    params.y_image = y.image;
    params.scale = 1;
    return params;
}

std::uint32_t groups(std::uint32_t items, std::uint32_t per_group) {
    return static_cast<std::uint32_t>(ceil_div(items, per_group));
}

/// y = scale * s^T v.
Status multiply(vk::Recorder& recorder, const char* op, const AttentionDesc& desc, const Matrix& s,
                const Matrix& v, const Matrix& y, float scale = 1) {
    const Kernels kernels = recorder.kernels();
    params::AttentionParams params = params_of(desc, s, y);
    params.m = s.columns;
    params.n = v.columns;
    params.k = s.rows;
    params.v_stride = v.stride;
    params.v_head = v.head;
    params.v_image = v.image;
    params.scale = scale;
    const std::uint32_t batches = desc.n * desc.heads;
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    std::vector<vk::SpecConstant> constants = {{params::kWorkgroupSizeId, size}};
    vk::Groups workgroups{groups(params.n, size), groups(params.m, 4), batches};
    if (kernels == Kernels::kCpu) {
        // Few columns would leave a wide tile idle.
        const std::uint32_t columns = params.n >= 64 ? 8 : params.n >= 16 ? 2 : 1;
        constants = {{params::kWorkgroupSizeId, 8},
                     {params::kAttentionColumnsId, columns},
                     {params::kAttentionBlocksId, kBlocks}};
        workgroups = {groups(params.n, 8 * columns), groups(params.m, 8 * kBlocks), batches};
    } else if (kernels == Kernels::kGpu) {
        const ProductTiles tiles =
            product_tiles(recorder.device(), params.m, params.n, batches, true);
        constants = tiles.constants();
        workgroups = {tiles.n, tiles.m, batches};
    }
    const double m = params.m;
    const double n = params.n;
    const double k = params.k;
    return recorder.dispatch({
        .op = op,
        .shader = "attention_product",
        .constants = std::move(constants),
        .push = params,
        .accesses = {vk::read(s.view), vk::read(v.view), vk::write(y.view)},
        .groups = workgroups,
        .work = {.flops = 2 * batches * m * n * k, .bytes = 4 * batches * (m * k + n * k + m * n)},
    });
}

/// y = s^T.
Status transpose(vk::Recorder& recorder, const AttentionDesc& desc, const Matrix& s,
                 const Matrix& y) {
    params::AttentionParams params = params_of(desc, s, y);
    params.m = s.rows;
    params.n = s.columns;
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 8);
    const double elements =
        static_cast<double>(desc.n) * desc.heads * s.rows * static_cast<double>(s.columns);
    return recorder.dispatch({
        .op = "attention_transpose",
        .shader = "attention_transpose",
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params,
        .accesses = {vk::read(s.view), vk::write(y.view)},
        .groups = {groups(quads_of(s.rows), size), quads_of(s.columns), desc.n * desc.heads},
        .work = {.flops = 0, .bytes = 8 * elements},
    });
}

/// Record a kernel with one invocation per query of the weights.
Status per_query(vk::Recorder& recorder, const char* kernel, const AttentionDesc& desc, float scale,
                 std::vector<vk::Access> accesses) {
    params::AttentionParams params{};
    params.n = desc.queries;
    params.k = desc.keys;
    params.heads = desc.heads;
    params.scale = scale;
    const std::uint32_t wanted = recorder.kernels() == Kernels::kCpu ? 8 : 64;
    const std::uint32_t size = vk::workgroup_size(recorder.device(), wanted);
    const double weights =
        static_cast<double>(desc.n) * desc.heads * desc.queries * static_cast<double>(desc.keys);
    return recorder.dispatch({
        .op = kernel,
        .shader = kernel,
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params,
        .accesses = std::move(accesses),
        .groups = {groups(desc.queries, size), 1, desc.n * desc.heads},
        .work = {.flops = 16 * weights, .bytes = 16 * weights},
        .may_alias = true,
    });
}

float scale_of(const AttentionDesc& desc) {
    return static_cast<float>(1 / std::sqrt(static_cast<double>(desc.c / desc.heads)));
}

/// The backward's workspace: gradient of the scores, one transposed matrix of that size, and one
/// transposed activation.
struct BackwardLayout {
    std::uint64_t scores = 0;
    std::uint64_t transposed = 0;
    std::uint64_t activation = 0;
    std::uint64_t end = 0;
};

BackwardLayout backward_layout(const vk::Recorder& recorder, const AttentionDesc& desc) {
    const std::uint64_t step = recorder.device().limits.offset_alignment;
    const std::uint32_t channels = desc.c / desc.heads;
    BackwardLayout layout;
    layout.transposed = round_up(scratch_bytes(desc, desc.keys, desc.queries), step);
    layout.activation =
        layout.transposed + round_up(scratch_bytes(desc, desc.queries, desc.keys), step);
    layout.end = layout.activation + std::max(scratch_bytes(desc, desc.queries, channels),
                                              scratch_bytes(desc, desc.keys, channels));
    return layout;
}

}  // namespace

Status attention_check(const vk::DeviceInfo& device, const AttentionDesc& desc) {
    if (desc.heads < 1 || desc.c % desc.heads != 0 ||
        (desc.heads > 1 && desc.c / desc.heads % 4 != 0))
        return error(Code::kShape,
                     "attention: %u channels do not divide into %u heads of a multiple of 4 "
                     "channels",
                     desc.c, desc.heads);
    for (const std::uint32_t extent : {desc.c / desc.heads, desc.queries, desc.keys})
        if (extent > kMaxExtent)
            return unsupported(
                "attention: %u channels per head, %u queries, %u keys; expected at most "
                "%u of each",
                desc.c / desc.heads, desc.queries, desc.keys, kMaxExtent);
    const auto batches = checked_mul(desc.n, desc.heads);
    const std::uint64_t most = round_up(std::max(desc.queries, desc.keys), 4);
    const auto weights = batches ? checked_mul(*batches, most * most) : batches;
    if (!weights || *weights > kMaxElements)
        return unsupported(
            "attention: %u x %u weights for each of %u images and %u heads are 2^31 or "
            "more",
            desc.queries, desc.keys, desc.n, desc.heads);
    if (*batches > device.limits.max_groups[2])
        return unsupported(
            "attention: %u images of %u heads, but the device takes at most %u in all", desc.n,
            desc.heads, device.limits.max_groups[2]);
    return {};
}

Shape attention_weights_shape(const AttentionDesc& desc) {
    return {desc.n * desc.heads, quads_of(desc.keys), desc.queries, 4};
}

std::uint64_t attention_forward_bytes(const AttentionDesc& desc) {
    return scratch_bytes(desc, desc.keys, desc.c / desc.heads);
}

std::uint64_t attention_backward_bytes(const vk::Recorder& recorder, const AttentionDesc& desc) {
    return backward_layout(recorder, desc).end;
}

Status attention_forward(vk::Recorder& recorder, const AttentionDesc& desc, const BufferView& q,
                         const BufferView& k, const BufferView& v, const BufferView& y,
                         const BufferView& weights, const BufferView& workspace) {
    SPLAT_TRY(attention_check(recorder.device(), desc));
    const std::uint32_t channels = desc.c / desc.heads;
    const Matrix values = activation(desc, v, desc.keys);
    const Matrix scores = scratch(desc, weights, desc.keys, desc.queries);
    const Matrix values_t =
        scratch(desc, workspace.part(0, attention_forward_bytes(desc)), desc.keys, channels);
    SPLAT_TRY(multiply(recorder, "attention_scores", desc, activation(desc, k, desc.keys),
                       activation(desc, q, desc.queries), scores, scale_of(desc)));
    SPLAT_TRY(
        per_query(recorder, "attention_forward", desc, 1, {vk::read(weights), vk::write(weights)}));
    SPLAT_TRY(transpose(recorder, desc, values, values_t));
    return multiply(recorder, "attention_values", desc, values_t, scores,
                    activation(desc, y, desc.queries));
}

Status attention_backward(vk::Recorder& recorder, const AttentionDesc& desc, const BufferView& q,
                          const BufferView& k, const BufferView& v, const BufferView& weights,
                          const BufferView& grad_y, const AttentionGradients& gradients,
                          const BufferView& workspace) {
    SPLAT_TRY(attention_check(recorder.device(), desc));
    const std::uint32_t channels = desc.c / desc.heads;
    const BackwardLayout layout = backward_layout(recorder, desc);
    const Matrix w = scratch(desc, weights, desc.keys, desc.queries);
    const Matrix grad_scores =
        scratch(desc, workspace.part(0, scratch_bytes(desc, desc.keys, desc.queries)), desc.keys,
                desc.queries);
    const Matrix transposed = scratch(
        desc, workspace.part(layout.transposed, scratch_bytes(desc, desc.queries, desc.keys)),
        desc.queries, desc.keys);
    const auto transposed_activation = [&](std::uint32_t pixels) {
        return scratch(desc,
                       workspace.part(layout.activation, scratch_bytes(desc, pixels, channels)),
                       pixels, channels);
    };
    const Matrix grad = activation(desc, grad_y, desc.queries);
    const Matrix of_queries = transposed_activation(desc.queries);
    const Matrix of_keys = transposed_activation(desc.keys);

    if (gradients.v.block != nullptr) {
        SPLAT_TRY(transpose(recorder, desc, grad, of_queries));
        SPLAT_TRY(transpose(recorder, desc, w, transposed));
        SPLAT_TRY(multiply(recorder, "attention_grad_v", desc, of_queries, transposed,
                           activation(desc, gradients.v, desc.keys)));
    }
    if (gradients.q.block == nullptr && gradients.k.block == nullptr) return {};
    SPLAT_TRY(multiply(recorder, "attention_grad_weights", desc, activation(desc, v, desc.keys),
                       grad, grad_scores));
    SPLAT_TRY(
        per_query(recorder, "attention_backward", desc, scale_of(desc),
                  {vk::read(weights), vk::read(grad_scores.view), vk::write(grad_scores.view)}));
    if (gradients.q.block != nullptr) {
        SPLAT_TRY(transpose(recorder, desc, activation(desc, k, desc.keys), of_keys));
        SPLAT_TRY(multiply(recorder, "attention_grad_q", desc, of_keys, grad_scores,
                           activation(desc, gradients.q, desc.queries)));
    }
    if (gradients.k.block == nullptr) return {};
    SPLAT_TRY(transpose(recorder, desc, activation(desc, q, desc.queries), of_queries));
    SPLAT_TRY(transpose(recorder, desc, grad_scores, transposed));
    return multiply(recorder, "attention_grad_k", desc, of_queries, transposed,
                    activation(desc, gradients.k, desc.keys));
}

namespace {

constexpr Port kAttentionInputs[] = {{"q"}, {"k"}, {"v"}};
constexpr const char* kAttentionSaved[] = {"weights"};
constexpr Attribute kAttentionAttributes[] = {
    {"heads", "integer", "1", "heads of neighbouring channels; divides the channels"},
};

Result<AttentionDesc> attention_desc(const Attributes& attributes, const Shape& q, const Shape& k) {
    if (q.rank() < 3)
        return error(Code::kShape, "attention: tensor 'q' has shape %s, expected [N, C, ...]",
                     q.text().c_str());
    SPLAT_ASSIGN(const QuadDims of_q, quad_dims(q));
    if (k.rank() < 3 || k[0] != q[0] || k[1] != q[1])
        return error(Code::kShape, "attention: tensor 'k' has shape %s, expected [%u, %u, ...]",
                     k.text().c_str(), q[0], q[1]);
    SPLAT_ASSIGN(const QuadDims of_k, quad_dims(k));
    const auto heads = attributes.integer("heads");
    if (heads < 1 || heads > of_q.c)
        return invalid("attention: heads is %lld, expected 1 to %u", lld(heads), of_q.c);
    return AttentionDesc{of_q.n, of_q.c, static_cast<std::uint32_t>(heads), of_q.p, of_k.p};
}

Result<OpPlan> attention_plan(const vk::Recorder& recorder, const Attributes& attributes,
                              std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const AttentionDesc desc, attention_desc(attributes, inputs[0], inputs[1]));
    SPLAT_TRY(expect_shape("attention", "v", inputs[2], inputs[1]));
    SPLAT_TRY(attention_check(recorder.device(), desc));
    return OpPlan{.outputs = {inputs[0]},
                  .saved = {attention_weights_shape(desc)},
                  .forward_workspace = attention_forward_bytes(desc),
                  .backward_workspace = attention_backward_bytes(recorder, desc)};
}

Status attention_row_forward(vk::Recorder& recorder, const Attributes& attributes,
                             const OpViews& v) {
    SPLAT_ASSIGN(const AttentionDesc desc,
                 attention_desc(attributes, v.inputs[0].shape, v.inputs[1].shape));
    return attention_forward(recorder, desc, v.inputs[0], v.inputs[1], v.inputs[2], v.outputs[0],
                             v.saved[0], v.workspace);
}

Status attention_row_backward(vk::Recorder& recorder, const Attributes& attributes,
                              const OpViews& v) {
    SPLAT_ASSIGN(const AttentionDesc desc,
                 attention_desc(attributes, v.inputs[0].shape, v.inputs[1].shape));
    return attention_backward(recorder, desc, v.inputs[0], v.inputs[1], v.inputs[2], v.saved[0],
                              v.grad_outputs[0],
                              {v.grad_inputs[0], v.grad_inputs[1], v.grad_inputs[2]}, v.workspace);
}

}  // namespace

const OpRow kAttentionRow = {
    .name = "attention",
    .equation = "y[c,l] = sum_j w[l,j] v[c,j], w[l,j] = softmax_j(q[c,l] k[c,j] / sqrt(C/heads))",
    .inputs = kAttentionInputs,
    .outputs = kOutputY,
    .saved = kAttentionSaved,
    .attributes = kAttentionAttributes,
    .plan = attention_plan,
    .forward = attention_row_forward,
    .backward = attention_row_backward};

}  // namespace splat::ops
