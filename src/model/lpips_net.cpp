#include "model/lpips_net.h"

#include <algorithm>

#include "core/finite.h"

namespace splat::model {
namespace {

using io::NamedTensor;
using io::NamedTensors;
using nn::kNoValue;
using nn::ValueId;

/// A stage of VGG16: positions of its convolutions in torchvision's list of layers, and their channels.
/// Stages end with the compared features; all but the first start by halving the image.
struct Stage {
    std::vector<int> layers;
    std::uint32_t channels;
};
const Stage kStages[] = {
    {{0, 2}, 64}, {{5, 7}, 128}, {{10, 12, 14}, 256}, {{17, 19, 21}, 512}, {{24, 26, 28}, 512}};
constexpr std::uint32_t kLeastSide = 16;  // one pixel after four halvings

constexpr const char* kScaling = "scaling";
constexpr double kShift[] = {-.030, -.088, -.188};
constexpr double kScale[] = {.458, .448, .450};

/// Names that a parameter may have in a file.
std::vector<std::string> file_names(const std::string& name) {
    if (!name.starts_with("features.")) return {name, "lins." + name.substr(3)};
    const std::string layer = name.substr(9);
    const int place = std::atoi(layer.c_str());
    int stage = 1;
    for (const Stage& s : kStages) {
        if (place <= s.layers.back()) break;
        ++stage;
    }
    return {name, "net.slice" + std::to_string(stage) + "." + layer};
}

/// (2x - 1 - shift) / scale of each channel, as a convolution of one tap.
std::vector<float> scaling_values(const std::string& name) {
    std::vector<float> values(name.ends_with("weight") ? 9 : 3, 0);
    for (std::size_t c = 0; c < 3; ++c) {
        if (values.size() == 9)
            values[4 * c] = static_cast<float>(2 / kScale[c]);
        else
            values[c] = static_cast<float>(-(1 + kShift[c]) / kScale[c]);
    }
    return values;
}

Result<const NamedTensor*> find(std::span<const NamedTensors* const> weights,
                                const nn::Parameter& parameter) {
    for (const NamedTensors* file : weights)
        for (const std::string& name : file_names(parameter.name)) {
            const NamedTensor* tensor = file->find(name);
            if (tensor == nullptr) continue;
            if (tensor->values.size() != parameter.shape.elements() ||
                (parameter.shape.rank() == 4 &&
                 (tensor->dims.size() != 4 || tensor->dims[0] != parameter.shape[0] ||
                  tensor->dims[2] != parameter.shape[2])))
                return error(Code::kShape, "LPIPS: tensor '%s' has shape %s, expected %s",
                             name.c_str(), io::dims_text(tensor->dims).c_str(),
                             parameter.shape.text().c_str());
            const std::size_t bad = find_not_finite(tensor->values);
            if (bad != tensor->values.size())
                return invalid("LPIPS: tensor '%s' holds %g at %zu, expected finite numbers",
                               name.c_str(), static_cast<double>(tensor->values[bad]), bad);
            return tensor;
        }
    return invalid(
        "LPIPS: no file has the tensor '%s' %s: torchvision's vgg16 and the learned weights "
        "of the lpips package are needed",
        parameter.name.c_str(), parameter.shape.text().c_str());
}

}  // namespace

ValueId LpipsNet::convolve(const std::string& name, ValueId x, std::uint32_t out,
                           std::uint32_t kernel, Precision precision) {
    if (!graph_.status().ok()) return kNoValue;
    const auto parameter = [&](const std::string& full, const Shape& shape) {
        const ValueId known = graph_.find(full);  // made for the other image
        return known != kNoValue ? known : graph_.parameter(full, shape, false);
    };
    const std::uint32_t in = graph_.value(x).shape[1];
    const ValueId weight = parameter(name + ".weight", {out, in, kernel, kernel});
    return graph_.op("conv2d", {x, weight, parameter(name + ".bias", {out}), kNoValue},
                     {{"precision", static_cast<std::int64_t>(precision) + 1}});
}

std::vector<ValueId> LpipsNet::features(ValueId image, Precision precision) {
    std::vector<ValueId> found;
    ValueId x = convolve(kScaling, image, 3, 1, precision);
    for (const Stage& stage : kStages) {
        if (!found.empty()) x = graph_.op("max_pool2d", {x});
        for (const int layer : stage.layers)
            x = graph_.op("relu", {convolve("features." + std::to_string(layer), x, stage.channels,
                                            3, precision)});
        found.push_back(x);
    }
    return found;
}

void LpipsNet::build(const LpipsDesc& desc) {
    const Shape shape{desc.images, 3, desc.side, desc.side};
    render_ = graph_.input("render", shape);
    target_ = graph_.input("target", shape);
    const std::vector<ValueId> a = features(render_, desc.precision);
    const std::vector<ValueId> b = features(target_, desc.precision);
    for (std::size_t i = 0; i < std::size(kStages); ++i) {
        const ValueId weight = graph_.parameter("lin" + std::to_string(i) + ".model.1.weight",
                                                {kStages[i].channels}, false);
        const ValueId distance = graph_.op("feature_distance", {a[i], b[i], weight});
        value_ = i == 0 ? distance : graph_.op("add", {value_, distance});
    }
}

Status LpipsNet::load(std::span<const NamedTensors* const> weights) {
    for (const nn::Parameter& parameter : parameters_->all()) {
        if (parameter.name.starts_with(kScaling)) {
            SPLAT_TRY(parameters_->write(parameter, scaling_values(parameter.name)));
        } else {
            SPLAT_ASSIGN(const NamedTensor* tensor, find(weights, parameter));
            SPLAT_TRY(parameters_->write(parameter, tensor->values));
        }
    }
    return {};
}

Result<std::unique_ptr<LpipsNet>> LpipsNet::create(vk::Context& context, const LpipsDesc& desc,
                                                   std::span<const NamedTensors* const> weights) {
    if (desc.images < 1 || desc.side < kLeastSide)
        return invalid("LPIPS: %u images of %u pixels, expected at least 1 of %u", desc.images,
                       desc.side, kLeastSide);
    std::unique_ptr<LpipsNet> made(new LpipsNet(context));
    made->build(desc);
    SPLAT_TRY(made->graph_.status());
    SPLAT_ASSIGN(nn::Parameters parameters, nn::Parameters::create(context, made->graph_));
    made->parameters_ = std::make_unique<nn::Parameters>(std::move(parameters));
    SPLAT_TRY(made->load(weights));
    nn::ExecutorDesc executor;
    executor.outputs = {made->value_};
    executor.keep_prepared = desc.keep_prepared;
    executor.backward = desc.gradients;
    if (desc.gradients) {
        executor.grad_outputs = {made->value_};
        executor.grad_inputs = {made->render_};
    }
    if (const auto& given = desc.quads) {
        executor.quads = {made->render_, made->target_, made->value_};
        executor.tensors = {{made->render_, given->render},
                            {made->target_, given->target},
                            {made->value_, given->value}};
        executor.gradients = {{made->value_, given->grad_value},
                              {made->render_, given->grad_render}};
    }
    SPLAT_ASSIGN(made->executor_,
                 nn::Executor::create(context, made->graph_, *made->parameters_, executor));
    return made;
}

Result<double> LpipsNet::compare(std::span<const float> render, std::span<const float> target) {
    SPLAT_TRY(context_.write(this->render(), render.data(), render.size_bytes()));
    SPLAT_TRY(context_.write(this->target(), target.data(), target.size_bytes()));
    SPLAT_TRY(forward());
    float value = 0;
    SPLAT_TRY(context_.read(values(), &value, sizeof value));
    return static_cast<double>(value);
}

}  // namespace splat::model
