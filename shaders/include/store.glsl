// How fast kernels write arrays of vec4 and uvec2. lavapipe stores a vec4 as four masked scalars, a vector of
// 64-bit integers as half as many, so kernels for CPU devices (TEXEL_LOADS) pack two floats into one
// integer. GPUs store vec4.
//
//   QUADS_OUT(binding, name)     declares a writeonly array of vec4
//   ST4(name, i, v)              writes its i-th element
//   ST4_RUN(name, pairs, i, v)   the same for groups of eight lanes that write eight consecutive elements, the first
//                                at an even index; pairs is OCTETS_OUT of the same binding; i and v are read once
//   OCTETS_OUT(binding, name)    declares a writeonly array of pairs of vec4
//   ST8(name, i, a, b)           writes its i-th element
//   ST8_ALL(name, i, a, b)       the same for groups of eight lanes; i, a and b are read once
//   PAIRS_OUT(binding, name)     declares a writeonly array of uvec2
//   ST2(name, i, v)              writes its i-th element
//   UINT_QUADS_OUT(binding, name), STU4(name, i, v)   the same for uvec4
//
// With AVX-512 eight lanes of 64-bit integers are one register. Sums of a loop that are stored unchanged then stay in
// such registers, a sixth slower on a Skylake server: a product with an unknown 1 prevents that.
// Specialisation: kPackedStores, which Pipelines sets. lavapipe writes such a register to memory to take a lane out
// of it, and Intel's CPUs do not forward its upper half to that load: 15 cycles instead of 1 on the one Xeon measured.
// There ST4, ST8, ST2 and STU4 store floats; in ST8_ALL and ST4_RUN four lanes of each eight store for all.

#ifndef SPLAT_STORE_GLSL
#define SPLAT_STORE_GLSL

// QUADS_IN_PLACE(binding, out, name) declares an array of vec4 that LD4 of load.glsl reads and ST4_IN_PLACE writes; the
// same array is bound twice, to `out` too, where texel buffers read it.
#if TEXEL_LOADS
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#include "params/spec_ids.h"
layout(constant_id = kPackedStoresId) const uint kPackedStores = 1;
#define STORES(slot, name, packed, plain) \
    layout(set = 0, binding = slot, std430) writeonly buffer name##Block { packed name[]; }; \
    layout(set = 0, binding = slot, std430) writeonly buffer name##Plain { plain name##_plain[]; }
#define QUADS_OUT(slot, name) STORES(slot, name, u64vec2, vec4)
#define OCTETS_OUT(slot, name) STORES(slot, name, u64vec4, vec4)
#define PAIRS_OUT(slot, name) STORES(slot, name, uint64_t, uvec2)
#define UINT_QUADS_OUT(slot, name) STORES(slot, name, u64vec2, uvec4)
#define STORE(name, i, packed, plain) if (kPackedStores != 0) name[i] = packed; else name##_plain[i] = plain
#define QUADS_IN_PLACE(slot, out_slot, name) QUADS(slot, name); QUADS_OUT(out_slot, name##_out)
#define ST4(name, i, v) STORE(name, i, packed_quad(v), v)
#define ST4_IN_PLACE(name, i, v) ST4(name##_out, i, v)
#define ST2(name, i, v) STORE(name, i, packUint2x32(v), v)
#define STU4(name, i, v) STORE(name, i, packed_bits(v), v)
#define ST8(name, i, a, b) \
    if (kPackedStores != 0) name[i] = packed_octet(a, b); \
    else name##_plain[2 * (i)] = a, name##_plain[2 * (i) + 1] = b
#define ST4_RUN(name, pairs, i, v) { \
    const uint st_at = i; \
    const vec4 st_own = v; \
    if (kPackedStores != 0) { \
        name[st_at] = packed_quad(st_own); \
    } else { \
        const uint st_lane = gl_SubgroupInvocationID & 7u; \
        const uint st_even = gl_SubgroupInvocationID - st_lane + ((2 * st_lane) & 7u); \
        const uint st_pair = subgroupShuffle(st_at, st_even) / 2; \
        const vec4 st_first = subgroupShuffle(st_own, st_even), st_second = subgroupShuffle(st_own, st_even + 1); \
        if (st_lane < 4) pairs[st_pair] = packed_octet(st_first, st_second); \
    } \
}
#define ST8_ALL(name, i, a, b) { \
    const uint st_at = i; \
    const vec4 st_first = a, st_second = b; \
    if (kPackedStores != 0) { \
        name[st_at] = packed_octet(st_first, st_second); \
    } else { \
        const uint st_upper = gl_SubgroupInvocationID | 4u; \
        const uint st_far = subgroupShuffle(st_at, st_upper); \
        const vec4 st_far_first = subgroupShuffle(st_first, st_upper); \
        const vec4 st_far_second = subgroupShuffle(st_second, st_upper); \
        if ((gl_SubgroupInvocationID & 4u) == 0) \
            name[st_at] = packed_octet(st_first, st_second), name[st_far] = packed_octet(st_far_first, st_far_second); \
    } \
}
u64vec2 packed_bits(uvec4 bits) { return u64vec2(packUint2x32(bits.xy), packUint2x32(bits.zw)); }
u64vec2 packed_quad(vec4 v) { return packed_bits(floatBitsToUint(v)); }
u64vec4 packed_octet(vec4 a, vec4 b) { return u64vec4(packed_quad(a), packed_quad(b)); }
#else
#define QUADS_OUT(slot, name) layout(set = 0, binding = slot, std430) writeonly buffer name##Block { vec4 name[]; }
#define OCTETS_OUT(slot, name) layout(set = 0, binding = slot, std430) writeonly buffer name##Block { vec4 name[]; }
#define PAIRS_OUT(slot, name) layout(set = 0, binding = slot, std430) writeonly buffer name##Block { uvec2 name[]; }
#define UINT_QUADS_OUT(slot, name) \
    layout(set = 0, binding = slot, std430) writeonly buffer name##Block { uvec4 name[]; }
#define QUADS_IN_PLACE(slot, out_slot, name) \
    layout(set = 0, binding = slot, std430) buffer name##Block { vec4 name[]; }  // accumulates
#define ST4(name, i, v) name[i] = v
#define ST4_IN_PLACE(name, i, v) ST4(name, i, v)
#define STU4(name, i, v) name[i] = v
#define ST2(name, i, v) name[i] = v
#define ST8(name, i, a, b) name[2 * (i)] = a, name[2 * (i) + 1] = b
#define ST4_RUN(name, pairs, i, v) ST4(name, i, v)
#define ST8_ALL(name, i, a, b) ST8(name, i, a, b)
#endif

#endif
