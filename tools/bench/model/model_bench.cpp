// Times a network, alone or alternating with the same one in PyTorch.

#include "bench/model/model_bench.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <random>

#include "bench/median.h"
#include "vkrun/cli/stopwatch.h"
#include "vkrun/config/image_channels.h"

namespace vkrun::bench {
namespace {

Model create(splat_device device, const ModelBenchOptions& options, const std::string& config) {
    auto desc = sized<splat_model_desc>();
    if (options.backward) desc.flags |= SPLAT_MODEL_GRADIENTS;
    if (options.low_memory) desc.flags |= SPLAT_MODEL_LOW_MEMORY;
    if (options.backward && options.recompute) desc.flags |= SPLAT_MODEL_RECOMPUTE;
    desc.config = config.empty() ? nullptr : config.c_str();
    desc.objects = options.objects;
    desc.precision = options.precision;
    Model model;
    check(splat_model_create(device, &desc, model.out()), kUsageError);
    return model;
}

/// The configuration as the library reads it, with adapters added.
std::string with_adapters(splat_device device, const ModelBenchOptions& options) {
    if (options.lora == 0) return options.config;
    Json config = Json::object();
    if (!options.config.empty())
        config = library_json(splat_model_report, create(device, options, options.config).get())
                     .at("config");
    config["opt"]["lora_finetune"] = true;
    config["opt"]["lora_rank"] = options.lora;
    return config.dump();
}

std::uint32_t number(const Json& config, const char* section, const char* key) {
    return config.at(section).at(key).get<std::uint32_t>();
}

bool flag(const Json& config, const char* section, const char* key) {
    return config.at(section).at(key).get<bool>();
}

std::vector<float> random_values(std::size_t count) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> unit(0, 1);
    std::vector<float> values(count);
    for (float& value : values) value = unit(random);
    return values;
}

/// Side in pixels of the output of a U-Net layer: the number after ".enc." or ".dec." in its name,
/// else `otherwise`.
double side_of(const std::string& name, double otherwise) {
    for (const char* part : {".enc.", ".dec."})
        if (const std::size_t at = name.find(part); at != std::string::npos)
            return std::atof(name.c_str() + at + std::strlen(part));
    return otherwise;
}

}  // namespace

void PassTimes::add(double ms, int call) {
    if (call == 0)
        first_ms = ms;
    else if (call == 1)
        second_ms = ms;
    else
        times_ms.push_back(ms);
}

double PassTimes::min_ms() const {
    return *std::min_element(times_ms.begin(), times_ms.end());
}

double PassTimes::median_ms() const {
    return median_of(times_ms);
}

ModelRun::ModelRun(splat_device device, const ModelBenchOptions& options)
    : objects_(options.objects) {
    const std::string config = with_adapters(device, options);
    create_ms_ = timed_ms([&] { model_ = create(device, options, config); });
    if (options.weights.empty())
        init_ms_ = timed_ms([&] { check(splat_model_init(model_.get(), 1)); });
    else
        load(options.weights);
    report_ = library_json(splat_model_report, model_.get());
    make_inputs();
}

void ModelRun::load(const std::string& weights) {
    Weights read;
    read_ms_ = timed_ms([&] { read = load_weights(weights); });
    init_ms_ = timed_ms([&] { check(splat_model_load(model_.get(), read.get(), 0), kBadData); });
}

void ModelRun::make_inputs() {
    const Json& config = report_.at("config");
    const std::size_t side = number(config, "data", "training_resolution");
    const std::size_t images = std::size_t{objects_} * number(config, "data", "input_images");
    pixels_ = images * side * side;
    images_ = random_values(ImageChannels::of(config).count() * pixels_);
    if (config.at("data").at("fov").get<double>() == 0)
        focals_.assign(2 * images, static_cast<float>(side));
    if (flag(config, "data", "custom_embedding"))
        embedding_ = random_values(images * 6 * number(config, "cam_embd", "dimension"));
    tokens_ = random_values(images * number(config, "model", "token_dim") *
                            number(config, "model", "tokens"));
    ones_.assign(pixels_ * 12, 1.0F);
}

double ModelRun::gflop() const {
    const Json& config = report_.at("config");
    const double views = number(config, "data", "input_images");
    const double seen = flag(config, "model", "cross_view_attention") ? views : 1;
    Weights weights;
    check(splat_model_store(model_.get(), weights.out()));
    std::uint32_t count = 0;
    check(splat_weights_count(weights.get(), &count));
    double products = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
        auto info = sized<splat_weights_info>();
        check(splat_weights_get_info(weights.get(), i, &info));
        const std::string name = info.name;
        if (info.rank != 4 || !name.ends_with(".weight")) continue;
        const double side = side_of(name, number(config, "data", "training_resolution"));
        products += static_cast<double>(info.elements) * side * side;
        if (name.ends_with(".qkv.weight"))  // queries by keys, and weights by values
            products += 2 * side * side * (seen * side * side) * static_cast<double>(info.dims[1]);
    }
    return 2 * products * objects_ * views * 1e-9;
}

Json ModelRun::report() const {
    return library_json(splat_model_report, model_.get());
}

std::vector<double> ModelRun::output(const char* name) const {
    const std::string what = name;
    const std::size_t terms = number(report_.at("config"), "model", "max_sh_degree") > 0 ? 4 : 1;
    const std::size_t size = what == "raw"         ? 12 + 3 * terms
                             : what == "opacities" ? 1
                             : what == "rotations" ? 4
                             : what == "sh"        ? 3 * terms
                                                   : 3;
    std::vector<float> values(pixels_ * size);
    check(splat_model_read(model_.get(), name, values.data(), values.size() * sizeof(float)));
    return {values.begin(), values.end()};
}

void ModelRun::save_weights(const std::string& path) const {
    Weights weights;
    check(splat_model_store(model_.get(), weights.out()));
    check(splat_weights_save(weights.get(), path.c_str(), 0));
}

double ModelRun::forward() {
    auto input = sized<splat_model_input>();
    const auto data = [](const std::vector<float>& values) {
        return values.empty() ? nullptr : values.data();
    };
    input.images = images_.data();
    input.focals = data(focals_);
    input.embedding = data(embedding_);
    input.tokens = data(tokens_);
    return timed_ms([&] { check(splat_model_forward(model_.get(), &input)); });
}

double ModelRun::step() {
    auto gradients = sized<splat_model_gradients>();
    gradients.means = gradients.opacities = gradients.scales = ones_.data();
    gradients.rotations = gradients.sh = ones_.data();
    const double forward_ms = forward();
    return forward_ms + timed_ms([&] { check(splat_model_backward(model_.get(), &gradients)); });
}

PassMeasurement measure_pass(ModelRun& run, ModelPeer* peer, bool step, int rounds) {
    PassMeasurement result;
    for (int call = 0; call < rounds + 2; ++call) {
        result.ours.add(step ? run.step() : run.forward(), call);
        if (peer != nullptr) result.peer.add(peer->run(step ? "step" : "forward"), call);
    }
    return result;
}

}  // namespace vkrun::bench
