// triangle_bench [triangles [side [views]]]: seconds a view and memory of a sphere of so many triangles.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "support/expect_status.h"
#include "triangles/mesh_cases.h"

namespace splat::test {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

int run(double triangles, std::uint32_t side, int views) {
    const auto context = need(vk::Context::create({}));
    scene::TriangleMesh mesh = sphere_mesh(static_cast<std::uint32_t>(std::sqrt(triangles / 4)));
    auto start = std::chrono::steady_clock::now();
    const triangles::MeshOnDevice on_device = need(triangles::upload(*context, mesh));
    std::printf("%zu triangles, upload %.2f s\n", mesh.triangles.size(), seconds_since(start));
    for (int view = 0; view < views; ++view) {
        const scene::Camera camera =
            camera_at({2.0 * std::cos(view), 2.0 * std::sin(view), 1}, side, side, side);
        start = std::chrono::steady_clock::now();
        const triangles::Images images =
            need(triangles::render(*context, on_device, {&camera, 1}, {}, kAll));
        std::printf("view %d: %.3f s\n", view, seconds_since(start));
    }
    const vk::MemoryUse use = context->memory().use();
    std::printf("device memory %.0f MB at most\n", static_cast<double>(use.peak) / 1e6);
    return 0;
}

}  // namespace
}  // namespace splat::test

int main(int argc, char** argv) {
    const auto number = [&](int i, double otherwise) {
        return argc > i ? std::atof(argv[i]) : otherwise;
    };
    return splat::test::run(number(1, 1e6), static_cast<std::uint32_t>(number(2, 128)),
                            static_cast<int>(number(3, 4)));
}
