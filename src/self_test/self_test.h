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
    std::string notes;      ///< file of what is known of them; empty: none
    unsigned families = 0;  ///< families that were asked for
};

/// File of what is known of a device's kernels, in the folder of the pipeline cache.
std::string notes_path(const std::string& cache_folder, const vk::DeviceInfo& info);

/// Makes those of info.kernels plain that are known to fail, and says why; or says which ones run where they differ.
/// Empty if there is nothing to tell.
std::string leave_out_failed(vk::DeviceInfo& info, const std::string& notes);

/// Open a context. Kernels that failed, in this process or an earlier one, are left out, unless they are chosen.
/// Errors: those of Context::create().
Result<std::shared_ptr<vk::Context>> create_context(const vk::ContextDesc& desc,
                                                    KernelTests& tests);

/// Compute on the device what a driver that miscompiles shaders gets wrong, and compare with the host. Call it before
/// an object of these families is made: its kernels are compiled then in any case, so the test costs little more than
/// its own run.
///
/// Where the kernels of a family compute wrongly, do not compile, lose the device or do not end, plain ones take their
/// place and a warning is logged; a device that is lost or hangs is opened anew, if nothing is on it. A result is kept
/// for the life of the process and, where there is a cache folder, in a file beside the pipeline cache, which names the
/// driver and the version of the library; so is a test that ended the process. SPLAT_SELF_TEST=0 leaves the test out.
///
/// Errors: those of the calls; kNoDevice if the plain kernels compute wrongly, too, or if the device already has
/// objects of the family, whose data has the layout of the kernels that failed; the failure if a device with anything
/// on it is lost or hangs.
Status test_kernels(vk::Context& context, KernelTests& tests, unsigned families);

}  // namespace splat::self_test
