#pragma once

#include <splat.h>

#include <optional>
#include <string>
#include <vector>

namespace vkrun {

enum class State { kOk, kWarning, kError };

/// What one check found: a sentence, and what to do about it unless it is ok.
struct Finding {
    std::string check;
    State state = State::kOk;
    std::string sentence;
    std::string remedy;
};
using Findings = std::vector<Finding>;

/// An environment variable that is set and not empty.
std::optional<std::string> variable(const char* name);

// ---- The machine (doctor_system.cpp): no device needed

Findings check_library();
Findings check_loader();
/// The loader's driver files. have_device  one of them works, so that trouble with others is only a warning.
Findings check_drivers(bool have_device);
/// A GPU that the system has but no Vulkan driver shows.
Findings check_gpu_nodes(const std::vector<splat_device_info>& devices);
Findings check_environment();
Findings check_cache_folder();

// ---- The device (doctor_device.cpp)

Findings check_devices(const std::vector<splat_device_info>& devices);
Findings check_limits(const splat_device_info& info);
/// For a device with a kernels_note.
Finding kernels_finding(const splat_device_info& info);
Findings check_kernels(const splat_device_info& info, const splat_device_info& described);
Findings check_memory(splat_device device, const splat_device_info& info);
/// Opens the device again, under the validation layer, and runs an operator.
Findings check_validation(const splat_device_desc& desc);

// ---- What it computes (doctor_selftest.cpp)

/// Forward and backward of each operator on the device that `desc` opens, against float64.
Findings check_operators(const splat_device_desc& desc);
Findings check_tensors(splat_device device);
/// Run one small operator, to provoke messages of the validation layer. Throws a Failure.
void run_one_operator(splat_device device);

}  // namespace vkrun
