#pragma once

#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// The image [n,c,rows*size,columns*size] and its patches [n,c*size*size,rows,columns]: the same numbers, pixel by
/// pixel in another order, so that each direction is the gradient of the other.
namespace splat::ref {

struct PatchShape {
    std::size_t planes;  ///< N * C of the image
    std::size_t rows;    ///< patches
    std::size_t columns;
    std::size_t size;

    [[nodiscard]] std::size_t elements() const { return planes * rows * columns * size * size; }
};

/// `from` is the image, or, if `up`, its patches.
template <class Real>
Summed<Real> patches2d(const PatchShape& s, const std::vector<Real>& from, bool up) {
    Summed<Real> to(s.elements(), 1);
    std::size_t image = 0;
    for (std::size_t plane = 0; plane < s.planes; ++plane)
        for (std::size_t row = 0; row < s.rows * s.size; ++row)
            for (std::size_t column = 0; column < s.columns * s.size; ++column, ++image) {
                const std::size_t channel =
                    (plane * s.size + row % s.size) * s.size + column % s.size;
                const std::size_t patch =
                    (channel * s.rows + row / s.size) * s.columns + column / s.size;
                to.add(up ? image : patch, from[up ? patch : image]);
            }
    return to;
}

inline Summed<double> patches2d(const OpArguments& in, const Values& from, bool up) {
    const OpTensor& x = in.inputs[0];
    const std::size_t size = in.count("size");
    if (in.flag("up"))
        return patches2d({x.dim(0) * x.dim(1) / (size * size), x.dim(2), x.dim(3), size}, from, up);
    return patches2d({x.dim(0) * x.dim(1), x.dim(2) / size, x.dim(3) / size, size}, from, up);
}

/// Patches of `rows` x `columns` of an image of c channels.
inline OpExample patches2d_example(std::size_t n, std::size_t c, std::size_t rows,
                                   std::size_t columns, std::size_t size, bool up) {
    const Dims image{n, c, rows * size, columns * size};
    const Dims patches{n, c * size * size, rows, columns};
    return {.inputs = {{up ? patches : image}},
            .outputs = {up ? image : patches},
            .attributes = "{\"size\": " + std::to_string(size) + (up ? ", \"up\": true}" : "}")};
}

inline constexpr OpRef kPatches2dRef{
    .name = "patches2d",
    .forward = [](const OpArguments& in) -> Sums {
        return {patches2d(in, in.values(0), in.flag("up"))};
    },
    .backward = [](const OpArguments& in, const Grads& grads) -> Sums {
        return {patches2d(in, grads[0], !in.flag("up"))};
    },
    .examples =
        [] {
            return std::vector{patches2d_example(2, 3, 2, 3, 3, false),
                               patches2d_example(2, 3, 2, 3, 3, true)};
        },
    .sizes =
        [] {  // what MoGe-2 has: the pixels of 1,200 tokens, and twice the size in its decoder
            return std::vector{patches2d_example(1, 3, 30, 40, 14, false),
                               patches2d_example(1, 192, 60, 80, 2, true)};
        }};

}  // namespace splat::ref
