// Ids of the specialisation constants that all kernels share. Those from 10 up belong to a family of
// kernels and stand in its *_params.h: k<Family><Name>Id is the id of k<Name> in all kernels of the family.

#ifndef SPLAT_SPEC_IDS_H
#define SPLAT_SPEC_IDS_H

#ifdef __cplusplus
#include <cstdint>
#define SPLAT_SPEC_ID inline constexpr std::uint32_t
namespace splat::params {
#else
#define SPLAT_SPEC_ID const uint
#endif

SPLAT_SPEC_ID kWorkgroupSizeId = 0u;  // invocations of a workgroup
SPLAT_SPEC_ID kPackedStoresId = 1u;   // kPackedStores of store.glsl

#ifdef __cplusplus
}
#endif

#endif
