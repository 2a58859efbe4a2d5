#include "api/model/port_list.h"

namespace splat::api {

splat_port port_of(const char* name, const Shape& shape, PortFlags flags) {
    splat_port port{};
    port.name = name;
    port.rank = shape.rank();
    if (flags.optional) port.flags |= SPLAT_PORT_OPTIONAL;
    if (flags.trainable) port.flags |= SPLAT_PORT_TRAINABLE;
    if (flags.graded) port.flags |= SPLAT_PORT_GRADIENT;
    for (std::uint32_t axis = 0; axis < shape.rank(); ++axis) port.dims[axis] = shape[axis];
    return port;
}

Status unknown_port_kind(splat_port_kind kind) {
    return invalid("kind is %d, expected %d to %d (SPLAT_PORT_KIND_)", kind, SPLAT_PORT_KIND_INPUT,
                   SPLAT_PORT_KIND_PARAMETER);
}

}  // namespace splat::api
