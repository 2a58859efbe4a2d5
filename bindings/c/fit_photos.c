/* Fit a scene to a folder of photographs with their cameras: a COLMAP project, or transforms.json and images.
 * Arguments: the folder of photographs, a new folder for the run and its scene.ply, seconds (60). */
#include <splat.h>
#include <stdio.h>
#include <stdlib.h>

static void check(splat_result result) {
    if (result == SPLAT_OK) return;
    fprintf(stderr, "fit_photos: %s\n", splat_last_error_message());
    exit(1);
}

int main(int argc, char** argv) {
    if (argc < 3) return fprintf(stderr, "usage: fit_photos PHOTOS RUN [SECONDS]\n"), 2;
    splat_fit_desc desc = {sizeof desc, .folder = argv[2], .data = argv[1]};
    desc.seconds = argc > 3 ? atof(argv[3]) : 60; /* or .steps, which give the same bits again */
    splat_run_event event = {.struct_size = sizeof event};
    splat_device device;
    splat_run run;
    splat_scene scene;
    double psnr = 0;
    check(splat_device_create(NULL, &device));
    check(splat_fit_open(device, &desc, &run));
    while (event.kind < SPLAT_EVENT_DONE) {
        check(splat_run_next(run, &event));
        if (event.text) puts(event.text);
        if (event.kind == SPLAT_EVENT_VALIDATION) psnr = event.numbers[0].value; /* val_psnr */
    }
    char path[4096];
    snprintf(path, sizeof path, "%s/scene.ply", argv[2]);
    check(splat_fit_scene(run, &scene));
    check(splat_scene_save(scene, path, NULL));
    printf("held-out PSNR %.2f dB\n", psnr);
    return 0;
}
