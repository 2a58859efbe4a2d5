#include "nn/op_table.h"

#include <string>

#include "core/checked_math.h"
#include "ops/group_norm.h"
#include "ops/linear.h"

namespace splat::nn {
namespace {

using vk::BufferView;

Status expect_shape(const char* op, const char* tensor, const Shape& got, const Shape& expected) {
    if (got == expected) return {};
    return error(Code::kShape, "%s: tensor '%s' has shape %s, expected %s", op, tensor,
                 got.text().c_str(), expected.text().c_str());
}

/// A part of the workspace, starting at `offset` bytes.
BufferView part_of(const BufferView& workspace, std::uint64_t offset, std::uint64_t bytes) {
    BufferView part = workspace;
    part.offset += offset;
    part.bytes = bytes;
    return part;
}

// ---- group_norm ---------------------------------------------------------------------------------

constexpr Port kGroupNormInputs[] = {
    {"x"}, {"gamma", Layout::kRowMajor}, {"beta", Layout::kRowMajor}};
constexpr Port kOutputY[] = {{"y"}};
constexpr const char* kGroupNormSaved[] = {"mean", "rstd"};
constexpr Attribute kGroupNormAttributes[] = {
    {"groups", "integer", "1", "number of groups; divides the channels"},
    {"eps", "number", "1e-6", "added to the variance; > 0"},
    {"silu", "boolean", "false", "apply SiLU in the same pass"},
};

Result<ops::GroupNormDesc> group_norm_desc(const Attributes& attributes, const Shape& x) {
    if (x.rank() < 2)
        return error(Code::kShape, "group_norm: tensor 'x' has shape %s, expected [N, C, ...]",
                     x.text().c_str());
    ops::GroupNormDesc desc;
    SPLAT_ASSIGN(desc.x, ops::quad_dims(x));
    const auto groups = attributes.integer("groups");
    if (groups < 1 || groups > desc.x.c)
        return error(Code::kInvalidArgument, "group_norm: groups is %lld, expected 1 to %u",
                     static_cast<long long>(groups), desc.x.c);
    desc.groups = static_cast<std::uint32_t>(groups);
    desc.eps = static_cast<float>(attributes.number("eps"));
    desc.silu = attributes.boolean("silu");
    return desc;
}

Result<OpPlan> group_norm_plan(const vk::Recorder& recorder, const Attributes& attributes,
                               std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const ops::GroupNormDesc desc, group_norm_desc(attributes, inputs[0]));
    SPLAT_TRY(ops::group_norm_check(recorder.device(), desc));
    SPLAT_TRY(expect_shape("group_norm", "gamma", inputs[1], {desc.x.c}));
    SPLAT_TRY(expect_shape("group_norm", "beta", inputs[2], {desc.x.c}));
    OpPlan plan;
    plan.outputs = {inputs[0]};
    plan.saved = {{desc.x.n, desc.groups}, {desc.x.n, desc.groups}};
    plan.backward_workspace = ops::group_norm_sums_bytes(desc);
    return plan;
}

Status group_norm_forward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    SPLAT_ASSIGN(const ops::GroupNormDesc desc, group_norm_desc(attributes, v.inputs[0].shape));
    return ops::group_norm_forward(recorder, desc, v.inputs[0], v.inputs[1], v.inputs[2],
                                   v.outputs[0], v.saved[0], v.saved[1]);
}

Status group_norm_backward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    SPLAT_ASSIGN(const ops::GroupNormDesc desc, group_norm_desc(attributes, v.inputs[0].shape));
    return ops::group_norm_backward(recorder, desc, v.inputs[0], v.inputs[1], v.inputs[2],
                                    v.saved[0], v.saved[1], v.grad_outputs[0], v.grad_inputs[0],
                                    v.grad_inputs[1], v.grad_inputs[2], v.workspace, v.accumulate);
}

// ---- linear -------------------------------------------------------------------------------------

constexpr Port kLinearInputs[] = {
    {"x"}, {"weight", Layout::kRowMajor}, {"bias", Layout::kRowMajor, true}};

ops::LinearDesc linear_desc(const Shape& x, const Shape& weight, bool bias) {
    return {x[0], x[1], weight[0], bias};
}

/// Where the workspace goes on behind the packed transpose.
std::uint64_t packed_end(const vk::Recorder& recorder, const ops::LinearDesc& desc) {
    return round_up(ops::linear_packed_bytes(recorder, desc, true),
                    recorder.device().limits.offset_alignment);
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
    const ops::LinearDesc desc = linear_desc(x, weight, bias);
    SPLAT_TRY(ops::linear_check(desc));
    OpPlan plan;
    plan.outputs = {{x[0], weight[0]}};
    plan.forward_workspace = ops::linear_packed_bytes(recorder, desc, false);
    plan.backward_workspace =
        packed_end(recorder, desc) + ops::linear_backward_weight_bytes(recorder, desc);
    return plan;
}

/// The weight in the form that the kernels in use read, packed into the workspace if need be.
Result<BufferView> pack(vk::Recorder& recorder, const ops::LinearDesc& desc, const OpViews& v,
                        bool transposed) {
    const std::uint64_t bytes = ops::linear_packed_bytes(recorder, desc, transposed);
    if (bytes == 0) return v.inputs[1];
    const BufferView packed = part_of(v.workspace, 0, bytes);
    SPLAT_TRY(ops::linear_pack_weight(recorder, desc, v.inputs[1], packed, transposed));
    return packed;
}

Status linear_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    const bool bias = v.inputs[2].block != nullptr;
    const ops::LinearDesc desc = linear_desc(v.inputs[0].shape, v.inputs[1].shape, bias);
    SPLAT_ASSIGN(const BufferView weight, pack(recorder, desc, v, false));
    return ops::linear_forward(recorder, desc, v.inputs[0], weight,
                               bias ? v.inputs[2] : v.inputs[1], v.outputs[0]);
}

Status linear_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    const bool bias = v.inputs[2].block != nullptr;
    const ops::LinearDesc desc = linear_desc(v.inputs[0].shape, v.inputs[1].shape, bias);
    SPLAT_ASSIGN(const BufferView weight, pack(recorder, desc, v, true));
    SPLAT_TRY(
        ops::linear_backward_input(recorder, desc, weight, v.grad_outputs[0], v.grad_inputs[0]));
    const std::uint64_t bytes = ops::linear_backward_weight_bytes(recorder, desc);
    const BufferView partial = part_of(v.workspace, packed_end(recorder, desc), bytes);
    SPLAT_TRY(ops::linear_backward_weight(recorder, desc, v.inputs[0], v.grad_outputs[0],
                                          v.grad_inputs[1], partial, v.accumulate));
    if (!bias) return {};
    return ops::linear_backward_bias(recorder, desc, v.grad_outputs[0], v.grad_inputs[2],
                                     v.accumulate);
}

const OpRow kOps[] = {
    {.name = "group_norm",
     .equation = "y = gamma * (x - mean) / sqrt(var + eps) + beta over C/groups channels and all "
                 "pixels; then silu(y) if silu",
     .inputs = kGroupNormInputs,
     .outputs = kOutputY,
     .saved = kGroupNormSaved,
     .attributes = kGroupNormAttributes,
     .plan = group_norm_plan,
     .forward = group_norm_forward,
     .backward = group_norm_backward},
    {.name = "linear",
     .equation = "y = x weight^T + bias",
     .inputs = kLinearInputs,
     .outputs = kOutputY,
     .saved = {},
     .attributes = {},
     .plan = linear_plan,
     .forward = linear_forward,
     .backward = linear_backward},
};

}  // namespace

std::span<const OpRow> op_table() {
    return kOps;
}

Result<const OpRow*> find_op(std::string_view name) {
    std::string names;
    for (const OpRow& row : kOps) {
        if (name == row.name) return &row;
        names += (names.empty() ? "" : ", ") + std::string(row.name);
    }
    return error(Code::kInvalidArgument, "no operator named '%s'; there are: %s",
                 std::string(name).c_str(), names.c_str());
}

namespace {

std::string text_of(const JsonScalar& scalar) {
    if (const auto* flag = std::get_if<bool>(&scalar.value)) return *flag ? "true" : "false";
    if (const auto* number = std::get_if<double>(&scalar.value)) return format("%.9g", *number);
    return std::to_string(std::get<std::int64_t>(scalar.value));
}

}  // namespace

Result<Attributes> complete_attributes(const OpRow& row, std::span<const JsonScalar> given) {
    std::vector<JsonScalar> complete;
    for (const Attribute& attribute : row.attributes) {
        SPLAT_ASSIGN(std::vector<JsonScalar> fallback,
                     parse_flat_json(format("{\"%s\": %s}", attribute.name, attribute.fallback),
                                     "attribute default"));
        complete.push_back(std::move(fallback[0]));
    }
    for (const JsonScalar& scalar : given) {
        std::size_t at = 0;
        while (at < complete.size() && complete[at].name != scalar.name) ++at;
        if (at == complete.size()) {
            std::string names;
            for (const Attribute& attribute : row.attributes)
                names += std::string(" ") + attribute.name;
            return error(Code::kInvalidArgument, "%s: no attribute '%s'; there are:%s", row.name,
                         scalar.name.c_str(), names.empty() ? " none" : names.c_str());
        }
        const std::string_view expected = row.attributes[at].type;
        const bool is_integer = std::holds_alternative<std::int64_t>(scalar.value);
        const bool fits = expected == "integer"   ? is_integer
                          : expected == "boolean" ? std::holds_alternative<bool>(scalar.value)
                                                  : !std::holds_alternative<bool>(scalar.value);
        if (!fits)
            return error(Code::kInvalidArgument, "%s: attribute '%s' is %s, expected type %s",
                         row.name, scalar.name.c_str(), text_of(scalar).c_str(),
                         row.attributes[at].type);
        complete[at].value = scalar.value;
    }
    return Attributes(std::move(complete));
}

const JsonScalar& Attributes::find(std::string_view name) const {
    std::size_t at = 0;
    while (values_[at].name != name) ++at;  // operators ask for what their row lists
    return values_[at];
}

std::int64_t Attributes::integer(std::string_view name) const {
    return std::get<std::int64_t>(find(name).value);
}

double Attributes::number(std::string_view name) const {
    const auto& value = find(name).value;
    const auto* integer = std::get_if<std::int64_t>(&value);
    return integer != nullptr ? static_cast<double>(*integer) : std::get<double>(value);
}

bool Attributes::boolean(std::string_view name) const {
    return std::get<bool>(find(name).value);
}

}  // namespace splat::nn
