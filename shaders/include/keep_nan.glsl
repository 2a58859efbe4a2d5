// For modules that test numbers for NaN or infinity: drivers may otherwise assume that neither occurs (MoltenVK does).
// Devices without the mode get the module without it (src/vk/spirv.h).

#ifndef SPLAT_KEEP_NAN_GLSL
#define SPLAT_KEEP_NAN_GLSL

#extension GL_EXT_spirv_intrinsics : require
spirv_execution_mode(capabilities = [4466], 4461, 32);  // SignedZeroInfNanPreserve of float32

#endif
