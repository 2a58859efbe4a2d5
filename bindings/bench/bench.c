/* What a call costs in C; README.md describes the three measurements. Argument: a scene. */
#define _POSIX_C_SOURCE 200809L
#include <splat.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { ROUNDS = 40, CALLS = 10000, SIDE = 1024, WIDTH = 144, HEIGHT = 240 };

static splat_tensor tensor;
static splat_rasterizer rasterizer;
static splat_scene scene;
static splat_camera cameras[2];
static float numbers[SIDE * SIDE], pixels[WIDTH * HEIGHT * 3];

static void check(splat_result result) {
    if (result >= 0) return;
    fprintf(stderr, "bench: %s\n", splat_last_error_message());
    exit(1);
}

static double now_ms(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

static int by_size(const void* a, const void* b) {
    const double x = *(const double*)a, y = *(const double*)b;
    return (x > y) - (x < y);
}

static void get(int round) {
    splat_tensor_info info = {.struct_size = sizeof info};
    for (int i = 0; i < CALLS; ++i) check(splat_tensor_get_info(tensor, &info));
    (void)round;
}

static void read_tensor(int round) {
    check(splat_tensor_read(tensor, numbers, sizeof numbers, NULL));
    (void)round;
}

static void render(int round) { /* the cameras take turns: an unchanged view is not drawn again */
    check(splat_rasterizer_forward_scene(rasterizer, NULL, scene, &cameras[round % 2], 1, NULL));
    check(splat_rasterizer_read(rasterizer, NULL, SPLAT_OUTPUT_RGB, pixels, sizeof pixels));
}

/* "NAME":[shortest, median] of the rounds, times a factor, after two rounds that do not count. */
static void measure(const char* name, void (*call)(int), double factor) {
    double times[ROUNDS];
    call(0);
    call(1);
    for (int i = 0; i < ROUNDS; ++i) {
        const double start = now_ms();
        call(i);
        times[i] = (now_ms() - start) * factor;
    }
    qsort(times, ROUNDS, sizeof *times, by_size);
    printf(",\"%s\":[%.3f,%.3f]", name, times[0], times[ROUNDS / 2]);
}

int main(int argc, char** argv) {
    splat_device device;
    splat_tensor_desc desc = {sizeof desc, .rank = 2, .dims = {SIDE, SIDE}};
    splat_orbit_desc orbit = {sizeof orbit, .width = WIDTH, .height = HEIGHT};
    splat_scene_info info = {.struct_size = sizeof info};
    if (argc != 2) return 2;
    check(splat_device_create(NULL, &device));
    check(splat_tensor_create(device, &desc, &tensor));
    check(splat_scene_load(argv[1], NULL, &scene));
    check(splat_scene_get_info(scene, &info));
    check(splat_camera_orbit(scene, &orbit, 2, cameras));
    splat_rasterizer_desc drawn = {sizeof drawn, .gaussians = (uint32_t)info.count, .width = WIDTH,
                                   .height = HEIGHT};
    check(splat_rasterizer_create(device, &drawn, &rasterizer));
    printf("{\"language\":\"C\"");
    measure("getter_ns", get, 1e6 / CALLS);
    measure("read_ms", read_tensor, 1);
    measure("render_ms", render, 1);
    printf("}\n");
    return 0;
}
