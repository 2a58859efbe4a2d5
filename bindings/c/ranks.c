/* Train on several ranks, which here are threads with a device each, and print the loss of each step.
 * Arguments: a new folder for data and run, the number of ranks (1, 2, 4 or 8). All give the same bits. */
#include <splat.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <threads.h>

enum { MOST = 8 };

/* ---- The group: what a rank gives to another lies at `offered` until that one has taken it ---- */

static mtx_t mutex; /* guards the following */
static cnd_t changed;
static const void* offered[MOST][MOST]; /* by giver and taker */
static unsigned count, arrived, barriers, gone;

static void offer(unsigned from, unsigned to, const void* data) {
    offered[from][to] = data ? data : "";
    cnd_broadcast(&changed);
}

/* Wait until it is there (1) or taken (0). Returns 1 if a rank is gone. */
static int await(unsigned from, unsigned to, int there) {
    while (!gone && (offered[from][to] != NULL) != there) cnd_wait(&changed, &mutex);
    return gone != 0;
}

static int take(unsigned from, unsigned to, void* data, uint64_t bytes) {
    if (await(from, to, 1)) return 1;
    if (bytes) memcpy(data, offered[from][to], (size_t)bytes);
    offered[from][to] = NULL;
    cnd_broadcast(&changed);
    return 0;
}

static int32_t send_receive(void* user, uint32_t peer, const void* sent, void* received, uint64_t bytes) {
    const unsigned self = *(const unsigned*)user;
    mtx_lock(&mutex);
    offer(self, peer, sent);
    const int failed = take(peer, self, received, bytes) || await(self, peer, 0);
    mtx_unlock(&mutex);
    return failed;
}

static int32_t broadcast(void* user, uint32_t root, void* data, uint64_t bytes) {
    const unsigned self = *(const unsigned*)user;
    int failed = 0;
    mtx_lock(&mutex);
    for (unsigned to = 0; self == root && to < count; ++to)
        if (to != root) offer(root, to, data);
    for (unsigned to = 0; self == root && to < count; ++to) failed |= await(root, to, 0);
    if (self != root) failed = take(root, self, data, bytes);
    mtx_unlock(&mutex);
    return failed;
}

static int32_t barrier(void* user) {
    (void)user;
    mtx_lock(&mutex);
    const unsigned mine = barriers;
    if (++arrived % count == 0) ++barriers;
    cnd_broadcast(&changed);
    while (!gone && barriers == mine) cnd_wait(&changed, &mutex);
    mtx_unlock(&mutex);
    return gone != 0;
}

static const char* describe(void* user, int32_t number) {
    (void)user, (void)number;
    return "another thread has ended";
}

/* ---- A rank ---------------------------------------------------------------------------------- */

static const char kConfig[] =
    "model: {base_dim: 8, num_blocks: 1, channel_mult: [1, 2], attention_resolutions: [8]}\n"
    "data: {training_resolution: 16}\n"
    "opt: {batch_size: 8, imgs_per_obj: 2, iterations: 5, base_lr: 1.0e-3}\n"
    "logging: {ckpt_iterations: 5, val_log: 0, loss_log: 1}\n";
static const char* folder;

static int failed(unsigned rank) {
    fprintf(stderr, "ranks: %s\n", splat_last_error_message());
    mtx_lock(&mutex);
    gone |= 1U << rank;
    cnd_broadcast(&changed);
    mtx_unlock(&mutex);
    return 1;
}

static int train(void* user) {
    unsigned rank = *(const unsigned*)user;
    char root[4096], run_folder[4096];
    snprintf(root, sizeof root, "data.root='%s/data'", folder);
    snprintf(run_folder, sizeof run_folder, "%s/run", folder);
    const char* const values[] = {root};
    const splat_group group = {.struct_size = sizeof group, .rank = rank, .count = count, .user = &rank,
                               .send_receive = send_receive, .broadcast = broadcast, .barrier = barrier,
                               .describe = describe};
    const splat_training_desc desc = {.struct_size = sizeof desc, .folder = rank == 0 ? run_folder : NULL,
                                      .config = kConfig, .values = values, .value_count = 1, .group = &group};
    splat_run_event event = {.struct_size = sizeof event};
    splat_device device;
    splat_run run;
    if (splat_device_create(NULL, &device) < 0 || splat_training_open(device, &desc, &run) < 0) return failed(rank);
    while (event.kind < SPLAT_EVENT_DONE) {
        if (splat_run_next(run, &event) < 0) return failed(rank);
        for (uint64_t i = 0; rank == 0 && event.kind == SPLAT_EVENT_STEP && i < event.number_count; ++i)
            if (strcmp(event.numbers[i].name, "loss") == 0)
                printf("step %llu, loss %.17g\n", (unsigned long long)event.step, event.numbers[i].value);
    }
    splat_run_destroy(run);
    splat_device_destroy(device);
    return 0;
}

int main(int argc, char** argv) {
    static unsigned ranks[MOST];
    static thrd_t threads[MOST];
    count = argc == 3 ? (unsigned)atoi(argv[2]) : 0;
    if (count == 0 || count > MOST) return fprintf(stderr, "usage: ranks FOLDER RANKS\n"), 2;
    folder = argv[1];
    char data[4096];
    snprintf(data, sizeof data, "%s/data", folder);
    const splat_synthetic_desc objects = {.struct_size = sizeof objects, .path = data, .resolution = 16,
                                          .train_views = 4, .train_objects = 8};
    for (uint32_t i = 0; i < objects.train_objects; ++i)
        if (splat_synthetic_write(&objects, i) < 0)
            return fprintf(stderr, "ranks: %s\n", splat_last_error_message()), 1;
    mtx_init(&mutex, mtx_plain);
    cnd_init(&changed);
    int all = 0;
    for (unsigned rank = 0; rank < count; ++rank) {
        ranks[rank] = rank;
        if (thrd_create(&threads[rank], train, &ranks[rank]) != thrd_success) return 1;
    }
    for (unsigned rank = 0; rank < count; ++rank) {
        int result = 0;
        thrd_join(threads[rank], &result);
        all |= result;
    }
    return all;
}
