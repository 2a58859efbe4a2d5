#include "data/image_cache.h"

namespace splat::data {

ImageCache::Pixels ImageCache::find(std::uint64_t key) {
    const std::lock_guard lock(mutex_);
    const auto place = places_.find(key);
    if (place == places_.end()) return nullptr;
    entries_.splice(entries_.begin(), entries_, place->second);
    return place->second->pixels;
}

void ImageCache::add(std::uint64_t key, Pixels pixels) {
    const std::lock_guard lock(mutex_);
    if (pixels->size() > max_bytes_ || places_.count(key) != 0) return;
    bytes_ += pixels->size();
    entries_.push_front({key, std::move(pixels)});
    places_[key] = entries_.begin();
    while (bytes_ > max_bytes_) {
        bytes_ -= entries_.back().pixels->size();
        places_.erase(entries_.back().key);
        entries_.pop_back();
    }
}

std::uint64_t ImageCache::bytes() const {
    const std::lock_guard lock(mutex_);
    return bytes_;
}

}  // namespace splat::data
