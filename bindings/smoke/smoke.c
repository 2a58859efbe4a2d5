/* The smoke list in C; README.md describes the cases. Argument: a folder with config.json and a
 * data set. */
#define _POSIX_C_SOURCE 200809L
#include <pthread.h>
#include <splat.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "smoke.h"

enum { COUNT = 1000, WIDTH = 144, HEIGHT = 96, VIEWS = 2, SIDE = 64, TENSORS = 8 };

static void* allocate(size_t bytes) {
    void* memory = malloc(bytes);
    if (memory == NULL) fail("out of memory");
    return memory;
}

/* ---- What the cases share -------------------------------------------------------------------- */

/* An integer from 0 to 255. */
static float draw(uint32_t* state) {
    *state = *state * 1664525U + 1013904223U;
    return (float)(*state >> 24);
}

static splat_scene make_scene(void) {
    static float means[COUNT][3], log_scales[COUNT][3], rotations[COUNT][4], opacity_logits[COUNT];
    static float sh[COUNT][12];
    uint32_t state = 1;
    for (int i = 0; i < COUNT; ++i) {
        for (int k = 0; k < 3; ++k) means[i][k] = (draw(&state) - 128) / 128;
        for (int k = 0; k < 3; ++k) log_scales[i][k] = -3 - draw(&state) / 128;
        rotations[i][0] = 1;
        for (int k = 1; k < 4; ++k) rotations[i][k] = (draw(&state) - 128) / 256;
        opacity_logits[i] = (draw(&state) - 128) / 32;
        for (int k = 0; k < 12; ++k) sh[i][k] = (draw(&state) - 128) / 128;
    }
    splat_scene_desc desc = {sizeof desc,
                             .count = COUNT,
                             .sh_degree = 1,
                             .means = means[0],
                             .log_scales = log_scales[0],
                             .rotations = rotations[0],
                             .opacity_logits = opacity_logits,
                             .sh = sh[0]};
    splat_scene scene;
    check(splat_scene_create(&desc, &scene));
    return scene;
}

static splat_rasterizer make_rasterizer(splat_device device) {
    splat_rasterizer_desc desc = {sizeof desc,        .flags = SPLAT_RASTERIZER_BACKWARD,
                                  .gaussians = COUNT, .views = VIEWS,
                                  .width = WIDTH,     .height = HEIGHT,
                                  .sh_degree = 1};
    splat_rasterizer rasterizer;
    check(splat_rasterizer_create(device, &desc, &rasterizer));
    return rasterizer;
}

static void make_cameras(splat_scene scene, splat_camera* cameras) {
    splat_orbit_desc orbit = {sizeof orbit, .width = WIDTH, .height = HEIGHT, .elevation = 0.5};
    check(splat_camera_orbit(scene, &orbit, VIEWS, cameras));
}

/* Draw the scene into a state of the rasterizer, NULL for its own. */
static void draw_scene(splat_rasterizer rasterizer, splat_raster_state state, splat_scene scene) {
    const float white[3] = {1, 1, 1};
    splat_camera cameras[VIEWS];
    make_cameras(scene, cameras);
    check(splat_rasterizer_forward_scene(rasterizer, state, scene, cameras, VIEWS, white));
}

static splat_tensor make_tensor(splat_device device, uint32_t rank, const int64_t* dims) {
    splat_tensor_desc desc = {sizeof desc, .rank = rank};
    splat_tensor tensor;
    memcpy(desc.dims, dims, rank * sizeof *dims);
    check(splat_tensor_create(device, &desc, &tensor));
    return tensor;
}

static splat_tensor make_square(splat_device device) {
    const int64_t dims[] = {64, 64};
    return make_tensor(device, 2, dims);
}

static uint64_t hash_of_tensor(splat_tensor tensor) {
    splat_tensor_info info = {.struct_size = sizeof info};
    check(splat_tensor_get_info(tensor, &info));
    void* values = allocate((size_t)info.bytes);
    check(splat_tensor_read(tensor, values, (size_t)info.bytes, NULL));
    const uint64_t value = hash(values, (size_t)info.bytes);
    free(values);
    return value;
}

/* What a prediction of the formula's picture gives. */
typedef struct prediction_facts {
    splat_result result;
    splat_found found;
    uint64_t gaussians;
    uint64_t ply;
} prediction_facts;

static uint64_t hash_of_ply(splat_scene scene) {
    splat_scene_file_desc file = {sizeof file, .format = SPLAT_SCENE_PLY};
    size_t bytes = 0;
    check(splat_scene_save_memory(scene, &file, NULL, 0, &bytes));
    void* data = allocate(bytes);
    check(splat_scene_save_memory(scene, &file, data, bytes, NULL));
    const uint64_t value = hash(data, bytes);
    free(data);
    return value;
}

static prediction_facts predict(splat_predictor predictor) {
    unsigned char pixels[64][80][4];
    make_disc(pixels);
    splat_picture picture = {
        .image.pixels = {pixels, sizeof pixels, SPLAT_PIXEL_U8, 80, 64, 4, 0, 0, 0}};
    splat_picture_info seen = {0};
    splat_prediction facts = {sizeof facts, .pictures = &seen, .picture_capacity = 1};
    splat_scene scene;
    prediction_facts out = {0};
    out.result = splat_predictor_predict(predictor, &picture, 1, &scene, &facts);
    if (out.result == SPLAT_CANCELLED) return out;
    check(out.result);
    out.found = seen.found;
    out.gaussians = facts.gaussians;
    out.ply = hash_of_ply(scene);
    check(splat_scene_destroy(scene));
    return out;
}

/* ---- Cases ----------------------------------------------------------------------------------- */

/* "ok", or ends the program. */
static const char* layout(void) {
#define SIZE(name) \
    { "\"" #name "\":", sizeof(name) }
    static const struct {
        const char* key;
        size_t bytes;
    } sizes[] = {
        SIZE(splat_camera),          SIZE(splat_device_info),     SIZE(splat_gaussians_desc),
        SIZE(splat_gradients_desc),  SIZE(splat_image),           SIZE(splat_memory_info),
        SIZE(splat_orbit_desc),      SIZE(splat_picture),         SIZE(splat_picture_info),
        SIZE(splat_prediction),      SIZE(splat_rasterizer_desc), SIZE(splat_scene_desc),
        SIZE(splat_scene_file_desc), SIZE(splat_scene_info),      SIZE(splat_tensor_desc),
        SIZE(splat_tensor_info),     SIZE(splat_training_desc),   SIZE(splat_run_event)};
#undef SIZE
    if (splat_version() != SPLAT_VERSION) fail("header and library have different versions");
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; ++i) {
        const char* found = strstr(splat_build_info(), sizes[i].key);
        if (found == NULL || strtoul(found + strlen(sizes[i].key), NULL, 10) != sizes[i].bytes)
            fail(sizes[i].key);
    }
    return "ok";
}

static void case_render(splat_device device, splat_scene scene) {
    static float rgb[VIEWS][HEIGHT][WIDTH][3];
    static unsigned char rgba[HEIGHT][WIDTH][4];
    splat_image image = {rgba, sizeof rgba, SPLAT_PIXEL_U8, WIDTH, HEIGHT, 4, 0, 0, 0};
    splat_rasterizer rasterizer = make_rasterizer(device);
    draw_scene(rasterizer, NULL, scene);
    check(splat_rasterizer_read(rasterizer, NULL, SPLAT_OUTPUT_RGB, rgb[0][0][0], sizeof rgb));
    check(splat_rasterizer_read_images(rasterizer, NULL, SPLAT_OUTPUT_RGB, 1, &image, 1));
    check(splat_rasterizer_destroy(rasterizer));
    printf("{\"case\":\"render\",\"rgb\":\"%016llx\",\"rgba\":\"%016llx\"}\n",
           (unsigned long long)hash(rgb, sizeof rgb), (unsigned long long)hash(rgba, sizeof rgba));
}

static void case_gradient(splat_device device, splat_scene scene) {
    static const char* names[] = {"means", "scales", "rotations", "opacities", "sh"};
    const int64_t image[] = {VIEWS, HEIGHT, WIDTH, 3}, same[] = {0, 0, 0, 0}, means[] = {COUNT, 3};
    const float one = 1, white[3] = {1, 1, 1};
    splat_tensor tensors[5];
    for (int i = 0; i < 5; ++i) check(splat_scene_to_tensor(scene, names[i], device, &tensors[i]));
    splat_gaussians_desc gaussians = {sizeof gaussians,        .means = tensors[0],
                                      .scales = tensors[1],    .rotations = tensors[2],
                                      .opacities = tensors[3], .sh = tensors[4]};
    splat_gradients_desc gradients = {sizeof gradients, .grad_rgb = make_tensor(device, 4, image),
                                      .grad_means = make_tensor(device, 2, means),
                                      .grad_opacities = make_tensor(device, 1, means)};
    splat_camera cameras[VIEWS];
    make_cameras(scene, cameras);
    splat_rasterizer rasterizer = make_rasterizer(device);
    check(splat_tensor_write(gradients.grad_rgb, &one, sizeof one, same));
    check(splat_rasterizer_forward(rasterizer, NULL, &gaussians, cameras, VIEWS, white));
    check(splat_rasterizer_backward(rasterizer, NULL, &gradients));
    printf("{\"case\":\"gradient\",\"means\":\"%016llx\",\"opacities\":\"%016llx\"}\n",
           (unsigned long long)hash_of_tensor(gradients.grad_means),
           (unsigned long long)hash_of_tensor(gradients.grad_opacities));
    check(splat_rasterizer_destroy(rasterizer));
    check(splat_tensor_destroy(gradients.grad_rgb));
    check(splat_tensor_destroy(gradients.grad_means));
    check(splat_tensor_destroy(gradients.grad_opacities));
    for (int i = 0; i < 5; ++i) check(splat_tensor_destroy(tensors[i]));
}

/* ---- Errors, threads, lifetimes --------------------------------------------------------------- */

static void case_errors(splat_scene scene) {
    splat_device_info device = {.struct_size = sizeof device};
    splat_scene_info info = {.struct_size = sizeof info};
    splat_result code = splat_device_describe(9999, &device);
    printf("{\"case\":\"error\",\"code\":%d,\"name\":\"%s\",\"message\":\"%s\"}\n", (int)code,
           splat_result_name(code), splat_last_error_message());
    check(splat_scene_destroy(scene));
    code = splat_scene_get_info(scene, &info);
    printf("{\"case\":\"handle\",\"code\":%d,\"name\":\"%s\"}\n", (int)code,
           splat_result_name(code));
}

static void* interrupt_training(void* training) {
    check(splat_run_interrupt(training));
    return NULL;
}

static splat_run_event_kind interrupted_training(splat_device device, const char* folder,
                                                 const char* config) {
    char root[4096], run[4096];
    const char* values[] = {root};
    splat_training_desc desc = {sizeof desc,      .flags = SPLAT_TRAINING_OVERWRITE,
                                .folder = run,    .config = config,
                                .values = values, .value_count = 1};
    splat_run_event event = {sizeof event, .kind = SPLAT_EVENT_MESSAGE};
    splat_run training;
    pthread_t thread;
    snprintf(root, sizeof root, "data.root='%s'", folder);
    snprintf(run, sizeof run, "%s/run_c", folder);
    check(splat_training_open(device, &desc, &training));
    while (event.kind != SPLAT_EVENT_STEP) check(splat_run_next(training, &event));
    if (pthread_create(&thread, NULL, interrupt_training, training) != 0) fail("no thread");
    pthread_join(thread, NULL);
    while (event.kind < SPLAT_EVENT_DONE) check(splat_run_next(training, &event));
    check(splat_run_destroy(training));
    return event.kind;
}

typedef struct cancelling {
    splat_device device;
    atomic_int stop;
} cancelling;

static void* cancel_device(void* argument) {
    cancelling* now = argument;
    const struct timespec millisecond = {0, 1000000};
    while (!atomic_load(&now->stop)) {
        check(splat_device_cancel(now->device));
        nanosleep(&millisecond, NULL);
    }
    return NULL;
}

static void case_cancel(splat_device device, splat_predictor predictor, const char* folder,
                        const char* config) {
    const splat_run_event_kind event = interrupted_training(device, folder, config);
    cancelling now = {.device = device};
    pthread_t thread;
    splat_result code;
    if (pthread_create(&thread, NULL, cancel_device, &now) != 0) fail("no thread");
    do code = predict(predictor).result;
    while (code != SPLAT_CANCELLED);
    atomic_store(&now.stop, 1);
    pthread_join(thread, NULL);
    printf("{\"case\":\"cancel\",\"event\":%d,\"code\":%d,\"name\":\"%s\"}\n", (int)event,
           (int)code, splat_result_name(code));
}

typedef struct computing {
    splat_predictor predictor;
    atomic_int started;
    prediction_facts last;
} computing;

static void* predict_four_times(void* argument) {
    computing* work = argument;
    atomic_store(&work->started, 1);
    for (int i = 0; i < 4; ++i) work->last = predict(work->predictor);
    return NULL;
}

static void case_busy(void) {
    splat_device device;
    splat_tensor tensors[TENSORS];
    computing work = {NULL};
    pthread_t thread;
    check(splat_device_create(NULL, &device));
    check(splat_predictor_create(device, NULL, &work.predictor));
    for (int i = 0; i < TENSORS; ++i) tensors[i] = make_square(device);
    splat_scene scene = make_scene();
    splat_rasterizer rasterizer = make_rasterizer(device);
    draw_scene(rasterizer, NULL, scene);
    if (pthread_create(&thread, NULL, predict_four_times, &work) != 0) fail("no thread");
    while (!atomic_load(&work.started)) nanosleep(&(struct timespec){0, 1000000}, NULL);
    check(splat_device_destroy(device));
    for (int i = 0; i < TENSORS; ++i) check(splat_tensor_destroy(tensors[i]));
    check(splat_scene_destroy(scene));
    check(splat_rasterizer_destroy(rasterizer));
    pthread_join(thread, NULL);
    check(splat_predictor_destroy(work.predictor));
    printf("{\"case\":\"busy\",\"ply\":\"%016llx\",\"result\":\"ok\"}\n",
           (unsigned long long)work.last.ply);
}

/* Destroy one device's objects in mixed order. Returns the bytes that live on it afterwards; 0 if
 * the device went first. */
static uint64_t destroy_in_mixed_order(int device_first) {
    const float one = 1;
    const int64_t same[] = {0, 0};
    splat_memory_info memory = {.struct_size = sizeof memory};
    splat_device device;
    splat_predictor predictor;
    splat_raster_state state;
    check(splat_device_create(NULL, &device));
    splat_tensor tensor = make_square(device);
    splat_rasterizer rasterizer = make_rasterizer(device);
    check(splat_raster_state_create(rasterizer, &state));
    splat_scene scene = make_scene();
    draw_scene(rasterizer, state, scene);
    check(splat_predictor_create(device, NULL, &predictor));
    predict(predictor);
    if (device_first) check(splat_device_destroy(device));
    check(splat_rasterizer_destroy(rasterizer));
    check(splat_predictor_destroy(predictor));
    check(splat_tensor_write(tensor, &one, sizeof one, same));
    check(splat_tensor_destroy(tensor));
    check(splat_scene_destroy(scene));
    check(splat_raster_state_destroy(state));
    if (device_first) return 0;
    check(splat_device_get_memory(device, &memory));
    check(splat_device_destroy(device));
    return memory.live_bytes;
}

static void case_order(void) {
    const uint64_t live = destroy_in_mixed_order(0);
    destroy_in_mixed_order(1);
    printf("{\"case\":\"order\",\"live_bytes\":%llu,\"result\":\"ok\"}\n",
           (unsigned long long)live);
}

/* ---- Main ------------------------------------------------------------------------------------ */

static void read_config(const char* folder, char* text, size_t capacity) {
    snprintf(text, capacity, "%s/config.json", folder);
    FILE* file = fopen(text, "rb");
    if (file == NULL) fail("there is no config.json in the folder");
    text[fread(text, 1, capacity - 1, file)] = '\0';
    fclose(file);
}

static void case_presets(void) {
    char names[4096];
    size_t needed = 0;
    if (splat_prior_preset(NULL, names, sizeof names, &needed) != SPLAT_OK) fail("no presets");
    printf("{\"case\":\"presets\",\"bytes\":%u,\"names\":\"%016llx\"}\n", (unsigned)(needed - 1),
           (unsigned long long)hash(names, needed - 1));
}

int main(int argc, char** argv) {
    char config[4096];
    splat_device device;
    splat_device_info info = {.struct_size = sizeof info};
    splat_predictor predictor;
    if (argc != 2) fail("usage: smoke FOLDER");
    read_config(argv[1], config, sizeof config);
    printf("{\"case\":\"version\",\"version\":\"%s\",\"layout\":\"%s\"}\n", splat_version_string(),
           layout());
    case_presets();
    check(splat_device_create(NULL, &device));
    check(splat_device_get_info(device, &info));
    printf("{\"case\":\"device\",\"kind\":%d}\n", (int)info.kind);
    splat_scene scene = make_scene();
    case_render(device, scene);
    case_gradient(device, scene);
    check(splat_predictor_create(device, NULL, &predictor));
    const prediction_facts facts = predict(predictor);
    printf("{\"case\":\"predict\",\"gaussians\":%llu,\"ply\":\"%016llx\",\"found\":%d}\n",
           (unsigned long long)facts.gaussians, (unsigned long long)facts.ply, (int)facts.found);
    case_judge(scene);
    case_maps();
    case_data(argv[1]);
    case_errors(scene);
    case_cancel(device, predictor, argv[1], config);
    check(splat_predictor_destroy(predictor));
    check(splat_device_destroy(device));
    case_busy();
    case_order();
    return fflush(stdout) == 0 ? 0 : 1;
}
