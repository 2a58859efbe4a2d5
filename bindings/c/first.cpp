// The first program of README.md in C++: splat.hpp has owners of handles and errors as exceptions.
#include <cstdio>
#include <splat.hpp>
#include <vector>

int main() try {
    const float logs[] = {-1, -2, -2}, opaque = 4;
    auto desc = splat::sized<splat_scene_desc>();
    desc.count = 1;
    desc.log_scales = logs;
    desc.opacity_logits = &opaque;
    splat::Scene scene;
    splat::check(splat_scene_create(&desc, scene.out()));

    auto orbit = splat::sized<splat_orbit_desc>();
    orbit.width = orbit.height = 128;
    orbit.distance = 3;
    splat_camera camera;
    splat::check(splat_camera_orbit(scene.get(), &orbit, 1, &camera));

    std::vector<unsigned char> pixels(128 * 128 * 4);
    const splat_image image = {pixels.data(), pixels.size(), SPLAT_PIXEL_U8, 128, 128, 4, 0, 0, 0};
    splat::check(splat_scene_render(scene.get(), nullptr, &camera, 1, nullptr, &image));
    splat::check(splat_image_save("first.png", &image));
} catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
}
