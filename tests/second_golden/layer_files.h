#pragma once

#include "second_golden/golden_case.h"

namespace splat::golden {

/// The files of the second set, with the keys of tests/golden/net/INDEX.md. Their sizes are those that
/// the first set keeps constant: ranks, channels, groups, attention resolution, odd image sizes, batches.
Arrays conv_file();
Arrays norm_file();
Arrays block_file();
Arrays lora_file();
Arrays graft_file();

}  // namespace splat::golden
