#include "self_test/self_test.h"

#include <algorithm>
#include <mutex>

#include "core/environment.h"
#include "core/fault.h"
#include "core/log.h"
#include "self_test/notes.h"
#include "self_test/parts.h"
#include "splat.h"
#include "vk/pipeline_cache_file.h"
#include "vk/watchdog.h"

namespace splat::self_test {
namespace {

using vk::Family;

/// A timeout that a caller made shorter says nothing of kernels.
constexpr std::uint64_t kPatienceNs = 10'000'000'000;

constexpr const char* kEnded = "a process ended while it tested them";

struct Part {
    unsigned family;
    const char* name;  ///< name of the family
    const char* what;
    Result<double> (*error)(vk::Context&);
    double most;  ///< roundings of float32; of scenes also a pixel at the threshold of 1/255
};

constexpr Part kParts[] = {
    {kNetworkKernels, "network", "a product of matrices", linear_error, 0},
    {kNetworkKernels, "network", "a convolution", convolution_error, 0},
    {kNetworkKernels, "network", "a group normalisation", group_norm_error, 1e-6},
    {kNetworkKernels, "network", "an attention", attention_error, 1e-5},
    {kNetworkGradientKernels, "network_gradient", "the gradient of a convolution",
     convolution_gradient_error, 0},
    {kNetworkGradientKernels, "network_gradient", "the gradient of a group normalisation",
     group_norm_gradient_error, 1e-5},
    {kNetworkGradientKernels, "network_gradient", "the gradient of an attention",
     attention_gradient_error, 1e-5},
    {kRasterKernels, "raster", "a sort of 5,000 keys", sort_error, 0},
    {kRasterKernels, "raster", "a scene of three Gaussians", raster_error, 5e-3},
    {kRasterKernels, "raster", "a tile of 200 Gaussians", raster_list_error, 5e-3},
    {kRasterGradientKernels, "raster_gradient", "the gradient of a scene of three Gaussians",
     raster_gradient_error, 5e-3},
    {kRasterGradientKernels, "raster_gradient", "the gradient of a tile of 200 Gaussians",
     raster_list_gradient_error, 5e-3}};

constexpr unsigned kNetworks = kNetworkKernels | kNetworkGradientKernels;

bool uses(unsigned families, Family family) {
    return (families & (family == Family::kNetwork ? kNetworks : kAllKernels & ~kNetworks)) != 0;
}

/// Kernels that a part blames if it fails: a sort tells nothing of blending, gradients sort nothing.
bool blames(const Part& part, Family family) {
    if (part.error == sort_error) return family == Family::kSort;
    if (part.family == kRasterGradientKernels) return family == Family::kBlend;
    return uses(part.family, family);
}

std::string driver_key(const vk::DeviceInfo& info) {
    return format("%d.%d.%d ", SPLAT_VERSION_MAJOR, SPLAT_VERSION_MINOR, SPLAT_VERSION_PATCH) +
           info.driver + " " + std::to_string(info.driver_version) + " " + info.name + " ";
}

std::string failure_key(const vk::DeviceInfo& info, vk::Kernels kernels, Family family) {
    return driver_key(info) + vk::kernels_name(kernels) + " " + vk::family_name(family);
}

std::string pass_key(vk::Context& context, const Part& part) {
    std::string key = driver_key(context.device().info());
    for (const Family family : vk::kFamilies)
        if (uses(part.family, family))
            key += std::string(vk::kernels_name(context.device().kernels(family))) + " ";
    return key + part.name;
}

bool left_out() {
    return environment("SPLAT_SELF_TEST").value_or("1") == "0";
}

/// The test's own runs are in no profile, also after one that runs out of memory.
struct Unprofiled : NoCopy {
    explicit Unprofiled(vk::Context& context) : of(context) { of.unprofiled = true; }
    ~Unprofiled() { of.unprofiled = false; }
    vk::Context& of;
};

struct Failure {
    const Part& part;
    std::string why;
    Status status;  ///< what a call returned; ok if a result is wrong
};

/// Whether a failed call tells against kernels: they did not compile, lost the device or did not end.
bool tells_against_kernels(vk::Context& context, const Status& status, std::size_t refused) {
    if (status.code() == Code::kTimeout) return context.timeout_ns() >= kPatienceNs;
    return status.code() == Code::kDeviceLost || context.pipelines().refused() != refused;
}

/// Errors: those of calls that do not tell against the kernels.
Result<std::optional<Failure>> failure_of(vk::Context& context, const KernelTests& tests,
                                          const Part& part) {
    const Unprofiled unprofiled(context);
    std::vector<std::string> keys;
    for (const Family family : vk::kFamilies)
        if (const vk::Kernels kernels = context.device().kernels(family);
            !tests.chosen && blames(part, family) && kernels != vk::Kernels::kPlain)
            keys.push_back(failure_key(context.device().info(), kernels, family));
    const Testing testing(tests.notes, keys);
    const vk::Watchdog watchdog(context.device().info().name.c_str(), "the test of kernels by",
                                part.what);
    const std::size_t refused = context.pipelines().refused();
    Result<double> got = part.error(context);
    if (!got.ok()) {
        const Status status = got.status();
        if (!tells_against_kernels(context, status, refused)) return status;
        return std::optional(
            Failure{part, format("%s fails: %s", part.what, status.message().c_str()), status});
    }
    const double error = SPLAT_FAULT("self_test.wrong") ? 1 : got.value();
    if (error <= part.most) return std::optional<Failure>();
    return std::optional(Failure{
        part, format("%s is off by %g, at most %g is right", part.what, error, part.most), {}});
}

/// Tests a family with the kernels in use, unless it has passed before. Nothing if it passes.
Result<std::optional<Failure>> failure_in(vk::Context& context, const KernelTests& tests,
                                          unsigned family) {
    std::string key;
    for (const Part& part : kParts) {
        if (part.family != family) continue;
        if (key.empty()) key = pass_key(context, part);
        if (has_passed(tests.notes, key)) return std::optional<Failure>();
        SPLAT_ASSIGN(std::optional<Failure> failure, failure_of(context, tests, part));
        if (failure) return failure;
    }
    note_passed(tests.notes, key);
    return std::optional<Failure>();
}

/// Plain kernels take the place of those that failed before, here or in an earlier process. Says why; empty: none did.
std::string replace_failed(vk::Device& device, const std::string& notes) {
    vk::DeviceInfo info = device.info();
    const std::string text = leave_out_failed(info, notes);
    if (info.kernels == device.info().kernels) return "";
    for (const Family family : vk::kFamilies)
        if (info.kernels[static_cast<std::size_t>(family)] == vk::Kernels::kPlain)
            device.use_plain_kernels(family);
    return text;
}

/// Note what failed, and run plain kernels instead. False if the kernels stay, right or wrong. Errors: the failure, if
/// they are plain or in use.
Result<bool> replace(vk::Context& context, const KernelTests& tests, const Failure& failure,
                     bool alone) {
    const vk::DeviceInfo& info = context.device().info();
    const bool wrong = failure.status.ok();
    vk::Kernels kernels = vk::Kernels::kPlain;
    bool in_use = false;
    for (const Family family : vk::kFamilies) {
        const vk::Kernels of = context.device().kernels(family);
        if (!blames(failure.part, family) || of == vk::Kernels::kPlain) continue;
        kernels = of;
        in_use = in_use || uses(tests.families, family);
        if (tests.chosen) continue;
        const Code code = failure.status.code();
        const auto noting =
            code == Code::kDeviceLost || code == Code::kTimeout ? note_suspect : note_failed;
        noting(tests.notes, failure_key(info, of, family), failure.why);
    }
    const std::string found = info.name + " (" + info.driver + ") " +
                              (wrong ? "computes wrongly" : "fails") + " with " +
                              vk::kernels_name(kernels) + " kernels: " + failure.why;
    if (!wrong && (tests.chosen || kernels == vk::Kernels::kPlain)) return failure.status;
    if (tests.chosen) {
        log(LogLevel::kWarning,
            found + "; the kernels were chosen, so they stay; results are not to be trusted");
        return false;
    }
    if (kernels == vk::Kernels::kPlain)
        return error(Code::kNoDevice,
                     "%s; update or change the driver, or choose another device "
                     "(SPLAT_SELF_TEST=0 uses it all the same)",
                     found.c_str());
    const Code code = failure.status.code();
    const bool gone = code == Code::kDeviceLost || code == Code::kTimeout;
    if (in_use || (gone && (!alone || context.device().adopted())))
        return error(gone ? code : Code::kNoDevice,
                     "%s; open the device again, which gives it plain kernels, or update the "
                     "driver",
                     found.c_str());
    if (gone) SPLAT_TRY(context.reopen());
    log(LogLevel::kWarning, found + "; plain ones are used, which are slower. Update the driver");
    replace_failed(context.device(), tests.notes);
    return true;
}

}  // namespace

std::string notes_path(const std::string& cache_folder, const vk::DeviceInfo& info) {
    return cache_folder.empty() ? "" : vk::pipeline_cache_path(cache_folder, info) + ".tested";
}

std::string leave_out_failed(vk::DeviceInfo& info, const std::string& notes) {
    std::string reasons;
    const std::vector<std::string> ended = unfinished(notes, false);
    for (const Family family : vk::kFamilies) {
        vk::Kernels& kernels = info.kernels[static_cast<std::size_t>(family)];
        if (left_out() || kernels == vk::Kernels::kPlain) continue;
        const std::string key = failure_key(info, kernels, family);
        auto why = why_failed(notes, key);
        if (!why && std::ranges::find(ended, key) != ended.end()) why = kEnded;
        if (!why) continue;
        reasons += format("; plain kernels instead of %s ones (%s): %s", vk::kernels_name(kernels),
                          vk::family_name(family), why->c_str());
        vk::make_plain(info.kernels, family);
    }
    const bool alike =
        std::ranges::count(info.kernels, info.kernels[0]) == std::ssize(info.kernels);
    if (alike && reasons.empty()) return "";
    return "kernels: " + vk::kernels_text(info.kernels) + reasons;
}

Result<std::shared_ptr<vk::Context>> create_context(const vk::ContextDesc& desc,
                                                    KernelTests& tests) {
    SPLAT_ASSIGN(std::shared_ptr<vk::Context> context, vk::Context::create(desc));
    tests.chosen = desc.device.kernels != vk::Kernels::kAuto ||
                   environment("SPLAT_KERNELS").value_or("auto") != "auto";
    tests.notes = notes_path(desc.cache_folder, context->device().info());
    if (tests.chosen || left_out()) return context;
    for (const std::string& key : unfinished(tests.notes, true))
        note_suspect(tests.notes, key, kEnded);
    const std::string text = replace_failed(context->device(), tests.notes);
    if (!text.empty()) log(LogLevel::kWarning, context->device().info().name + ": " + text);
    return context;
}

Status test_kernels(vk::Context& context, KernelTests& tests, unsigned families) {
    const std::lock_guard lock(context.mutex);
    if ((tests.families & families) == families || left_out()) return {};
    const bool alone = tests.families == 0 && context.memory().use().live == 0;
    for (const unsigned family :
         {kNetworkKernels, kNetworkGradientKernels, kRasterKernels, kRasterGradientKernels}) {
        bool again = (families & family) != 0;
        while (again) {
            SPLAT_ASSIGN(const std::optional<Failure> failure, failure_in(context, tests, family));
            again = false;
            if (failure) SPLAT_SET(again, replace(context, tests, *failure, alone));
        }
    }
    tests.families |= families;
    return {};
}

}  // namespace splat::self_test
