/* Calls from many threads on one device: drawing, predicting, objects that come and go, getters, the
 * log, a training that is interrupted, and cancelling all of it. Built with -fsanitize=thread by the
 * preset tsan. Argument: a folder as of bindings/smoke/README.md. */
#define _POSIX_C_SOURCE 200809L
#include <pthread.h>
#include <splat.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { COUNT = 200, SIDE = 64, ROUNDS = 12, PICTURE = 48 };

static splat_device device;
static splat_scene scene;
static const char* folder;
static char config[4096];
static atomic_int working, cancelled, logged;
static atomic_uintptr_t training_now; /* the session that may be interrupted */

/* True if a call did its work; a cancelled one did not, and any other failure ends the program. */
static int done(splat_result result) {
    if (result == SPLAT_CANCELLED) atomic_fetch_add(&cancelled, 1);
    if (result >= 0 || result == SPLAT_CANCELLED) return result >= 0;
    fprintf(stderr, "threads: %s\n", splat_last_error_message());
    exit(1);
}

static void check(splat_result result) {
    if (!done(result)) exit((fprintf(stderr, "threads: a call was cancelled in vain\n"), 1));
}

static void pause_ms(long ms) {
    nanosleep(&(struct timespec){0, ms * 1000000}, NULL);
}

static splat_scene make_scene(void) {
    static float means[COUNT][3], log_scales[COUNT][3];
    for (int i = 0; i < COUNT; ++i)
        for (int k = 0; k < 3; ++k) {
            means[i][k] = (float)((i * 37 + k * 61) % 101 - 50) / 50;
            log_scales[i][k] = -3;
        }
    splat_scene_desc desc = {sizeof desc, .count = COUNT, .means = means[0],
                             .log_scales = log_scales[0]};
    splat_scene made;
    check(splat_scene_create(&desc, &made));
    return made;
}

static void* draw(void* unused) {
    static const float white[3] = {1, 1, 1};
    splat_rasterizer_desc desc = {sizeof desc, .gaussians = COUNT, .width = SIDE, .height = SIDE};
    splat_orbit_desc orbit = {sizeof orbit, .width = SIDE, .height = SIDE};
    float pixels[SIDE * SIDE * 3];
    splat_camera cameras[ROUNDS];
    check(splat_camera_orbit(scene, &orbit, ROUNDS, cameras));
    for (int i = 0; i < ROUNDS; ++i) {
        splat_rasterizer rasterizer;
        if (!done(splat_rasterizer_create(device, &desc, &rasterizer))) continue;
        if (done(splat_rasterizer_forward_scene(rasterizer, NULL, scene, &cameras[i], 1, white)))
            done(splat_rasterizer_read(rasterizer, NULL, SPLAT_OUTPUT_RGB, pixels, sizeof pixels));
        check(splat_rasterizer_destroy(rasterizer));
    }
    atomic_fetch_sub(&working, 1);
    return unused;
}

static void* predict(void* predictor) {
    static unsigned char pixels[PICTURE * PICTURE * 3];
    splat_picture picture = {
        .image.pixels = {pixels, sizeof pixels, SPLAT_PIXEL_U8, PICTURE, PICTURE, 3, 0, 0, 0},
        .flags = SPLAT_PICTURE_WHOLE};
    for (int i = 0; i < ROUNDS; ++i) {
        splat_scene made;
        if (done(splat_predictor_predict(predictor, &picture, 1, &made, NULL)))
            check(splat_scene_destroy(made));
    }
    atomic_fetch_sub(&working, 1);
    return NULL;
}

/* Tensors that come and go, a scene that others draw and this thread writes, and getters. */
static void* come_and_go(void* unused) {
    splat_tensor_desc desc = {sizeof desc, .rank = 2, .dims = {COUNT, 3}};
    splat_memory_info memory = {.struct_size = sizeof memory};
    splat_scene_info info = {.struct_size = sizeof info};
    float means[COUNT * 3];
    check(splat_scene_read(scene, "means", means, sizeof means));
    for (int i = 0; i < 10 * ROUNDS; ++i) {
        splat_tensor tensor;
        check(splat_scene_write(scene, "means", means, sizeof means));
        check(splat_scene_get_info(scene, &info));
        check(splat_device_get_memory(device, &memory));
        if (!done(splat_tensor_create(device, &desc, &tensor))) continue;
        if (done(splat_tensor_write(tensor, means, sizeof means, NULL)))
            done(splat_tensor_read(tensor, means, sizeof means, NULL));
        check(splat_tensor_destroy(tensor));
        check(splat_scene_read(scene, "means", means, sizeof means));
    }
    atomic_fetch_sub(&working, 1);
    return unused;
}

static void* train(void* unused) {
    char root[4096], run[4096];
    const char* values[] = {root};
    splat_training_desc desc = {sizeof desc,      .flags = SPLAT_TRAINING_OVERWRITE,
                                .folder = run,    .config = config,
                                .values = values, .value_count = 1};
    splat_run_event event = {.struct_size = sizeof event};
    splat_run training;
    snprintf(root, sizeof root, "data.root='%s'", folder);
    snprintf(run, sizeof run, "%s/run_threads", folder);
    while (!done(splat_training_open(device, &desc, &training))) continue;
    atomic_store(&training_now, (uintptr_t)training);
    while (event.kind < SPLAT_EVENT_DONE) done(splat_run_next(training, &event));
    if (event.kind != SPLAT_EVENT_INTERRUPTED) exit(1);
    check(splat_run_destroy(training)); /* while another thread may interrupt it */
    atomic_fetch_sub(&working, 1);
    return unused;
}

static void* cancel(void* unused) {
    for (int i = 0; i < 100 && atomic_load(&working) > 0; ++i) {
        check(splat_device_cancel(device));
        pause_ms(5 + i % 40);
    }
    return unused;
}

static void* interrupt(void* unused) {
    while (atomic_load(&training_now) == 0) pause_ms(1);
    pause_ms(100);
    while (atomic_load(&working) > 0) { /* an ended session is refused, not followed */
        splat_run_interrupt((splat_run)atomic_load(&training_now));
        pause_ms(2);
    }
    return unused;
}

static void count_messages(void* user, splat_log_level level, const char* message) {
    atomic_fetch_add((atomic_int*)user, level > 0 && message != NULL);
}

static void* change_log(void* unused) {
    while (atomic_load(&working) > 0) {
        check(splat_log_set_callback(count_messages, &logged, SPLAT_LOG_DEBUG));
        pause_ms(1);
        check(splat_log_set_callback(NULL, NULL, 0));
    }
    return unused;
}

int main(int argc, char** argv) {
    void* (*const calls[])(void*) = {draw,  draw,   predict,   predict,   come_and_go,
                                     train, cancel, interrupt, change_log};
    enum { THREADS = sizeof calls / sizeof *calls, WORKERS = 6 };
    pthread_t threads[THREADS];
    splat_predictor predictor;
    if (argc != 2) return 2;
    folder = argv[1];
    snprintf(config, sizeof config, "%s/config.json", folder);
    FILE* file = fopen(config, "rb");
    if (file == NULL) return 2;
    config[fread(config, 1, sizeof config - 1, file)] = '\0';
    fclose(file);
    check(splat_device_create(NULL, &device));
    check(splat_predictor_create(device, NULL, &predictor));
    scene = make_scene();
    atomic_store(&working, WORKERS);
    for (int i = 0; i < THREADS; ++i)
        if (pthread_create(&threads[i], NULL, calls[i], predictor) != 0) return 1;
    for (int i = 0; i < THREADS; ++i) pthread_join(threads[i], NULL);
    check(splat_predictor_destroy(predictor));
    check(splat_scene_destroy(scene));
    check(splat_device_destroy(device));
    printf("%d calls cancelled\n", atomic_load(&cancelled));
    return atomic_load(&cancelled) > 0 ? 0 : 1;
}
