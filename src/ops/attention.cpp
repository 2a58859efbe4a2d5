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
constexpr std::uint32_t kMaxExtent = 65536;   ///< loops over its quads stay below lavapipe's limit
constexpr std::uint32_t kFusedChannels = 64;  ///< 256 sums of an invocation
constexpr std::uint64_t kLeastQueries = 16;   ///< a block has so many
/// Most of a block on CPU devices: a softmax reads the scores of a query 16 bytes each by as many queries apart. If
/// these are a kilobyte or less, CPUs fetch them ahead.
constexpr std::uint64_t kCpuQueries = 64;

/// What is computed at a time: all images and queries, or some queries of one image.
struct Block {
    std::uint32_t image = 0, images = 1;
    std::uint32_t query = 0, queries = 1;
};

struct Step {
    vk::Recorder& recorder;
    const AttentionDesc& desc;
    Block block = {};

    [[nodiscard]] std::uint32_t batches() const { return block.images * desc.heads; }
};

/// One matrix per image and head, in quads over its rows.
struct Matrix {
    BufferView view;
    std::uint32_t rows = 0, columns = 0;
    std::uint32_t from = 0, stride = 0, head = 0, image = 0;  ///< in quads
};

std::uint32_t quads_of(std::uint32_t rows) {
    return (rows + 3) / 4;
}

/// Channels by `columns` pixels of an activation of `pixels`, from the pixel `first` of the block's first image on.
Matrix activation(const Step& step, const BufferView& view, std::uint32_t pixels,
                  std::uint32_t first, std::uint32_t columns) {
    const std::uint32_t channels = step.desc.c / step.desc.heads;
    const std::uint32_t stride = step.desc.n * pixels;
    const std::uint32_t from = step.block.image * pixels + first;
    return {view, channels, columns, from, stride, channels / 4 * stride, pixels};
}

Matrix of_keys(const Step& step, const BufferView& view) {
    return activation(step, view, step.desc.keys, 0, step.desc.keys);
}

Matrix of_queries(const Step& step, const BufferView& view) {
    return activation(step, view, step.desc.queries, step.block.query, step.block.queries);
}

/// A workspace of consecutive matrices.
Matrix scratch(const AttentionDesc& desc, const BufferView& view, std::uint32_t rows,
               std::uint32_t columns) {
    const std::uint32_t size = quads_of(rows) * columns;
    return {view, rows, columns, 0, columns, size, desc.heads * size};
}

std::uint64_t scratch_bytes(const AttentionDesc& desc, std::uint32_t images, std::uint32_t rows,
                            std::uint32_t columns) {
    return std::uint64_t{images} * desc.heads * quads_of(rows) * columns * 16;
}

params::AttentionParams params_of(const AttentionDesc& desc, const Matrix& s, const Matrix& v,
                                  const Matrix& y) {
    return {.m = 0,
            .n = 0,
            .k = 0,
            .heads = desc.heads,
            .s_from = s.from,
            .s_stride = s.stride,
            .s_head = s.head,
            .s_image = s.image,
            .v_from = v.from,
            .v_stride = v.stride,
            .v_head = v.head,
            .v_image = v.image,
            .y_from = y.from,
            .y_stride = y.stride,
            .y_head = y.head,
            .y_image = y.image,
            .scale = 1};
}

std::uint32_t groups(std::uint32_t items, std::uint32_t per_group) {
    return static_cast<std::uint32_t>(ceil_div(items, per_group));
}

/// What a product adds or multiplies to its result.
struct Other {
    BufferView view;
    std::uint32_t use = params::kAttentionNoOther;
};

/// y = scale * s^T v.
Status multiply(const Step& step, const char* op, const Matrix& s, const Matrix& v, const Matrix& y,
                float scale = 1, const Other& other = {}) {
    const vk::DeviceInfo& device = step.recorder.device();
    const Kernels kernels = step.recorder.kernels();
    params::AttentionParams params = params_of(step.desc, s, v, y);
    params.m = s.columns;
    params.n = v.columns;
    params.k = s.rows;
    params.scale = scale;
    const std::uint32_t batches = step.batches();
    const std::uint32_t size = vk::workgroup_size(device, 64);
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
        const ProductTiles tiles = product_tiles(device, params.m, params.n, batches, true);
        constants = tiles.constants();
        workgroups = {tiles.n, tiles.m, batches};
    }
    constants.push_back({params::kAttentionOtherId, other.use});
    const double m = params.m, n = params.n, k = params.k;
    return step.recorder.dispatch({
        .op = op,
        .shader = "attention_product",
        .constants = std::move(constants),
        .push = params,
        .accesses = {vk::read(s.view), vk::read(v.view),
                     vk::read(present(other.view) ? other.view : v.view), vk::write(y.view)},
        .groups = workgroups,
        .work = {.flops = 2 * batches * m * n * k, .bytes = 4 * batches * (m * k + n * k + m * n)},
        .may_alias = other.use == params::kAttentionAddsOther,
    });
}

/// y = s^T.
Status transpose(const Step& step, const Matrix& s, const Matrix& y) {
    params::AttentionParams params = params_of(step.desc, s, {}, y);
    params.m = s.rows;
    params.n = s.columns;
    const std::uint32_t size = vk::workgroup_size(step.recorder.device(), 8);
    const double elements = 1.0 * step.batches() * s.rows * s.columns;
    return step.recorder.dispatch({
        .op = "attention_transpose",
        .shader = "attention_transpose",
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params,
        .accesses = {vk::read(s.view), vk::write(y.view)},
        .groups = {groups(quads_of(s.rows), size), quads_of(s.columns), step.batches()},
        .work = {.flops = 0, .bytes = 8 * elements},
    });
}

/// Record a kernel with one invocation per query of the weights.
Status per_query(const Step& step, const char* kernel, float scale,
                 std::vector<vk::Access> accesses) {
    params::AttentionParams params{};
    params.n = step.block.queries;
    params.k = step.desc.keys;
    params.heads = step.desc.heads;
    params.scale = scale;
    const std::uint32_t wanted = step.recorder.kernels() == Kernels::kCpu ? 8 : 64;
    const std::uint32_t size = vk::workgroup_size(step.recorder.device(), wanted);
    const double weights = 1.0 * step.batches() * params.n * params.k;
    return step.recorder.dispatch({
        .op = kernel,
        .shader = kernel,
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params,
        .accesses = std::move(accesses),
        .groups = {groups(params.n, size), 1, step.batches()},
        .work = {.flops = 16 * weights, .bytes = 16 * weights},
        .may_alias = true,
    });
}

float scale_of(const AttentionDesc& desc) {
    return static_cast<float>(1 / std::sqrt(static_cast<double>(desc.c / desc.heads)));
}

/// The weights are neither kept nor stored for a block: forward of a CPU device, if the sums of a head fit its kernel.
bool fuses(const vk::Recorder& recorder, const AttentionDesc& desc, Pass pass) {
    return pass == Pass::kForward && recorder.kernels() == Kernels::kCpu &&
           desc.c / desc.heads <= kFusedChannels && attention_block(recorder, desc) != 0;
}

/// Images and queries of the largest block.
Block largest_block(const vk::Recorder& recorder, const AttentionDesc& desc, Pass pass) {
    const std::uint32_t block = attention_block(recorder, desc);
    if (block == 0) return {0, desc.n, 0, desc.queries};
    return {0, 1, 0, fuses(recorder, desc, pass) ? desc.queries : block};
}

/// Every block, in order.
template <class Function>
Status each_block(const vk::Recorder& recorder, const AttentionDesc& desc, Pass pass,
                  const Function& function) {
    const Block largest = largest_block(recorder, desc, pass);
    for (Block block = largest; block.image < desc.n; block.image += block.images)
        for (block.query = 0; block.query < desc.queries; block.query += largest.queries) {
            block.queries = std::min(largest.queries, desc.queries - block.query);
            SPLAT_TRY(function(block));
        }
    return {};
}

/// Parts of a workspace.
struct Spaces {
    BufferView activation;  ///< transposed
    BufferView weights;     ///< weights of a block; without a buffer if they are kept
    BufferView factors;     ///< a quad for each query of a block
    BufferView scores;      ///< backward: their gradient
    BufferView transposed;  ///< backward: a matrix of their size
    std::uint64_t end = 0;
};

Spaces spaces_of(const vk::Recorder& recorder, const AttentionDesc& desc, const BufferView& view,
                 Pass pass) {
    const Block block = largest_block(recorder, desc, pass);
    const bool backward = pass == Pass::kBackward;
    const std::uint32_t channels = desc.c / desc.heads;
    Spaces at;
    const auto next = [&](std::uint32_t rows, std::uint32_t columns) {
        const std::uint64_t from = at.end;
        const std::uint64_t bytes = scratch_bytes(desc, block.images, rows, columns);
        at.end = round_up(from + bytes, recorder.device().limits.offset_alignment);
        return present(view) ? view.part(from, bytes) : view;
    };
    at.activation = next(backward ? std::max(desc.keys, block.queries) : desc.keys, channels);
    if (attention_block(recorder, desc) != 0 && !fuses(recorder, desc, pass)) {
        at.weights = next(desc.keys, block.queries);
        at.factors = next(1, block.queries);
    }
    if (backward) {
        at.scores = next(desc.keys, block.queries);
        at.transposed = next(block.queries, desc.keys);
    }
    return at;
}

/// weights = softmax(scale * k^T q); with `factors` without its quotient, which they get.
Status compute_weights(const Step& step, const BufferView& q, const BufferView& k,
                       const Matrix& weights, const BufferView& factors = {}) {
    SPLAT_TRY(multiply(step, "attention_scores", of_keys(step, k), of_queries(step, q), weights,
                       scale_of(step.desc)));
    std::vector<vk::Access> accesses = {vk::read(weights.view), vk::write(weights.view)};
    if (!present(factors)) return per_query(step, "attention_forward", 1, std::move(accesses));
    accesses.push_back(vk::write(factors));
    return per_query(step, "attention_forward_block", 1, std::move(accesses));
}

/// y = softmax of all queries' scores, times the values.
Status forward_fused(const Step& step, const Matrix& q, const Matrix& k, const Matrix& values,
                     const Matrix& y) {
    params::AttentionParams params = params_of(step.desc, k, q, y);
    params.m = q.rows;
    params.n = q.columns;
    params.k = k.columns;
    params.scale = scale_of(step.desc);
    const std::uint32_t columns = params.n >= 32 ? 4 : 1;
    const std::uint32_t quads = quads_of(params.m);
    const double pairs = 1.0 * step.batches() * params.n * params.k;
    return step.recorder.dispatch({
        .op = "attention_forward_fused",
        .shader = "attention_forward_fused",
        .constants = {{params::kWorkgroupSizeId, 8},
                      {params::kAttentionColumnsId, columns},
                      {params::kAttentionBlocksId, kBlocks},
                      {params::kAttentionQuadsId, quads},
                      {params::kAttentionDepthId, quads % 4 == 0   ? 4U
                                                  : quads % 2 == 0 ? 2U
                                                                   : 1U}},
        .push = params,
        .accesses = {vk::read(q.view), vk::read(k.view), vk::read(values.view), vk::write(y.view)},
        .groups = {groups(params.n, 8 * columns), 1, step.batches()},
        .work = {.flops = pairs * (4 * params.m + 16),
                 .bytes = 8.0 * step.desc.c * (params.n + params.k)},
    });
}

struct BackwardViews {
    BufferView q, k, v, grad_y;
    AttentionGradients gradients;
};

/// The gradients of one block; those of keys and values are added to the ones of the image's queries before it.
Status backward_block(const Step& step, const BackwardViews& views, const Spaces& spaces,
                      const Matrix& weights) {
    const AttentionDesc& desc = step.desc;
    const AttentionGradients& gradients = views.gradients;
    const std::uint32_t channels = desc.c / desc.heads;
    const std::uint32_t queries = step.block.queries;
    const Matrix grad_scores = scratch(desc, spaces.scores, desc.keys, queries);
    const Matrix transposed = scratch(desc, spaces.transposed, queries, desc.keys);
    const Matrix queries_t = scratch(desc, spaces.activation, queries, channels);
    const Matrix keys_t = scratch(desc, spaces.activation, desc.keys, channels);
    const Matrix grad = of_queries(step, views.grad_y);
    const auto over_queries = [&](const char* op, const Matrix& s, const Matrix& w,
                                  const BufferView& y) -> Status {
        SPLAT_TRY(transpose(step, s, queries_t));
        SPLAT_TRY(transpose(step, w, transposed));
        const Other before =
            step.block.query == 0 ? Other{} : Other{y, params::kAttentionAddsOther};
        return multiply(step, op, queries_t, transposed, of_keys(step, y), 1, before);
    };

    if (present(gradients.v))
        SPLAT_TRY(over_queries("attention_grad_v", grad, weights, gradients.v));
    if (!present(gradients.q) && !present(gradients.k)) return {};
    SPLAT_TRY(multiply(step, "attention_grad_weights", of_keys(step, views.v), grad, grad_scores));
    SPLAT_TRY(per_query(
        step, "attention_backward", scale_of(desc),
        {vk::read(weights.view), vk::read(grad_scores.view), vk::write(grad_scores.view)}));
    if (present(gradients.q)) {
        SPLAT_TRY(transpose(step, of_keys(step, views.k), keys_t));
        SPLAT_TRY(
            multiply(step, "attention_grad_q", keys_t, grad_scores, of_queries(step, gradients.q)));
    }
    if (!present(gradients.k)) return {};
    return over_queries("attention_grad_k", of_queries(step, views.q), grad_scores, gradients.k);
}

}  // namespace

std::uint32_t attention_block(const vk::Recorder& recorder, const AttentionDesc& desc) {
    const std::uint64_t query = scratch_bytes(desc, 1, desc.keys, 1);
    const std::uint64_t slice = recorder.device().limits.slice_bytes;
    if (query * desc.queries <= slice) return 0;
    const bool cpu = recorder.kernels() == Kernels::kCpu;
    const std::uint64_t most = cpu ? std::min(slice / query, kCpuQueries) : 8 * slice / query;
    const std::uint64_t tile = most < 64 ? kLeastQueries : 64;  // whole tiles of the products
    const std::uint64_t whole = std::max(most / tile * tile, kLeastQueries);
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(whole, desc.queries));
}

Status attention_check(const vk::Recorder& recorder, const AttentionDesc& desc) {
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
    const Block block = largest_block(recorder, desc, Pass::kBackward);
    const std::uint64_t most =
        round_up(block.queries, std::uint64_t{4}) * round_up(desc.keys, std::uint64_t{4});
    const auto weights = checked_mul(std::uint64_t{block.images} * desc.heads, most);
    if (!batches || !weights || *weights > kMaxElements)
        return unsupported(
            "attention: %u x %u weights for each of %u images and %u heads are 2^31 or "
            "more",
            block.queries, desc.keys, block.images, desc.heads);
    const std::uint32_t most_groups = recorder.device().limits.max_groups[2];
    if (*batches > most_groups)
        return unsupported(
            "attention: %u images of %u heads, but the device takes at most %u in all", desc.n,
            desc.heads, most_groups);
    return {};
}

Shape attention_weights_shape(const AttentionDesc& desc) {
    return {desc.n * desc.heads, quads_of(desc.keys), desc.queries, 4};
}

std::uint64_t attention_forward_bytes(const vk::Recorder& recorder, const AttentionDesc& desc) {
    return spaces_of(recorder, desc, {}, Pass::kForward).end;
}

std::uint64_t attention_backward_bytes(const vk::Recorder& recorder, const AttentionDesc& desc) {
    return spaces_of(recorder, desc, {}, Pass::kBackward).end;
}

Status attention_forward(vk::Recorder& recorder, const AttentionDesc& desc, const BufferView& q,
                         const BufferView& k, const BufferView& v, const BufferView& y,
                         const BufferView& weights, const BufferView& workspace) {
    SPLAT_TRY(attention_check(recorder, desc));
    const Spaces spaces = spaces_of(recorder, desc, workspace, Pass::kForward);
    return each_block(recorder, desc, Pass::kForward, [&](const Block& block) -> Status {
        const Step step{recorder, desc, block};
        const Matrix values = scratch(desc, spaces.activation, desc.keys, desc.c / desc.heads);
        const Matrix out = of_queries(step, y);
        if (block.query == 0) SPLAT_TRY(transpose(step, of_keys(step, v), values));
        if (fuses(recorder, desc, Pass::kForward))
            return forward_fused(step, of_queries(step, q), of_keys(step, k), values, out);
        const bool kept = !present(spaces.weights);
        const Matrix w = scratch(desc, kept ? weights : spaces.weights, desc.keys, block.queries);
        SPLAT_TRY(compute_weights(step, q, k, w, spaces.factors));
        const Other factors = {spaces.factors, params::kAttentionTimesOther};
        return multiply(step, "attention_values", values, w, out, 1, kept ? Other{} : factors);
    });
}

Status attention_backward(vk::Recorder& recorder, const AttentionDesc& desc, const BufferView& q,
                          const BufferView& k, const BufferView& v, const BufferView& weights,
                          const BufferView& grad_y, const AttentionGradients& gradients,
                          const BufferView& workspace) {
    SPLAT_TRY(attention_check(recorder, desc));
    const Spaces spaces = spaces_of(recorder, desc, workspace, Pass::kBackward);
    return each_block(recorder, desc, Pass::kBackward, [&](const Block& block) -> Status {
        const Step step{recorder, desc, block};
        const bool kept = !present(spaces.weights);
        const Matrix w = scratch(desc, kept ? weights : spaces.weights, desc.keys, block.queries);
        if (!kept) SPLAT_TRY(compute_weights(step, q, k, w));
        return backward_block(step, {q, k, v, grad_y, gradients}, spaces, w);
    });
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
    SPLAT_TRY(attention_check(recorder, desc));
    OpPlan plan{.outputs = {inputs[0]},
                .forward_workspace = attention_forward_bytes(recorder, desc),
                .backward_workspace = attention_backward_bytes(recorder, desc)};
    if (attention_block(recorder, desc) == 0) plan.saved = {attention_weights_shape(desc)};
    return plan;
}

BufferView kept_weights(const OpViews& v) {
    return v.saved.empty() ? BufferView{} : v.saved[0];
}

Status attention_row_forward(vk::Recorder& recorder, const Attributes& attributes,
                             const OpViews& v) {
    SPLAT_ASSIGN(const AttentionDesc desc,
                 attention_desc(attributes, v.inputs[0].shape, v.inputs[1].shape));
    return attention_forward(recorder, desc, v.inputs[0], v.inputs[1], v.inputs[2], v.outputs[0],
                             kept_weights(v), v.workspace);
}

Status attention_row_backward(vk::Recorder& recorder, const Attributes& attributes,
                              const OpViews& v) {
    SPLAT_ASSIGN(const AttentionDesc desc,
                 attention_desc(attributes, v.inputs[0].shape, v.inputs[1].shape));
    return attention_backward(recorder, desc, v.inputs[0], v.inputs[1], v.inputs[2],
                              kept_weights(v), v.grad_outputs[0],
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
