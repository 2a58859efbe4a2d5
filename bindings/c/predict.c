/* Turn a picture of an object into a scene, with the weights that come with the library.
 * Arguments: a picture (PNG, JPEG, WebP), the file for the scene. */
#include <splat.h>
#include <stdio.h>
#include <stdlib.h>

static void check(splat_result result) {
    if (result == SPLAT_OK) return;
    fprintf(stderr, "predict: %s\n", splat_last_error_message());
    exit(1);
}

int main(int argc, char** argv) {
    splat_device device;
    splat_predictor predictor;
    splat_scene scene;
    splat_picture_info seen = {.width = 0};
    splat_prediction facts = {sizeof facts, .pictures = &seen, .picture_capacity = 1};
    if (argc != 3) {
        fprintf(stderr, "usage: predict PICTURE SCENE.ply\n");
        return 2;
    }
    splat_picture picture = {.image.path = argv[1]};
    check(splat_device_create(NULL, &device));
    check(splat_predictor_create(device, NULL, &predictor)); /* NULL: the built-in weights */
    check(splat_predictor_predict(predictor, &picture, 1, &scene, &facts));
    check(splat_scene_save(scene, argv[2], NULL));
    printf("%llu Gaussians from a square of %.0f pixels, %.0f ms\n",
           (unsigned long long)facts.gaussians, seen.square[2], facts.network_ms);
    if (seen.warnings & SPLAT_PICTURE_NO_OBJECT) printf("no object was found in the picture\n");

    check(splat_scene_destroy(scene));
    check(splat_predictor_destroy(predictor));
    check(splat_device_destroy(device));
    return 0;
}
