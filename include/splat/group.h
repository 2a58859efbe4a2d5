/* libsplat: processes or threads that train together, one rank each.
 *
 *   splat_group group = {.struct_size = sizeof group, .rank = rank, .count = count, .user = user,
 *                        .send_receive = send_receive, .broadcast = broadcast, .barrier = barrier};
 *   splat_training_desc desc = {sizeof desc, .folder = "run", .config = text, .group = &group};
 *
 * The library opens no connection. It calls the functions of the application, which may hand bytes to MPI, to
 * sockets, or to another thread. All ranks make the same calls in the same order: one that fails on a rank must fail
 * on its partner too, sooner or later.
 *
 * Rank 0 has the folder, and its run is as run.h says. Those of the other ranks follow it: splat_run_next gives a step,
 * without "averaged_loss", or the event that ends the run, and waits meanwhile for rank 0, which alone validates and
 * saves. So each rank calls splat_run_next until an event or an error ends its run.
 *
 * splat_training_open returns the same error on all ranks, "rank 2: ..." for one of rank 2, before anything is written:
 * also SPLAT_ERROR_INVALID_ARGUMENT for a version of the library, a key of the configuration, data or weights to start
 * from that differ from those of rank 0, and for a splat_device that has the open run of another rank. data.root,
 * opt.pretrained_ckpt and opt.num_workers may differ. Another kind of device is a warning in the log.
 *
 * splat_run_interrupt of any rank ends the run on all, with everything saved. An error on any rank, also a cancelled
 * call, is returned on all and ends the run, as if rank 0 is destroyed; log.txt and run.json keep it. The latest state
 * can be resumed by another count of ranks, with the same bits. */
#ifndef SPLAT_GROUP_H
#define SPLAT_GROUP_H

#include "core.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Send `bytes` bytes to rank `peer`, and receive as many from it, which makes the same call at that time. `sent` and
 * `received` do not overlap. Returns 0, or a number of its own where it failed: then the run ends with an error that
 * names it. Called by one thread at a time, also one of the library, never beside another function of the group; it
 * must not throw and not call the library. So do the next ones. */
typedef int32_t (*splat_group_send_receive)(void* user, uint32_t peer, const void* sent, void* received,
                                            uint64_t bytes);

/* Give `bytes` bytes of rank `root` to all ranks. data: in on `root`, out on the others. */
typedef int32_t (*splat_group_broadcast)(void* user, uint32_t root, void* data, uint64_t bytes);

/* Return when all ranks have called it. */
typedef int32_t (*splat_group_barrier)(void* user);

/* Replace `count` numbers by their sums over all ranks, in any order. */
typedef int32_t (*splat_group_sum)(void* user, float* values, uint64_t count);

/* Describe a number that a function returned, UTF-8, valid until the next call; NULL: nothing is known. */
typedef const char* (*splat_group_describe)(void* user, int32_t number);

/* The ranks of a run, and how they reach each other. The struct is copied; functions and `user` must live until the
 * run is destroyed. */
typedef struct splat_group {
    uint32_t struct_size;
    uint32_t rank;  /* 0 ... count - 1; 0 has the folder of the run */
    uint32_t count; /* a power of two, at most 4096; 1: as without a group */
    uint32_t reserved;
    void* user; /* passed to the functions */
    splat_group_send_receive send_receive;
    splat_group_broadcast broadcast;
    splat_group_barrier barrier;
    /* NULL: gradients are summed in a fixed order, so that 1, 2, 4... ranks give the same bits. With it they are
     * summed by it, and the facts of the run say that it cannot be reproduced */
    splat_group_sum sum;
    splat_group_describe describe; /* NULL: errors have the number alone */
} splat_group;

#ifdef __cplusplus
}
#endif

#endif /* SPLAT_GROUP_H */
