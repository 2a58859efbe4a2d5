/* What vkrun and its plugin for MPI say to each other. The plugin is a library of its own, made of mpi_plugin.c and one
 * MPI: those of Open MPI and MPICH cannot take each other's place. */
#ifndef VKRUN_MPI_PLUGIN_H
#define VKRUN_MPI_PLUGIN_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Changes with the struct below. */
#define VKRUN_MPI_VERSION 1

typedef struct vkrun_mpi {
    /* In: how long a call waits for another rank, and the most bytes of one message. */
    double timeout_seconds;
    uint64_t message_bytes;

    /* Out. */
    uint32_t rank, count;
    uint32_t local_rank, local_count; /* among the ranks of this machine */
    char library[128];                /* name and version of MPI */
    char failed[256];                 /* why it does not start */

    /* They are those of splat/group.h; `user` is not used. A call that waits too long gives VKRUN_MPI_TIMEOUT, others
     * an error of MPI. From then on only `describe` and `end_all` may be called. */
    int32_t (*send_receive)(void* user, uint32_t peer, const void* sent, void* received, uint64_t bytes);
    int32_t (*broadcast)(void* user, uint32_t root, void* data, uint64_t bytes);
    int32_t (*barrier)(void* user);
    const char* (*describe)(void* user, int32_t number);

    /* Leave MPI; all ranks call it, after a barrier. */
    int32_t (*finish)(void);
    /* End this process and all others, with the exit status. */
    void (*end_all)(int32_t status);
} vkrun_mpi;

#define VKRUN_MPI_TIMEOUT (-1)
#define VKRUN_MPI_OTHER_VERSION (-2)

/* The function of the plugin, called once. Returns 0; VKRUN_MPI_OTHER_VERSION, and nothing is written; or another
 * number, with the reason in `failed`. */
int32_t vkrun_mpi_start(uint32_t version, vkrun_mpi* mpi);
typedef int32_t (*vkrun_mpi_start_function)(uint32_t version, vkrun_mpi* mpi);

#ifdef __cplusplus
}
#endif

#endif /* VKRUN_MPI_PLUGIN_H */
