#include "vkrun/ranks/launcher.h"

#include <algorithm>
#include <charconv>

#include "vkrun/cli/device.h"

namespace vkrun {

Launcher find_launcher(
    const std::function<std::optional<std::string>(const char* name)>& variable) {
    const auto number = [&](const char* name) {
        const std::string text = variable(name).value_or("");
        std::uint32_t value = 0;
        std::from_chars(text.data(), text.data() + text.size(), value);
        return value;
    };
    // Inside a job of Slurm mpirun's processes have its variables, too: it comes last. The count of a step tells srun's
    // processes from the job's script, which is one.
    const struct {
        const char *variable, *name;
        std::vector<std::string> kinds;
    } launchers[] = {{"OMPI_COMM_WORLD_SIZE", "mpirun", {"openmpi"}},
                     {"PMI_SIZE", "mpirun", {"mpich", "openmpi"}},
                     {"SLURM_STEP_NUM_TASKS", "srun", {"openmpi", "mpich"}}};
    for (const auto& [size, name, kinds] : launchers)
        if (const std::uint32_t count = number(size); count != 0) return {name, count, kinds};
    if (const std::uint32_t count = number("WORLD_SIZE");
        count > 1 && variable("RANK") && variable("LOCAL_RANK"))
        return {"torchrun", count, {}};
    return {};
}

std::vector<std::uint32_t> devices_to_share(const splat_device_desc& desc,
                                            const std::vector<splat_device_info>& devices) {
    std::optional<splat_device_kind> kind;
    if (desc.select == SPLAT_SELECT_BY_KIND) kind = desc.kind;
    if (const auto best = best_device(devices); best && desc.select == SPLAT_SELECT_BEST)
        kind = devices[*best].kind;
    std::vector<std::uint32_t> shared;
    for (const splat_device_info& device : devices)
        if (kind == device.kind && device.usable != 0 && device.reason[0] == '\0')
            shared.push_back(device.index);
    return shared;
}

}  // namespace vkrun
