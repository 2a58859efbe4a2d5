// A process that may start no more threads.
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <system_error>
#include <thread>

#include "api/api_calls.h"

namespace splat::test {
namespace {

/// While it lives, the system starts no thread for this process. The limit does not hold for root, so that another
/// user runs it meanwhile.
class NoMoreThreads {
  public:
    NoMoreThreads() : root_(geteuid() == 0) {
        getrlimit(RLIMIT_NPROC, &before_);
        const rlimit none{0, before_.rlim_max};
        setrlimit(RLIMIT_NPROC, &none);
        constexpr uid_t kNobody = 65534;
        become(kNobody);
    }
    NoMoreThreads(const NoMoreThreads&) = delete;
    NoMoreThreads& operator=(const NoMoreThreads&) = delete;
    ~NoMoreThreads() {
        become(0);
        prctl(PR_SET_DUMPABLE, 1);  // the leak check needs it
        setrlimit(RLIMIT_NPROC, &before_);
    }
    [[nodiscard]] bool works() const {
        try {
            std::thread([] {}).join();
            return false;
        } catch (const std::system_error&) {
            return true;
        }
    }

  private:
    void become(uid_t user) const {
        const int done = root_ ? setresuid(user, user, 0) : 0;
        EXPECT_EQ(done, 0);
    }

    bool root_;
    rlimit before_{};
};

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
