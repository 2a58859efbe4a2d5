#ifndef SPLAT_PROJECT_PARAMS_H
#define SPLAT_PROJECT_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#define SPLAT_FLAG inline constexpr uint
#else
#define SPLAT_FLAG const uint
#endif

// Specialisation constants.
SPLAT_SPEC_ID kProjectDegreeId = 10u;      // degree of the spherical harmonics
SPLAT_SPEC_ID kProjectExportId = 11u;      // backward: write exported
SPLAT_SPEC_ID kProjectPoseId = 12u;        // backward: write pose
SPLAT_SPEC_ID kProjectFlagsId = 13u;       // bits below
SPLAT_SPEC_ID kProjectIntrinsicsId = 14u;  // backward: write the intrinsics' gradient with pose

// Bits of kFlags, a specialisation constant, as lavapipe runs both sides of every branch.
SPLAT_FLAG kFlagGsplat = 1u;            // convention gsplat, else 3dgs
SPLAT_FLAG kFlagAntialias = 2u;         // opacity compensates for the dilation
SPLAT_FLAG kFlagDirectColors = 4u;      // colours are given, not spherical harmonics
SPLAT_FLAG kFlagOriginalGradient = 8u;  // 3dgs: the original's gradient with its quirks
SPLAT_FLAG kFlagOpacityExtent = 16u;    // skip: extents that depend on the opacity
SPLAT_FLAG kFlagExactTiles = 32u;       // skip: tiles that the ellipse does not touch
SPLAT_FLAG kFlagCull = 64u;             // skip: Gaussians that no pixel of the window can see
SPLAT_FLAG kFlagViewSizes = 128u;       // views have their own sizes
SPLAT_FLAG kFlagTileMask = 256u;        // tiles may be off
SPLAT_FLAG kFlagRanges = 512u;          // views see ranges of the Gaussians
SPLAT_FLAG kFlagSortByDistance = 1024u;  // blended by the distance to the camera, not by depth
SPLAT_FLAG kFlagCut3Sigma = 2048u;       // a Gaussian ends at 3 sigma
SPLAT_FLAG kFlagRayMaximum = 4096u;      // convention ray_maximum, with kFlagGsplat for what both have

// Words of a view's row of the table of ranges.
SPLAT_FLAG kRangeFirst = 0u;   // first Gaussian that it sees
SPLAT_FLAG kRangeCount = 1u;   // Gaussians that it sees
SPLAT_FLAG kRangeItems = 2u;   // items of the views before
SPLAT_FLAG kRangeGroups = 3u;  // workgroups of the views before
SPLAT_FLAG kRangeNext = 4u;    // next view with this range, or the number of views
SPLAT_FLAG kRangeLayer = 5u;   // layer of the range; 0xFFFFFFFF if a view before has the same
SPLAT_FLAG kRangeWords = 6u;

// An item is a Gaussian in a view: view * gaussians + Gaussian, or see raster/view_ranges.glsl.
struct ProjectParams {
    uint gaussians;
    uint first;  // this dispatch computes Gaussians first to first + count - 1
    uint count;  // with kFlagRanges: it computes the workgroups whose first Gaussian is one of them
    uint width;  // pixels
    uint height;
    uint row_begin;  // tile rows of this pass: [row_begin, row_end)
    uint row_end;
    uint sh_degree;
    uint sh_quads;  // vec4 per Gaussian in the colours
    float near_plane;
    float far_plane;
    uint accumulate;  // backward: 1 adds to the gradients
    uint views;
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
    // Backward: where first records begin behind the counts and sums of poses behind the exported gradients, and the
    // vec4 of a record.
    uint begins;
    uint pose;
    uint record_quads;
    uint rays;   // kFlagRayMaximum: first vec4 of the ray forms behind the splats
    uint layer;  // backward with kFlagRanges: of this dispatch; those after the first add to the set's gradients
};

#undef SPLAT_FLAG
#ifdef __cplusplus
static_assert(sizeof(ProjectParams) <= 128);
}
#endif

#endif
