#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "ops/op_harness.h"
#include "run/thread_group.h"

namespace splat::test {

/// Threads as ranks, each with a device of its own.
class RankContexts : public testing::Test {
  protected:
    static constexpr std::uint32_t kMost = 4;

    static void SetUpTestSuite() {
        for (std::uint32_t rank = 0; rank < kMost; ++rank)
            contexts_.push_back(need(vk::Context::create(context_desc(vk::Kernels::kCpu))));
    }
    static void TearDownTestSuite() { contexts_.clear(); }
    static vk::Context& rank_context(std::uint32_t rank) { return *contexts_[rank]; }

    /// Call body(context, group, rank) for each rank; for one of them without a group.
    template <class Body>
    static void on_ranks(std::uint32_t ranks, const Body& body) {
        if (ranks == 1) return body(rank_context(0), nullptr, 0);
        ThreadGroup threads(ranks);
        threads.run([&](const run::GroupCalls& calls) {
            run::Group group(calls);
            body(rank_context(calls.rank), &group, calls.rank);
        });
    }

  private:
    static inline std::vector<std::shared_ptr<vk::Context>> contexts_;
};

}  // namespace splat::test
