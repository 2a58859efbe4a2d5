#pragma once

#include "vk/command.h"
#include "vk/command_list.h"

namespace splat::vk {

class Context;

/// Collects commands with declared reads and writes and turns them into a command list.
///
/// Barriers are derived, see levels.h. No memory is allocated on the device while recording; operators take workspaces
/// as views.
///
/// The list is cut into segments, one a submit, see pace.h. A dispatch that takes longer than one is split by its
/// groups, so shaders must not use gl_NumWorkGroups. With assertions a dispatch that no split makes short enough for a
/// watchdog is kInternal in finish().
class Recorder {
  public:
    explicit Recorder(Context& context) : context_(context) {}

    /// Runs the kernel's module for the kernels in use, the plain one where they have none.
    ///
    /// Errors: kInternal if no module has that stem, if the work is not estimated, if the
    /// declarations differ from the shader's (count, readonly, writeonly, push bytes) or ranges
    /// alias without may_alias; kUnsupported if a view exceeds the binding limits or the groups exceed the device's.
    Status dispatch(const Dispatch& dispatch);

    Status fill(const BufferView& view, std::uint32_t word);
    Status copy(const BufferView& from, const BufferView& to);

    /// Record the list's end and build it. The recorder is empty afterwards.
    Result<CommandList> finish();

    [[nodiscard]] const DeviceInfo& device() const;
    [[nodiscard]] Kernels kernels(Family family = Family::kNetwork) const;

    bool omit_barriers = false;  ///< tests: record a wrong list
    bool bounds = false;         ///< the work of dispatches is a bound, see KernelPace::bound

  private:
    void add(Command command, Kernels kernels);
    Status check_limits(const Command& command) const;

    Context& context_;
    std::vector<Command> commands_;
};

/// The module of a stem; the plain one where the kernels have none of their own, nullptr for an unknown stem.
const ShaderModule* module_for(std::string_view stem, Kernels kernels);

/// How long `work` takes by the rates that a device is taken to have before anything is measured.
double estimated_seconds(const DeviceInfo& info, Kernels kernels, const Work& work);

}  // namespace splat::vk
