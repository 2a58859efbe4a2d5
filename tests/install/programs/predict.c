/* A picture in memory to a file of Gaussians, with the weights that come with the library. */
#include <splat.h>
#include <stdio.h>
#include <stdlib.h>

static void check(splat_result result) {
    if (result >= 0) return;
    fprintf(stderr, "%s\n", splat_last_error_message());
    exit(1);
}

int main(int argc, char** argv) {
    enum { SIDE = 96 };
    static unsigned char pixels[SIDE][SIDE][3];
    for (int y = 0; y < SIDE; ++y)
        for (int x = 0; x < SIDE; ++x) /* a red box on white */
            for (int c = 0; c < 3; ++c)
                pixels[y][x][c] = x > 20 && x < 76 && y > 40 && y < 64 && c > 0 ? 30 : 255;
    splat_picture picture = {.image.pixels = {.pixels = pixels,
                                              .bytes = sizeof pixels,
                                              .type = SPLAT_PIXEL_U8,
                                              .width = SIDE,
                                              .height = SIDE,
                                              .channels = 3}};
    splat_prediction facts = {.struct_size = sizeof facts};
    splat_device device;
    splat_predictor predictor;
    splat_scene scene;
    check(splat_device_create(NULL, &device));
    check(splat_predictor_create(device, NULL, &predictor));
    check(splat_predictor_predict(predictor, &picture, 1, &scene, &facts));
    check(splat_scene_save(scene, argc > 1 ? argv[1] : "scene.ply", NULL));
    printf("%d Gaussians\n", (int)facts.gaussians);
    return facts.gaussians == 0;
}
