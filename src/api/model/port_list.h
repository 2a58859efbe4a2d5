#pragma once

#include <algorithm>
#include <vector>

#include "api/handles.h"
#include "core/shape.h"

namespace splat::api {

struct PortFlags {
    bool optional = false;
    bool trainable = false;
    bool graded = false;
};

splat_port port_of(const char* name, const Shape& shape, PortFlags flags);

/// kInvalidArgument.
Status unknown_port_kind(splat_port_kind kind);

/// An entry point that lists ports of a live object: `body(object)` returns all of them.
template <class Handle, class Body>
splat_result list_ports(Handle handle, splat_port* ports, std::uint32_t capacity,
                        std::uint32_t* count, Body&& body) {
    bool cut = false;
    const splat_result result = with(handle, [&](const auto& object) -> Status {
        SPLAT_ASSIGN(const std::vector<splat_port> all, body(*object));
        if (capacity > 0) SPLAT_TRY(require(ports, "ports"));
        std::copy_n(all.begin(), std::min<std::size_t>(all.size(), capacity), ports);
        if (count != nullptr) *count = static_cast<std::uint32_t>(all.size());
        cut = all.size() > capacity;
        return {};
    });
    return result == SPLAT_OK && cut ? SPLAT_INCOMPLETE : result;
}

}  // namespace splat::api
