// A process that may start no more threads.
#include "api/api_calls.h"
#include "support/system.h"

namespace splat::test {
namespace {

TEST(ApiThreadLimit, IsNamed) {
    const Dataset dataset = make_training_dataset();
    const splat_device_desc desc = device_desc();
    Device device;
    Batches batches;
    {
        const NoMoreThreads limit;
        if (!limit.works()) GTEST_SKIP() << "the system starts threads all the same";
        EXPECT_REFUSED(splat_device_create(&desc, device.out()), SPLAT_ERROR_OUT_OF_HOST_MEMORY,
                       "vkCreateDevice: the system starts no more threads: a limit of the user "
                       "(`ulimit -u`), of the container (pids.max, TasksMax) or of the machine is "
                       "reached; end other programs, or raise it");
        EXPECT_REFUSED(splat_batches_create(dataset, trainer_desc().config, 1, batches.out()),
                       SPLAT_ERROR_OUT_OF_HOST_MEMORY,
                       "reading batches: the system starts no more threads");
    }
    EXPECT_DONE(splat_device_create(&desc, device.out()));
    EXPECT_DONE(splat_batches_create(dataset, trainer_desc().config, 1, batches.out()));
}

}  // namespace
}  // namespace splat::test
