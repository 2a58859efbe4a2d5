#include "api/model/model_tensors.h"

#include <optional>

#include "core/number_in.h"

namespace splat::api {
namespace {

using model::Model;

constexpr std::pair<Model::Input, const char*> kGradedInputs[] = {
    {Model::Input::kImages, "images"},
    {Model::Input::kEmbedding, "embedding"},
    {Model::Input::kTokens, "tokens"}};

/// "grad:means[1]" taken apart.
struct TensorName {
    bool gradient = false;
    std::string base;
    std::optional<std::uint32_t> object;
};

TensorName parse_name(const std::string& text) {
    TensorName name;
    name.gradient = text.starts_with("grad:");
    name.base = name.gradient ? text.substr(5) : text;
    const std::size_t open = name.base.find('[');
    if (open == std::string::npos || !name.base.ends_with(']')) return name;
    const std::string_view index(&name.base[open + 1], name.base.size() - open - 2);
    name.object = number_in<std::uint32_t>(index);
    if (name.object) name.base.resize(open);
    return name;
}

/// Object `i` of a tensor whose first dimension is that of the objects, or of their images, which then stays. Sets
/// shape, place and length alone.
Status take_object(ModelTensor& found, vk::Context& context, std::uint32_t objects, std::uint32_t i,
                   bool images, const char* name) {
    if (i >= objects) return invalid("'%s': expected an object less than %u", name, objects);
    const Shape all = found.view.shape;
    std::vector<std::int64_t> dims;
    if (images || all[0] != objects) dims.push_back(all[0] / objects);
    for (std::uint32_t axis = 1; axis < all.rank(); ++axis) dims.push_back(all[axis]);
    if (dims.back() == 1) dims.pop_back();
    SPLAT_ASSIGN(const Shape shape, Shape::create(dims, name));
    const std::uint64_t bytes = shape.elements() * sizeof(float);
    const std::uint64_t alignment = context.device().info().limits.offset_alignment;
    if (objects > 1 && (bytes % alignment != 0 || bytes % 16 != 0))
        return unsupported(
            "'%s' has %llu bytes, but the device binds parts at multiples of %llu: take "
            "the tensor of all objects",
            name, llu(bytes), llu(alignment));
    if (objects > 1) {
        found.offset = i * bytes;
        if (found.rows == nullptr) found.view = found.view.part(found.offset, bytes);
    }
    found.view.shape = shape;
    return {};
}

Status no_gradients() {
    return bad_state("the model was made without SPLAT_MODEL_GRADIENTS");
}

Result<vk::BufferView> parameter_view(const nn::Parameter& parameter, bool gradient) {
    if (!gradient) return parameter.value;
    if (parameter.grad.block != nullptr) return parameter.grad;
    return bad_state("parameter '%s' has no gradient: %s", parameter.name.c_str(),
                     parameter.trainable ? "the model was made without SPLAT_MODEL_GRADIENTS"
                                         : "the configuration does not train it");
}

}  // namespace

Status expect_ran(const ModelObject& object) {
    if (object.ran) return {};
    return bad_state("the model has not run: call splat_model_forward first");
}

std::vector<ModelOutput> model_outputs(const Model& network) {
    const std::uint32_t m = network.set_desc().gaussians;
    // Not from sets(), whose version a pass on another thread changes.
    const std::uint32_t n = network.raw_output().shape[0] / network.config().views;
    using Rows = Model::Outputs;
    return {{"means", {n, m, 3}, &Rows::means},
            {"opacities", {n, m, 1}, &Rows::opacities},
            {"scales", {n, m, 3}, &Rows::scales},
            {"rotations", {n, m, 4}, &Rows::rotations},
            {"sh", {n, m, network.set_desc().color_floats() / 3, 3}, &Rows::sh},
            {"raw", network.raw_output().shape, nullptr}};
}

Result<ModelTensor> find_model_tensor(Model& network, std::uint32_t objects,
                                      const std::string& text) {
    const TensorName name = parse_name(text);
    for (const ModelOutput& output : model_outputs(network)) {
        if (name.base != output.name || (name.gradient && output.rows == nullptr)) continue;
        if (name.gradient && !network.has_gradients()) return no_gradients();
        ModelTensor found;
        found.use = name.gradient ? network.outside_gradients() : network.outside();
        found.of_pass = !name.gradient;
        found.rows = output.rows;
        if (output.rows == nullptr) found.view = network.raw_output();
        found.view.shape = output.shape;
        if (name.object)
            SPLAT_TRY(take_object(found, network.context(), objects, *name.object,
                                  output.rows == nullptr, text.c_str()));
        return found;
    }
    if (!name.object) {
        for (const auto& [input, known] : kGradedInputs) {
            if (!name.gradient || name.base != known) continue;
            SPLAT_ASSIGN(const vk::BufferView view, network.input_gradient_tensor(input));
            return ModelTensor{view, network.outside_gradients(), false, true};
        }
        for (const Model::Port& port : network.inputs()) {
            if (name.gradient || name.base != port.name) continue;
            SPLAT_ASSIGN(const vk::BufferView view, network.input_tensor(port.name));
            return ModelTensor{view, network.outside(), false, false};
        }
        if (const nn::Parameter* parameter = network.parameters().find(name.base)) {
            SPLAT_ASSIGN(const vk::BufferView view, parameter_view(*parameter, name.gradient));
            return ModelTensor{
                view, name.gradient ? network.outside_gradients() : network.parameters().outside(),
                false, false};
        }
    }
    std::string inputs;
    for (const Model::Port& port : network.inputs()) inputs += std::string(", ") + port.name;
    return not_found(
        "'%s' is not a result (means, opacities, scales, rotations, sh, raw; of one object "
        "'means[0]'), an input (%s), a parameter, or a gradient ('grad:' and the name of a "
        "result, a parameter, images, embedding or tokens)",
        text.c_str(), inputs.c_str() + 2);
}

Status bind_model_tensor(Model& network, ModelTensor& tensor) {
    if (tensor.rows == nullptr) return {};
    SPLAT_ASSIGN(const Model::Outputs rows,
                 tensor.of_pass ? network.outputs() : network.output_gradients());
    const Shape shape = tensor.view.shape;
    const vk::BufferView& all = rows.*tensor.rows;
    const bool whole = shape.elements() == all.shape.elements();
    tensor.view = whole ? all : all.part(tensor.offset, shape.elements() * sizeof(float));
    tensor.view.shape = shape;
    return {};
}

}  // namespace splat::api
