/* Draw a scene from places around it: one PNG with alpha for each.
 * Arguments: a file of Gaussians (.ply, .spz, .sog, .glb...), what the pictures' names begin with. */
#include <splat.h>
#include <stdio.h>
#include <stdlib.h>

enum { VIEWS = 8, WIDTH = 320, HEIGHT = 240 };

static void check(splat_result result) {
    if (result == SPLAT_OK) return;
    fprintf(stderr, "render: %s\n", splat_last_error_message());
    exit(1);
}

int main(int argc, char** argv) {
    static unsigned char pixels[VIEWS][HEIGHT * WIDTH * 4];
    splat_image images[VIEWS];
    splat_camera cameras[VIEWS];
    splat_device device;
    splat_scene scene;
    splat_rasterizer rasterizer;
    splat_scene_info info = {.struct_size = sizeof info};
    if (argc != 3) {
        fprintf(stderr, "usage: render SCENE PREFIX\n");
        return 2;
    }
    check(splat_device_create(NULL, &device)); /* the best one; VK_DRIVER_FILES may choose */
    check(splat_scene_load(argv[1], NULL, &scene));
    check(splat_scene_get_info(scene, &info));

    splat_orbit_desc orbit = {sizeof orbit, .width = WIDTH, .height = HEIGHT, .elevation = 0.3};
    check(splat_camera_orbit(scene, &orbit, VIEWS, cameras));
    splat_rasterizer_desc desc = {sizeof desc,      .gaussians = (uint32_t)info.count,
                                  .views = VIEWS,   .width = WIDTH,
                                  .height = HEIGHT, .sh_degree = info.sh_degree};
    check(splat_rasterizer_create(device, &desc, &rasterizer));
    check(splat_rasterizer_forward_scene(rasterizer, NULL, scene, cameras, VIEWS, NULL));
    for (int i = 0; i < VIEWS; ++i)
        images[i] = (splat_image){.pixels = pixels[i],
                                  .bytes = sizeof pixels[i],
                                  .type = SPLAT_PIXEL_U8,
                                  .width = WIDTH,
                                  .height = HEIGHT,
                                  .channels = 4};
    check(splat_rasterizer_read_images(rasterizer, NULL, SPLAT_OUTPUT_RGB, 0, images, VIEWS));
    for (int i = 0; i < VIEWS; ++i) {
        char path[4096];
        snprintf(path, sizeof path, "%s%d.png", argv[2], i);
        check(splat_image_save(path, &images[i]));
    }
    printf("%d views of %llu Gaussians\n", VIEWS, (unsigned long long)info.count);

    check(splat_rasterizer_destroy(rasterizer)); /* any order is legal */
    check(splat_scene_destroy(scene));
    check(splat_device_destroy(device));
    return 0;
}
