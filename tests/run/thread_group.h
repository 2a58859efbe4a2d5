#pragma once

#include <condition_variable>
#include <cstring>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "run/group.h"

namespace splat {

/// A group of threads of this process. A call that waits for more than `patience` seconds, or in a group in which a
/// rank left or another call failed, gives kNobody.
class ThreadGroup {
  public:
    static constexpr std::int32_t kNobody = 7;
    explicit ThreadGroup(std::uint32_t count, double patience = 60)
        : count_(count), patience_(patience) {}

    /// Call `body` on a thread for each rank, and wait for all.
    template <class Body>
    void run(Body&& body) {
        std::vector<std::thread> threads;
        std::vector<Rank> ranks(count_);
        for (std::uint32_t rank = 0; rank < count_; ++rank) {
            ranks[rank] = {this, rank};
            threads.emplace_back([&, rank] { body(calls(ranks[rank])); });
        }
        for (std::thread& thread : threads) thread.join();
    }

    /// All calls that wait, and all later ones, fail.
    void leave() {
        const std::lock_guard lock(mutex_);
        left_ = true;
        changed_.notify_all();
    }

  private:
    struct Rank {
        ThreadGroup* group;
        std::uint32_t number;
    };

    run::GroupCalls calls(Rank& rank) const {
        run::GroupCalls calls;
        calls.rank = rank.number;
        calls.count = count_;
        calls.user = &rank;
        calls.send_receive = [](void* user, std::uint32_t peer, const void* sent, void* received,
                                std::uint64_t bytes) {
            const auto& [group, self] = *static_cast<Rank*>(user);
            group->put(self, peer, sent, bytes);
            return group->take(peer, self, received, bytes);
        };
        calls.broadcast = [](void* user, std::uint32_t root, void* data, std::uint64_t bytes) {
            const auto& [group, self] = *static_cast<Rank*>(user);
            if (self != root) return group->take(root, self, data, bytes);
            for (std::uint32_t to = 0; to < group->count_; ++to)
                if (to != root) group->put(root, to, data, bytes);
            return 0;
        };
        calls.barrier = [](void* user) {
            const auto& [group, self] = *static_cast<Rank*>(user);
            char none = 0;
            for (std::uint32_t other = 0; other < group->count_; ++other)
                if (other != self) group->put(self, other, &none, 1);
            for (std::uint32_t other = 0; other < group->count_; ++other)
                if (const std::int32_t failed =
                        other == self ? 0 : group->take(other, self, &none, 1);
                    failed != 0)
                    return failed;
            return 0;
        };
        calls.describe = [](void*, std::int32_t) { return "a thread is gone"; };
        return calls;
    }

    void put(std::uint32_t from, std::uint32_t to, const void* data, std::uint64_t bytes) {
        const std::lock_guard lock(mutex_);
        sent_[{from, to}].emplace_back(static_cast<const char*>(data), bytes);
        changed_.notify_all();
    }

    std::int32_t take(std::uint32_t from, std::uint32_t to, void* data, std::uint64_t bytes) {
        std::unique_lock lock(mutex_);
        std::vector<std::string>& messages = sent_[{from, to}];
        changed_.wait_for(lock, std::chrono::duration<double>(patience_),
                          [&] { return left_ || !messages.empty(); });
        if (messages.empty() || messages.front().size() != bytes) return kNobody;
        std::memcpy(data, messages.front().data(), bytes);
        messages.erase(messages.begin());
        return 0;
    }

    std::uint32_t count_;
    double patience_;
    std::mutex mutex_;  ///< guards the members below
    std::condition_variable changed_;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::string>> sent_;
    bool left_ = false;
};

}  // namespace splat
