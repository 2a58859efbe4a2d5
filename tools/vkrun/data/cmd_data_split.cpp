// vkrun data split: one set of objects into train, val and test.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <numeric>
#include <random>

#include "vkrun/cli/command.h"
#include "vkrun/cli/options.h"
#include "vkrun/data/transfer.h"

namespace vkrun {
namespace {

constexpr const char* kDataSplitFooter =
    R"(Deals whole objects at random, so that no object is seen in two splits; the same seed deals them alike.

Exit status: 0 done, 2 wrong usage, 4 the data cannot be read, or OUT cannot be written.

Examples:
  vkrun data split photographs tables --val 0.1 --test 0.1
  vkrun data split data out --to srn --val 0.05 --test 0 --seed 7
)";

struct SplitOptions : TransferOptions {
    std::string from = "train";
    double val = 0.1;
    double test = 0.1;
    std::uint64_t seed = 0;
};

/// Numbers below `count` in an order that depends on the seed alone.
std::vector<std::uint32_t> shuffled(std::uint32_t count, std::uint64_t seed) {
    std::vector<std::uint32_t> order(count);
    std::iota(order.begin(), order.end(), 0U);
    std::mt19937_64 random(seed);
    for (std::uint32_t i = count; i > 1; --i) std::swap(order[i - 1], order[random() % i]);
    return order;
}

void split_data(const CLI::App& command, const SplitOptions& options) {
    check_effect(command, options);
    check_number("--val", options.val, 0, 1);
    check_number("--test", options.test, 0, 1);
    check_number("--val and --test together", options.val + options.test, 0, 1);
    const Dataset dataset = open_source(options, options.from);
    const Json report = library_json(splat_dataset_report, dataset.get());
    const auto count = report.at("objects").get<std::uint32_t>();
    const std::vector<std::uint32_t> order = shuffled(count, options.seed);
    const auto part = [count](double share) {
        return static_cast<std::uint32_t>(std::lround(share * count));
    };
    const std::uint32_t val = std::min(part(options.val), count);
    const std::uint32_t test = std::min(part(options.test), count - val);
    const std::uint32_t ends[] = {count - val - test, count - test, count};
    std::uint32_t begin = 0;
    std::uint32_t next = 0;
    for_each_split(options, [&](const std::string& split, std::string& missing) -> Json {
        std::vector<std::uint32_t> objects(order.begin() + begin, order.begin() + ends[next]);
        begin = ends[next++];
        std::sort(objects.begin(), objects.end());
        if (objects.empty())
            missing = "split " + split + " gets none of " + std::to_string(count) + " objects";
        return objects.empty() ? Json(nullptr)
                               : write_split(options, dataset.get(), split, objects);
    });
}

}  // namespace

void add_data_split(CLI::App& data, int& exit_code) {
    CLI::App* command =
        add_command(data, "split", "Deal the objects of a data set into splits.", kDataSplitFooter);
    const auto options = std::make_shared<SplitOptions>();
    add_transfer_options(*command, *options);
    add_export_options(*command, *options);
    command->add_option("--from", options->from, "Split of DIR that is dealt")
        ->type_name("NAME")
        ->capture_default_str()
        ->check(one_of({"train", "val", "test"}));
    command->add_option("--val", options->val, "Share of objects for validation, 0 to 1")
        ->type_name("X")
        ->capture_default_str();
    command->add_option("--test", options->test, "Share of objects for tests, 0 to 1")
        ->type_name("X")
        ->capture_default_str();
    command->add_option("--seed", options->seed, "Seed of the random order")
        ->type_name("N")
        ->capture_default_str();
    command->callback([command, options, &exit_code] {
        split_data(*command, *options);
        exit_code = kSuccess;
    });
}

}  // namespace vkrun
