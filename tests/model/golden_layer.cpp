#include "model/golden_layer.h"

#include "nn/executor.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

using nn::kNoValue;
using nn::ValueId;

/// Relative L2. INDEX.md asks for 1e-5 per layer; a block has five of them, whose errors do not all
/// add up. Gradients run through all layers twice.
constexpr double kOutput = 1e-5;
constexpr double kGradient = 1e-4;

/// Activations are [N,C,H,W]; what stands for a matrix has one pixel per row.
Shape image_shape(const std::vector<std::int64_t>& dims) {
    const auto at = [&](std::size_t i) {
        return i < dims.size() ? static_cast<std::uint32_t>(dims[i]) : 1U;
    };
    return {at(0), at(1), at(2), at(3)};
}

/// [N,C,P] of factors to [N*P,2C]: the factors of each pixel, then zeros to add.
std::vector<float> per_pixel(const std::vector<float>& mask, const Shape& shape) {
    const std::size_t channels = shape[1];
    const std::size_t pixels = std::size_t{shape[2]} * shape[3];
    std::vector<float> result(2 * mask.size(), 0);
    for (std::size_t n = 0; n < shape[0]; ++n)
        for (std::size_t c = 0; c < channels; ++c)
            for (std::size_t p = 0; p < pixels; ++p)
                result[(n * pixels + p) * 2 * channels + c] = mask[(n * channels + c) * pixels + p];
    return result;
}

/// The graph of one layer on a device.
class Run {
  public:
    Run(vk::Context& context, const GoldenLayer& layer)
        : context_(context), layer_(layer), graph_(context) {}

    Status forward_and_backward() {
        SPLAT_TRY(build());
        SPLAT_TRY(put(executor_->tensor(x_), layer_.golden.floats(layer_.key("x"))));
        if (emb_ != kNoValue)
            SPLAT_TRY(put(executor_->tensor(emb_), layer_.golden.floats(layer_.key("emb"))));
        if (mask_ != kNoValue) {
            const Shape shape = image_shape(layer_.golden.dims(layer_.key("mask")));
            SPLAT_TRY(put(executor_->tensor(mask_),
                          per_pixel(layer_.golden.floats(layer_.key("mask")), shape)));
        }
        SPLAT_TRY(executor_->forward());
        y_values = get(executor_->tensor(y_));
        SPLAT_TRY(put(executor_->gradient(y_), layer_.golden.floats(layer_.key("g"))));
        return executor_->backward();
    }

    void expect_all() const {
        expect("y", y_values, kOutput);
        expect("d_x", get(executor_->gradient(x_)), kGradient);
        if (emb_ != kNoValue) expect("d_emb", get(executor_->gradient(emb_)), kGradient);
        EXPECT_FALSE(parameters_->all().empty());
        for (const nn::Parameter& parameter : parameters_->all()) {
            const std::string key = "d." + parameter.name.substr(layer_.name.size() + 1);
            const bool trained = parameter.grad.block != nullptr;
            EXPECT_EQ(trained, layer_.golden.has(layer_.key(key.c_str()))) << parameter.name;
            if (trained) expect(key.c_str(), get(parameter.grad), kGradient);
        }
    }

  private:
    Status build() {
        const Golden& golden = layer_.golden;
        const Shape shape = image_shape(golden.dims(layer_.key("x")));
        x_ = graph_.input("x", shape);
        const bool masked = golden.has(layer_.key("mask"));
        Layers layers(graph_, layer_.config, {.precision = layer_.precision});
        if (golden.has(layer_.key("emb"))) {
            const auto dims = golden.dims(layer_.key("emb"));
            emb_ = graph_.input(
                "emb", {static_cast<std::uint32_t>(dims[0]), static_cast<std::uint32_t>(dims[1])});
            layers.embedding_ = emb_;
        }
        if (masked) {
            const Shape of = image_shape(golden.dims(layer_.key("mask")));
            mask_ = graph_.input("mask", {of[0] * of[2] * of[3], 2 * of[1]});
            layers.mask = mask_;
        }
        y_ = layer_.build(layers, x_);
        SPLAT_TRY(graph_.status());
        SPLAT_ASSIGN(nn::Parameters made, nn::Parameters::create(context_, graph_));
        parameters_ = std::make_unique<nn::Parameters>(std::move(made));
        for (const nn::Parameter& parameter : parameters_->all()) {
            const std::string key = "p." + parameter.name.substr(layer_.name.size() + 1);
            SPLAT_TRY(parameters_->write(parameter, golden.floats(layer_.key(key.c_str()))));
        }
        SPLAT_TRY(parameters_->zero_gradients());
        nn::ExecutorDesc desc{
            .outputs = {y_}, .backward = true, .grad_outputs = {y_}, .grad_inputs = {x_}};
        if (emb_ != kNoValue) desc.grad_inputs.push_back(emb_);
        SPLAT_ASSIGN(executor_, nn::Executor::create(context_, graph_, *parameters_, desc));
        return {};
    }

    Status put(const vk::BufferView& view, const std::vector<float>& values) {
        EXPECT_EQ(view.shape.elements(), values.size()) << layer_.name;
        return context_.write(view, values.data(), values.size() * 4);
    }
    [[nodiscard]] std::vector<float> get(const vk::BufferView& view) const {
        std::vector<float> values(view.shape.elements());
        EXPECT_OK(context_.read(view, values.data(), values.size() * 4));
        return values;
    }
    /// Against the float64 run where the file has it.
    void expect(const char* what, const std::vector<float>& got, double figure) const {
        const std::string key = layer_.key(what);
        const std::vector<double> expected = layer_.golden.has(key + "64")
                                                 ? layer_.golden.doubles(key + "64")
                                                 : to_double(layer_.golden.floats(key));
        expect_relative(layer_.golden.name + " " + key, got, expected, figure);
    }

    vk::Context& context_;
    const GoldenLayer& layer_;
    nn::Graph graph_;
    ValueId x_ = kNoValue, emb_ = kNoValue, mask_ = kNoValue, y_ = kNoValue;
    std::unique_ptr<nn::Parameters> parameters_;
    std::unique_ptr<nn::Executor> executor_;
    std::vector<float> y_values;
};

}  // namespace

ValueId Layers::dropout(ValueId x, float p) {
    if (mask == kNoValue) return SongUnet::dropout(x, p);
    if (!graph_.status().ok()) return kNoValue;
    const Shape shape = graph_.value(x).shape;
    const ValueId pixels = graph_.reshape(x, {shape[0] * shape[2] * shape[3], shape[1], 1, 1});
    return graph_.reshape(graph_.op("film", {pixels, mask}), shape);
}

void expect_golden_layer(vk::Context& context, const GoldenLayer& layer) {
    Run run(context, layer);
    ASSERT_OK(run.forward_and_backward()) << layer.golden.name << " " << layer.name;
    run.expect_all();
}

}  // namespace splat::test
