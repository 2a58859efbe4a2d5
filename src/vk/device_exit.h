#pragma once

#include <cstdint>

namespace splat::vk {

class Device;

/// Since 1.4.305 the validation layer destroys what it knows of living devices when the process exits. Up to 1.4.321
/// GPU-assisted validation aborts the process then, because it locks a table twice; later versions crash in calls that
/// come after it, such as those of the destructors of global objects. So devices under validation end before, and
/// later calls on them do nothing.
///
/// Call it each time that the layer was loaded: handlers at exit run in reverse order.
void end_devices_before(std::uint32_t layer_version);

/// Devices under validation, from their creation to their destruction.
void add_validated(Device& device);
void remove_validated(const Device& device) noexcept;

/// True once they have ended: the process exits.
bool devices_ended_at_exit() noexcept;

}  // namespace splat::vk
