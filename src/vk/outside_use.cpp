#include "vk/outside_use.h"

#include <algorithm>
#include <mutex>

namespace splat::vk {

void OutsideUse::map(const BufferView& view) {
    const std::lock_guard lock(mutex_);
    mapped_.push_back(view);
}

void OutsideUse::unmap(const BufferView& view) {
    const std::lock_guard lock(mutex_);
    const auto found = std::ranges::find_if(
        mapped_, [&view](const BufferView& one) { return one.overlaps(view); });
    if (found != mapped_.end()) mapped_.erase(found);
}

bool OutsideUse::mapped() const {
    const std::lock_guard lock(mutex_);
    return !mapped_.empty();
}

bool OutsideUse::mapped(const BufferView& view) const {
    const std::lock_guard lock(mutex_);
    return std::ranges::any_of(mapped_,
                               [&view](const BufferView& one) { return one.overlaps(view); });
}

}  // namespace splat::vk
