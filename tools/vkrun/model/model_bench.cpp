// How a network is timed, alone or in turns with the same one in PyTorch.

#include "vkrun/model/model_bench.h"

#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <random>

#include "vkrun/command.h"
#include "vkrun/table.h"

extern char** environ;  // NOLINT(readability-redundant-declaration): some C libraries lack it

namespace vkrun {
namespace {

template <class Body>
double milliseconds(Body&& body) {
    const auto start = std::chrono::steady_clock::now();
    body();
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
}

Json report_of(splat_model model) {
    return Json::parse(whole_text([model](char* buffer, std::size_t capacity, std::size_t* needed) {
        return splat_model_report(model, buffer, capacity, needed);
    }));
}

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

/// The configuration with adapters; what the library read of a file is what they are added to.
std::string with_adapters(splat_device device, const ModelBenchOptions& options) {
    if (options.lora == 0) return options.config;
    Json config = Json::object();
    if (!options.config.empty())
        config = report_of(create(device, options, options.config).get()).at("config");
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

std::uint32_t image_channels(const Json& config) {
    const auto given = [&](const char* key) { return flag(config, "data", key) ? 1U : 0U; };
    return 3 + given("use_pred_depth") + 3 * given("use_pred_normal") + given("use_mask");
}

std::vector<float> random_values(std::size_t count) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> unit(0, 1);
    std::vector<float> values(count);
    for (float& value : values) value = unit(random);
    return values;
}

/// Side in pixels of what a layer of the U-Net writes, which its name starts with; else `otherwise`.
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
    std::vector<double> sorted = times_ms;
    std::sort(sorted.begin(), sorted.end());
    const std::size_t middle = sorted.size() / 2;
    return sorted.size() % 2 == 1 ? sorted[middle] : (sorted[middle - 1] + sorted[middle]) / 2;
}

ModelRun::ModelRun(splat_device device, const ModelBenchOptions& options)
    : objects_(options.objects) {
    const std::string config = with_adapters(device, options);
    create_ms_ = milliseconds([&] { model_ = create(device, options, config); });
    if (options.weights.empty())
        init_ms_ = milliseconds([&] { check(splat_model_init(model_.get(), 1)); });
    else
        load(options.weights);
    report_ = report_of(model_.get());
    make_inputs();
}

void ModelRun::load(const std::string& weights) {
    Owner<splat_weights, splat_weights_destroy> read;
    read_ms_ =
        milliseconds([&] { check(splat_weights_load(weights.c_str(), read.out()), kBadData); });
    init_ms_ =
        milliseconds([&] { check(splat_model_load(model_.get(), read.get(), 0), kBadData); });
}

void ModelRun::make_inputs() {
    const Json& config = report_.at("config");
    const std::size_t side = number(config, "data", "training_resolution");
    const std::size_t images = std::size_t{objects_} * number(config, "data", "input_images");
    const std::size_t channels =
        image_channels(config) + (flag(config, "data", "origin_distances") ? 1U : 0U);
    pixels_ = images * side * side;
    images_ = random_values(channels * pixels_);
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
    Owner<splat_weights, splat_weights_destroy> weights;
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
    return report_of(model_.get());
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
    Owner<splat_weights, splat_weights_destroy> weights;
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
    return milliseconds([&] { check(splat_model_forward(model_.get(), &input)); });
}

double ModelRun::step() {
    const float* ones = ones_.data();
    const float* const gradients[5] = {ones, ones, ones, ones, ones};
    const double forward_ms = forward();
    return forward_ms + milliseconds([&] { check(splat_model_backward(model_.get(), gradients)); });
}

const char* const kPeerRemedy =
    "PyTorch and a fast BLAS for it: `apt-get install python3-torch libopenblas0-pthread`; "
    "--python PROGRAM names another interpreter";

ModelPeer::ModelPeer(const std::vector<std::string>& command, const std::string& remedy) {
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
        throw Failure(kFailed, std::string("cannot connect to a peer: ") + std::strerror(errno));
    socket_ = ends[0];
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    std::vector<char*> words;
    for (const std::string& word : command) words.push_back(const_cast<char*>(word.c_str()));
    words.push_back(nullptr);
    const int failed = posix_spawnp(&process_, words[0], &actions, nullptr, words.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    std::string line;
    if (failed == 0) line = read_line();
    if (line.rfind("ready ", 0) == 0) {
        about_ = Json::parse(line.substr(6));
        return;
    }
    close(socket_);
    if (failed == 0) waitpid(process_, nullptr, 0);
    throw Failure(kFailed, "the peer '" + command.front() + "' " +
                               (failed == 0 ? "did not get ready" : std::strerror(failed)) + "; " +
                               remedy);
}

ModelPeer::~ModelPeer() {
    send(socket_, "quit\n", 5, MSG_NOSIGNAL);
    close(socket_);
    waitpid(process_, nullptr, 0);
}

std::string ModelPeer::read_line() {
    std::size_t end = 0;
    while ((end = received_.find('\n')) == std::string::npos) {
        char buffer[512];
        const ssize_t count = read(socket_, buffer, sizeof buffer);
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) return {};
        received_.append(buffer, static_cast<std::size_t>(count));
    }
    std::string line = received_.substr(0, end);
    received_.erase(0, end + 1);
    return line;
}

double ModelPeer::run(const std::string& pass) {
    const std::string line = pass + "\n";
    send(socket_, line.data(), line.size(), MSG_NOSIGNAL);
    const std::string answer = read_line();
    char* end = nullptr;
    const double ms = std::strtod(answer.c_str(), &end);
    if (answer.empty() || *end != '\0' || ms <= 0)
        throw Failure(kFailed, "the peer answered '" + answer + "' to '" + pass +
                                   "', expected milliseconds; it may be out of memory");
    return ms;
}

std::vector<std::string> peer_arguments(const Json& config, std::uint32_t objects) {
    const auto refuse = [](bool different, const char* what) {
        if (different)
            throw Failure(kUsageError, std::string("--peer has no network ") + what +
                                           ": leave out --peer, or change the configuration");
    };
    refuse(config.at("cam_embd").at("embedding") != "none", "with an embedding");
    refuse(number(config, "model", "token_dim") > 0, "with tokens");
    refuse(
        flag(config, "data", "origin_distances") || config.at("data").at("fov").get<double>() == 0,
        "with origin distances or focal lengths per view");
    refuse(flag(config, "model", "network_without_offset"), "without offset");
    refuse(flag(config, "model", "isotropic"), "with isotropic scales");
    const auto list = [&](const char* key) {
        std::string text;
        for (const Json& value : config.at("model").at(key))
            text += (text.empty() ? "" : ",") + value.dump();
        return text;
    };
    const auto text = [](std::uint32_t value) { return std::to_string(value); };
    const std::uint32_t views = number(config, "data", "input_images");
    const bool crossing = flag(config, "model", "cross_view_attention");
    std::vector<std::string> arguments = {"--resolution",
                                          text(number(config, "data", "training_resolution")),
                                          "--channels",
                                          text(image_channels(config)),
                                          "--base-dim",
                                          text(number(config, "model", "base_dim")),
                                          "--num-blocks",
                                          text(number(config, "model", "num_blocks")),
                                          "--channel-mult",
                                          list("channel_mult"),
                                          "--attention=" + list("attention_resolutions"),
                                          "--views",
                                          text(crossing ? views : 1),
                                          "--batch",
                                          text(objects * views),
                                          "--sh-degree",
                                          text(number(config, "model", "max_sh_degree"))};
    if (config.contains("opt")) {
        const Json& opt = config.at("opt");
        refuse(
            !opt.at("freeze").empty() || !opt.value("train_with_adapters", Json::array()).empty(),
            "with a choice of what is trained");
        refuse(opt.at("lora_targets") != Json({"conv0", "conv1", "qkv", "proj"}),
               "with these lora_targets");
        arguments.insert(arguments.end(), {"--lora", text(number(config, "opt", "lora_rank"))});
    }
    return arguments;
}

std::string find_peer_script() {
    namespace fs = std::filesystem;
    std::error_code ignored;
    for (const fs::path& start :
         {fs::read_symlink("/proc/self/exe", ignored), fs::current_path(ignored) / "."})
        for (fs::path folder = start.parent_path();; folder = folder.parent_path()) {
            const fs::path script = folder / "tools/bench/torch_model.py";
            if (fs::exists(script, ignored)) return script.string();
            if (folder == folder.root_path() || folder.empty()) break;
        }
    throw Failure(kFailed,
                  "tools/bench/torch_model.py is in no folder above this program or the current "
                  "one; --peer-script FILE names it");
}

PassMeasurement measure_pass(ModelRun& run, ModelPeer* peer, bool step, int rounds) {
    PassMeasurement result;
    for (int call = 0; call < rounds + 2; ++call) {
        result.ours.add(step ? run.step() : run.forward(), call);
        if (peer != nullptr) result.peer.add(peer->run(step ? "step" : "forward"), call);
    }
    return result;
}

}  // namespace vkrun
