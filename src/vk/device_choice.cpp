#include "vk/device_choice.h"

#include <algorithm>
#include <tuple>

#include "core/os/drivers.h"

namespace splat::vk {
namespace {

/// Two drivers of one GPU. Some drivers know no UUID, or give all their GPUs the same.
bool are_one_gpu(const DeviceInfo& a, const DeviceInfo& b) {
    return a.uuid == b.uuid && a.uuid != decltype(a.uuid){} && a.driver_id != b.driver_id;
}

bool is_cpu(const DeviceInfo& info) {
    return info.kind == DeviceKind::kCpu;
}

/// 0 for the drivers to prefer.
int driver_rank(const DeviceInfo& info) {
    return (info.conformant ? 0 : 2) + (info.driver_id == VK_DRIVER_ID_MESA_DOZEN ? 1 : 0);
}

/// The better of two drivers of one GPU has less.
auto driver_order(const DeviceInfo& info) {
    const bool amdvlk = info.driver_id == VK_DRIVER_ID_AMD_OPEN_SOURCE;  // after RADV, as ggml does
    return std::tuple(driver_rank(info), amdvlk, info.index);
}

std::string selection_text(const DeviceDesc& desc) {
    switch (desc.select) {
        case DeviceSelect::kByIndex:
            return format("with index %u", desc.index);
        case DeviceSelect::kByUuid:
            return "with UUID " + uuid_text(desc.uuid);
        case DeviceSelect::kByKind:
            return std::string("of kind ") + device_kind_name(desc.kind);
        case DeviceSelect::kBest:
            break;
    }
    return "that is usable";
}

bool fits(const DeviceDesc& desc, const DeviceInfo& info) {
    switch (desc.select) {
        case DeviceSelect::kByIndex:
            return info.index == desc.index;
        case DeviceSelect::kByUuid:
            return info.uuid == desc.uuid;
        case DeviceSelect::kByKind:
            return info.kind == desc.kind;
        case DeviceSelect::kBest:
            break;
    }
    return info.usable();
}

}  // namespace

std::string uuid_text(const std::array<std::uint8_t, VK_UUID_SIZE>& uuid) {
    std::string text;
    for (const std::uint8_t byte : uuid) text += format("%02x", byte);
    return text;
}

void pass_over(std::vector<DeviceInfo>& infos) {
    for (DeviceInfo& info : infos) {
        if (!info.usable()) continue;
        const DeviceInfo* chosen = &info;  // best driver of this GPU
        bool conformant = true;
        for (const DeviceInfo& other : infos) {
            if (!other.usable()) continue;
            if (are_one_gpu(other, info) && driver_order(other) < driver_order(*chosen))
                chosen = &other;
            if (is_cpu(other) == is_cpu(info) && driver_rank(other) < driver_rank(info))
                conformant = false;
        }
        info.passed_over.clear();
        if (chosen != &info)
            info.passed_over = format("device %u is the same GPU and is chosen", chosen->index);
        else if (!conformant)
            info.passed_over =
                info.conformant ? "its driver translates to Direct3D 12, another device is chosen"
                                : "its driver passed no conformance test, another device is chosen";
    }
}

Result<std::vector<std::uint32_t>> devices_to_try(const DeviceDesc& desc,
                                                  const std::vector<DeviceInfo>& infos) {
    std::vector<const DeviceInfo*> order;
    for (const DeviceInfo& info : infos)
        if (fits(desc, info)) order.push_back(&info);
    std::ranges::stable_sort(order, {}, [](const DeviceInfo* info) {
        return std::tuple(!info->usable(), is_cpu(*info), !info->passed_over.empty(),
                          driver_rank(*info), -static_cast<int>(info->kind));
    });
    if (!order.empty() && !order[0]->usable())
        return unsupported("device %u (%s) is not usable: %s; %s", order[0]->index,
                           order[0]->name.c_str(), order[0]->reason.c_str(),
                           os::install_driver().c_str());
    std::vector<std::uint32_t> indices;
    for (const DeviceInfo* info : order) indices.push_back(info->index);
    if (desc.select != DeviceSelect::kBest && !indices.empty()) indices.resize(1);
    if (!indices.empty()) return indices;
    std::string list;
    for (const DeviceInfo& info : infos)
        list += format("%s%u: %s (%s)%s%s", list.empty() ? "" : "; ", info.index, info.name.c_str(),
                       device_kind_name(info.kind),
                       info.usable() ? "" : ", not usable: ", info.reason.c_str());
    const bool useless = std::ranges::none_of(infos, &DeviceInfo::usable);
    return error(Code::kNoDevice, "no Vulkan device %s; found: %s%s", selection_text(desc).c_str(),
                 list.empty() ? "none" : list.c_str(),
                 useless ? ("; " + os::install_driver()).c_str() : "");
}

}  // namespace splat::vk
