// vkrun weights graft, lora-merge, lora-unmerge, lora-extract: load weights into the network of a
// configuration, and fold adapters in and out.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>

#include "vkrun/cli/command.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/config/merged_config.h"
#include "vkrun/weights/model_load.h"

namespace vkrun {
namespace {

constexpr const char* kGraftFooter =
    R"(The first convolution is widened to the channels of the configuration. Its weights move to the channels that
they belong to, and new channels get zeros, so that predictions stay those of IN until they are trained.
Adapters, embeddings and attention to tokens that IN lacks start at random.

The field of view is that of the configuration; a warning tells if IN has another. The configuration, with
every value, is written beside OUT (out.json for out.safetensors), where predict and eval look for it.

JSON: {in, out, config, copied, widened, fresh, left_out, rays_differ, rays_taken}.

Exit status: 0 done, 1 OUT cannot be written, 2 wrong usage or configuration, 3 no device, 4 IN cannot
be read or does not fit.

Examples:
  vkrun weights graft model_best.pth start.safetensors --config depth_normal.yaml
  vkrun weights graft depth.safetensors all.safetensors --config all.yaml --from depth --json
)";

constexpr const char* kMergeFooter =
    R"(OUT is the state dict of the configuration's network without adapters, which are folded into its
weights: W + lora_alpha / lora_rank * B A. The adapters are in IN, or in the file of --adapters, which
names them as state dicts or PEFT do. Their configuration, without adapters, is written
beside OUT (out.json for out.safetensors).

JSON: {in, out, adapters, config, folded}.

Exit status: 0 done, 1 OUT cannot be written, 2 wrong usage or configuration, 3 no device, 4 a file
cannot be read or does not fit.

Examples:
  vkrun weights lora-merge model_latest.pth merged.safetensors --config config.yaml
  vkrun weights lora-merge cars.pth merged.npz --config lora.yaml --adapters adapters.safetensors --json
)";

constexpr const char* kUnmergeFooter =
    R"(OUT is IN without the adapters that lora-merge folded into its weights. Each weight is as it was before,
up to two roundings. Needs no device.

JSON: {in, out, adapters, alpha}.

Exit status: 0 done, 1 OUT cannot be written, 2 wrong usage, 4 a file cannot be read or does not fit.

Examples:
  vkrun weights lora-unmerge merged.safetensors cars.safetensors --adapters adapters.safetensors
  vkrun weights lora-unmerge merged.npz cars.npz --adapters adapters.npz --alpha 8 --json
)";

constexpr const char* kExtractFooter =
    R"(OUT holds only the adapters, with the names and shapes of PEFT (base_model.model.<layer>.lora_A.weight)
and, as .safetensors, lora_alpha and lora_rank in its metadata.

JSON: {in, out, config, layers}.

Exit status: 0 done, 1 OUT cannot be written, 2 wrong usage or configuration, 3 no device, 4 IN cannot
be read or does not fit.

Examples:
  vkrun weights lora-extract model_latest.pth adapters.safetensors --config config.yaml
  vkrun weights lora-extract tuned.safetensors adapters.safetensors --config lora.yaml --json
)";

struct WeightsModelOptions {
    std::string in;
    std::string out;
    std::string config;
    std::string adapters;
    std::vector<std::string> from;
    std::uint64_t seed = 0;
    std::string device = "best";
    bool overwrite = false;
    bool json = false;
};

/// A model of the configuration, its parameters started at random.
class StartedModel {
  public:
    explicit StartedModel(const WeightsModelOptions& options)
        : device_(open_device(device_desc(options.device))) {
        const std::string config = config_text(options.config);
        auto desc = sized<splat_model_desc>();
        desc.flags = SPLAT_MODEL_LOW_MEMORY;
        desc.config = config.c_str();
        check(splat_model_create(device_.get(), &desc, model_.out()), kUsageError);
        check(splat_model_init(model_.get(), options.seed));
    }

    void load(const std::string& path, std::uint32_t flags) {
        const Weights weights = load_weights(path);
        check(splat_model_load(model_.get(), weights.get(), flags), kBadData);
        if ((flags & SPLAT_LOAD_ADAPTERS) == 0) warn_of_rays(path, weights.get(), report());
    }

    [[nodiscard]] Json report() const { return library_json(splat_model_report, model_.get()); }

    [[nodiscard]] splat_model get() const { return model_.get(); }

  private:
    Device device_;
    Model model_;
};

int graft(const WeightsModelOptions& options) {
    check_target(options.out, options.overwrite, {options.config});
    const Json config = merged_config(options.config, {});
    check_config_target(options.out, config, options.overwrite, options.config);
    StartedModel model(options);
    model.load(options.in, graft_flags("--from", options.from));
    const Json report = model.report();
    Weights made;
    check(splat_model_store(model.get(), made.out()));
    check(splat_weights_save(made.get(), options.out.c_str(), 0));
    write_config_beside(options.out, config);
    const Json& load = report.at("load");
    if (options.json) {
        Json json = {{"in", options.in}, {"out", options.out}, {"config", report.at("config")}};
        for (const char* key :
             {"copied", "widened", "fresh", "left_out", "rays_differ", "rays_taken"})
            json[key] = load.at(key);
        print_json(json);
        return kSuccess;
    }
    std::printf("%s: %s\n", options.out.c_str(), load_counts(load).c_str());
    return kSuccess;
}

/// A model with the weights of IN, and its adapters alone.
struct Adapted {
    StartedModel model;
    Weights adapters;
    std::uint32_t layers = 0;

    explicit Adapted(const WeightsModelOptions& options) : model(options) {
        const Json config = model.report().at("config");
        if (!config.contains("opt") || !config.at("opt").value("lora_finetune", false))
            throw Failure(kUsageError, "the network of '" + options.config +
                                           "' has no adapters: set opt.lora_finetune");
        model.load(options.in, SPLAT_LOAD_TAKE_RAYS);
        if (!options.adapters.empty()) {
            model.load(options.adapters, SPLAT_LOAD_ADAPTERS);
        } else if (const Json fresh = model.report().at("load").at("fresh"); !fresh.empty()) {
            throw Failure(kBadData, options.in + " has no tensor '" + fresh[0].get<std::string>() +
                                        "'; a file of adapters alone is given with --adapters");
        }
        check(splat_model_export(model.get(), SPLAT_EXPORT_ADAPTERS, adapters.out()), kBadData);
        check(splat_weights_count(adapters.get(), &layers));
        layers /= 2;
    }
};

int extract(const WeightsModelOptions& options) {
    check_target(options.out, options.overwrite, {options.config});
    const Adapted made(options);
    check(splat_weights_save(made.adapters.get(), options.out.c_str(), 0));
    if (options.json)
        print_json({{"in", options.in},
                    {"out", options.out},
                    {"config", made.model.report().at("config")},
                    {"layers", made.layers}});
    else
        std::printf("%s: the adapters of %u layers\n", options.out.c_str(), made.layers);
    return kSuccess;
}

int merge(const WeightsModelOptions& options) {
    check_target(options.out, options.overwrite, {options.config, options.adapters});
    const Json config = merged_config(options.config, {"opt.lora_finetune=false"});
    check_config_target(options.out, config, options.overwrite, options.config);
    const Adapted adapted(options);
    Weights made;
    check(splat_model_export(adapted.model.get(), SPLAT_EXPORT_MERGED, made.out()));
    check(splat_weights_save(made.get(), options.out.c_str(), 0));
    write_config_beside(options.out, config);
    if (options.json)
        print_json({{"in", options.in},
                    {"out", options.out},
                    {"adapters", options.adapters},
                    {"config", adapted.model.report().at("config")},
                    {"folded", adapted.layers}});
    else
        std::printf("%s: the adapters of %u layers are folded in\n", options.out.c_str(),
                    adapted.layers);
    return kSuccess;
}

struct UnmergeOptions {
    std::string in;
    std::string out;
    std::string adapters;
    double alpha = 0;
    bool alpha_given = false;
    bool overwrite = false;
    bool json = false;
};

/// The lora_alpha of a file of adapters.
double alpha_of(splat_weights adapters, const std::string& path) {
    const Json report = library_json(splat_weights_report, adapters);
    const auto text = report.at("metadata").value("lora_alpha", std::string());
    char* end = nullptr;
    const double alpha = std::strtod(text.c_str(), &end);
    if (text.empty() || *end != '\0')
        throw Failure(kUsageError, "'" + path + "' does not say lora_alpha: give it as --alpha");
    return alpha;
}

int unmerge(const UnmergeOptions& options) {
    check_target(options.out, options.overwrite, {options.adapters});
    constexpr double kMost = std::numeric_limits<float>::max();  // opt.lora_alpha is a float
    if (options.alpha_given) check_number("--alpha", options.alpha, -kMost, kMost);
    const Weights merged = load_weights(options.in);
    const Weights adapters = load_weights(options.adapters);
    Weights made;
    const double alpha =
        options.alpha_given ? options.alpha : alpha_of(adapters.get(), options.adapters);
    check(splat_weights_fold(merged.get(), adapters.get(), alpha, SPLAT_FOLD_OUT, made.out()),
          kBadData);
    check(splat_weights_save(made.get(), options.out.c_str(), 0));
    if (options.json)
        print_json({{"in", options.in},
                    {"out", options.out},
                    {"adapters", options.adapters},
                    {"alpha", alpha}});
    else
        std::printf("%s: the adapters are taken out again, with alpha %g\n", options.out.c_str(),
                    alpha);
    return kSuccess;
}

void add_unmerge(CLI::App& weights, int& exit_code) {
    const auto options = std::make_shared<UnmergeOptions>();
    CLI::App* command = add_command(
        weights, "lora-unmerge", "Take low-rank adapters out of merged weights.", kUnmergeFooter);
    command->add_option("IN", options->in, "Weights to read")->required()->type_name("");
    command->add_option("OUT", options->out, "Weights to write: .safetensors, .pth or .npz")
        ->required()
        ->type_name("");
    command->add_option("--adapters", options->adapters, "File of the adapters that were folded in")
        ->type_name("FILE")
        ->required();
    const CLI::Option* alpha =
        command
            ->add_option("--alpha", options->alpha,
                         "opt.lora_alpha of the training; default: that in the\nmetadata of FILE")
            ->type_name("X");
    add_overwrite_flag(*command, options->overwrite, "OUT");
    add_json_flag(*command, options->json);
    command->callback([options, alpha, &exit_code] {
        options->alpha_given = alpha->count() > 0;
        exit_code = unmerge(*options);
    });
}

CLI::App* add(CLI::App& weights, const char* name, const char* sentence, const char* footer,
              WeightsModelOptions& options) {
    CLI::App* command = add_command(weights, name, sentence, footer);
    command->add_option("IN", options.in, "Weights to read")->required()->type_name("");
    command->add_option("OUT", options.out, "Weights to write: .safetensors, .pth or .npz")
        ->required()
        ->type_name("");
    command
        ->add_option("--config", options.config,
                     "Configuration of the network of OUT, YAML or JSON")
        ->type_name("FILE")
        ->required();
    add_device_option(*command, options.device);
    add_overwrite_flag(*command, options.overwrite, "OUT");
    add_json_flag(*command, options.json);
    return command;
}

}  // namespace

void add_weights_model(CLI::App& weights, int& exit_code) {
    const auto options = std::make_shared<WeightsModelOptions>();
    CLI::App* command = add(weights, "graft", "Load weights into a network of more input channels.",
                            kGraftFooter, *options);
    command
        ->add_option("--from", options->from,
                     "Input channels of IN after RGB: any of depth,normal,mask,plane")
        ->type_name("LIST")
        ->delimiter(',')
        ->check(one_of({"depth", "normal", "mask", "plane"}));
    command->add_option("--seed", options->seed, "Seed of what starts at random")
        ->type_name("N")
        ->capture_default_str();
    command->callback([options, &exit_code] { exit_code = graft(*options); });

    const auto merging = std::make_shared<WeightsModelOptions>();
    command =
        add(weights, "lora-merge", "Fold low-rank adapters into weights.", kMergeFooter, *merging);
    command->add_option("--adapters", merging->adapters, "File of the adapters, if IN has none")
        ->type_name("FILE");
    command->callback([merging, &exit_code] { exit_code = merge(*merging); });

    add_unmerge(weights, exit_code);

    const auto extracting = std::make_shared<WeightsModelOptions>();
    command = add(weights, "lora-extract", "Write only the low-rank adapters of weights.",
                  kExtractFooter, *extracting);
    command->callback([extracting, &exit_code] { exit_code = extract(*extracting); });
}

}  // namespace vkrun
