#include "api/handles.h"

#include <shared_mutex>
#include <type_traits>
#include <unordered_map>

#include "core/fork.h"
#include "core/interrupt.h"

namespace splat::api {
namespace {

template <class Object>
constexpr const char* kKind = nullptr;
#define SPLAT_HANDLE_NAME(kind, object, handle, argument) \
    template <>                                           \
    constexpr const char* kKind<object> = #handle;
SPLAT_HANDLE_KINDS(SPLAT_HANDLE_NAME)

struct Entry {
    const char* kind;
    std::shared_ptr<void> object;
};

struct Registry {
    ForkMutex mutex;
    std::uintptr_t next = 0x1000;  // small integers are never handles
    std::unordered_map<std::uintptr_t, Entry> entries;
};

/// Never destroyed: the process may destroy handles while it exits.
Registry& registry() {
    return for_ever<Registry>();
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

/// Errors: kInvalidState for an object of a device that another process opened.
template <class Object>
Status check_process(const std::shared_ptr<Object>& object, const char* argument) {
    if constexpr (std::is_base_of_v<OfDevice, Object>)
        if (object->context->forked())
            return bad_state("%s: %s", argument, object->context->mutex.check().message().c_str());
    return {};
}

/// Let Interrupt::raise find the object, if it has an interrupt, by this key; 0 hides it.
template <class Object>
void name_interrupt([[maybe_unused]] Object& object, [[maybe_unused]] std::uintptr_t key) {
    if constexpr (std::is_same_v<Object, DeviceObject>)
        object.context->mutex.interrupt().name(key, kKind<Object>);
    else if constexpr (requires { object.interrupt.name(key, ""); })
        object.interrupt.name(key, kKind<Object>);
}

/// An object that a forked child does not destroy.
struct Kept {
    std::shared_ptr<void> object;
    Kept* next;
};

}  // namespace

void keep_for_ever(std::shared_ptr<void> object) noexcept {
    static std::atomic<Kept*> latest{nullptr};  // reachable, so that leak checkers are quiet
    auto* const kept = new Kept{std::move(object), latest.load()};
    while (!latest.compare_exchange_weak(kept->next, kept)) {
    }
}

template <class Object, class Handle>
Handle Handles<Object, Handle>::add(std::shared_ptr<Object> object) {
    Registry& all = registry();
    const std::lock_guard lock(all.mutex);
    const std::uintptr_t key = all.next;
    Object& added = *object;
    all.entries.emplace(key, Entry{kKind<Object>, std::move(object)});
    all.next += 16;
    name_interrupt(added, key);
    return reinterpret_cast<Handle>(key);
}

template <class Object, class Handle>
Result<std::shared_ptr<Object>> Handles<Object, Handle>::find(Handle handle, const char* argument) {
    Registry& all = registry();
    const auto key = reinterpret_cast<std::uintptr_t>(handle);
    const std::shared_lock lock(all.mutex);
    SPLAT_TRY(check<Object>(all, key, argument));
    auto object = std::static_pointer_cast<Object>(all.entries.find(key)->second.object);
    SPLAT_TRY(check_process(object, argument));
    return object;
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
    name_interrupt(*object, 0);
    return object;
}

template <class Object, class Handle>
bool Handles<Object, Handle>::interrupt(Handle handle) noexcept {
    return Interrupt::raise(reinterpret_cast<std::uintptr_t>(handle), kKind<Object>);
}

#define SPLAT_HANDLE_CODE(kind, object, handle, argument) template struct Handles<object, handle>;
SPLAT_HANDLE_KINDS(SPLAT_HANDLE_CODE)

}  // namespace splat::api

// splat_tensor_destroy and so on. The object lives on while others need it.
#define SPLAT_HANDLE_DESTROY(kind, object, handle, argument)                         \
    splat_result handle##_destroy(handle argument) {                                 \
        return splat::api::guarded(                                                  \
            [&] { return splat::api::kind::remove(argument, #argument).status(); }); \
    }
SPLAT_KINDS_BUT_DEVICES(SPLAT_HANDLE_DESTROY)
