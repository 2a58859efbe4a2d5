#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/os/child.h"
#include "vkrun/cli/json.h"

namespace vkrun::bench {

/// How torch_model.py is started.
struct PeerOptions {
    std::string device = "cpu";   ///< cpu or cuda
    std::string isa = "default";  ///< default or avx2, of the CPU
    bool tf32 = false;            ///< CUDA: allow TF32
    bool graphs = false;          ///< CUDA: replay graphs
    std::string layout = "channels_last";
#if defined(_WIN32)
    std::string python = "python";
#else
    std::string python = "/usr/bin/python3";  ///< where Debian's python3-torch is found
#endif
    std::string script;  ///< empty: find_script()
};

/// A process that prints "ready" with JSON about itself, then runs passes on request. It is
/// torch_model.py with the network that libsplat also runs, or vkrun itself in `bench start`.
class ModelPeer {
  public:
    /// command  the program and its arguments; variables  those that it has anew. Throws, with the
    /// remedy, unless it gets ready.
    ModelPeer(const std::vector<std::string>& command, const std::string& remedy,
              const std::vector<std::pair<std::string, std::string>>& variables = {});
    ~ModelPeer();
    ModelPeer(const ModelPeer&) = delete;
    ModelPeer& operator=(const ModelPeer&) = delete;

    [[nodiscard]] const Json& about() const { return about_; }

    /// pass  "forward", "step", or "outputs" with a folder for the exchange; Returns  its time, ms
    double run(const std::string& pass);

  private:
    std::string read_line();

    splat::os::Child child_;
    std::string received_;
    Json about_;
};

/// Throws if an option has no effect on the peer's device.
void check_peer_options(const PeerOptions& options);

/// A script of the sources in a folder above this program or above the current folder.
std::string find_script(const std::string& name);

/// The program and arguments of torch_model.py for a configuration as reports hold it. Throws if the
/// peer cannot build such a network.
std::vector<std::string> peer_command(const PeerOptions& options, const Json& config,
                                      std::uint32_t objects);

/// torch_model.py, started by such a command, perhaps with more arguments. Throws, with the remedy,
/// unless it gets ready, and if it has no fast BLAS on the CPU.
std::unique_ptr<ModelPeer> start_torch(const PeerOptions& options,
                                       const std::vector<std::string>& command);

}  // namespace vkrun::bench
