// Consumer of libsplat in C++11 or later.
#include <iostream>
#include <splat.hpp>
#include <utility>

int main() {
    splat::Weights weights;
    try {
        splat::check(splat_weights_load("/nonexistent/weights.npz", 0, weights.out()));
        return 1;
    } catch (const splat::Error& error) {
        if (error.code() != SPLAT_ERROR_NOT_FOUND || weights) return 1;
    }
    splat::Scene scene;
    const auto desc = splat::sized<splat_scene_desc>();
    splat::check(splat_scene_create(&desc, scene.out()));
    splat::Scene moved = std::move(scene);
    auto info = splat::sized<splat_scene_info>();
    splat::check(splat_scene_get_info(moved.get(), &info));
    if (scene || !moved || info.count != 0) return 1;
    std::cout << splat_version_string() << '\n';
    return splat_version() == SPLAT_VERSION ? 0 : 1;
}
