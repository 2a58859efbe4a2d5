// Small arrays that every invocation reads, through texel buffers on all devices: some bind only 8 storage buffers to a
// shader (Raspberry Pi), and every device reads 65,536 elements of a texel buffer.
//
//   TABLE(binding, name)        declares a readonly array of vec4
//   TABLE4(name, i)             reads its i-th element
//   UINT_TABLE(binding, name)   declares a readonly array of uint
//   TABLE1(name, i)             reads its i-th element

#ifndef SPLAT_TABLE_GLSL
#define SPLAT_TABLE_GLSL

#define TABLE(slot, name) layout(set = 0, binding = slot) uniform samplerBuffer name
#define TABLE4(name, i) texelFetch(name, int(i))
#define UINT_TABLE(slot, name) layout(set = 0, binding = slot) uniform usamplerBuffer name
#define TABLE1(name, i) texelFetch(name, int(i)).x

#endif
