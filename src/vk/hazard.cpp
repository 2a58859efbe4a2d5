#include "vk/hazard.h"

namespace splat::vk {
namespace {

const char* use_name(Use use) {
    constexpr const char* kNames[] = {"read", "write", "read-modify-write"};
    return kNames[static_cast<std::size_t>(use)];
}

Status check_pair(std::span<const Command> commands, std::size_t earlier, std::size_t later) {
    const Command& a = commands[earlier];
    const Command& b = commands[later];
    for (const Access& first : a.accesses)
        for (const Access& second : b.accesses)
            if (first.view.overlaps(second.view) && (writes(first.use) || writes(second.use)))
                return error(Code::kInternal,
                             "hazard: command %zu (%s) and command %zu (%s) %s and %s bytes [%llu, "
                             "%llu) and [%llu, %llu) "
                             "of one buffer without a barrier between them",
                             earlier, a.op.c_str(), later, b.op.c_str(), use_name(first.use),
                             use_name(second.use), llu(first.view.offset), llu(first.view.end()),
                             llu(second.view.offset), llu(second.view.end()));
    return {};
}

}  // namespace

Status check_hazards(std::span<const Command> commands) {
    if (commands.empty()) return {};
    if (commands.front().kind != CommandKind::kBarrier)
        return error(Code::kInternal,
                     "hazard: the list does not begin with a barrier against the one before it");
    if (commands.back().kind != CommandKind::kToHost)
        return error(Code::kInternal, "hazard: the list does not end with a barrier to the host");
    for (std::size_t later = 0; later < commands.size(); ++later) {
        if (is_barrier(commands[later])) continue;
        for (std::size_t earlier = later; earlier-- > 0 && !is_barrier(commands[earlier]);)
            SPLAT_TRY(check_pair(commands, earlier, later));
    }
    return {};
}

}  // namespace splat::vk
