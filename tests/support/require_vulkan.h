#pragma once

#include <gtest/gtest.h>

#include "core/environment.h"

namespace splat::test {

/// SPLAT_REQUIRE_VULKAN=1: tests that cannot run for want of a device, or of a part of Vulkan that devices may lack,
/// fail. Otherwise they are skipped.
inline bool vulkan_required() {
    return environment("SPLAT_REQUIRE_VULKAN").value_or("0") != "0";
}

}  // namespace splat::test

/// Leaves the running test, whose device lacks what it needs: `what` may be a chain of <<.
#define SPLAT_SKIP_FOR_DEVICE(what)                                                             \
    do {                                                                                        \
        if (::splat::test::vulkan_required())                                                   \
            FAIL() << what << "; SPLAT_REQUIRE_VULKAN is set, so what is skipped is a failure"; \
        GTEST_SKIP() << what;                                                                   \
    } while (false)
