// vkrun data tokens: masks of classes and instances to tokens or vectors of views.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "vkrun/cli/command.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"

namespace vkrun {
namespace {

constexpr const char* kDataTokensFooter =
    R"(MASKS has SPLIT/OBJECT/ with a .png for each view, in the order of their names; of a data set without splits
OBJECT/. NAMES says what their colours mean: a .json with COCO's panoptic annotations (file_name is the path in MASKS,
or its last part; ids are R + 256 G + 65536 B), or a palette as GIMP writes it, lines "R G B name". Colours with one
name are instances of one class. The id 0 of COCO and colours named "void" have no token.

FILE gets an array for each object: [views, dimension, tokens] for data.tokens_file, with model.token_dim and
model.tokens of these numbers; with --pooled [views, dimension] for data.embedding_file, the sum of the tokens of all
segments, each times its share of the picture: cam_embd.dimension is then a sixth of --dimension. Segments follow each
other by area, the largest first, then by id. A token has dimension - 8 numbers of the class (sines and cosines that
depend on its name alone), sine and cosine of the instance's number (0 for the first of its class), x and y of the
centre, width and height of its box, its area, as shares of the picture, and 1. Tokens that a view lacks are 0.

Exit status: 0 done, 1 FILE cannot be written, 2 wrong usage, 4 the data set, a mask or NAMES is missing, damaged or
does not fit.

Examples:
  vkrun data tokens data --masks panoptic --names panoptic.json --out tokens.npz
  vkrun train small --data data --set data.tokens_file=tokens.npz --set model.token_dim=32 --set model.tokens=16
  vkrun data tokens data --masks labels --names palette.gpl --pooled --out embedding.npz --json
)";

struct TokensOptions {
    std::string dir, format, category, masks, names, out;
    std::uint32_t dimension = 0;
    std::uint32_t tokens = 16;
    bool pooled = false;
    bool overwrite = false;
    bool json = false;
};

const char* or_null(const std::string& text) {
    return text.empty() ? nullptr : text.c_str();
}

int write_tokens(const CLI::App& command, const TokensOptions& options) {
    if (options.pooled && command.count("--tokens") > 0)
        throw Failure(kUsageError,
                      "--tokens has no effect with --pooled, which makes one vector of all");
    check_target(options.out, options.overwrite, {options.names});
    check_folder_of(options.out);
    auto desc = sized<splat_tokens_desc>();
    desc.data = options.dir.c_str();
    desc.format = or_null(options.format);
    desc.category = or_null(options.category);
    desc.masks = options.masks.c_str();
    desc.names = options.names.c_str();
    desc.out = options.out.c_str();
    desc.dimension = options.dimension;
    desc.tokens = options.tokens;
    if (options.pooled) desc.flags |= SPLAT_TOKENS_POOLED;
    auto info = sized<splat_tokens_info>();
    const splat_result result = splat_tokens_write(&desc, &info);
    const bool wrong = result == SPLAT_ERROR_INVALID_ARGUMENT;
    check(result, wrong ? kUsageError : result == SPLAT_ERROR_IO ? kFailed : kBadData);
    const auto number = [](std::uint64_t value) { return static_cast<unsigned long long>(value); };
    if (options.json) {
        print_json({{"out", options.out},
                    {"objects", info.objects},
                    {"views", info.views},
                    {"classes", info.classes},
                    {"segments", info.segments},
                    {"dropped", info.dropped}});
        return kSuccess;
    }
    std::printf("%s: %u objects, %llu views, %llu segments of %u classes\n", options.out.c_str(),
                info.objects, number(info.views), number(info.segments), info.classes);
    if (info.dropped > 0)
        std::printf(
            "%llu segments, the smallest of their views, have no token; --tokens gives more\n",
            number(info.dropped));
    return kSuccess;
}

}  // namespace

void add_data_tokens(CLI::App& data, int& exit_code) {
    CLI::App* command =
        add_command(data, "tokens", "Turn masks of classes and instances into tokens of views.",
                    kDataTokensFooter);
    const auto options = std::make_shared<TokensOptions>();
    command->add_option("DIR", options->dir, "Folder of the data set")->required()->type_name("");
    command->add_option("--masks", options->masks, "Folder of the masks")
        ->required()
        ->type_name("MASKS");
    command->add_option("--names", options->names, "What their colours mean, .json or a palette")
        ->required()
        ->type_name("NAMES");
    command->add_option("--out", options->out, "File to write, .npz or .safetensors")
        ->required()
        ->type_name("FILE");
    command->add_option("--format", options->format, "Format of the data set; default: detected")
        ->type_name("NAME");
    command->add_option("--category", options->category, "Which of several in the folder")
        ->type_name("NAME");
    add_count_option(*command, "--dimension", options->dimension,
                     "Numbers of a token, even, from 12; 0: 32, with --pooled 60", 0, 4096);
    add_count_option(*command, "--tokens", options->tokens, "Tokens of a view", 1, 65536);
    command->add_flag("--pooled", options->pooled, "One vector for each view instead");
    add_overwrite_flag(*command, options->overwrite, "FILE");
    add_json_flag(*command, options->json);
    command->callback(
        [command, options, &exit_code] { exit_code = write_tokens(*command, *options); });
}

}  // namespace vkrun
