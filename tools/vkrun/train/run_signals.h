#pragma once

#include <splat.h>

namespace vkrun {

/// Let Ctrl-C, SIGTERM, SIGHUP and a closed pipe end a run after its piece of work; a third signal ends at once.
/// `tells`: the first one prints what is still done.
void catch_run_signals(bool tells = true);

/// True once such a signal came.
bool run_interrupted();

/// Name the piece of work that is next, which a signal lets end. The text that a handler may be writing stays: there
/// are two.
void prepare_farewell(const splat_run_event& done);

}  // namespace vkrun
