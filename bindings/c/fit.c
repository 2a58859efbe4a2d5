/* Fit 200 Gaussians to a picture: rasterizer, loss, gradients and Adam, all on the device.
 * Arguments: a picture of 128 x 96 pixels, or "-" for a formula's; the file for the result. */
#include <math.h>
#include <splat.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { W = 128, H = 96, N = 200, COLUMNS = 20, STEPS = 300 };

static splat_device device;

static void check(splat_result result) {
    if (result == SPLAT_OK) return;
    fprintf(stderr, "fit: %s\n", splat_last_error_message());
    exit(1);
}

/* A tensor [rows, columns] with the contents of an array; NULL: zeros. */
static splat_tensor table(int64_t rows, int64_t columns, const float* values) {
    splat_tensor_desc desc = {sizeof desc, .rank = columns ? 2 : 1, .dims = {rows, columns}};
    const size_t bytes = (size_t)(rows * (columns ? columns : 1)) * sizeof(float);
    splat_tensor tensor;
    check(values ? splat_tensor_from_host(device, &desc, values, bytes, NULL, &tensor)
                 : splat_tensor_create(device, &desc, &tensor));
    return tensor;
}

/* A tensor [1, H, W, 3] with the contents of a picture; NULL: zeros. */
static splat_tensor view(const float* values) {
    splat_tensor_desc desc = {sizeof desc, .rank = 4, .dims = {1, H, W, 3}};
    splat_tensor tensor;
    check(splat_tensor_create(device, &desc, &tensor));
    if (values) check(splat_tensor_write(tensor, values, H * W * 3 * sizeof(float), NULL));
    return tensor;
}

/* The tensor that an operator makes of x, with both gradients. */
typedef struct {
    splat_tensor x, grad_x, y, grad_y;
    splat_op op;
} activated;

static activated activate(const char* type, int64_t columns, const float* values) {
    activated a = {table(N, columns, values), table(N, columns, NULL), table(N, columns, NULL),
                   table(N, columns, NULL), NULL};
    splat_op_desc desc = {
        sizeof desc,    .type = type,    .input_count = 1,          .output_count = 1,
        .inputs = &a.x, .outputs = &a.y, .grad_outputs = &a.grad_y, .grad_inputs = &a.grad_x};
    check(splat_op_create(device, &desc, &a.op));
    return a;
}

static activated scales, opacities; /* no step of logarithms and logits leaves their ranges */

/* Gaussians on a grid that fills the picture, at z = 1. */
static splat_gaussians_desc grid(void) {
    static float means[N * 3], logarithms[N * 3], rotations[N * 4], logits[N], colors[N * 3];
    for (int i = 0; i < N; ++i) {
        means[3 * i] = ((float)(i % COLUMNS) + 0.5F) / COLUMNS - 0.5F;
        means[3 * i + 1] = (((float)(i / COLUMNS) + 0.5F) / (N / COLUMNS) - 0.5F) * H / W;
        means[3 * i + 2] = rotations[4 * i] = 1;
        logits[i] = 2.2F; /* 0.9 */
        for (int k = 3 * i; k < 3 * i + 3; ++k) logarithms[k] = logf(0.04F), colors[k] = 0.5F;
    }
    scales = activate("exp", 3, logarithms);
    opacities = activate("sigmoid", 0, logits);
    return (splat_gaussians_desc){sizeof(splat_gaussians_desc), .means = table(N, 3, means),
                                  .scales = scales.y,           .rotations = table(N, 4, rotations),
                                  .opacities = opacities.y,     .colors = table(N, 3, colors)};
}

int main(int argc, char** argv) {
    static float pixels[H * W * 3];
    splat_image picture = {pixels, sizeof pixels, SPLAT_PIXEL_F32, W, H, 3, 0, 0, 0};
    for (int i = 0; i < H * W * 3; ++i) /* waves */
        pixels[i] = 0.5F + 0.2F * sinf(0.07F * (float)(i / 3 % W) + (float)(i % 3)) +
                    0.2F * cosf(0.06F * (float)(i / 3 / W) - (float)(i % 3));
    if (argc > 1 && argv[1][0] != '-') check(splat_image_load(argv[1], &picture, NULL));

    check(splat_device_create(NULL, &device));
    splat_gaussians_desc shown = grid();
    splat_tensor pair[] = {view(NULL), view(pixels)}, slopes[] = {view(NULL), NULL};
    splat_tensor loss = table(1, 0, NULL), one = table(1, 0, &(float){1});
    splat_gradients_desc back = {sizeof back,
                                 .grad_rgb = slopes[0],
                                 .grad_means = table(N, 3, NULL),
                                 .grad_scales = scales.grad_y,
                                 .grad_rotations = table(N, 4, NULL),
                                 .grad_opacities = opacities.grad_y,
                                 .grad_colors = table(N, 3, NULL)};
    splat_optimizer_item items[] = {{"means", NULL, NULL, shown.means, back.grad_means},
                                    {"logarithms", NULL, NULL, scales.x, scales.grad_x},
                                    {"logits", NULL, NULL, opacities.x, opacities.grad_x},
                                    {"turns", NULL, NULL, shown.rotations, back.grad_rotations},
                                    {"colors", NULL, NULL, shown.colors, back.grad_colors}};
    splat_optimizer_group group = {"means", 0.1, 0, 0, 0};
    splat_optimizer_desc adam = {sizeof adam,      .items = items,   .item_count = 5,
                                 .groups = &group, .group_count = 1, .rate = 1e-2};
    splat_op_desc l2 = {
        sizeof l2,      .type = "l2",     .input_count = 2,     .output_count = 1,
        .inputs = pair, .outputs = &loss, .grad_outputs = &one, .grad_inputs = slopes};
    splat_rasterizer_desc draw = {
        sizeof draw, .flags = SPLAT_RASTERIZER_BACKWARD | SPLAT_RASTERIZER_DIRECT_COLORS,
        .gaussians = N, .width = W, .height = H};
    const splat_camera camera = {W, H, W, W, W / 2, H / 2, {[0] = 1, [5] = 1, [10] = 1, [15] = 1}};
    splat_optimizer optimizer;
    splat_op mean_square;
    splat_rasterizer rasterizer;
    check(splat_rasterizer_create(device, &draw, &rasterizer));
    check(splat_op_create(device, &l2, &mean_square));
    check(splat_optimizer_create(device, &adam, &optimizer));

    struct timespec from, to;
    float error = 1;
    timespec_get(&from, TIME_UTC);
    for (int step = 0; step < STEPS; ++step) {
        check(splat_op_forward(scales.op));
        check(splat_op_forward(opacities.op));
        check(splat_rasterizer_forward(rasterizer, NULL, &shown, &camera, 1, NULL));
        check(splat_rasterizer_output(rasterizer, NULL, SPLAT_OUTPUT_RGB, pair[0]));
        check(splat_op_forward(mean_square));
        check(splat_op_backward(mean_square));
        check(splat_rasterizer_backward(rasterizer, NULL, &back));
        check(splat_op_backward(scales.op));
        check(splat_op_backward(opacities.op));
        check(splat_optimizer_step(optimizer, NULL));
    }
    timespec_get(&to, TIME_UTC);
    check(splat_tensor_read(loss, &error, sizeof error, NULL));
    const double ms =
        (double)(to.tv_sec - from.tv_sec) * 1e3 + (double)(to.tv_nsec - from.tv_nsec) / 1e6;
    printf("%.1f dB, %.2f ms per step\n", -10 * log10((double)error), ms / STEPS);
    check(splat_rasterizer_read_images(rasterizer, NULL, SPLAT_OUTPUT_RGB, 0, &picture, 1));
    check(splat_image_save(argc > 2 ? argv[2] : "fit.png", &picture));
    return 0;
}
