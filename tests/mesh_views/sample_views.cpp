#include "mesh_views/sample_views.h"

namespace splat::test {
namespace {

mesh_views::Drawn drawn_square(std::uint32_t size) {
    mesh_views::Drawn drawn;
    const std::uint32_t low = size / 4, high = size - size / 4 - 1;
    for (std::uint32_t y = 0; y < size; ++y)
        for (std::uint32_t x = 0; x < size; ++x) {
            const bool inside = x >= low && x <= high && y >= low && y <= high;
            const bool border = inside && (x == low || x == high || y == low || y == high);
            const float alpha = !inside ? 0.0F : border ? 0.5F : 1.0F;
            drawn.alpha.push_back(alpha);
            drawn.depth.push_back(inside ? 1.0F : 0.0F);
            for (const float value : {alpha, 0.0F, 0.0F}) drawn.color.push_back(value);
            for (const float value : {0.0F, alpha, 0.0F}) drawn.albedo.push_back(value);
            for (const float value : {0.0F, 0.0F, -1.0F})
                drawn.normal.push_back(inside ? value : 0.0F);
        }
    return drawn;
}

}  // namespace

mesh_views::ViewsDesc sample_views(const std::filesystem::path& path) {
    mesh_views::ViewsDesc desc;
    desc.path = path.string();
    desc.name = "block";
    desc.size = 16;
    desc.train_views = 3;
    desc.test_views = 4;
    desc.points = 20;
    return desc;
}

scene::TriangleMesh sample_square() {
    scene::TriangleMesh mesh;
    mesh.vertices = {{-0.25, 0, -0.25}, {0.25, 0, -0.25}, {0.25, 0, 0.25}, {-0.25, 0, 0.25}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
}

mesh_views::Draw sample_draw(std::uint32_t size) {
    return
        [size](std::span<const scene::Camera> cameras) -> Result<std::vector<mesh_views::Drawn>> {
            return std::vector<mesh_views::Drawn>(cameras.size(), drawn_square(size));
        };
}

}  // namespace splat::test
