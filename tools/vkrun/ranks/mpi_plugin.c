/* The plugin of vkrun for one MPI: cc -shared with what `mpicc` adds. README.md names the command. */

#define _POSIX_C_SOURCE 200809L

#include "mpi_plugin.h"

#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#if defined(__GNUC__)
__attribute__((visibility("default"))) int32_t vkrun_mpi_start(uint32_t version, vkrun_mpi* mpi);
#endif

static MPI_Comm comm = MPI_COMM_NULL;
static double timeout_seconds;
static uint64_t message_bytes;

static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Waits for one or two requests. Ranks may share cores, so it sleeps between looks: not at first, as most answers come
 * within microseconds, and longer after a second, when another rank has work of its own. Seconds in which this process
 * was stopped count as one. */
static int32_t wait_for(int count, MPI_Request* requests) {
    double last = seconds(), waited = 0;
    MPI_Status statuses[2];
    for (;;) {
        int done = 0;
        const int failed = MPI_Testall(count, requests, &done, statuses);
        if (failed != MPI_SUCCESS || done) return failed;
        const double now = seconds();
        waited += now - last < 1 ? now - last : 1;
        last = now;
        if (waited > timeout_seconds) return VKRUN_MPI_TIMEOUT;
        if (waited < 20e-6) continue;
        const struct timespec pause = {0, waited < 1 ? 20000 : 1000000};
        nanosleep(&pause, NULL);
    }
}

/* Bytes of the message that begins at `at`. */
static int part(uint64_t bytes, uint64_t at) {
    return (int)(bytes - at < message_bytes ? bytes - at : message_bytes);
}

static int32_t send_receive(void* user, uint32_t peer, const void* sent, void* received,
                            uint64_t bytes) {
    (void)user;
    for (uint64_t at = 0; at < bytes; at += message_bytes) {
        MPI_Request requests[2] = {MPI_REQUEST_NULL, MPI_REQUEST_NULL};
        int failed = MPI_Irecv((char*)received + at, part(bytes, at), MPI_BYTE, (int)peer, 0, comm,
                               &requests[0]);
        if (failed == MPI_SUCCESS)
            failed = MPI_Isend((const char*)sent + at, part(bytes, at), MPI_BYTE, (int)peer, 0,
                               comm, &requests[1]);
        if (failed == MPI_SUCCESS) failed = wait_for(2, requests);
        if (failed != MPI_SUCCESS) return failed;
    }
    return 0;
}

static int32_t broadcast(void* user, uint32_t root, void* data, uint64_t bytes) {
    (void)user;
    for (uint64_t at = 0; at < bytes; at += message_bytes) {
        MPI_Request request = MPI_REQUEST_NULL;
        int failed =
            MPI_Ibcast((char*)data + at, part(bytes, at), MPI_BYTE, (int)root, comm, &request);
        if (failed == MPI_SUCCESS) failed = wait_for(1, &request);
        if (failed != MPI_SUCCESS) return failed;
    }
    return 0;
}

static int32_t barrier(void* user) {
    (void)user;
    MPI_Request request = MPI_REQUEST_NULL;
    const int failed = MPI_Ibarrier(comm, &request);
    return failed == MPI_SUCCESS ? wait_for(1, &request) : failed;
}

static const char* describe(void* user, int32_t number) {
    static char text[MPI_MAX_ERROR_STRING + 1];
    int length = 0;
    (void)user;
    if (number == VKRUN_MPI_TIMEOUT)
        snprintf(text, sizeof text, "no answer within %g s (--rank-timeout)", timeout_seconds);
    else if (MPI_Error_string(number, text, &length) != MPI_SUCCESS)
        return NULL;
    return text;
}

static int32_t finish(void) {
    return MPI_Finalize();
}

/* MPICH's mpirun drops what a process has printed right before. */
static void end_all(int32_t status) {
    const struct timespec pause = {0, 500000000};
    nanosleep(&pause, NULL);
    MPI_Abort(MPI_COMM_WORLD, status);
    _Exit(status);
}

/* The first line of what MPI says of itself, up to a comma: "Open MPI v4.1.4", "MPICH 4.0.2". */
static void name_library(char* to, size_t bytes) {
    char text[MPI_MAX_LIBRARY_VERSION_STRING + 1] = "";
    int length = 0;
    MPI_Get_library_version(text, &length);
    text[strcspn(text, ",\r\n")] = 0;
    for (char* tab = text; (tab = strchr(tab, '\t')) != NULL;) *tab = ' ';
    char* const word = strstr(text, " Version:");
    if (word != NULL) memmove(word, word + 9, strlen(word + 9) + 1);
    snprintf(to, bytes, "%.*s", (int)bytes - 1, text);
}

static int ranks_of(MPI_Comm of, uint32_t* rank, uint32_t* count) {
    int mine = 0, all = 0;
    const int failed =
        MPI_Comm_rank(of, &mine) != MPI_SUCCESS || MPI_Comm_size(of, &all) != MPI_SUCCESS;
    *rank = (uint32_t)mine;
    *count = (uint32_t)all;
    return failed;
}

int32_t vkrun_mpi_start(uint32_t version, vkrun_mpi* mpi) {
    if (version != VKRUN_MPI_VERSION) return VKRUN_MPI_OTHER_VERSION;
    int provided = MPI_THREAD_SINGLE;
    MPI_Comm local = MPI_COMM_NULL;
    /* Open MPI gives its time slice away at each look where ranks share cores, though wait_for() sleeps itself: on two
     * busy cores an exchange of 8 bytes among four ranks took 20 ms with it, 0.5 ms without. */
    setenv("OMPI_MCA_mpi_yield_when_idle", "0", 0);
    /* Calls come one at a time, from any thread. */
    if (MPI_Init_thread(NULL, NULL, MPI_THREAD_SERIALIZED, &provided) != MPI_SUCCESS) {
        snprintf(mpi->failed, sizeof mpi->failed, "MPI_Init_thread fails");
        return 1;
    }
    if (provided < MPI_THREAD_SERIALIZED) {
        snprintf(mpi->failed, sizeof mpi->failed, "this MPI may be called by one thread only");
        return 1;
    }
    if (MPI_Comm_dup(MPI_COMM_WORLD, &comm) != MPI_SUCCESS ||
        MPI_Comm_split_type(comm, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &local) != MPI_SUCCESS ||
        ranks_of(comm, &mpi->rank, &mpi->count) ||
        ranks_of(local, &mpi->local_rank, &mpi->local_count)) {
        snprintf(mpi->failed, sizeof mpi->failed, "MPI makes no communicator");
        return 1;
    }
    MPI_Comm_free(&local);
    MPI_Comm_set_errhandler(comm, MPI_ERRORS_RETURN);
    name_library(mpi->library, sizeof mpi->library);
    timeout_seconds = mpi->timeout_seconds;
    message_bytes = mpi->message_bytes;
    mpi->send_receive = send_receive;
    mpi->broadcast = broadcast;
    mpi->barrier = barrier;
    mpi->describe = describe;
    mpi->finish = finish;
    mpi->end_all = end_all;
    return 0;
}
