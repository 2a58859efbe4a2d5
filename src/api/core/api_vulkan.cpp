#include "api/api_guard.h"
#include "api/handles.h"
#include "vk/caller/requirements.h"

using namespace splat;

namespace {

/// Beyond all that exist, so that a wrong count is found.
constexpr std::uint32_t kMostExtensions = 1024;

/// The handles that both structs have.
template <class Struct>
Result<vk::Adopted> adopted_of(const Struct& given) {
    const std::string type = std::string(api::kStructName<Struct>) + ".";
    SPLAT_TRY(api::require(reinterpret_cast<const void*>(given.get_instance_proc_addr),
                           (type + "get_instance_proc_addr").c_str(), given.instance,
                           (type + "instance").c_str(), given.physical_device,
                           (type + "physical_device").c_str(), given.features,
                           (type + "features").c_str()));
    vk::Adopted adopted;
    SPLAT_COPY(adopted, given, get_instance_proc_addr, instance, physical_device, features);
    return adopted;
}

Status take_extensions(const splat_vulkan_desc& given, vk::Adopted& adopted) {
    if (given.extension_count > kMostExtensions)
        return invalid("splat_vulkan_desc.extension_count is %u, expected at most %u",
                       given.extension_count, kMostExtensions);
    if (given.extension_count > 0)
        SPLAT_TRY(api::require(given.extensions, "splat_vulkan_desc.extensions"));
    for (std::uint32_t i = 0; i < given.extension_count; ++i) {
        SPLAT_TRY(api::require(given.extensions[i],
                               format("splat_vulkan_desc.extensions[%u]", i).c_str()));
        adopted.extensions.emplace_back(given.extensions[i]);
    }
    return {};
}

/// The application has chosen the device already.
Status check_unselected(const splat_device_desc& desc) {
    const auto must_be_0 = [](const char* field, std::int64_t value) {
        if (value == 0) return Status();
        return invalid(
            "splat_device_desc.%s is %lld, expected 0: the application's device is given", field,
            lld(value));
    };
    SPLAT_TRY(must_be_0("select", desc.select));
    SPLAT_TRY(must_be_0("index", desc.index));
    SPLAT_TRY(must_be_0("kind", desc.kind));
    for (const std::uint8_t byte : desc.uuid) SPLAT_TRY(must_be_0("uuid", byte));
    return {};
}

}  // namespace

splat_result splat_device_requirements(splat_vulkan_requirements* needs) {
    return api::guarded([&]() -> Status {
        splat_vulkan_requirements filled{};
        SPLAT_TRY(api::take_input(needs, "needs", filled));
        SPLAT_ASSIGN(const vk::Adopted from, adopted_of(filled));
        SPLAT_ASSIGN(const vk::Requirements found, vk::require_of(from, filled.features));
        filled.queue_family = found.queue_family;
        filled.extensions = found.extensions.data();
        filled.extension_count = static_cast<std::uint32_t>(found.extensions.size());
        api::give(filled, needs);
        return {};
    });
}

splat_result splat_device_from_vulkan(const splat_vulkan_desc* vulkan,
                                      const splat_device_desc* desc, splat_device* device) {
    return api::create(device, [&]() -> api::Devices::Made {
        splat_vulkan_desc given{};
        if (vulkan == nullptr) return api::require(vulkan, "vulkan");
        SPLAT_TRY(api::check_desc(vulkan, 0));
        SPLAT_TRY(api::take_input(vulkan, "vulkan", given));
        splat_device_desc complete{};
        complete.struct_size = sizeof complete;
        if (desc != nullptr) {
            SPLAT_TRY(api::check_desc(desc, SPLAT_DEVICE_PROFILE));
            SPLAT_TRY(api::take_input(desc, "desc", complete));
            SPLAT_TRY(check_unselected(complete));
        }
        SPLAT_ASSIGN(vk::Adopted adopted, adopted_of(given));
        SPLAT_TRY(api::require(given.device, "splat_vulkan_desc.device", given.queue,
                               "splat_vulkan_desc.queue"));
        SPLAT_TRY(take_extensions(given, adopted));
        if ((given.lock_queue == nullptr) != (given.unlock_queue == nullptr))
            return invalid(
                "splat_vulkan_desc.%s is NULL and the other callback is not, expected both or none",
                given.lock_queue == nullptr ? "lock_queue" : "unlock_queue");
        SPLAT_COPY(adopted, given, device, queue, queue_family, api_version);
        adopted.lock = {given.lock_queue, given.unlock_queue, given.user};
        return api::open_device(complete, std::move(adopted));
    });
}
