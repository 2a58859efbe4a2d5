#ifndef SPLAT_IMAGES_PARAMS_H
#define SPLAT_IMAGES_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

// Specialisation constants.
SPLAT_SPEC_ID kResample2dBoxId = 10u;      // the filter is [1, 1]
SPLAT_SPEC_ID kResample2dUpId = 11u;       // to twice the size, else to half
SPLAT_SPEC_ID kPad2dReplicateId = 12u;     // what lies outside is the nearest pixel, else 0
SPLAT_SPEC_ID kResize2dCubicId = 13u;      // filter of two pixels to each side, else of one
SPLAT_SPEC_ID kResize2dAntialiasId = 14u;  // the filter grows with the pixels of y
SPLAT_SPEC_ID kPatches2dPairsId = 15u;     // from channels to pixels, patches of 2 x 2: one in an invocation

// In all of them groups_x is the number of workgroups per row of the dispatch, see src/vk/launch.h.

struct MaxPool2dParams {
    uint planes;  // quads of channels times images
    uint height;  // size of x
    uint width;
    uint groups_x;
};

struct Resample2dParams {
    uint planes;  // quads of channels times images
    uint height;  // size of this dispatch's input
    uint width;
    uint taps;   // taps of the filter, unless it is the box
    float gain;  // multiplies the filter outer(f, f) / sum(f)^2
    uint groups_x;
};

struct Patches2dParams {
    uint n;  // images
    uint c;  // their channels
    uint rows;  // patches along each axis
    uint columns;
    uint size;  // pixels of one along each axis
    uint groups_x;
};

struct Pad2dParams {
    uint planes;  // quads of channels times images
    uint height;  // size of x
    uint width;
    uint new_height;  // size of y
    uint new_width;
    int top;  // rows above x; negative where x is cut
    int left;
    uint groups_x;
};

// One axis of resize2d: [outer, from, inner] to [outer, to, inner], or back.
struct Resize2dParams {
    uint outer;
    uint inner;
    uint from;        // pixels of x
    uint to;          // pixels of y
    uint step_whole;  // pixels of x in half a pixel of y: whole + (high + low / 2^32) / 2^32
    uint step_high;
    uint step_low;
    float rate;     // pixels of y in one of x
    float stretch;  // how wide the filter is, in pixels of x: 1, or more with antialias
    uint groups_x;
};

#ifdef __cplusplus
static_assert(sizeof(Pad2dParams) <= 128 && sizeof(Resize2dParams) <= 128);
}
#endif

#endif
