#pragma once

#include <splat.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace vkrun {

/// What started this process as one of several.
struct Launcher {
    std::string name;                ///< "mpirun", "srun", "torchrun"; empty: nothing did
    std::uint32_t count = 1;         ///< how many processes it started
    std::vector<std::string> kinds;  ///< the MPI that it may be for, the likelier one first
};

/// By the variables that launchers set, which `variable` gives.
Launcher find_launcher(
    const std::function<std::optional<std::string>(const char* name)>& variable);

/// The devices that the ranks of a machine share, in turn: usable ones of the kind that `desc` has or, where it asks
/// for the best, of that one's kind. Empty if it names a device.
std::vector<std::uint32_t> devices_to_share(const splat_device_desc& desc,
                                            const std::vector<splat_device_info>& devices);

}  // namespace vkrun
