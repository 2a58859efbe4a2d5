#include <algorithm>
#include <cstring>

#include "api/api_guard.h"
#include "api/handles.h"
#include "core/environment.h"

using namespace splat;

namespace {

static_assert(static_cast<int>(vk::DeviceKind::kDiscrete) == SPLAT_DEVICE_KIND_DISCRETE);
static_assert(static_cast<int>(vk::DeviceKind::kOther) == SPLAT_DEVICE_KIND_OTHER);
static_assert(static_cast<int>(vk::Kernels::kGpu) == SPLAT_KERNELS_GPU);
static_assert(static_cast<int>(vk::DeviceSelect::kByKind) == SPLAT_SELECT_BY_KIND);

template <std::size_t N>
void copy_text(char (&to)[N], const std::string& from) {
    const std::size_t length = std::min(from.size(), N - 1);
    std::memcpy(to, from.data(), length);
    to[length] = '\0';
}

/// `notes`: file of what is known of its kernels.
splat_device_info info_of(vk::DeviceInfo device, const std::string& notes) {
    const std::string kernels = self_test::leave_out_failed(device, notes);
    splat_device_info info{};
    SPLAT_COPY(info, device, index, vendor_id, device_id, vulkan_version, driver_version);
    info.kind = static_cast<splat_device_kind>(device.kind);
    info.usable = device.usable() ? 1 : 0;
    std::ranges::copy(device.uuid, info.uuid);
    SPLAT_COPY(info, device.limits, heap_bytes, max_allocation_bytes, max_storage_buffer_bytes,
               shared_memory_bytes, subgroup_size);
    info.max_workgroup_invocations = device.limits.max_group_invocations;
    const auto flag = [](bool set, std::uint32_t bit) { return set ? bit : 0U; };
    info.features = flag(device.limits.timestamp_ns > 0, SPLAT_FEATURE_TIMESTAMPS) |
                    flag(device.features.subgroup_shuffle, SPLAT_FEATURE_SUBGROUP_SHUFFLE) |
                    flag(device.features.subgroup_arithmetic, SPLAT_FEATURE_SUBGROUP_ARITHMETIC) |
                    flag(device.features.int64, SPLAT_FEATURE_INT64) |
                    flag(device.features.unified_memory, SPLAT_FEATURE_UNIFIED_MEMORY) |
                    flag(device.features.external_memory, SPLAT_FEATURE_EXTERNAL_MEMORY);
    info.kernels = static_cast<splat_kernels>(device.kernels[0]);
    copy_text(info.name, device.name);
    copy_text(info.driver, device.driver);
    copy_text(info.reason, device.usable() ? device.passed_over : device.reason);
    copy_text(info.kernels_note, kernels);
    return info;
}

Status check_range(const char* field, std::int32_t value, std::int32_t most) {
    if (value >= 0 && value <= most) return {};
    return invalid("splat_device_desc.%s is %d, expected 0 to %d", field, value, most);
}

Result<vk::ContextDesc> context_desc(const splat_device_desc& desc) {
    SPLAT_TRY(check_range("select", desc.select, SPLAT_SELECT_BY_KIND));
    SPLAT_TRY(check_range("kind", desc.kind, SPLAT_DEVICE_KIND_DISCRETE));
    SPLAT_TRY(check_range("kernels", desc.kernels, SPLAT_KERNELS_GPU));
    if (desc.select == SPLAT_SELECT_BY_KIND && desc.kind == 0)
        return invalid(
            "splat_device_desc.kind is 0, expected a kind, because select is SPLAT_SELECT_BY_KIND");
    vk::ContextDesc context;
    context.device.select = static_cast<vk::DeviceSelect>(desc.select);
    context.device.index = desc.index;
    context.device.kind = static_cast<vk::DeviceKind>(desc.kind);
    std::ranges::copy(desc.uuid, context.device.uuid.begin());
    context.device.kernels = static_cast<vk::Kernels>(desc.kernels);
    context.device.max_submit_ns = desc.max_submit_ns;
    const auto forced = environment("SPLAT_VALIDATION");
    context.device.validation =
        (desc.flags & SPLAT_DEVICE_VALIDATION) != 0 || (forced && *forced != "0");
    context.memory.budget_bytes = desc.max_device_bytes;
    context.timeout_ns = desc.timeout_ns;
    context.cache_folder =
        desc.cache_folder != nullptr ? desc.cache_folder : user_cache_folder().value_or("");
    context.profile = (desc.flags & SPLAT_DEVICE_PROFILE) != 0;
    return context;
}

/// Writes the pipeline cache. Names the context without owning it: the context does its work before it
/// ends.
struct PipelineSaving : vk::DeferredWork {
    explicit PipelineSaving(vk::Context& of) : context(of) {}
    ~PipelineSaving() override { context.pipelines().save(); }
    vk::Context& context;
};

splat_result give_profile(splat_device device, char* buffer, size_t capacity, size_t* needed,
                          std::string (vk::Profile::*text)(const std::string&) const) {
    const auto profile = [&](api::DeviceObject& object) -> Result<std::string> {
        vk::Context& context = *object.context;
        if (context.profile() == nullptr)
            return bad_state(
                "the device was created without SPLAT_DEVICE_PROFILE, so it has no profile");
        return (context.profile()->*text)(context.device().info().name);
    };
    return api::report(device, buffer, capacity, needed, profile);
}

}  // namespace

Status api::DeviceObject::be_rank(const std::shared_ptr<run::Group>& group) {
    const std::lock_guard lock(rank_mutex);
    if (const auto other = rank.lock())
        return invalid(
            "device has the open run of rank %u, expected a device of its own for each rank: "
            "create one more (splat_device_create)",
            other->rank());
    rank = group;
    return {};
}

Result<std::shared_ptr<api::DeviceObject>> api::open_device(const splat_device_desc& desc,
                                                            std::optional<vk::Adopted> adopted) {
    SPLAT_ASSIGN(vk::ContextDesc wanted, context_desc(desc));
    if (adopted) wanted.device.validation = false;  // the application's instance has it or not
    wanted.device.adopted = std::move(adopted);
    self_test::KernelTests tests;
    SPLAT_ASSIGN(std::shared_ptr<vk::Context> context, self_test::create_context(wanted, tests));
    auto object = std::make_shared<DeviceObject>(std::move(context));
    object->saving = std::make_unique<PipelineSaving>(*object->context);
    object->tests = std::move(tests);
    return object;
}

splat_result splat_device_count(uint32_t* count) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(api::require(count, "count"));
        SPLAT_ASSIGN(const auto instance, vk::Instance::get(false));
        *count = static_cast<uint32_t>(instance->physical_devices().size());
        return {};
    });
}

splat_result splat_device_describe(uint32_t index, splat_device_info* info) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(api::check_fill(info, "info"));
        SPLAT_ASSIGN(const auto instance, vk::Instance::get(false));
        SPLAT_ASSIGN(const auto devices, vk::describe_devices(*instance));
        if (index >= devices.size())
            return invalid("index is %u, expected less than %zu, the number of devices", index,
                           devices.size());
        const std::string notes =
            self_test::notes_path(user_cache_folder().value_or(""), devices[index]);
        api::give(info_of(devices[index], notes), info);
        return {};
    });
}

splat_result splat_device_create(const splat_device_desc* desc, splat_device* device) {
    return api::create(device, [&]() -> api::Devices::Made {
        splat_device_desc complete{};
        complete.struct_size = sizeof complete;
        if (desc != nullptr) {
            SPLAT_TRY(api::check_desc(desc, SPLAT_DEVICE_VALIDATION | SPLAT_DEVICE_PROFILE));
            SPLAT_TRY(api::take_input(desc, "desc", complete));
        }
        return api::open_device(complete);
    });
}

splat_result splat_device_destroy(splat_device device) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, api::Devices::remove(device, "device"));
        if (object == nullptr || object->saving == nullptr || object->context->forked()) return {};
        // Save now: the last child may never be destroyed, as finalisers of other languages may
        // not run.
        object->context->mutex.defer(std::move(object->saving));
        return {};
    });
}

splat_result splat_device_cancel(splat_device device) {
    if (api::Devices::interrupt(device)) return SPLAT_OK;
    return api::guarded([&] { return api::find(device).status(); });
}

splat_result splat_device_get_info(splat_device device, splat_device_info* info) {
    return api::describe(device, info, "info", [&](auto& object) {
        splat_device_info filled = info_of(object.context->device().info(), object.tests.notes);
        if (object.tests.chosen) filled.kernels_note[0] = '\0';
        filled.kernels = static_cast<splat_kernels>(object.context->device().kernels());
        return filled;
    });
}

splat_result splat_device_get_memory(splat_device device, splat_memory_info* info) {
    return api::describe(device, info, "info", [](auto& object) {
        const vk::MemoryUse use = object.context->memory().use();
        return splat_memory_info{.struct_size = 0,
                                 .allocations = use.allocations,
                                 .used_bytes = use.used,
                                 .live_bytes = use.live,
                                 .peak_bytes = use.peak,
                                 .budget_bytes = use.budget};
    });
}

splat_result splat_device_profile_json(splat_device device, char* buffer, size_t capacity,
                                       size_t* needed) {
    return give_profile(device, buffer, capacity, needed, &vk::Profile::json);
}

splat_result splat_device_profile_table(splat_device device, char* buffer, size_t capacity,
                                        size_t* needed) {
    return give_profile(device, buffer, capacity, needed, &vk::Profile::table);
}

splat_result splat_device_profile_reset(splat_device device) {
    return api::with(device, [&](const auto& object) -> Status {
        if (object->context->profile() == nullptr)
            return bad_state(
                "the device was created without SPLAT_DEVICE_PROFILE, so it has no profile");
        object->context->profile()->reset();
        return {};
    });
}
