// vkrun data co3d: the raw release of CO3D to a data set.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "vkrun/cli/command.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/stopwatch.h"

namespace vkrun {
namespace {

constexpr const char* kDataCo3dFooter =
    R"(RAW is CO3D's second release: RAW/CATEGORY/frame_annotations.jgz, sequence_annotations.jgz, set_lists/ and a
folder for each sequence. OUT/co3d_CATEGORY_for_gs/SPLIT gets, as Splatter Image's preprocessing makes them, for each
sequence images_full.npy, images_fg.npy on black, focal_lengths.npy and frame_order.txt, and for all of them
camera_Rs.npz and camera_Ts.npz; and masks.npy, the foreground probability. Each image is the largest square around
the principal point. The origin, axes and scale of the world come from the point cloud and the cameras. Sequences
that are there are kept, so an interrupted run can be repeated, also with another --limit; prepared.json keeps --size,
--subset and --stored-poses, and others are refused. 'vkrun --verbose data co3d' tells each sequence.

Exit status: 0 done, 1 a file cannot be written, 2 wrong usage, 4 the release is missing, damaged or incomplete.

Examples:
  vkrun data co3d co3d data --category hydrant
  vkrun data co3d co3d data --category teddybear --split test --limit 3 --json
)";

struct Co3dOptions {
    std::string raw, out, category;
    std::string subset = "fewview_dev";
    std::string split = "all";
    std::uint32_t size = 128;
    std::uint32_t limit = 0;
    bool stored_poses = false;
    bool json = false;
};

Json prepare_split(const Co3dOptions& options, const char* split) {
    auto desc = sized<splat_co3d_desc>();
    desc.raw = options.raw.c_str();
    desc.out = options.out.c_str();
    desc.category = options.category.c_str();
    desc.subset = options.subset.c_str();
    desc.split = split;
    desc.size = options.size;
    desc.limit = options.limit;
    if (options.stored_poses) desc.flags |= SPLAT_CO3D_STORED_POSES;
    auto info = sized<splat_co3d_info>();
    const Stopwatch watch;
    const splat_result result = splat_co3d_prepare(&desc, &info);
    const bool bad_data = result == SPLAT_ERROR_NOT_FOUND || result == SPLAT_ERROR_FORMAT;
    const bool wrong = result == SPLAT_ERROR_INVALID_ARGUMENT;
    check(result, wrong ? kUsageError : bad_data ? kBadData : kFailed);
    if (!options.json)
        std::printf("%s: %u sequences, %llu frames; %u were there, %u left out; %.1f s\n", split,
                    info.sequences, static_cast<unsigned long long>(info.frames), info.kept,
                    info.left_out, watch.seconds());
    return {{"split", split},    {"sequences", info.sequences}, {"frames", info.frames},
            {"kept", info.kept}, {"left_out", info.left_out},   {"seconds", watch.seconds()}};
}

int prepare(const Co3dOptions& options) {
    Json splits = Json::array();
    for (const char* split : {"train", "val", "test"})
        if (options.split == "all" || options.split == split)
            splits.push_back(prepare_split(options, split));
    if (options.json)
        print_json(
            {{"path", options.out + "/co3d_" + options.category + "_for_gs"}, {"splits", splits}});
    return kSuccess;
}

}  // namespace

void add_data_co3d(CLI::App& data, int& exit_code) {
    CLI::App* command =
        add_command(data, "co3d", "Make a data set of the raw release of CO3D.", kDataCo3dFooter);
    const auto options = std::make_shared<Co3dOptions>();
    command->add_option("RAW", options->raw, "Folder of the release")->required()->type_name("");
    command->add_option("OUT", options->out, "Folder to write to")->required()->type_name("");
    command->add_option("--category", options->category, "hydrant, teddybear or another")
        ->required()
        ->type_name("NAME");
    command->add_option("--subset", options->subset, "Which lists of frames")
        ->type_name("NAME")
        ->capture_default_str();
    command->add_option("--split", options->split, "train, val, test or all")
        ->type_name("NAME")
        ->capture_default_str()
        ->check(one_of({"train", "val", "test", "all"}));
    add_count_option(*command, "--size", options->size, "Side of the images, pixels", 1, 4096);
    add_count_option(*command, "--limit", options->limit,
                     "Only the first N sequences of each split; 0: all", 0, 1000000);
    command->add_flag("--stored-poses", options->stored_poses,
                      "Keep the release's cameras instead of normalised ones");
    add_json_flag(*command, options->json);
    command->callback([options, &exit_code] { exit_code = prepare(*options); });
}

}  // namespace vkrun
