// Equal bits with any number of threads: Mesa's software driver reads LP_NUM_THREADS when a process starts.

#include "bench/model/model_peer.h"
#include "core/os/process.h"
#include "stress/stress.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/text.h"

namespace vkrun::stress {
namespace {

Json hashes_with(const Run& run, int threads) {
    const bench::ModelPeer child({splat::os::program_file(), "stress", "--quick", "--hashes",
                                  "--device", run.options().device},
                                 "its message says why",
                                 {{"LP_NUM_THREADS", std::to_string(threads)}});
    return child.about();
}

}  // namespace

void stress_threads(Run& run) {
    const std::string name = "threads/bits";
    if (run.options().hashes || !run.wants(name)) return;
    if (info_of(run.devices().front().device.get()).kind != SPLAT_DEVICE_KIND_CPU) {
        run.note("train/" + name + ": not run: only a software driver has threads to choose");
        return;
    }
    const Json with_one = hashes_with(run, 1);
    for (const int threads : run.quick() ? std::vector<int>{4} : std::vector<int>{0, 2, 4}) {
        const Json other = hashes_with(run, threads);
        Row row{"train",
                name,
                format("%zu results with LP_NUM_THREADS=1 and %d", with_one.size(), threads),
                "bits",
                "auto",
                "equal bits with any number of threads"};
        row.verdict.elements = with_one.size();
        for (const auto& [result, hash] : with_one.items())
            if (other.at(result) != hash) ++row.verdict.unequal;
        if (run.options().fault != Fault::kNone) ++row.verdict.unequal;
        run.add(std::move(row));
    }
}

}  // namespace vkrun::stress
