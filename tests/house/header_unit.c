/* Compiled as C and as C++ by header_tests.cmake. The variables make clang lay out the structs, so
 * that -Wpadded sees them; a test of the house checks that none is left out. */
#include <splat.h>

splat_device_info sample_device_info;
splat_device_desc sample_device_desc;
splat_memory_info sample_memory_info;
splat_tensor_desc sample_tensor_desc;
splat_tensor_info sample_tensor_info;
splat_tensor_stats sample_tensor_stats;
splat_op_desc sample_op_desc;
