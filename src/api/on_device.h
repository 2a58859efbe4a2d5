#pragma once

#include <memory>
#include <mutex>
#include <utility>

#include "vk/context.h"

namespace splat::api {

/// Keep an object until the process ends: what a forked child must not destroy.
void keep_for_ever(std::shared_ptr<void> object) noexcept;

/// Base of the objects of a device. Keeps the device open until their other members are destroyed.
struct OfDevice : NoCopy {
    explicit OfDevice(std::shared_ptr<vk::Context> owner) : context(std::move(owner)) {}
    ~OfDevice() {
        if (context->forked()) keep_for_ever(std::move(context));
    }
    std::shared_ptr<vk::Context> context;
};

/// A member of such an object, destroyed under the context's mutex: at once if the mutex is free, else
/// by its holder. The destructor never waits. Nothing in it may lock that mutex.
template <class Part>
class OnDevice : public Part, NoCopy {
  public:
    explicit OnDevice(const OfDevice& object)
        : context_(*object.context), left_(std::make_unique<Left>()) {}
    ~OnDevice() {
        left_->part = std::move(static_cast<Part&>(*this));
        if (context_.forked())
            keep_for_ever(std::move(left_));
        else
            context_.mutex.defer(std::move(left_));
    }
    using Part::operator=;

  private:
    struct Left : vk::DeferredWork {
        Part part;
    };
    vk::Context& context_;
    std::unique_ptr<Left> left_;  ///< made beforehand, because a destructor must not fail
};

/// A value that calls set, and that functions which describe an object read without waiting for them.
template <class Value>
class Published {
  public:
    void set(Value value) {
        const std::lock_guard lock(mutex_);
        value_ = std::move(value);
    }
    [[nodiscard]] Value get() const {
        const std::lock_guard lock(mutex_);
        return value_;
    }

  private:
    mutable std::mutex mutex_;
    Value value_{};
};

}  // namespace splat::api
