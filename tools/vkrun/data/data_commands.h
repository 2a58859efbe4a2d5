#pragma once

#include <splat.h>

#include "vkrun/command.h"
#include "vkrun/objects.h"

namespace vkrun {

using Dataset = Owner<splat_dataset, splat_dataset_destroy>;

/// Each adds one command below `data`.
void add_data_synth(CLI::App& data, int& exit_code);

}  // namespace vkrun
