#include "api/handles.h"

#include <unordered_map>

namespace splat::api {
namespace {

template <class Object>
constexpr const char* kKind = nullptr;
template <>
constexpr const char* kKind<DeviceObject> = "splat_device";
template <>
constexpr const char* kKind<TensorObject> = "splat_tensor";
template <>
constexpr const char* kKind<OpObject> = "splat_op";
template <>
constexpr const char* kKind<SceneObject> = "splat_scene";
template <>
constexpr const char* kKind<RasterizerObject> = "splat_rasterizer";
template <>
constexpr const char* kKind<WeightsObject> = "splat_weights";
template <>
constexpr const char* kKind<DatasetObject> = "splat_dataset";
template <>
constexpr const char* kKind<ModelObject> = "splat_model";
template <>
constexpr const char* kKind<ModuleObject> = "splat_module";
template <>
constexpr const char* kKind<TrainerObject> = "splat_trainer";
template <>
constexpr const char* kKind<LpipsObject> = "splat_lpips";

struct Entry {
    const char* kind;
    std::shared_ptr<void> object;
};

struct Registry {
    std::mutex mutex;
    std::uintptr_t next = 0x1000;  // small integers are never handles
    std::unordered_map<std::uintptr_t, Entry> entries;
};

/// Never destroyed: the process may destroy handles while it exits.
Registry& registry() {
    static Registry* const instance = new Registry;
    return *instance;
}

template <class Object>
Status check(const Registry& all, std::uintptr_t key, const char* argument) {
    const char* const kind = kKind<Object>;
    if (key == 0)
        return error(Code::kInvalidHandle, "%s is NULL, expected a live %s", argument, kind);
    const auto found = all.entries.find(key);
    if (found == all.entries.end())
        return error(Code::kInvalidHandle,
                     "%s is not a live handle (destroyed, or never one), expected a %s", argument,
                     kind);
    if (found->second.kind != kind)
        return error(Code::kInvalidHandle, "%s is a %s, expected a %s", argument,
                     found->second.kind, kind);
    return {};
}

}  // namespace

template <class Object, class Handle>
Handle Handles<Object, Handle>::add(std::shared_ptr<Object> object) {
    Registry& all = registry();
    const std::lock_guard lock(all.mutex);
    const std::uintptr_t key = all.next;
    all.entries.emplace(key, Entry{kKind<Object>, std::move(object)});
    all.next += 16;
    return reinterpret_cast<Handle>(key);
}

template <class Object, class Handle>
Result<std::shared_ptr<Object>> Handles<Object, Handle>::find(Handle handle, const char* argument) {
    Registry& all = registry();
    const auto key = reinterpret_cast<std::uintptr_t>(handle);
    const std::lock_guard lock(all.mutex);
    SPLAT_TRY(check<Object>(all, key, argument));
    return std::static_pointer_cast<Object>(all.entries.find(key)->second.object);
}

template <class Object, class Handle>
Result<std::shared_ptr<Object>> Handles<Object, Handle>::remove(Handle handle,
                                                                const char* argument) {
    if (handle == nullptr) return std::shared_ptr<Object>();
    Registry& all = registry();
    const auto key = reinterpret_cast<std::uintptr_t>(handle);
    const std::lock_guard lock(all.mutex);
    SPLAT_TRY(check<Object>(all, key, argument));
    auto object = std::static_pointer_cast<Object>(all.entries.find(key)->second.object);
    all.entries.erase(key);
    return object;
}

template struct Handles<DeviceObject, splat_device>;
template struct Handles<TensorObject, splat_tensor>;
template struct Handles<OpObject, splat_op>;
template struct Handles<SceneObject, splat_scene>;
template struct Handles<RasterizerObject, splat_rasterizer>;
template struct Handles<WeightsObject, splat_weights>;
template struct Handles<DatasetObject, splat_dataset>;
template struct Handles<ModelObject, splat_model>;
template struct Handles<ModuleObject, splat_module>;
template struct Handles<TrainerObject, splat_trainer>;
template struct Handles<LpipsObject, splat_lpips>;

}  // namespace splat::api
