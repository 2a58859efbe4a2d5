// How fast kernels read arrays of vec4. A storage-buffer load costs lavapipe 8 guarded scalar
// loads, a texel-buffer load a few vector instructions; GPUs prefer storage buffers. One source,
// two modules: see cmake/SplatShaders.cmake.
//
//   QUADS(binding, name)    declares a readonly array of vec4
//   LD4(name, i)            reads its i-th element
//   UINTS(binding, name)    declares a readonly array of uint
//   LD1(name, i)            reads its i-th element
//   UINT_QUADS(binding, name), LDU4(name, i)   the same for uvec4

#ifndef SPLAT_LOAD_GLSL
#define SPLAT_LOAD_GLSL

#if TEXEL_LOADS
#define QUADS(slot, name) layout(set = 0, binding = slot) uniform samplerBuffer name
#define LD4(name, i) texelFetch(name, int(i))
#define UINTS(slot, name) layout(set = 0, binding = slot) uniform usamplerBuffer name
#define LD1(name, i) texelFetch(name, int(i)).x
#define UINT_QUADS(slot, name) layout(set = 0, binding = slot) uniform isamplerBuffer name
#define LDU4(name, i) uvec4(texelFetch(name, int(i)))
#else
#define QUADS(slot, name) layout(set = 0, binding = slot, std430) readonly buffer name##Buffer { vec4 name[]; }
#define LD4(name, i) name[i]
#define UINTS(slot, name) layout(set = 0, binding = slot, std430) readonly buffer name##Buffer { uint name[]; }
#define LD1(name, i) name[i]
#define UINT_QUADS(slot, name) layout(set = 0, binding = slot, std430) readonly buffer name##Buffer { uvec4 name[]; }
#define LDU4(name, i) name[i]
#endif

#endif
