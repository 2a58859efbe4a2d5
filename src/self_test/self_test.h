#pragma once

#include <memory>
#include <string>

#include "vk/context.h"

namespace splat::self_test {

/// Kernels that are tested together, as bits: those of networks and operators, of the rasterizer, and of their
/// gradients.
enum KernelFamily : unsigned {
    kNetworkKernels = 1,
    kNetworkGradientKernels = 2,
    kRasterKernels = 4,
    kRasterGradientKernels = 8,
    kAllKernels = 15,
};

/// What is known of a device's kernels.
struct KernelTests {
    bool chosen = false;    ///< by the caller or by SPLAT_KERNELS: they are kept, right or wrong
    std::string notes;      ///< file of the families that passed; empty: none
    unsigned families = 0;  ///< families that were asked for
};

/// Open a context. Kernels that failed in this process are left out, unless they are chosen.
/// Errors: those of Context::create().
Result<std::shared_ptr<vk::Context>> create_context(const vk::ContextDesc& desc,
                                                    KernelTests& tests);

/// Compute on the device what a driver that miscompiles shaders gets wrong, and compare with the host. Call it before
/// an object of these families is made: its kernels are compiled then in any case, so the test costs little more than
/// its own run.
///
/// Where the kernels in use fail, the plain ones are used and a warning is logged. A result is kept for the life of the
/// process and, where there is a cache folder, in a file beside the pipeline cache, which names the driver and the
/// version of the library. SPLAT_SELF_TEST=0 leaves the test out.
///
/// Errors: those of the calls; kNoDevice if the plain kernels fail, too, or if the device already has objects of other
/// families, whose data has the layout of the kernels that failed.
Status test_kernels(vk::Context& context, KernelTests& tests, unsigned families);

}  // namespace splat::self_test
