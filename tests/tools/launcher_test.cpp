// What started a process, by the variables of launchers, and which device each rank of a machine takes.

#include "vkrun/ranks/launcher.h"

#include <gtest/gtest.h>

#include <cstring>
#include <map>

#include "vkrun/cli/handles.h"

namespace vkrun {
namespace {

Launcher launcher_of(const std::map<std::string, std::string>& variables) {
    return find_launcher([&](const char* name) -> std::optional<std::string> {
        const auto found = variables.find(name);
        if (found == variables.end()) return std::nullopt;
        return found->second;
    });
}

TEST(Launcher, IsKnownByItsVariables) {
    using Kinds = std::vector<std::string>;
    const Launcher open_mpi = launcher_of({{"OMPI_COMM_WORLD_SIZE", "4"}, {"PMI_SIZE", "9"}});
    EXPECT_EQ(open_mpi.name, "mpirun");
    EXPECT_EQ(open_mpi.count, 4U);
    EXPECT_EQ(open_mpi.kinds, Kinds{"openmpi"});
    // Hydra starts its processes by srun, which counts one a machine.
    const Launcher hydra = launcher_of({{"PMI_SIZE", "8"}, {"SLURM_STEP_NUM_TASKS", "2"}});
    EXPECT_EQ(hydra.name, "mpirun");
    EXPECT_EQ(hydra.count, 8U);
    EXPECT_EQ(hydra.kinds.front(), "mpich");
    const Launcher srun = launcher_of({{"SLURM_STEP_NUM_TASKS", "2"}, {"SLURM_NTASKS", "16"}});
    EXPECT_EQ(srun.name, "srun");
    EXPECT_EQ(srun.count, 2U);
    const Launcher torchrun =
        launcher_of({{"RANK", "0"}, {"WORLD_SIZE", "2"}, {"LOCAL_RANK", "0"}});
    EXPECT_EQ(torchrun.name, "torchrun");
    EXPECT_EQ(torchrun.count, 2U);
    EXPECT_TRUE(torchrun.kinds.empty());
}

TEST(Launcher, IsNoneOfOneProcess) {
    for (const auto& variables : std::initializer_list<std::map<std::string, std::string>>{
             {},
             {{"SLURM_NTASKS", "16"}, {"SLURM_PROCID", "0"}},  // the script of a job
             {{"WORLD_SIZE", "2"}},
             {{"RANK", "0"}, {"WORLD_SIZE", "1"}, {"LOCAL_RANK", "0"}},
             {{"OMPI_COMM_WORLD_SIZE", "many"}}}) {
        EXPECT_EQ(launcher_of(variables).name, "");
        EXPECT_EQ(launcher_of(variables).count, 1U);
    }
    EXPECT_EQ(launcher_of({{"OMPI_COMM_WORLD_SIZE", "1"}}).count, 1U);
}

TEST(Launcher, RanksShareTheUsableDevicesOfAKind) {
    std::vector<splat_device_info> devices;
    const auto add = [&](splat_device_kind kind, const char* reason) {
        auto info = sized<splat_device_info>();
        info.index = static_cast<std::uint32_t>(devices.size());
        info.kind = kind;
        info.usable = 1;
        std::strncpy(info.reason, reason, sizeof info.reason - 1);
        devices.push_back(info);
    };
    add(SPLAT_DEVICE_KIND_CPU, "");
    add(SPLAT_DEVICE_KIND_DISCRETE, "");
    add(SPLAT_DEVICE_KIND_DISCRETE, "computes wrongly");
    add(SPLAT_DEVICE_KIND_DISCRETE, "");
    auto desc = sized<splat_device_desc>();
    desc.select = SPLAT_SELECT_BEST;
    EXPECT_EQ(devices_to_share(desc, devices), (std::vector<std::uint32_t>{1, 3}));
    desc.select = SPLAT_SELECT_BY_KIND;
    desc.kind = SPLAT_DEVICE_KIND_CPU;
    EXPECT_EQ(devices_to_share(desc, devices), (std::vector<std::uint32_t>{0}));
    desc.kind = SPLAT_DEVICE_KIND_INTEGRATED;
    EXPECT_TRUE(devices_to_share(desc, devices).empty());
    desc.select = SPLAT_SELECT_BY_INDEX;
    EXPECT_TRUE(devices_to_share(desc, devices).empty());
}

}  // namespace
}  // namespace vkrun
