#pragma once

#include <memory>
#include <string>

#include "vk/context.h"

namespace splat::api {

/// Compute on the device what a driver that miscompiles shaders gets wrong, and compare with the host: a product of
/// matrices (register tiles, shuffles), a group normalisation (sums over a workgroup) and a small scene
/// (projection, sorts, blending).
///
/// Returns empty if the results are right, else a sentence that names what is wrong.
/// Errors: those of the calls; nothing is known of the kernels then.
Result<std::string> self_test(vk::Context& context);

/// A context whose kernels pass the self-test. Where those that the device would get fail, the plain ones are used
/// and a warning is logged; kernels that the caller chose stay, with the warning.
///
/// A result is kept for the life of the process and, where there is a cache folder, in a file beside the
/// pipeline cache, which names the driver and the version of the library. SPLAT_SELF_TEST=0 leaves it out.
/// Errors: those of Context::create(); kNoDevice if the plain kernels fail, too.
Result<std::shared_ptr<vk::Context>> tested_context(const vk::ContextDesc& desc);

}  // namespace splat::api
