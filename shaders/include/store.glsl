// How fast kernels write arrays of vec4 and uvec2. lavapipe stores a vec4 as four masked scalars, a vector of
// 64-bit integers as half as many, so kernels for CPU devices (TEXEL_LOADS) pack two floats into one
// integer. GPUs store vec4.
//
//   QUADS_OUT(binding, name)     declares a writeonly array of vec4
//   ST4(name, i, v)              writes its i-th element
//   OCTETS_OUT(binding, name)    declares a writeonly array of pairs of vec4
//   ST8(name, i, a, b)           writes its i-th element
//   PAIRS_OUT(binding, name)     declares a writeonly array of uvec2
//   ST2(name, i, v)              writes its i-th element
//   UINT_QUADS_OUT(binding, name), STU4(name, i, v)   the same for uvec4
//
// Eight lanes of 64-bit integers are a register of 512 bits where there is AVX-512. Sums of a loop that are
// stored as they are then live in such registers all through the loop, a sixth slower on a Skylake server. A product
// with a factor of 1 that the compiler does not know ends it.

#ifndef SPLAT_STORE_GLSL
#define SPLAT_STORE_GLSL

#if TEXEL_LOADS
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#define QUADS_OUT(slot, name) layout(set = 0, binding = slot, std430) writeonly buffer name##Block { u64vec2 name[]; }
#define OCTETS_OUT(slot, name) layout(set = 0, binding = slot, std430) writeonly buffer name##Block { u64vec4 name[]; }
#define PAIRS_OUT(slot, name) layout(set = 0, binding = slot, std430) writeonly buffer name##Block { uint64_t name[]; }
#define UINT_QUADS_OUT(slot, name) QUADS_OUT(slot, name)
#define ST4(name, i, v) name[i] = packed_quad(v)
#define ST2(name, i, v) name[i] = packUint2x32(v)
#define STU4(name, i, v) name[i] = packed_bits(v)
#define ST8(name, i, a, b) name[i] = u64vec4(packed_quad(a), packed_quad(b))
u64vec2 packed_bits(uvec4 bits) { return u64vec2(packUint2x32(bits.xy), packUint2x32(bits.zw)); }
u64vec2 packed_quad(vec4 v) { return packed_bits(floatBitsToUint(v)); }
#else
#define QUADS_OUT(slot, name) layout(set = 0, binding = slot, std430) writeonly buffer name##Block { vec4 name[]; }
#define OCTETS_OUT(slot, name) layout(set = 0, binding = slot, std430) writeonly buffer name##Block { vec4 name[]; }
#define PAIRS_OUT(slot, name) layout(set = 0, binding = slot, std430) writeonly buffer name##Block { uvec2 name[]; }
#define UINT_QUADS_OUT(slot, name) \
    layout(set = 0, binding = slot, std430) writeonly buffer name##Block { uvec4 name[]; }
#define ST4(name, i, v) name[i] = v
#define STU4(name, i, v) name[i] = v
#define ST2(name, i, v) name[i] = v
#define ST8(name, i, a, b) name[2 * (i)] = a, name[2 * (i) + 1] = b
#endif

#endif
