#include "self_test/self_test.h"

#include <filesystem>
#include <fstream>
#include <mutex>
#include <set>

#include "core/environment.h"
#include "core/fault.h"
#include "core/fork.h"
#include "core/log.h"
#include "self_test/parts.h"
#include "splat.h"
#include "vk/pipeline_cache_file.h"

namespace splat::self_test {
namespace {

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
    {kRasterKernels, "raster", "a scene of three Gaussians", raster_error, 5e-3},
    {kRasterGradientKernels, "raster_gradient", "the gradient of a scene of three Gaussians",
     raster_gradient_error, 5e-3}};

/// Results of this process: a driver, kernels and a family, or a driver and kernels. Locked for no longer than a
/// look, as a fork waits for it.
class Results {
  public:
    bool has(const std::string& key) {
        const std::lock_guard lock(mutex_);
        return keys_.count(key) != 0;
    }
    void add(const std::string& key) {
        const std::lock_guard lock(mutex_);
        keys_.insert(key);
    }

  private:
    ForkMutex mutex_;
    std::set<std::string> keys_;
};

Results& passed() {
    static Results& all = *new Results;  // threads may outlive static objects
    return all;
}

Results& failed() {
    static Results& all = *new Results;
    return all;
}

std::string key_of(vk::Context& context) {
    const vk::DeviceInfo& info = context.device().info();
    return format("%d.%d.%d ", SPLAT_VERSION_MAJOR, SPLAT_VERSION_MINOR, SPLAT_VERSION_PATCH) +
           info.driver + " " + std::to_string(info.driver_version) + " " + info.name + " " +
           vk::kernels_name(context.device().kernels());
}

bool noted(const std::string& path, const std::string& key) {
    std::error_code none;
    if (path.empty() || !std::filesystem::is_regular_file(path, none)) return false;
    std::ifstream file(path);
    std::string line;
    while (std::getline(file, line))
        if (line == key) return true;
    return false;
}

/// A folder that cannot be written, or something else in the file's place, only means another test next time.
void note(const std::string& path, const std::string& key) {
    std::error_code none;
    if (path.empty()) return;
    std::filesystem::create_directories(std::filesystem::path(path).parent_path(), none);
    if (std::filesystem::exists(path, none) && !std::filesystem::is_regular_file(path, none))
        return;
    std::ofstream(path, std::ios::app) << key << "\n";
}

/// The test's own runs are in no profile, also after one that runs out of memory.
struct Unprofiled : NoCopy {
    explicit Unprofiled(vk::Context& context) : of(context) { of.unprofiled = true; }
    ~Unprofiled() { of.unprofiled = false; }
    vk::Context& of;
};

/// Empty if the results of a family are right, else a sentence that names what is wrong.
Result<std::string> wrong_part(vk::Context& context, unsigned family) {
    for (const Part& part : kParts) {
        if (part.family != family) continue;
        const Unprofiled unprofiled(context);
        SPLAT_ASSIGN(double error, part.error(context));
        if (SPLAT_FAULT("self_test.wrong")) error = 1;
        if (error <= part.most) continue;
        return format("%s is off by %g, at most %g is right", part.what, error, part.most);
    }
    return std::string();
}

/// Tests the families with the kernels in use, those that have not passed before. Empty if all pass.
Result<std::string> find_wrong(vk::Context& context, const KernelTests& tests, unsigned families) {
    const std::string key = key_of(context);
    unsigned known = 0;
    for (const Part& part : kParts) {
        if ((families & part.family) == 0 || (known & part.family) != 0) continue;
        known |= part.family;
        const std::string of_family = key + " " + part.name;
        if (passed().has(of_family)) continue;
        if (!noted(tests.notes, of_family)) {
            SPLAT_ASSIGN(std::string wrong, wrong_part(context, part.family));
            if (!wrong.empty()) return wrong;
            note(tests.notes, of_family);
        }
        passed().add(of_family);
    }
    return std::string();
}

}  // namespace

Result<std::shared_ptr<vk::Context>> create_context(const vk::ContextDesc& desc,
                                                    KernelTests& tests) {
    SPLAT_ASSIGN(std::shared_ptr<vk::Context> context, vk::Context::create(desc));
    tests.chosen = desc.device.kernels != vk::Kernels::kAuto ||
                   environment("SPLAT_KERNELS").value_or("auto") != "auto";
    if (!desc.cache_folder.empty())
        tests.notes =
            vk::pipeline_cache_path(desc.cache_folder, context->device().info()) + ".tested";
    if (!tests.chosen && failed().has(key_of(*context))) context->device().use_plain_kernels();
    return context;
}

Status test_kernels(vk::Context& context, KernelTests& tests, unsigned families) {
    const std::lock_guard lock(context.mutex);
    if ((tests.families & families) == families) return {};
    if (environment("SPLAT_SELF_TEST").value_or("1") == "0") return {};
    for (;;) {
        SPLAT_ASSIGN(const std::string wrong, find_wrong(context, tests, families));
        if (wrong.empty()) break;
        const vk::DeviceInfo& info = context.device().info();
        const vk::Kernels kernels = context.device().kernels();
        const std::string found = info.name + " (" + info.driver + ") computes wrongly with " +
                                  vk::kernels_name(kernels) + " kernels: " + wrong;
        if (tests.chosen) {
            log(LogLevel::kWarning,
                found + "; the kernels were chosen, so they stay; results are not to be trusted");
            break;
        }
        if (kernels == vk::Kernels::kPlain)
            return error(Code::kNoDevice,
                         "%s; update or change the driver, or choose another device "
                         "(SPLAT_SELF_TEST=0 uses it all the same)",
                         found.c_str());
        failed().add(key_of(context));
        if (tests.families != 0)
            return error(Code::kNoDevice,
                         "%s; open the device again, which gives it plain kernels, or update the "
                         "driver",
                         found.c_str());
        log(LogLevel::kWarning,
            found + "; plain ones are used, which are slower. Update the driver");
        context.device().use_plain_kernels();
    }
    tests.families |= families;
    return {};
}

}  // namespace splat::self_test
