#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "io/bytes.h"

namespace splat::test {

/// A folder of its own for each test, removed at the end.
class FolderTest : public testing::Test {
  protected:
    void SetUp() override;
    void TearDown() override { std::filesystem::remove_all(folder_); }
    [[nodiscard]] std::string path(const std::string& name) const {
        return (folder_ / name).string();
    }

    std::filesystem::path folder_;
};

/// A zlib stream, as PNG has it.
io::Buffer zlib_stream(io::Bytes bytes);

/// Length, type, data, CRC of type and data.
void put_png_chunk(io::Buffer& png, std::string_view type, io::Bytes data);

/// Layout of a compressed .ply file. The counts are texts, so that they can be wrong.
struct CompressedPlyLayout {
    bool colors = true;    ///< chunks have ranges of colour
    std::size_t rest = 0;  ///< properties of element "sh"
    std::string chunks = "1";
    std::string vertices = "2";
    std::string rest_rows = "2";
    bool extra = false;  ///< chunk and vertex have a property "extra" more
};

std::string compressed_ply_header(const CompressedPlyLayout& layout);

/// Two Gaussians: at the low end and at the high end of every range.
io::Buffer sample_compressed_ply(const CompressedPlyLayout& layout);

/// A .ksplat file of this level, a section for each degree. A section has five Gaussians: two in a full
/// bucket, one and two in partly filled ones, and room for a sixth. Gaussian i of section s in bucket b:
/// mean (10 s + b + i / 8, -i / 8, b), scales 0.5, 1, 2, rotation 0.5, -0.5, 0.5, -0.5, colour 255, 0, 128,
/// opacity 51 + i. Harmonic j is (j - 4) / 8, at level 2 the byte 10 j of the range -1 to 2.
io::Buffer sample_ksplat(std::uint16_t level, const std::vector<std::uint16_t>& degrees);

/// A COLMAP model of four lenses, three of which have images.
inline const char* const kColmapCameras =
    "# comment\n1 PINHOLE 64 48 50 51 32 24\n2 SIMPLE_PINHOLE 10 20 9 5 10\n"
    "3 OPENCV 64 48 50 51 32 24 0 0 0 0\n4 SIMPLE_RADIAL 8 8 7 4 4 0.5\n";
inline const char* const kColmapImages =
    "# comment\n1 1 0 0 0 1 2 3 1 a b.png\n10 20 -1 5 6 7\n"
    "2 0.5 0.5 0.5 0.5 0 0 0 2 c.png\n\n3 1 0 0 0 0 0 0 3 d.png";

/// The first two of them as binary files.
io::Buffer sample_colmap_cameras();
io::Buffer sample_colmap_images();

}  // namespace splat::test
