#pragma once

#include <cstring>

#include "api/scenario/scenario.h"

namespace splat::test {

/// How a scenario makes its calls.
class ScenarioCalls {
  protected:
    explicit ScenarioCalls(Observer& observer) : observer_(observer) {}

    /// Make a call, and repeat it if the observer asks for it. `untouched` says whether a failed
    /// call left its outputs alone.
    template <class Call, class Untouched>
    bool call(const char* name, Call&& make, Untouched&& untouched) {
        for (int attempt = 0;; ++attempt) {
            observer_.before();
            const splat_result result = make();
            observer_.after();
            if (result >= SPLAT_OK) return true;
            EXPECT_TRUE(untouched()) << name << " failed, but wrote to its outputs";
            EXPECT_GT(std::strlen(splat_last_error_message()), 10U) << name;
            if (attempt > 0)
                ADD_FAILURE() << name << " failed again: " << splat_last_error_message();
            if (attempt > 0 || !observer_.retry(name, result)) return false;
        }
    }

    /// A call without outputs.
    template <class Call>
    bool call(const char* name, Call&& make) {
        return call(name, make, [] { return true; });
    }

    template <class Handle, class Call>
    bool create(const char* name, Handle& handle, Call&& make) {
        Output<Handle> output;
        if (!call(
                name, [&] { return make(output.out()); }, [&] { return output.untouched(); }))
            return false;
        handle = output.value();
        return true;
    }

    template <class Handle>
    void destroy(const char* name, splat_result (*function)(Handle), Handle handle) {
        observer_.before();
        const splat_result result = function(handle);
        observer_.after();
        EXPECT_EQ(result, SPLAT_OK) << name << ": " << splat_last_error_message();
    }

  private:
    Observer& observer_;
};

/// A call of a scenario: without outputs, with some that a failed call leaves alone, with a handle.
#define SPLAT_STEP(function, ...) call(#function, [&] { return function(__VA_ARGS__); })
#define SPLAT_STEP_WITH(untouched, function, ...) \
    call(                                         \
        #function, [&] { return function(__VA_ARGS__); }, [&] { return untouched; })
#define SPLAT_MAKE(handle, function, ...) \
    create(#function, handle, [&](auto* out) { return function(__VA_ARGS__, out); })
#define SPLAT_DESTROY(function, handle) destroy(#function, function, handle)

/// The results of a scenario, or nothing if its observer gave up.
template <class Scenario>
std::optional<ScenarioResults> live(Observer& observer, const splat_device_desc& device) {
    Scenario scenario(observer);
    if (!scenario.run(device)) return std::nullopt;
    return std::move(scenario.results);
}

}  // namespace splat::test
