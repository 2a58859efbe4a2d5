#pragma once

#include <splat.h>

#include <string>

namespace CLI {
class App;
}

namespace vkrun {

struct RankOptions {
    std::string ranks = "auto";
    double timeout = 600;  ///< seconds
};

/// --ranks and --rank-timeout
void add_rank_options(CLI::App& command, RankOptions& options);

/// The processes that do a command together, by MPI; or this one alone. From its start an error that ends the command
/// ends all of them.
class Ranks {
  public:
    /// Throws a Failure where several processes were started that cannot reach each other.
    explicit Ranks(const RankOptions& options);

    /// Null: this process is alone.
    [[nodiscard]] const splat_group* group() const { return several() ? &group_ : nullptr; }
    [[nodiscard]] bool several() const { return group_.count > 1; }
    /// Whether this one prints and writes.
    [[nodiscard]] bool leads() const { return group_.rank == 0; }

    /// Let the ranks of a machine share its devices, where `device` (--device) names none, and tell it.
    [[nodiscard]] splat_device_desc device_desc(const std::string& device) const;

    /// Return when all ranks have called it. Throws a Failure that names what others wait for.
    void wait(const std::string& what) const;
    /// The same at the end, before this process exits.
    void finish() const;

  private:
    splat_group group_;
};

}  // namespace vkrun
