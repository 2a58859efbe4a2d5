#pragma once

#include <gtest/gtest.h>

#include "io/tensor_file.h"
#include "io/weights_file.h"
#include "support/expect_status.h"
#include "support/rng_fill.h"

namespace splat::test {

/// Random weights of VGG16's shapes, under torchvision's names. Made once: they are 15 million.
inline const io::NamedTensors& vgg_weights() {
    static const io::NamedTensors weights = [] {
        io::NamedTensors made;
        std::int64_t in = 3;
        std::uint64_t seed = 1;
        const std::pair<int, std::int64_t> layers[] = {
            {0, 64},   {2, 64},   {5, 128},  {7, 128},  {10, 256}, {12, 256}, {14, 256},
            {17, 512}, {19, 512}, {21, 512}, {24, 512}, {26, 512}, {28, 512}};
        for (const auto& [layer, out] : layers) {
            const std::string name = "features." + std::to_string(layer);
            const double deviation = std::sqrt(2.0 / (9.0 * static_cast<double>(in)));
            EXPECT_OK(made.add(
                {name + ".weight",
                 {out, in, 3, 3},
                 io::NumberType::kF32,
                 normal_fill(static_cast<std::size_t>(out * in * 9), ++seed, 0, deviation)}));
            EXPECT_OK(made.add({name + ".bias",
                                {out},
                                io::NumberType::kF32,
                                normal_fill(static_cast<std::size_t>(out), ++seed, 0, 0.1)}));
            in = out;
        }
        return made;
    }();
    return weights;
}

/// Weights of the distance, all 0.5, under the names of the lpips package.
inline io::NamedTensors linear_weights() {
    io::NamedTensors made;
    const std::int64_t channels[] = {64, 128, 256, 512, 512};
    for (int k = 0; k < 5; ++k)
        EXPECT_OK(made.add({"lin" + std::to_string(k) + ".model.1.weight",
                            {1, channels[k], 1, 1},
                            io::NumberType::kF32,
                            std::vector<float>(static_cast<std::size_t>(channels[k]), 0.5F)}));
    return made;
}

/// Both as files of a folder, as opt.lpips_weights names them.
inline std::vector<std::string> save_lpips_weights(const std::string& folder) {
    const std::vector<std::string> paths = {folder + "/vgg16.safetensors",
                                            folder + "/lpips.safetensors"};
    io::WeightsFile file;
    for (const std::string& path : paths) {
        file.tensors = path == paths[0] ? vgg_weights() : linear_weights();
        EXPECT_OK(io::save_weights(file, path));
    }
    return paths;
}

}  // namespace splat::test
