#pragma once

#include <span>

#include "vk/command.h"

namespace splat::vk {

/// Prove that a command list orders every pair of conflicting accesses; run on every list in builds
/// with assertions.
///
/// Independent of the recorder: checks all pairs. Two commands conflict if their byte ranges
/// overlap and at least one writes; a read-modify-write counts as both. A conflict is safe if a
/// barrier lies between the two. The parts of one split dispatch do not conflict with each other. A
/// list must begin with a barrier (against the list before it) and end with one to the host.
/// Errors: kInternal, names both commands.
Status check_hazards(std::span<const Command> commands);

}  // namespace splat::vk
