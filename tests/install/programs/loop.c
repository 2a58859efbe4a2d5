/* Twenty steps of training with a loss of one's own; every number stays on the device. */
#include <splat.h>
#include <stdio.h>
#include <stdlib.h>
#define CHECK(call) ((call) != SPLAT_OK ? (puts(splat_last_error_message()), exit(1)) : (void)0)
#define TENSOR(name) (CHECK(splat_model_tensor(model, name, &t)), t)
#define IMAGE(value) (CHECK(splat_tensor_from_host(device, &size, &(float){value}, 4, same, &t)), t)
int main(void) {
    splat_device device; splat_model model; splat_op l2; splat_rasterizer raster;
    splat_optimizer adam; splat_tensor t; float now, first = 0; const int64_t same[4] = {0}; /* repeats */
    splat_model_desc net = {sizeof net, .flags = SPLAT_MODEL_GRADIENTS, .config =
        "model.base_dim: 16\nmodel.num_blocks: 1\ndata.training_resolution: 32"};
    splat_tensor_desc size = {sizeof size, .rank = 4, .dims = {1, 32, 32, 3}};
    splat_rasterizer_desc draw = {sizeof draw, SPLAT_RASTERIZER_BACKWARD, NULL, 1024, 1, 32, 32, .sh_degree = 1};
    splat_camera camera = {32, 32, 33, 33, 16, 16, {[0] = 1, [5] = 1, [10] = 1, [15] = 1}};
    CHECK(splat_device_create(NULL, &device) || splat_model_create(device, &net, &model)
        || splat_model_init(model, 1) || splat_rasterizer_create(device, &draw, &raster));
    splat_optimizer_desc rule = {sizeof rule, .items = &(splat_optimizer_item){.model = model}, .item_count = 1,
        .rate = 3e-3};
    splat_tensor pair[] = {IMAGE(0), IMAGE(0.8F)}, slopes[] = {IMAGE(0), NULL};
    splat_tensor loss = (size.rank = 1, IMAGE(0)), one = IMAGE(1);
    splat_op_desc mean = {sizeof mean, 0, NULL, "l2", NULL, 2, 1, pair, &loss, &one, slopes};
    CHECK(splat_op_create(device, &mean, &l2) || splat_optimizer_create(device, &rule, &adam));
    splat_gaussians_desc shown = {sizeof shown, 0, NULL, TENSOR("means[0]"), TENSOR("scales[0]"),
        TENSOR("rotations[0]"), TENSOR("opacities[0]"), .sh = TENSOR("sh[0]")};
    splat_gradients_desc back = {sizeof back, .grad_rgb = slopes[0], .grad_sh = TENSOR("grad:sh[0]"),
        .grad_means = TENSOR("grad:means[0]"), .grad_scales = TENSOR("grad:scales[0]"),
        .grad_rotations = TENSOR("grad:rotations[0]"), .grad_opacities = TENSOR("grad:opacities[0]")};
    splat_model_input in = {sizeof in, .flags = SPLAT_PASS_TENSORS};
    splat_model_gradients grad = {sizeof grad, .flags = SPLAT_PASS_TENSORS};
    CHECK(splat_tensor_write(TENSOR("images"), &(float){0.5F}, sizeof(float), same));
    for (int step = 0; step < 20; ++step, first = first > 0 ? first : now)
        CHECK(splat_optimizer_zero_gradients(adam) || splat_model_forward(model, &in)
            || splat_rasterizer_forward(raster, NULL, &shown, &camera, 1, NULL)
            || splat_rasterizer_output(raster, NULL, SPLAT_OUTPUT_RGB, pair[0])
            || splat_op_forward(l2) || splat_op_backward(l2)
            || splat_rasterizer_backward(raster, NULL, &back) || splat_model_backward(model, &grad)
            || splat_optimizer_step(adam, NULL) || splat_tensor_read(loss, &now, 4, NULL));
    return printf("loss %g, then %g\n", first, now) > 0 && now < 0.9F * first ? 0 : 1;
}
