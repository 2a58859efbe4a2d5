#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace splat::test {

/// Sizes one below, at and one above the sizes of vectors, quads and workgroups.
inline constexpr std::uint32_t kOddSizes[] = {1,  2,  3,  5,  7,  8,   9,   15,  16, 17,
                                              31, 33, 63, 64, 65, 127, 129, 255, 257};

struct NormShape {
    std::uint32_t N;
    std::uint32_t C;
    std::uint32_t H;
    std::uint32_t W;
    std::uint32_t G;

    [[nodiscard]] std::size_t elements() const { return std::size_t{N} * C * H * W; }
    [[nodiscard]] std::string text() const {
        return "N=" + std::to_string(N) + " C=" + std::to_string(C) + " H=" + std::to_string(H) +
               " W=" + std::to_string(W) + " G=" + std::to_string(G);
    }
};

/// Images 1x1, 1xN, Nx1 and odd ones; batch 1-3; groups 1, C and between; channels that fill no
/// quad; groups that cut a quad.
inline constexpr NormShape kNormShapes[] = {
    {1, 1, 1, 2, 1},     {1, 4, 1, 1, 1},     {2, 8, 1, 1, 2},     {1, 3, 1, 17, 1},
    {1, 5, 17, 1, 5},    {2, 6, 3, 5, 3},     {1, 6, 15, 17, 2},   {3, 7, 5, 7, 7},
    {1, 8, 16, 16, 2},   {2, 9, 9, 8, 3},     {1, 12, 17, 33, 4},  {1, 15, 7, 9, 5},
    {3, 16, 8, 8, 4},    {1, 16, 16, 16, 16}, {2, 17, 5, 3, 1},    {1, 20, 2, 31, 10},
    {1, 32, 15, 17, 8},  {2, 33, 3, 3, 11},   {1, 64, 16, 16, 16}, {1, 64, 1, 1, 8},
    {1, 65, 2, 2, 13},   {2, 128, 8, 8, 32},  {1, 129, 1, 3, 43},  {1, 4, 64, 64, 1},
    {1, 256, 4, 4, 32},  {1, 255, 1, 2, 5},   {1, 2, 63, 65, 1},   {1, 32, 33, 31, 8},
    {1, 4, 128, 128, 2},
};

/// Every second of the above and the large ones: the backward's list.
inline constexpr NormShape kNormBackwardShapes[] = {
    {1, 1, 1, 2, 1},    {2, 8, 1, 1, 2},     {1, 3, 1, 17, 1},    {1, 5, 17, 1, 5},
    {2, 6, 3, 5, 3},    {1, 6, 15, 17, 2},   {3, 7, 5, 7, 7},     {2, 9, 9, 8, 3},
    {1, 12, 17, 33, 4}, {3, 16, 8, 8, 4},    {1, 16, 16, 16, 16}, {2, 17, 5, 3, 1},
    {2, 33, 3, 3, 11},  {1, 64, 16, 16, 16}, {2, 128, 8, 8, 32},  {1, 129, 1, 3, 43},
    {1, 4, 64, 64, 1},  {1, 256, 4, 4, 32},
};

struct MatrixShape {
    std::uint32_t rows;
    std::uint32_t in;
    std::uint32_t out;

    [[nodiscard]] std::string text() const {
        return "rows=" + std::to_string(rows) + " in=" + std::to_string(in) +
               " out=" + std::to_string(out);
    }
};

inline constexpr MatrixShape kMatrixShapes[] = {
    {1, 1, 1},     {1, 2, 3},      {2, 1, 1},    {3, 5, 7},     {7, 8, 9},       {8, 8, 8},
    {15, 16, 17},  {16, 16, 16},   {17, 15, 31}, {31, 33, 5},   {33, 31, 63},    {1, 257, 129},
    {63, 64, 65},  {64, 64, 64},   {65, 63, 33}, {127, 2, 129}, {129, 127, 3},   {2, 255, 257},
    {255, 1, 2},   {257, 33, 9},   {5, 129, 64}, {9, 64, 255},  {128, 128, 128}, {3, 1024, 16},
    {1, 4608, 33}, {257, 129, 65}, {67, 50, 53},
};

inline constexpr MatrixShape kMatrixBackwardShapes[] = {
    {1, 1, 1},       {2, 1, 1},    {3, 5, 7},      {8, 8, 8},     {15, 16, 17}, {17, 15, 31},
    {1, 257, 129},   {63, 64, 65}, {64, 64, 64},   {127, 2, 129}, {255, 1, 2},  {257, 33, 9},
    {128, 128, 128}, {4096, 3, 5}, {257, 129, 65}, {67, 50, 53},
};

struct ConvShape {
    std::uint32_t N;
    std::uint32_t C;
    std::uint32_t H;
    std::uint32_t W;
    std::uint32_t K;
    std::uint32_t R;

    [[nodiscard]] std::size_t x() const { return std::size_t{N} * C * H * W; }
    [[nodiscard]] std::size_t y() const { return std::size_t{N} * K * H * W; }
    [[nodiscard]] std::size_t weights() const { return std::size_t{K} * C * R * R; }
    [[nodiscard]] std::string text() const {
        return "N=" + std::to_string(N) + " C=" + std::to_string(C) + " H=" + std::to_string(H) +
               " W=" + std::to_string(W) + " K=" + std::to_string(K) + " R=" + std::to_string(R);
    }
};

/// Images 1x1, 1xN, Nx1, smaller than, equal to and beyond tiles of 2, 4 and 8 pixels; channels that
/// fill no quad; batches whose tiles share a slice; more tiles than a slice takes.
inline constexpr ConvShape kConvShapes[] = {
    {1, 1, 1, 1, 1, 3},    {1, 3, 1, 1, 7, 3},     {2, 4, 1, 17, 4, 3},  {1, 5, 17, 1, 3, 3},
    {3, 7, 2, 3, 5, 3},    {1, 8, 3, 2, 8, 3},     {2, 3, 5, 5, 24, 3},  {1, 24, 5, 7, 1, 3},
    {1, 7, 7, 9, 9, 3},    {1, 16, 8, 8, 16, 3},   {2, 9, 9, 8, 15, 3},  {1, 3, 15, 17, 16, 3},
    {1, 17, 16, 16, 8, 3}, {1, 33, 4, 4, 31, 3},   {3, 8, 17, 5, 3, 3},  {1, 4, 17, 33, 5, 3},
    {1, 2, 31, 33, 2, 3},  {1, 64, 8, 8, 65, 3},   {1, 129, 3, 3, 2, 3}, {2, 255, 2, 2, 3, 3},
    {1, 3, 64, 64, 4, 3},  {1, 1, 128, 128, 2, 3}, {1, 2, 1, 257, 3, 3}, {2, 24, 12, 12, 24, 3},
    {1, 1024, 1, 2, 3, 3}, {1, 3, 65, 63, 1, 3},   {1, 1, 1, 1, 1, 1},   {2, 3, 5, 7, 24, 1},
    {1, 24, 15, 17, 1, 1}, {3, 7, 2, 2, 9, 1},     {1, 64, 8, 8, 33, 1}, {1, 4, 64, 64, 3, 1},
};

/// The backward's list.
inline constexpr ConvShape kConvBackwardShapes[] = {
    {1, 1, 1, 1, 1, 3},   {1, 3, 1, 1, 7, 3},     {2, 4, 1, 17, 4, 3},    {3, 7, 2, 3, 5, 3},
    {2, 3, 5, 5, 24, 3},  {1, 24, 5, 7, 1, 3},    {2, 9, 9, 8, 15, 3},    {1, 17, 16, 16, 8, 3},
    {3, 8, 17, 5, 3, 3},  {1, 4, 17, 33, 5, 3},   {1, 64, 8, 8, 65, 3},   {2, 255, 2, 2, 3, 3},
    {1, 3, 64, 64, 4, 3}, {1, 1, 128, 128, 2, 3}, {2, 33, 12, 12, 40, 3}, {1, 1, 1, 1, 1, 1},
    {2, 3, 5, 7, 24, 1},  {1, 64, 8, 8, 33, 1},
};

}  // namespace splat::test
