// vkrun data synth: a data set of procedural objects.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "vkrun/cli/command.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/stopwatch.h"
#include "vkrun/data/for_each_index.h"

namespace vkrun {
namespace {

constexpr const char* kDataSynthFooter =
    R"(Writes OUT/srn_CLASS/CLASS_{train,val,test}/ in the layout of SRN's ShapeNet renders (intrinsics.txt,
pose/, rgb/), with depth/, normal/ and mask/ next to rgb/. Training views are at random places around the
object, views of val and test on a spiral from the horizon to the top. Existing objects are kept, so an
interrupted run can be repeated and a set extended. The same seed gives the same files, with any number of
threads.

Exit status: 0 done, 1 a file cannot be written, 2 wrong usage.

Examples:
  vkrun data synth data
  vkrun data synth data --objects 500 --val 20 --test 20 --class chairs --size 64 --seed 7
  vkrun data synth data --objects 2 --json
)";

struct SynthOptions {
    std::string out;
    std::string category = "cars";
    std::uint64_t seed = 0;
    std::uint32_t size = 128;
    std::uint32_t views = 50;
    std::uint32_t test_views = 251;
    std::uint32_t train = 100;
    std::uint32_t val = 0;
    std::uint32_t test = 0;
    std::uint32_t threads = 0;
    bool json = false;
};

int synth(const SynthOptions& options) {
    auto desc = sized<splat_synthetic_desc>();
    desc.path = options.out.c_str();
    desc.category = options.category.c_str();
    desc.seed = options.seed;
    desc.resolution = options.size;
    desc.train_views = options.views;
    desc.test_views = options.test_views;
    desc.train_objects = options.train;
    desc.val_objects = options.val;
    desc.test_objects = options.test;
    const std::uint32_t total = options.train + options.val + options.test;
    if (total == 0)
        throw Failure(kUsageError,
                      "--objects, --val and --test are all 0: ask for at least one object");
    const Stopwatch watch;
    for_each_index("objects", total, options.threads,
                   [&desc](std::uint32_t index) { check(splat_synthetic_write(&desc, index)); });
    const double seconds = watch.seconds();
    const std::uint64_t views = std::uint64_t{options.train} * options.views +
                                (std::uint64_t{options.val} + options.test) * options.test_views;
    const std::string folder = options.out + "/srn_" + options.category;
    if (options.json)
        print_json({{"path", folder},
                    {"objects", total},
                    {"views", views},
                    {"resolution", options.size},
                    {"seed", options.seed},
                    {"seconds", seconds}});
    else
        std::printf("%s: %u objects, %llu views of %u x %u pixels, %.1f s\n", folder.c_str(), total,
                    static_cast<unsigned long long>(views), options.size, options.size, seconds);
    return kSuccess;
}

}  // namespace

void add_data_synth(CLI::App& data, int& exit_code) {
    CLI::App* command = add_command(
        data, "synth", "Write a data set of procedural objects with exact maps.", kDataSynthFooter);
    const auto options = std::make_shared<SynthOptions>();
    command->add_option("OUT", options->out, "Folder to write to")->required()->type_name("");
    add_count_option(*command, "--objects", options->train, "Training objects", 0, 1000000);
    add_count_option(*command, "--val", options->val, "Validation objects", 0, 1000000);
    add_count_option(*command, "--test", options->test, "Test objects", 0, 1000000);
    add_count_option(*command, "--views", options->views, "Views of each training object", 2,
                     100000);
    add_count_option(*command, "--test-views", options->test_views,
                     "Views of each validation or test object", 2, 100000);
    add_count_option(*command, "--size", options->size, "Side of the images, pixels", 8, 2048);
    command->add_option("--class", options->category, "cars, chairs or mixed")
        ->type_name("NAME")
        ->capture_default_str()
        ->check(one_of({"cars", "chairs", "mixed"}));
    command->add_option("--seed", options->seed, "Seed of all random choices")
        ->type_name("N")
        ->capture_default_str();
    add_threads_option(*command, options->threads);
    add_json_flag(*command, options->json);
    command->callback([options, &exit_code] { exit_code = synth(*options); });
}

}  // namespace vkrun
