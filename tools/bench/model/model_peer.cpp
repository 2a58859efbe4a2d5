#include "bench/model/model_peer.h"

#include <cstdlib>
#include <filesystem>

#include "core/os/path.h"
#include "core/os/process.h"
#include "ref/gaussian_head_ref.h"
#include "vkrun/config/image_channels.h"

namespace vkrun::bench {
namespace {

/// "depth:1,point:3,...": the blocks of the head's layout.
std::string head_text(std::uint32_t sh_degree) {
    std::string text;
    for (const splat::HeadBlock& block : splat::HeadLayout({.sh_degree = sh_degree}).blocks)
        if (block.channels > 0)
            text += (text.empty() ? "" : ",") + std::string(block.name) + ":" +
                    std::to_string(block.channels);
    return text;
}

/// Arguments for a configuration as reports hold it.
std::vector<std::string> network_arguments(const Json& config, std::uint32_t objects) {
    const Json& data = config.at("data");
    const Json& model = config.at("model");
    const auto refuse = [](bool different, const char* what) {
        if (different)
            throw Failure(kUsageError, std::string("--peer has no network ") + what +
                                           ": leave out --peer, or change the configuration");
    };
    const auto flag = [](const Json& section, const char* key) {
        return section.at(key).get<bool>();
    };
    const auto text = [](const Json& section, const char* key) { return section.at(key).dump(); };
    const auto list = [&](const char* key) {
        std::string values;
        for (const Json& value : model.at(key)) {
            if (!values.empty()) values += ',';
            values += value.dump();
        }
        return values;
    };
    refuse(config.at("cam_embd").at("embedding") != "none", "with an embedding");
    refuse(model.at("token_dim") > 0, "with tokens");
    refuse(flag(data, "origin_distances") || data.at("fov").get<double>() == 0,
           "with origin distances or focal lengths per view");
    refuse(flag(model, "network_without_offset"), "without offset");
    refuse(flag(model, "isotropic"), "with isotropic scales");
    const auto views = data.at("input_images").get<std::uint32_t>();
    std::vector<std::string> arguments = {
        "--resolution",
        text(data, "training_resolution"),
        "--channels",
        std::to_string(ImageChannels::of(config).count()),
        "--base-dim",
        text(model, "base_dim"),
        "--num-blocks",
        text(model, "num_blocks"),
        "--channel-mult",
        list("channel_mult"),
        "--attention=" + list("attention_resolutions"),
        "--views",
        std::to_string(flag(model, "cross_view_attention") ? views : 1),
        "--batch",
        std::to_string(objects * views),
        "--head",
        head_text(model.at("max_sh_degree").get<std::uint32_t>())};
    if (config.contains("opt")) {
        const Json& opt = config.at("opt");
        refuse(
            !opt.at("freeze").empty() || !opt.value("train_with_adapters", Json::array()).empty(),
            "with a choice of what is trained");
        refuse(opt.at("lora_targets") != Json({"conv0", "conv1", "qkv", "proj"}),
               "with these lora_targets");
        arguments.insert(arguments.end(), {"--lora", text(opt, "lora_rank")});
    }
    return arguments;
}

std::string remedy(const PeerOptions& options) {
    return std::string(options.device == "cuda"
                           ? "PyTorch with CUDA, and a GPU for it"
                           : "PyTorch and a fast BLAS for it: `apt-get install python3-torch "
                             "libopenblas0-pthread`") +
           "; --python PROGRAM names another interpreter";
}

}  // namespace

void check_peer_options(const PeerOptions& options) {
    const bool cuda = options.device == "cuda";
    const auto refuse = [](bool given, const char* what) {
        if (given) throw Failure(kUsageError, what);
    };
    refuse(cuda && options.isa != "default",
           "--peer-isa limits a CPU: leave it out, or use --peer-device cpu");
    refuse(!cuda && options.tf32, "--peer-tf32 needs --peer-device cuda");
    refuse(!cuda && options.graphs, "--peer-graphs needs --peer-device cuda");
}

std::string find_script(const std::string& name) {
    namespace fs = std::filesystem;
    std::error_code ignored;
    for (const fs::path& start :
         {splat::os::path_of(splat::os::program_file()), fs::current_path(ignored) / "."})
        for (fs::path folder = start.parent_path();; folder = folder.parent_path()) {
            const fs::path script = folder / splat::os::path_of(name);
            if (fs::exists(script, ignored)) return splat::os::text_of(script);
            if (folder == folder.root_path() || folder.empty()) break;
        }
    throw Failure(
        kFailed,
        name +
            " is in no folder above this program or the current one; run vkrun from the sources");
}

ModelPeer::ModelPeer(const std::vector<std::string>& command, const std::string& remedy,
                     const std::vector<std::pair<std::string, std::string>>& variables) {
    using splat::os::Stream;
    const int failed = child_.start(
        command, {.in = Stream::kPiped, .out = Stream::kPiped, .variables = variables});
    std::string line;
    if (failed == 0) line = read_line();
    if (line.rfind("ready ", 0) == 0) {
        about_ = Json::parse(line.substr(6));
        return;
    }
    child_.close_input();
    if (failed == 0) child_.wait();
    throw Failure(kFailed, "the peer '" + command.front() + "' " +
                               (failed == 0 ? "did not get ready" : splat::os::reason(failed)) +
                               "; " + remedy);
}

ModelPeer::~ModelPeer() {
    child_.write("quit\n");
    child_.close_input();
    child_.wait();
}

std::string ModelPeer::read_line() {
    std::size_t end = 0;
    while ((end = received_.find('\n')) == std::string::npos) {
        char buffer[512];
        const auto got = child_.read(buffer, sizeof buffer, -1);
        if (!got) return {};
        received_.append(buffer, got->bytes);
    }
    std::string line = received_.substr(0, end);
    received_.erase(0, end + 1);
    if (line.ends_with('\r')) line.pop_back();  // Python's end of a line on Windows
    return line;
}

double ModelPeer::run(const std::string& pass) {
    const std::string line = pass + "\n";
    child_.write(line);
    const std::string answer = read_line();
    char* end = nullptr;
    const double ms = std::strtod(answer.c_str(), &end);
    if (answer.empty() || *end != '\0' || ms <= 0)
        throw Failure(kFailed, "the peer answered '" + answer + "' to '" + pass +
                                   "', expected milliseconds; it may be out of memory");
    return ms;
}

std::vector<std::string> peer_command(const PeerOptions& options, const Json& config,
                                      std::uint32_t objects) {
    std::vector<std::string> command = {
        options.python,
        options.script.empty() ? find_script("tools/bench/torch_model.py") : options.script};
    for (const std::string& word : network_arguments(config, objects)) command.push_back(word);
    if (options.device == "cuda")
        command.insert(command.end(), {"--device", "cuda"});
    else
        command.insert(command.end(), {"--threads", "2", "--isa", options.isa});
    if (options.tf32) command.push_back("--tf32");
    if (options.graphs) command.push_back("--graphs");
    command.insert(command.end(), {"--layout", options.layout});
    return command;
}

std::unique_ptr<ModelPeer> start_torch(const PeerOptions& options,
                                       const std::vector<std::string>& command) {
    auto peer = std::make_unique<ModelPeer>(command, remedy(options));
    if (options.device == "cpu" && peer->about().at("blas").is_null())
        throw Failure(kFailed,
                      "the peer has neither MKL nor OpenBLAS, which makes it many times slower "
                      "than PyTorch can be: `apt-get install libopenblas0-pthread`");
    return peer;
}

}  // namespace vkrun::bench
