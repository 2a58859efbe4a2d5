// triangle_hashes: prints one line per mesh and set of kernels with a hash of all pictures. The test compares its
// output for different numbers of driver threads.
#include <bit>
#include <cstdio>

#include "support/gpu_env.h"
#include "triangles/mesh_cases.h"

namespace splat::test {
namespace {

std::uint64_t hash_of(const std::vector<float>& values, std::uint64_t hash) {
    for (const float value : values)  // FNV-1a over words
        hash = (hash ^ std::bit_cast<std::uint32_t>(value)) * 0x100000001B3ULL;
    return hash;
}

void print_hash(const char* name, const scene::TriangleMesh& mesh) {
    const std::vector<scene::Camera> cameras = {camera_at({2, 1.5, 1}, 60, 60, 50),
                                                camera_at({0.2, 0.1, 0.3}, 60, 60, 25)};
    for (const vk::Kernels kernels : kernels_to_test()) {
        const triangles::Images images = drawn(*shared_context(kernels), mesh, cameras, {}, kAll);
        std::uint64_t hash = 0xCBF29CE484222325ULL;
        for (const auto* values :
             {&images.color, &images.alpha, &images.depth, &images.normal, &images.albedo})
            hash = hash_of(*values, hash);
        std::printf("%s %s %016llx\n", name, vk::kernels_name(kernels), llu(hash));
    }
}

}  // namespace
}  // namespace splat::test

int main() {
    using namespace splat::test;
    print_hash("soup", triangle_soup(2000, 0.3, 21));
    print_hash("sphere", sphere_mesh(40));
    splat::scene::TriangleMesh thin = triangle_soup(500, 0.5, 22);
    thin.materials = {
        {.color = {0.8F, 0.4F, 0.2F, 0.6F}, .alpha = splat::scene::AlphaMode::kBlend}};
    print_hash("thin", thin);
    close_shared_contexts();
    return 0;
}
