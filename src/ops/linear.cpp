#include "ops/linear.h"

#include <algorithm>

#include "core/checked_math.h"
#include "core/shape.h"
#include "ops/gpu_tiles.h"
#include "params/linear_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

using vk::Kernels;

/// The register tile of linear_forward_cpu.comp: many rows fill it, few rows (FiLM: one per image) would leave it
/// idle. The height is chosen to waste the least on blocks beyond the last: fetching the rows of a tile takes
/// about as long as three fifths of a block (by its instructions on lavapipe). Only 1, 2 or 4 blocks, because
/// lavapipe compiles each form for 20 to 50 ms. A single block takes twice the rows, because its fetches serve the
/// fewest products; so does any tile on a CPU of many registers, where larger code gains a tenth (Zen 5).
struct Tile {
    std::uint32_t columns;
    std::uint32_t blocks;
    std::uint32_t depth;  ///< quads of k per turn of the loop, 1 or 2
};
constexpr std::uint32_t kMostBlocks = 4;

/// Two quads deep if the unrolled code fits in the instruction cache: for large tiles this is a fifth slower on Zen 3,
/// but takes 0.93 of the time on a Xeon with 64 KiB.
Tile tile_for(const LinearDesc& desc, const vk::DeviceFeatures& device) {
    const std::uint64_t blocks = ceil_div(desc.out_features, 8);
    const auto cost = [&](std::uint32_t height) {
        return ceil_div(blocks, height) * (5 * height + 3);
    };
    std::uint32_t best = 1;
    for (std::uint32_t height = 2; height <= kMostBlocks; height *= 2)
        if (cost(height) <= cost(best)) best = height;
    std::uint32_t columns = 1;
    if (desc.rows >= 32) columns = best == 1 || (device.many_registers && desc.rows >= 64) ? 8 : 4;
    return {columns, best, columns * best <= 8 || device.large_code_cache ? 2U : 1U};
}

params::LinearParams params_of(const LinearDesc& desc) {
    return {desc.rows, desc.in_features, desc.out_features, desc.bias ? 1U : 0U, 0, 0, 0, 1,
            0,         desc.scale};
}

double count(std::uint32_t a, std::uint32_t b) {
    return static_cast<double>(a) * b;
}

vk::Work product_work(const LinearDesc& desc) {
    return {
        .flops = 2.0 * count(desc.rows, desc.in_features) * desc.out_features,
        .bytes = 4.0 * (count(desc.rows, desc.in_features) + count(desc.rows, desc.out_features) +
                        count(desc.in_features, desc.out_features))};
}

/// On CPU devices: the plain kernels loop over all features of a row in one invocation, see kMaxTurns.
constexpr std::uint32_t kMaxFeatures = 65000;

/// linear_backward_weight_cpu.comp: most features per tile, both ways.
constexpr std::uint32_t kFeatureTile = 32;

/// Slices of the rows: enough that none takes more turns than kMaxTurns and, for the fast kernels, that every
/// core or multiprocessor has work, but none with less than a few blocks of 64 rows. On GPUs each sums at most 8192
/// rows, in fours: errors of more would add up, as there are no blocks whose sums are added. More than some 264 slices
/// take longer to be summed than they save.
/// On CPU devices slices of 1024 rows, up to 16, stay in the cache while all tiles read them: a tenth faster.
std::uint32_t slices_for(const vk::Recorder& recorder, const LinearDesc& desc) {
    const bool plain = recorder.kernels() == Kernels::kPlain;
    const std::uint64_t least = ceil_div(desc.rows, plain ? vk::kMaxTurns : 4 * vk::kMaxTurns);
    if (plain) return static_cast<std::uint32_t>(least);
    if (recorder.kernels() == Kernels::kGpu) {
        const std::uint64_t groups = product_groups(desc.in_features, desc.out_features, 64);
        const std::uint64_t busy =
            std::min(ceil_div(2 * kProductGroups, groups), kProductGroups / 2);
        return static_cast<std::uint32_t>(
            std::max(ceil_div(desc.rows, 8192), std::min(busy, ceil_div(desc.rows, 64))));
    }
    const std::uint64_t tiles =
        ceil_div(desc.in_features, kFeatureTile) * ceil_div(desc.out_features, kFeatureTile);
    const std::uint64_t busy = std::min(ceil_div(16, tiles), ceil_div(desc.rows, 256));
    const std::uint64_t cached = std::min<std::uint64_t>(desc.rows / 1024, 16);
    return static_cast<std::uint32_t>(std::max({least, busy, cached}));
}

/// A fast product's workgroups: those along the output features, next to each other in time, and along the rows.
vk::Groups product_groups_of(const vk::Recorder& recorder, std::uint64_t features,
                             std::uint64_t row_groups) {
    const std::uint64_t layers = ceil_div(row_groups, recorder.device().limits.max_groups[1]);
    return {static_cast<std::uint32_t>(features),
            static_cast<std::uint32_t>(ceil_div(row_groups, layers)),
            static_cast<std::uint32_t>(layers)};
}

/// The fast product; backward_input is the same with in and out exchanged.
Status multiply(vk::Recorder& recorder, const char* op, const LinearDesc& desc,
                const vk::BufferView& x, const vk::BufferView& weight, const vk::BufferView& bias,
                const vk::BufferView& y, const vk::BufferView& residual) {
    const bool has_residual = residual.block != nullptr;
    std::vector<vk::SpecConstant> constants;
    vk::Groups groups;
    if (recorder.kernels() == Kernels::kCpu) {
        const Tile tile = tile_for(desc, recorder.device().features);
        constexpr std::uint32_t kSize = 8;  // CPU devices distribute workgroups, so these are small
        constants = {{params::kWorkgroupSizeId, kSize},
                     {params::kLinearColumnsId, tile.columns},
                     {params::kLinearBlocksId, tile.blocks},
                     {params::kLinearDepthId, tile.depth}};
        groups = product_groups_of(recorder, ceil_div(desc.out_features, 8 * tile.blocks),
                                   ceil_div(desc.rows, std::uint64_t{kSize} * tile.columns));
    } else {
        const ProductTiles tiles =
            product_tiles(recorder.device(), desc.out_features, desc.rows, 1, true);
        constants = tiles.constants();
        groups = product_groups_of(recorder, tiles.m, tiles.n);
    }
    constants.push_back({params::kLinearResidualId, has_residual ? 1U : 0U});
    params::LinearParams params = params_of(desc);
    params.groups_x = groups[1];
    return recorder.dispatch({
        .op = op,
        .shader = "linear_forward",
        .constants = std::move(constants),
        .push = params,
        .accesses = {vk::read(x), vk::read(weight), vk::read(bias),
                     vk::read(has_residual ? residual : x), vk::write(y)},
        .groups = groups,
        .work = product_work(desc),
    });
}

}  // namespace

Status linear_check(const vk::DeviceInfo& device, const LinearDesc& desc) {
    const std::uint64_t rows = desc.rows;
    const std::uint64_t in = round_up(desc.in_features, 16);
    const std::uint64_t out = round_up(desc.out_features, 16);
    if (rows * in > kMaxElements || rows * out > kMaxElements || in * out > kMaxElements)
        return unsupported(
            "linear: %u rows, %u -> %u features: an operand has 2^31 elements or more", desc.rows,
            desc.in_features, desc.out_features);
    if (device.kind == vk::DeviceKind::kCpu &&
        (desc.in_features > kMaxFeatures || desc.out_features > kMaxFeatures))
        return unsupported("linear: %u -> %u features, expected at most %u", desc.in_features,
                           desc.out_features, kMaxFeatures);
    return {};
}

std::uint64_t linear_packed_bytes(const vk::Recorder& recorder, const LinearDesc& desc,
                                  bool transposed) {
    if (recorder.kernels() == Kernels::kPlain) return 0;
    const std::uint64_t in = transposed ? desc.out_features : desc.in_features;
    const std::uint64_t out = transposed ? desc.in_features : desc.out_features;
    return round_up(in, 8) * round_up(out, 8) * 4;
}

Status linear_pack_weight(vk::Recorder& recorder, const LinearDesc& desc,
                          const vk::BufferView& weight, const vk::BufferView& packed,
                          bool transposed) {
    SPLAT_TRY(linear_check(recorder.device(), desc));
    const std::uint64_t bytes = linear_packed_bytes(recorder, desc, transposed);
    if (bytes == 0) return {};
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups = vk::groups_for(recorder.device(), bytes / 16, size);
    params::LinearParams params = params_of(desc);
    if (transposed) std::swap(params.in_features, params.out_features);
    params.transposed = transposed ? 1 : 0;
    params.groups_x = groups[0];
    return recorder.dispatch({
        .op = "linear_pack_weight",
        .shader = "linear_pack_weight",
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params,
        .accesses = {vk::read(weight), vk::write(packed)},
        .groups = groups,
        .work = {.flops = 0, .bytes = 2.0 * static_cast<double>(bytes)},
    });
}

Status linear_forward(vk::Recorder& recorder, const LinearDesc& desc, const vk::BufferView& x,
                      const vk::BufferView& weight, const vk::BufferView& bias,
                      const vk::BufferView& y, const vk::BufferView& residual) {
    SPLAT_TRY(linear_check(recorder.device(), desc));
    if (recorder.kernels() != Kernels::kPlain)
        return multiply(recorder, "linear_forward", desc, x, weight, bias, y, residual);
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups =
        vk::groups_for(recorder.device(), ceil_div(desc.out_features, 4) * desc.rows, size);
    params::LinearParams params = params_of(desc);
    params.groups_x = groups[0];
    params.has_residual = residual.block != nullptr ? 1 : 0;
    return recorder.dispatch({
        .op = "linear_forward",
        .shader = "linear_forward",
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params,
        .accesses = {vk::read(x), vk::read(weight), vk::read(bias),
                     vk::read(params.has_residual != 0 ? residual : x), vk::write(y)},
        .groups = groups,
        .work = product_work(desc),
    });
}

Status linear_backward_input(vk::Recorder& recorder, const LinearDesc& desc,
                             const vk::BufferView& weight, const vk::BufferView& grad_y,
                             const vk::BufferView& grad_x) {
    SPLAT_TRY(linear_check(recorder.device(), desc));
    if (recorder.kernels() != Kernels::kPlain) {
        const LinearDesc transposed{desc.rows, desc.out_features, desc.in_features, false,
                                    desc.scale};
        return multiply(recorder, "linear_backward_input", transposed, grad_y, weight, weight,
                        grad_x, {});
    }
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups =
        vk::groups_for(recorder.device(), ceil_div(desc.in_features, 4) * desc.rows, size);
    params::LinearParams params = params_of(desc);
    params.groups_x = groups[0];
    return recorder.dispatch({
        .op = "linear_backward_input",
        .shader = "linear_backward_input",
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params,
        .accesses = {vk::read(weight), vk::read(grad_y), vk::write(grad_x)},
        .groups = groups,
        .work = product_work(desc),
    });
}

std::uint64_t linear_backward_weight_bytes(const vk::Recorder& recorder, const LinearDesc& desc) {
    return std::uint64_t{slices_for(recorder, desc)} * desc.out_features *
           round_up(desc.in_features, 4) * 4;
}

Status linear_backward_weight(vk::Recorder& recorder, const LinearDesc& desc,
                              const vk::BufferView& x, const vk::BufferView& grad_y,
                              const vk::BufferView& grad_weight, const vk::BufferView& partial,
                              bool accumulate) {
    SPLAT_TRY(linear_check(recorder.device(), desc));
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups per_weight = vk::groups_for(
        recorder.device(), std::uint64_t{desc.in_features} * desc.out_features, size);
    params::LinearParams params = params_of(desc);
    params.accumulate = accumulate ? 1 : 0;
    params.groups_x = per_weight[0];
    params.slices = slices_for(recorder, desc);

    const Kernels kernels = recorder.kernels();
    vk::Groups groups = per_weight;
    std::vector<vk::SpecConstant> constants = {{params::kWorkgroupSizeId, size}};
    if (kernels == Kernels::kCpu) {
        // The 72 taps of an adapter of rank 8 are three tiles of 24, not of 32. Only two sizes, as each is
        // one more pipeline.
        const auto out_tiles =
            static_cast<std::uint32_t>(ceil_div(desc.out_features, kFeatureTile));
        const std::uint64_t out_quads = ceil_div(ceil_div(desc.out_features, 4), out_tiles);
        constants = {{params::kWorkgroupSizeId, 8},
                     {params::kLinearOutQuadsId, out_tiles > 1 && out_quads <= 6 ? 6U : 8U}};
        groups = {static_cast<std::uint32_t>(ceil_div(desc.in_features, kFeatureTile)), out_tiles,
                  1};
    } else if (kernels == Kernels::kGpu) {
        const ProductTiles tiles = product_tiles(recorder.device(), desc.in_features,
                                                 desc.out_features, params.slices, false);
        constants = tiles.constants();
        groups = {tiles.m, tiles.n, 1};
    }
    groups[2] = params.slices;
    SPLAT_TRY(recorder.dispatch({
        .op = "linear_backward_weight",
        .shader = "linear_backward_weight",
        .constants = constants,
        .push = params,
        .accesses = {vk::read(x), vk::read(grad_y), vk::write(partial)},
        .groups = groups,
        .work = product_work(desc),
    }));
    const double sums = count(params.slices, desc.in_features) * desc.out_features;
    return recorder.dispatch({
        .op = "linear_backward_weight_reduce",
        .shader = "linear_backward_weight_reduce",
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params,
        .accesses = {vk::read(partial), vk::read_write(grad_weight)},
        .groups = per_weight,
        .work = {.flops = sums, .bytes = 4.0 * sums},
    });
}

Status linear_backward_bias(vk::Recorder& recorder, const LinearDesc& desc,
                            const vk::BufferView& grad_y, const vk::BufferView& grad_bias,
                            bool accumulate) {
    SPLAT_TRY(linear_check(recorder.device(), desc));
    params::LinearParams params = params_of(desc);
    params.accumulate = accumulate ? 1 : 0;
    const double elements = count(desc.rows, desc.out_features);
    return recorder.dispatch({
        .op = "linear_backward_bias",
        .shader = "linear_backward_bias",
        .constants = {{params::kWorkgroupSizeId,
                       vk::workgroup_size(recorder.device(), 64, desc.rows)}},
        .push = params,
        .accesses = {vk::read(grad_y), vk::read_write(grad_bias)},
        .groups = {(desc.out_features + 3) / 4, 1, 1},
        .work = {.flops = elements, .bytes = 4.0 * elements},
    });
}

namespace {

constexpr Port kLinearInputs[] = {
    {"x"}, {"weight", Layout::kRowMajor}, {"bias", Layout::kRowMajor, true}};

LinearDesc linear_desc(const OpViews& v) {
    const Shape& x = v.inputs[0].shape;
    return {x[0], x[1], v.inputs[1].shape[0], present(v.inputs[2])};
}

Result<OpPlan> linear_plan(const vk::Recorder& recorder, const Attributes&,
                           std::span<const Shape> inputs) {
    const Shape& x = inputs[0];
    const Shape& weight = inputs[1];
    if (x.rank() != 2)
        return error(Code::kShape, "linear: tensor 'x' has shape %s, expected [rows, in]",
                     x.text().c_str());
    if (weight.rank() != 2)
        return error(Code::kShape, "linear: tensor 'weight' has shape %s, expected [out, in]",
                     weight.text().c_str());
    SPLAT_TRY(expect_shape("linear", "weight", weight, {weight[0], x[1]}));
    const bool bias = inputs[2].rank() > 0;
    if (bias) SPLAT_TRY(expect_shape("linear", "bias", inputs[2], {weight[0]}));
    const LinearDesc desc{x[0], x[1], weight[0], bias};
    SPLAT_TRY(linear_check(recorder.device(), desc));
    return OpPlan{.outputs = {Shape{x[0], weight[0]}},
                  .backward_workspace = linear_backward_weight_bytes(recorder, desc),
                  .forward_prepared = linear_packed_bytes(recorder, desc, false),
                  .backward_prepared = linear_packed_bytes(recorder, desc, true)};
}

Status linear_row_prepare(vk::Recorder& recorder, const Attributes&, const OpViews& v, Pass pass) {
    const bool transposed = pass == Pass::kBackward;
    return linear_pack_weight(recorder, linear_desc(v), v.inputs[1],
                              transposed ? v.backward_prepared : v.forward_prepared, transposed);
}

Status linear_row_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    const LinearDesc desc = linear_desc(v);
    const vk::BufferView& weight = present(v.forward_prepared) ? v.forward_prepared : v.inputs[1];
    return linear_forward(recorder, desc, v.inputs[0], weight,
                          desc.bias ? v.inputs[2] : v.inputs[1], v.outputs[0]);
}

Status linear_row_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    const LinearDesc desc = linear_desc(v);
    const vk::BufferView& weight = present(v.backward_prepared) ? v.backward_prepared : v.inputs[1];
    if (present(v.grad_inputs[0]))
        SPLAT_TRY(
            linear_backward_input(recorder, desc, weight, v.grad_outputs[0], v.grad_inputs[0]));
    if (present(v.grad_inputs[1])) {
        const vk::BufferView partial =
            v.workspace.part(0, linear_backward_weight_bytes(recorder, desc));
        SPLAT_TRY(linear_backward_weight(recorder, desc, v.inputs[0], v.grad_outputs[0],
                                         v.grad_inputs[1], partial, v.accumulate));
    }
    if (!present(v.grad_inputs[2])) return {};
    return linear_backward_bias(recorder, desc, v.grad_outputs[0], v.grad_inputs[2], v.accumulate);
}

}  // namespace

const OpRow kLinearRow = {.name = "linear",
                          .equation = "y = x weight^T + bias",
                          .inputs = kLinearInputs,
                          .outputs = kOutputY,
                          .plan = linear_plan,
                          .prepare = linear_row_prepare,
                          .forward = linear_row_forward,
                          .backward = linear_row_backward,
                          .backward_reads = product_backward_reads};

}  // namespace splat::ops
