/* A training that is stopped after three steps, as if its process had ended. `vkrun train --resume`
 * goes on with the same bits. Arguments: data set, folder of the run. */
#include <splat.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void check(splat_result result) {
    if (result >= 0) return;
    fprintf(stderr, "%s\n", splat_last_error_message());
    exit(1);
}

static double number_of(const splat_run_event* event, const char* name) {
    for (uint64_t i = 0; i < event->number_count; ++i)
        if (strcmp(event->numbers[i].name, name) == 0) return event->numbers[i].value;
    return 0;
}

int main(int argc, char** argv) {
    const char* config =
        "model: {base_dim: 8, num_blocks: 1, channel_mult: [1, 2], attention_resolutions: [8]}\n"
        "data: {training_resolution: 16}\n"
        "opt: {batch_size: 1, imgs_per_obj: 2, iterations: 6}\n"
        "logging: {ckpt_iterations: 2, val_log: 0}\n";
    char root[4096];
    const char* values[] = {root};
    splat_training_desc desc = {sizeof desc, .config = config, .values = values, .value_count = 1};
    splat_run_event event = {sizeof event, .kind = SPLAT_EVENT_MESSAGE};
    splat_device device;
    splat_run training;
    if (argc != 3) return 2;
    snprintf(root, sizeof root, "data.root='%s'", argv[1]);
    desc.folder = argv[2];
    check(splat_device_create(NULL, &device));
    check(splat_training_open(device, &desc, &training));
    while (event.step < 3) {
        check(splat_run_next(training, &event));
        if (event.kind == SPLAT_EVENT_STEP)
            printf("step %d: %.2f dB\n", (int)event.step, number_of(&event, "psnr"));
    }
    check(splat_run_destroy(training)); /* without a state of step 3 */
    return 0;
}
