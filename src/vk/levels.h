#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vk/command.h"

namespace splat::vk {

/// The level of each command, from 1 on: one more than the greatest of those before it that it conflicts with (byte
/// ranges overlap, and one of the two writes). Commands of a level may overlap, and may run before those that were
/// recorded before them in a later one. `in_order`: no level is below that of the command before.
std::vector<std::uint32_t> dependency_levels(std::span<const Command> commands, bool in_order);

/// The commands by level, and within one as recorded, with a barrier before each level and one to the host at the end.
///
/// A barrier names the stages of the level after it, and those before it that no barrier has ordered against them yet.
/// The first of a stage is also against the lists before.
std::vector<Command> in_levels(std::vector<Command> commands,
                               std::span<const std::uint32_t> levels);

}  // namespace splat::vk
