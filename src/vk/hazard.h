#pragma once

#include <span>

#include "vk/command.h"

namespace splat::vk {

/// Prove that a command list orders every pair of conflicting accesses; run on every list in builds
/// with assertions.
///
/// Independent of the recorder: checks all pairs. Two commands conflict if their byte ranges
/// overlap and at least one writes; a read-modify-write counts as both. A conflict is safe if the two are in the order
/// in which they were recorded, and a barrier that names the stages of both lies between them. The parts of one split
/// dispatch do not conflict with each other. A list must begin with a barrier, order each stage that it uses against
/// the lists before, and end with a barrier to the host that names all stages used.
/// Errors: kInternal, names both commands.
Status check_hazards(std::span<const Command> commands);

}  // namespace splat::vk
