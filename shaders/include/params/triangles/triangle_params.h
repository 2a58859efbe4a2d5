#ifndef SPLAT_TRIANGLE_PARAMS_H
#define SPLAT_TRIANGLE_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#define SPLAT_TRIANGLE inline constexpr uint
#else
#define SPLAT_TRIANGLE const uint
#endif

// Specialisation constant: some materials are not opaque.
SPLAT_SPEC_ID kTriangleTransparentId = 10u;

SPLAT_TRIANGLE kTrianglesAtOnce = 1u << 22;  // so that levels 0 to 3 of the sums are enough
SPLAT_TRIANGLE kSumsBits = 6u;               // a sum of one level has 64 of the level below
SPLAT_TRIANGLE kTriangleTile = 8u;           // pixels, a side
SPLAT_TRIANGLE kSubpixels = 16u;             // a pixel's side in the units of samples and boxes
SPLAT_TRIANGLE kNoTriangle = 0xFFFFFFFFu;    // a sample sees nothing

// Quads of the table of a view.
SPLAT_TRIANGLE kViewX = 0u;       // rows that map a vertex to homogeneous pixels; see triangles/setup.glsl
SPLAT_TRIANGLE kViewY = 1u;
SPLAT_TRIANGLE kViewZ = 2u;
SPLAT_TRIANGLE kViewScale = 3u;   // near plane; of subpixels to z: 16 H; area of a sample by z^2; 0
SPLAT_TRIANGLE kViewRight = 4u;   // rows of the camera's rotation; in the fourth 1/fx, 1/fy, and 0
SPLAT_TRIANGLE kViewDown = 5u;
SPLAT_TRIANGLE kViewFront = 6u;
SPLAT_TRIANGLE kViewUp = 7u;      // where the sky is; cx
SPLAT_TRIANGLE kViewLight = 8u;   // where the light comes from; cy
SPLAT_TRIANGLE kViewQuads = 9u;

// Words of a material, from the table of linear values of bytes on.
SPLAT_TRIANGLE kByteValues = 256u;
SPLAT_TRIANGLE kMaterialTexture = 4u;  // after color; kNoTriangle: none
SPLAT_TRIANGLE kMaterialBits = 5u;
SPLAT_TRIANGLE kMaterialCutoff = 6u;
SPLAT_TRIANGLE kMaterialPlace = 8u;    // six numbers that place the texture
SPLAT_TRIANGLE kMaterialWords = 16u;
SPLAT_TRIANGLE kTextureWords = 4u;     // where its texels are, width, height, levels

// Bits of a material; the first four are the wrapping of u and of v, as numbered in scene/triangle_mesh.h.
SPLAT_TRIANGLE kWrapVBit = 2u;
SPLAT_TRIANGLE kNearestBit = 4u;
SPLAT_TRIANGLE kAlphaBit = 5u;  // two bits, as numbered there
SPLAT_TRIANGLE kDoubleSidedBit = 7u;

struct TriangleParams {
    uint first;     // triangle of the mesh that is the range's first
    uint count;     // triangles of the range, or elements of a level of sums
    uint groups_x;
    uint pairs_begin;  // pairs of a triangle and a tile that this dispatch draws
    uint pairs_end;
    uint numbers;   // 1: the numbers of the nearest triangles, 0: their depths
    uint width;     // pixels
    uint height;
    uint row_begin;  // first row of the band
    uint row_end;
    uint samples;   // a pixel's side has so many, a power of two; 0: only centres
    uint centers;   // 1: centres of pixels, too
    uint level1;    // where sums of 64, 64^2 and 64^3 counts are
    uint level2;
    uint level3;
    uint mesh_bits;  // see below
    uint texcoords_at;  // words of the attributes before them
    uint colors_at;
    uint textures_at;
    uint color_at;   // quads of the output before each picture; kNoTriangle: not wanted
    uint maps_at;
    uint albedo_at;
    uint lit;        // 0: color is albedo
};

// What a mesh has.
SPLAT_TRIANGLE kMeshNormals = 1u;
SPLAT_TRIANGLE kMeshTexcoords = 2u;
SPLAT_TRIANGLE kMeshColors = 4u;
SPLAT_TRIANGLE kMeshNormalIndices = 8u;     // separate ones, 3 words a triangle; else the vertices, 4 words
SPLAT_TRIANGLE kMeshTexcoordIndices = 16u;

struct TriangleSumsParams {
    uint begin;  // words of the sums before this level
    uint count;  // elements of the level
    uint next;   // words before the next
    uint groups_x;
};

#undef SPLAT_TRIANGLE
#ifdef __cplusplus
static_assert(sizeof(TriangleParams) <= 128);
}
#endif

#endif
