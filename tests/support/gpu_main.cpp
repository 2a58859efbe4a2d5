#include <gtest/gtest.h>

#include "support/gpu_env.h"

int main(int argc, char** argv) {
    testing::InitGoogleTest(&argc, argv);
    splat::test::install_gpu_environment();
    return RUN_ALL_TESTS();
}
