#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "vk/context.h"

namespace splat::test {

/// False if SPLAT_TEST_VALIDATION=0 disables the validation layer, as in sanitizer builds.
bool validation_on();

/// How overruns of a test's allocations are found.
enum class Bounds {
    /// 64 guard bytes on both sides find overruns by transfers, the host, and shaders on GPUs.
    kGuards,
    /// A separate VkBuffer each. GPU-assisted validation measures accesses against the whole VkBuffer,
    /// not the binding, and lavapipe drops stores outside the binding, so no guard would change.
    kExact,
};

/// How tests open a device: validation on, fresh memory full of NaN, no cache file.
vk::ContextDesc context_desc(vk::Kernels kernels = vk::Kernels::kAuto,
                             Bounds bounds = Bounds::kGuards);

/// A context for one test, which fails and ends where it cannot be opened. Its guard bytes are
/// checked when the test ends or when it closes, whichever comes first.
std::shared_ptr<vk::Context> make_context(const vk::ContextDesc& desc = context_desc());

/// One context per set of kernels, opened on first use and shared by all tests of the program;
/// exact bounds under validation, else guards. Null, with a test failure, if it cannot be opened;
/// tests do not run without the one of kAuto.
vk::Context* shared_context(vk::Kernels kernels = vk::Kernels::kAuto);

/// A second shared context per set of kernels, with guards. Memory that it allocates from now on is
/// filled with `pattern`. MemoryDesc::poison would need a context with all its pipelines per pattern.
vk::Context* poisoned_context(vk::Kernels kernels, std::uint32_t pattern);

/// For programs without gtest's environment.
void close_shared_contexts();

/// The sets of kernels that the device can run: plain, and cpu and gpu where its subgroups allow
/// them.
std::vector<vk::Kernels> kernels_to_test();

/// Messages of the validation layer that a test provokes on purpose.
class ExpectedMessages {
  public:
    ExpectedMessages();
    ~ExpectedMessages();
    ExpectedMessages(const ExpectedMessages&) = delete;
    ExpectedMessages& operator=(const ExpectedMessages&) = delete;

    /// Number of messages since the constructor. They do not fail the test.
    [[nodiscard]] std::uint64_t count() const;

  private:
    std::uint64_t start_;
};

/// Registers the environment (log sink, bait hazard that the layer must report) and the listener
/// that fails every test during which the layer reported something or a guard byte changed. Called by
/// gpu_main.cpp.
void install_gpu_environment();

}  // namespace splat::test
