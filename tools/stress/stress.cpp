#include "stress/stress.h"

#include <algorithm>
#include <bit>
#include <iterator>
#include <limits>

#include "vkrun/cli/device.h"

namespace vkrun::stress {
namespace {

/// Cases beside "usual" whose bits are compared between numbers of threads: long sums, many Gaussians, steps.
constexpr const char* kHashed[] = {
    "linear/inner_1e4",         "l2/sum_1e5", "group_norm/sum_1e4", "usual/turned_3dgs",
    "order/equal_depth_gsplat", "depth/16",   "rate/1e-3"};

std::uint64_t hash_of(const std::vector<float>& values) {  // FNV-1a, by words
    std::uint64_t hash = 0xCBF29CE484222325ULL;
    for (const float value : values)
        hash = (hash ^ std::bit_cast<std::uint32_t>(value)) * 0x100000001B3ULL;
    return hash;
}

}  // namespace

std::string Row::reproduce() const {
    return "vkrun stress " + group + " --case " + name;
}

Run::Run(Options options) : options_(std::move(options)) {
    if (options_.hashes) {
        devices_.push_back({"auto", open_device(device_desc(options_.device))});
        return;
    }
    for (const splat_kernels kernels :
         {SPLAT_KERNELS_PLAIN, SPLAT_KERNELS_CPU, SPLAT_KERNELS_GPU}) {
        splat_device_desc desc = device_desc(options_.device);
        desc.kernels = kernels;
        if (kernels != SPLAT_KERNELS_PLAIN) {  // a device need not have the others
            Device device;
            if (splat_device_create(&desc, device.out()) < 0) continue;
            devices_.push_back({kernels_name(info_of(device.get()).kernels), std::move(device)});
        } else {
            Device device = open_device(desc);
            devices_.push_back({kernels_name(info_of(device.get()).kernels), std::move(device)});
        }
        for (std::size_t i = 0; i + 1 < devices_.size(); ++i)  // SPLAT_KERNELS forces one
            if (devices_[i].kernels == devices_.back().kernels) {
                devices_.pop_back();
                break;
            }
    }
}

bool Run::wants(const std::string& name) const {
    if (options_.hashes)
        return std::find(std::begin(kHashed), std::end(kHashed), name) != std::end(kHashed) ||
               name.find("/usual") != std::string::npos;
    const std::string& only = options_.only;
    return only.empty() || name == only || name.rfind(only + "/", 0) == 0;
}

void Run::unless_refused(const std::string& what, const std::function<void()>& compute) {
    try {
        compute();
    } catch (const Failure& failure) {
        if (failure.result() != SPLAT_ERROR_UNSUPPORTED) throw;
        note(what + " kernels: refused: " + failure.what());
    }
}

void Run::add(Row row, std::vector<float> got, const std::vector<float>& again,
              const Expected& expected) {
    hashes_[row.group + "/" + row.name + " " + row.result] = hash_of(got);
    const std::size_t unequal = count_unequal(got, again);
    if (options_.fault != Fault::kNone && !got.empty())
        got[0] = options_.fault == Fault::kNan ? std::numeric_limits<float>::quiet_NaN()
                                               : beyond_bound(expected);
    row.verdict = judge(got, expected);
    row.verdict.unequal = unequal;
    rows_.push_back(std::move(row));
}

ExitCode exit_code_of(const std::vector<Row>& rows) {
    ExitCode code = kSuccess;
    for (const Row& row : rows) {
        if (row.verdict.non_finite > 0) return kNotFinite;
        if (!row.verdict.passed()) code = kGateMissed;
    }
    return code;
}

}  // namespace vkrun::stress
