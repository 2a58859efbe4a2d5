// vkrun weights show, convert, diff: files of network weights. Needs no device.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>

#include "vkrun/cli/command.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/table.h"
#include "vkrun/cli/text.h"
#include "vkrun/config/merged_config.h"
#include "vkrun/weights/published.h"
#include "vkrun/weights/published_config.h"

namespace vkrun {
namespace {

constexpr const char* kShowFooter =
    R"(FILE is .safetensors, .pth (a state dict saved by torch.save, whose pickle is not executed) or .npz.
Mean, deviation, least and most are those of the finite numbers.

Exit status: 0 done, 2 wrong usage, 4 the file cannot be read.

Examples:
  vkrun weights show model_best.pth
  vkrun weights show model.safetensors --json | jq '.tensors[].name'
)";

constexpr const char* kWeightsConvertFooter =
    R"(IN is also a .pth from before PyTorch 1.6, such as those of torchvision and of the lpips package. OUT is
.safetensors, which keeps iteration, loss and best_PSNR of a checkpoint; .pth, a checkpoint for the published
Python code (torch.load) with these three, 0 where IN has none, and model_state_dict; or .npz. The configuration
beside IN, or the published one that IN fits, is written beside OUT (out.json for out.safetensors), unless OUT has
the same one.

Exit status: 0 done, 1 OUT cannot be written, 2 wrong usage, 4 IN cannot be read.

Examples:
  vkrun weights convert model_best.pth model.safetensors
  vkrun weights convert run/weights_best.safetensors model_best.pth
  vkrun weights convert model.safetensors small.safetensors --half --json
)";

constexpr const char* kDiffFooter =
    R"(Tensors are compared by name. NaN equals NaN.

Exit status: 0 no difference above the tolerance, 1 a difference above it, 2 wrong usage, 4 a file
cannot be read.

Examples:
  vkrun weights diff model_best.pth model.safetensors
  vkrun weights diff a.npz b.npz --tolerance 1e-3 --json
)";

struct TensorData {
    std::string name;
    std::string dtype;
    std::vector<std::int64_t> dims;
    std::vector<float> values;
};

struct WeightsFile {
    Weights weights;
    std::uint32_t count = 0;
    Json report;
};

WeightsFile load(const std::string& path) {
    WeightsFile file;
    file.weights = load_weights(path);
    check(splat_weights_count(file.weights.get(), &file.count));
    file.report = library_json(splat_weights_report, file.weights.get());
    return file;
}

TensorData tensor(const WeightsFile& file, std::uint32_t index) {
    auto info = sized<splat_weights_info>();
    check(splat_weights_get_info(file.weights.get(), index, &info));
    TensorData data{info.name, info.dtype, {info.dims, info.dims + info.rank}, {}};
    data.values.resize(info.elements);
    float none = 0;
    check(splat_weights_read(file.weights.get(), index,
                             data.values.empty() ? &none : data.values.data(),
                             data.values.size() * sizeof(float)));
    return data;
}

std::string shape_text(const std::vector<std::int64_t>& dims) {
    std::string text;
    for (const std::int64_t dim : dims) text += (text.empty() ? "" : " x ") + std::to_string(dim);
    return text.empty() ? "number" : text;
}

struct Summary {
    double mean = 0;
    double std = 0;
    double min = 0;
    double max = 0;
    std::uint64_t non_finite = 0;
};

Summary summarise(const std::vector<float>& values) {
    Summary s;
    double sum = 0;
    std::uint64_t finite = 0;
    for (const float value : values) {
        if (!std::isfinite(value)) continue;
        const auto v = static_cast<double>(value);
        s.min = finite == 0 ? v : std::min(s.min, v);
        s.max = finite == 0 ? v : std::max(s.max, v);
        sum += v;
        ++finite;
    }
    s.non_finite = values.size() - finite;
    if (finite == 0) return s;
    s.mean = sum / static_cast<double>(finite);
    double squares = 0;
    for (const float value : values)
        if (std::isfinite(value)) squares += std::pow(static_cast<double>(value) - s.mean, 2);
    s.std = std::sqrt(squares / static_cast<double>(finite));
    return s;
}

int show(const std::string& path, bool json) {
    const WeightsFile file = load(path);
    warn_of_old_weights(path);
    Table table({"tensor", ">shape", "dtype", ">mean", ">std", ">min", ">max", ">not finite"});
    Json tensors = Json::array();
    std::uint64_t elements = 0;
    std::uint64_t non_finite = 0;
    for (std::uint32_t i = 0; i < file.count; ++i) {
        const TensorData data = tensor(file, i);
        const Summary s = summarise(data.values);
        elements += data.values.size();
        non_finite += s.non_finite;
        if (json)
            tensors.push_back({{"name", data.name},
                               {"shape", data.dims},
                               {"dtype", data.dtype},
                               {"mean", s.mean},
                               {"std", s.std},
                               {"min", s.min},
                               {"max", s.max},
                               {"non_finite", s.non_finite}});
        else
            table.add({data.name, shape_text(data.dims), data.dtype, format("%.4g", s.mean),
                       format("%.4g", s.std), format("%.4g", s.min), format("%.4g", s.max),
                       format("%llu", static_cast<unsigned long long>(s.non_finite))});
    }
    if (json) {
        Json document = file.report;
        document["file"] = path;
        document["count"] = file.count;
        document["elements"] = elements;
        document["non_finite"] = non_finite;
        document["tensors"] = std::move(tensors);
        print_json(document);
        return kSuccess;
    }
    std::printf("%s\n%u tensors, %llu numbers (%s as float32), %llu not finite; format %s\n",
                table.text().c_str(), file.count, static_cast<unsigned long long>(elements),
                bytes_text(elements * sizeof(float)).c_str(),
                static_cast<unsigned long long>(non_finite),
                file.report.at("format").get<std::string>().c_str());
    const Json& published = file.report.at("published");
    const auto head = published.at("head").get<std::string>();
    std::printf("%s%s\n", published.at("sentence").get<std::string>().c_str(),
                head.empty() ? "" : ("; model.head is " + head).c_str());
    for (const auto& [key, value] : file.report.at("metadata").items())
        std::printf("%s: %s\n", key.c_str(), value.get<std::string>().c_str());
    for (const Json& warning : file.report.at("warnings"))
        std::printf("warning: %s\n", warning.get<std::string>().c_str());
    return kSuccess;
}

struct WeightsConvertOptions {
    std::string in;
    std::string out;
    bool half = false;
    bool overwrite = false;
    bool json = false;
};

/// The configuration beside IN, or the published one that it fits, with every value; null if there is none that is
/// to lie beside OUT too.
Json config_to_carry(const WeightsConvertOptions& options, splat_weights weights) {
    const std::string found = find_config(options.in);
    if (found.empty()) {
        const PublishedConfig published = published_config(options.in, weights);
        if (!published.name.empty()) {
            std::fprintf(
                stderr,
                "vkrun: note: no configuration lies beside '%s'; the published one of %s, which it "
                "fits, is written beside '%s'\n",
                options.in.c_str(), published.name.c_str(), options.out.c_str());
            return merged_config(published.name, {});
        }
        std::fprintf(stderr, "note: no configuration lies beside '%s', so none beside '%s': %s\n",
                     options.in.c_str(), options.out.c_str(), published.sentence.c_str());
        return nullptr;
    }
    if (found == find_config(options.out)) return nullptr;
    try {
        return merged_config(found, {});
    } catch (const Failure& failure) {  // perhaps of another program
        std::fprintf(stderr, "warning: no configuration is written beside '%s': %s\n",
                     options.out.c_str(), failure.what());
        return nullptr;
    }
}

int convert(const WeightsConvertOptions& options) {
    check_target(options.out, options.overwrite);
    const WeightsFile file = load(options.in);
    const Json config = config_to_carry(options, file.weights.get());
    if (!config.is_null()) check_config_target(options.out, config, options.overwrite);
    check(splat_weights_save(file.weights.get(), options.out.c_str(),
                             options.half ? std::uint32_t{SPLAT_WEIGHTS_HALF} : 0U));
    if (!config.is_null()) write_config_beside(options.out, config);
    if (options.json)
        print_json({{"in", options.in},
                    {"out", options.out},
                    {"half", options.half},
                    {"count", file.count},
                    {"config", config.is_null() ? Json() : Json(config_target(options.out))},
                    {"warnings", file.report.at("warnings")}});
    else
        std::printf("%s: %u tensors\n", options.out.c_str(), file.count);
    for (const Json& warning : file.report.at("warnings"))
        std::fprintf(stderr, "warning: %s\n", warning.get<std::string>().c_str());
    return kSuccess;
}

/// Infinite if only one of two numbers is NaN, or they differ and one is infinite.
double largest_difference(const std::vector<float>& a, const std::vector<float>& b) {
    double largest = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        if (a[i] == b[i] || (std::isnan(a[i]) && std::isnan(b[i]))) continue;
        const double difference = std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i]));
        largest = std::isfinite(difference) ? std::max(largest, difference)
                                            : std::numeric_limits<double>::infinity();
    }
    return largest;
}

constexpr const char* kOnlyInSecond = "only in the second file";

/// A tensor that differs: in what, or if `problem` is empty, by how much.
struct Difference {
    std::string name;
    std::string problem;
    double largest = 0;
};

std::vector<Difference> differences(const WeightsFile& a, const WeightsFile& b, double tolerance) {
    std::vector<Difference> found;
    for (std::uint32_t i = 0; i < a.count; ++i) {
        const TensorData one = tensor(a, i);
        std::uint32_t index = 0;
        if (splat_weights_find(b.weights.get(), one.name.c_str(), &index) != SPLAT_OK) {
            found.push_back({one.name, "only in the first file", 0});
            continue;
        }
        const TensorData other = tensor(b, index);
        if (one.dims != other.dims) {
            found.push_back({one.name, shape_text(one.dims) + " and " + shape_text(other.dims), 0});
            continue;
        }
        const double largest = largest_difference(one.values, other.values);
        if (!(largest <= tolerance)) found.push_back({one.name, "", largest});
    }
    for (std::uint32_t i = 0; i < b.count; ++i) {
        auto info = sized<splat_weights_info>();
        check(splat_weights_get_info(b.weights.get(), i, &info));
        std::uint32_t index = 0;
        if (splat_weights_find(a.weights.get(), info.name, &index) != SPLAT_OK)
            found.push_back({info.name, kOnlyInSecond, 0});
    }
    return found;
}

int diff(const std::string& first, const std::string& second, double tolerance, bool json) {
    check_number("--tolerance", tolerance, 0, 1e300);
    const WeightsFile a = load(first);
    const WeightsFile b = load(second);
    const std::vector<Difference> found = differences(a, b, tolerance);
    if (json) {
        Json list = Json::array();
        for (const Difference& d : found)
            list.push_back({{"name", d.name}, {"problem", d.problem}, {"largest", d.largest}});
        print_json({{"tolerance", tolerance}, {"differences", list}});
    } else {
        for (const Difference& d : found)
            std::printf("%s: %s\n", d.name.c_str(),
                        d.problem.empty() ? format("differs by up to %.6g", d.largest).c_str()
                                          : d.problem.c_str());
        const auto only_second = std::count_if(found.begin(), found.end(), [](const Difference& d) {
            return d.problem == kOnlyInSecond;
        });
        std::printf("%zu of %lld tensors differ by more than %g\n", found.size(),
                    static_cast<long long>(a.count + only_second), tolerance);
    }
    return found.empty() ? kSuccess : kFailed;
}

void add_show(CLI::App& weights, int& exit_code) {
    CLI::App* command = add_command(weights, "show", "List the tensors of a file.", kShowFooter);
    const auto path = std::make_shared<std::string>();
    const auto json = std::make_shared<bool>(false);
    command->add_option("FILE", *path, "Weights to read")->required()->type_name("");
    add_json_flag(*command, *json);
    command->callback([path, json, &exit_code] { exit_code = show(*path, *json); });
}

void add_weights_convert(CLI::App& weights, int& exit_code) {
    CLI::App* command =
        add_command(weights, "convert", "Write weights in another format.", kWeightsConvertFooter);
    const auto options = std::make_shared<WeightsConvertOptions>();
    command->add_option("IN", options->in, "Weights to read")->required()->type_name("");
    command->add_option("OUT", options->out, "Weights to write: .safetensors, .pth or .npz")
        ->required()
        ->type_name("");
    command->add_flag("--half", options->half, "Write float16, in half the bytes");
    add_overwrite_flag(*command, options->overwrite, "OUT");
    add_json_flag(*command, options->json);
    command->callback([options, &exit_code] { exit_code = convert(*options); });
}

void add_diff(CLI::App& weights, int& exit_code) {
    CLI::App* command =
        add_command(weights, "diff", "Compare the tensors of two files.", kDiffFooter);
    struct Options {
        std::string first;
        std::string second;
        double tolerance = 0;
        bool json = false;
    };
    const auto options = std::make_shared<Options>();
    command->add_option("A", options->first, "Weights to read")->required()->type_name("");
    command->add_option("B", options->second, "Weights to compare with")->required()->type_name("");
    command->add_option("--tolerance", options->tolerance, "Largest difference to accept")
        ->type_name("X")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 1e30).description(""));
    add_json_flag(*command, options->json);
    command->callback([options, &exit_code] {
        exit_code = diff(options->first, options->second, options->tolerance, options->json);
    });
}

}  // namespace

void add_weights(CLI::App& app, int& exit_code) {
    CLI::App* weights = add_command(
        app, "weights", "Show, fetch, convert, compare, graft and merge network weights.",
        "'vkrun weights COMMAND --help' describes a command.\n");
    weights->require_subcommand(1);
    add_show(*weights, exit_code);
    add_weights_convert(*weights, exit_code);
    add_diff(*weights, exit_code);
    add_weights_published(*weights, exit_code);
    add_weights_model(*weights, exit_code);
}

}  // namespace vkrun
