#pragma once

#include <splat.h>

#include <atomic>
#include <functional>
#include <string>

#include "vkrun/command.h"
#include "vkrun/objects.h"

namespace vkrun {

using Dataset = Owner<splat_dataset, splat_dataset_destroy>;

/// Calls `work` for 0 to count - 1 from several threads (0: one for each core) under a progress bar, until
/// one throws; that exception is passed on.
void for_each_index(const char* what, std::uint32_t count, std::uint32_t threads,
                    const std::function<void(std::uint32_t)>& work);

/// Each adds one command below `data`.
void add_data_synth(CLI::App& data, int& exit_code);
void add_data_check(CLI::App& data, int& exit_code);
void add_data_show(CLI::App& data, int& exit_code);

}  // namespace vkrun
