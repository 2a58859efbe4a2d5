// vkrun doctor: what Vulkan shows, and what the chosen device can do.

#include <atomic>

#include "vkrun/cli/device.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/log.h"
#include "vkrun/cli/text.h"
#include "vkrun/doctor/doctor.h"

namespace vkrun {
namespace {

/// Enough for the activations of the network at 128 x 128 and batch 8 in one tensor.
constexpr std::uint64_t kStorageBufferBytes = std::uint64_t{128} << 20;
/// A workspace for one training step of the network.
constexpr std::uint64_t kMemoryBytes = std::uint64_t{2} << 30;

std::atomic<int> g_validation_messages{0};
// Written before the count is first raised, under a lock of the library.
std::string g_first_message;

void count_validation(void*, splat_log_level, const char* message) {
    const std::string text = message;
    if (text.rfind("[validation]", 0) != 0) return;
    if (g_validation_messages.load() == 0) g_first_message = text;
    g_validation_messages.fetch_add(1);
}

std::string device_words(const splat_device_info& info) {
    return format("%u: %s (%s, Vulkan %s, %s)", info.index, info.name, kind_name(info.kind),
                  vulkan_version_text(info.vulkan_version).c_str(), info.driver);
}

Finding at_least(const char* check, std::uint64_t value, std::uint64_t wanted,
                 const std::string& words, const char* consequence, const char* remedy) {
    if (value >= wanted) return {check, State::kOk, words, ""};
    return {check, State::kWarning, words + "; " + consequence, remedy};
}

}  // namespace

Findings check_devices(const std::vector<splat_device_info>& devices) {
    Findings findings;
    for (const splat_device_info& info : devices)
        if (info.usable != 0)
            findings.push_back({"devices", State::kOk, "device " + device_words(info), ""});
        else
            findings.push_back({"devices", State::kWarning,
                                "device " + device_words(info) + " cannot be used: " + info.reason,
                                "a newer driver may help; libsplat needs Vulkan 1.2 with compute"});
    if (devices.empty())
        findings.push_back(
            {"devices", State::kError, "the drivers found show no device",
             "mesa-vulkan-drivers (`apt-get install` or `dnf install`) gives a software device; it "
             "needs no GPU"});
    return findings;
}

Findings check_limits(const splat_device_info& info) {
    Findings findings;
    findings.push_back(at_least("storage", info.max_storage_buffer_bytes, kStorageBufferBytes,
                                "a tensor may have " + bytes_text(info.max_storage_buffer_bytes) +
                                    ", an allocation " + bytes_text(info.max_allocation_bytes),
                                "large batches will be refused",
                                "use smaller batches on this device"));
    const bool shuffle = (info.features & SPLAT_FEATURE_SUBGROUP_SHUFFLE) != 0;
    findings.push_back(
        at_least("subgroups", shuffle ? info.subgroup_size : 0, 8,
                 format("subgroups of %u lanes, %s", info.subgroup_size,
                        shuffle ? "with shuffle" : "without shuffle"),
                 "the fast kernels of networks need 8 lanes with shuffle, so plain ones run",
                 info.kind == SPLAT_DEVICE_KIND_CPU
                     ? "LP_NATIVE_VECTOR_WIDTH=256 in the environment may give lavapipe 8 lanes"
                     : "a newer driver may help; results are the same, slower"));
    findings.push_back(at_least(
        "workgroups", info.shared_memory_bytes, 16384,
        format("workgroups of %u invocations with %s of shared memory",
               info.max_workgroup_invocations, bytes_text(info.shared_memory_bytes).c_str()),
        "Vulkan guarantees 16 KiB", "update the driver"));
    findings.push_back(
        at_least("timestamps", info.features & SPLAT_FEATURE_TIMESTAMPS, 1,
                 (info.features & SPLAT_FEATURE_TIMESTAMPS) != 0 ? "the device has timestamps"
                                                                 : "the device has no timestamps",
                 "profiles and 'vkrun bench' need them", "measure on another device"));
    return findings;
}

Finding kernels_finding(const splat_device_info& info) {
    return {"kernels", State::kWarning,
            std::string(kernels_name(info.kernels)) + " kernels run; " + info.kernels_note,
            "a newer driver may help; kernels that failed are tested again with it, or without the "
            "*.tested file in the folder of the pipeline cache; results are the same, slower"};
}

Findings check_kernels(const splat_device_info& info, const splat_device_info& described) {
    std::string words = std::string(kernels_name(info.kernels)) + " kernels run";
    const auto forced = variable("SPLAT_KERNELS");
    if (forced && *forced != "auto") words += ", because SPLAT_KERNELS=" + *forced;
    if (info.kernels_note[0] != '\0') return {kernels_finding(info)};
    if (info.kernels == described.kernels) return {{"kernels", State::kOk, words, ""}};
    return {{"kernels", State::kWarning,
             words + "; " + kernels_name(described.kernels) + " ones suit this device better",
             "unset SPLAT_KERNELS unless you compare kernels"}};
}

Findings check_memory(splat_device device, const splat_device_info& info) {
    auto memory = sized<splat_memory_info>();
    check(splat_device_get_memory(device, &memory));
    return {at_least("memory", memory.budget_bytes, kMemoryBytes,
                     "libsplat may use " + bytes_text(memory.budget_bytes) +
                         "; the driver names a heap of " + bytes_text(info.heap_bytes),
                     "training needs more", "use small batches, or another device")};
}

Findings check_validation(const splat_device_desc& desc) {
    splat_device_desc checked = desc;
    checked.flags |= SPLAT_DEVICE_VALIDATION;
    // The layer adds its checks of bounds to every kernel of the operator and the self-test: half a minute for those
    // of CPUs.
    checked.kernels = SPLAT_KERNELS_PLAIN;
    Device device;
    if (splat_device_create(&checked, device.out()) < SPLAT_OK)
        return {{"validation", State::kWarning,
                 std::string("no device under the validation layer: ") + library_message(),
                 "only tests and debugging need it: `apt-get install "
                 "vulkan-validationlayers`"}};
    g_validation_messages = 0;
    check(splat_log_set_callback(count_validation, nullptr, SPLAT_LOG_WARNING));
    std::string failed;
    try {
        run_one_operator(device.get());
        device = Device();
    } catch (const Failure& failure) {
        failed = failure.what();
    }
    log_to_stderr();
    if (!failed.empty())
        return {{"validation", State::kWarning,
                 "under the validation layer an operator fails: " + failed,
                 "update the layer: `apt-get install vulkan-validationlayers`"}};
    if (const int count = g_validation_messages; count > 0)
        return {{"validation", State::kWarning,
                 format("the validation layer gives %d messages on one operator, the first: %s",
                        count, g_first_message.c_str()),
                 "please report this with the output of 'vkrun doctor --json'"}};
    return {{"validation", State::kOk,
             "an operator runs under the validation layer without messages", ""}};
}

}  // namespace vkrun
