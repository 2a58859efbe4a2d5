#include "core/interrupt.h"

#include "core/fork.h"

namespace splat {

/// Never freed, because a signal handler may be reading it; taken again by a later Interrupt.
struct Interrupt::Slot {
    std::atomic<bool> taken{true};
    std::atomic<std::uintptr_t> key{0};
    std::atomic<const char*> kind{nullptr};
    std::atomic<std::uint64_t> count{0};
    Slot* next = nullptr;

    static std::atomic<Slot*> first;

    /// A child cannot interrupt what its parent runs.
    static void hide_all() {
        for (Slot* slot = first.load(); slot != nullptr; slot = slot->next) slot->key.store(0);
    }
};
std::atomic<Interrupt::Slot*> Interrupt::Slot::first{nullptr};

static_assert(std::atomic<std::uintptr_t>::is_always_lock_free);
static_assert(std::atomic<std::uint64_t>::is_always_lock_free);

Interrupt::Interrupt() : slot_(Slot::first.load()) {
    static const bool prepared = (at_fork_in_child(Slot::hide_all), true);
    static_cast<void>(prepared);
    for (; slot_ != nullptr; slot_ = slot_->next) {
        bool free = false;
        if (slot_->taken.compare_exchange_strong(free, true)) return;
    }
    slot_ = new Slot;
    slot_->next = Slot::first.load();
    while (!Slot::first.compare_exchange_weak(slot_->next, slot_)) {
    }
}

Interrupt::~Interrupt() {
    slot_->key.store(0);
    slot_->taken.store(false);
}

void Interrupt::name(std::uintptr_t key, const char* kind) noexcept {
    slot_->key.store(0);
    slot_->kind.store(kind);
    slot_->key.store(key);
}

void Interrupt::raise() noexcept {
    slot_->count.fetch_add(1);
}

std::uint64_t Interrupt::count() const noexcept {
    return slot_->count.load();
}

bool Interrupt::raise(std::uintptr_t key, const char* kind) noexcept {
    if (key == 0) return false;
    for (Slot* slot = Slot::first.load(); slot != nullptr; slot = slot->next)
        if (slot->key.load() == key && slot->kind.load() == kind) {
            slot->count.fetch_add(1);
            return true;
        }
    return false;
}

}  // namespace splat
