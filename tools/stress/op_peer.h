#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bench/model/model_peer.h"
#include "vkrun/doctor/op_case.h"
#include "vkrun/cli/temporary_folder.h"

namespace vkrun::stress {

/// By name: "y", "grad_x".
using PeerResults = std::map<std::string, std::vector<float>>;

/// Operators in PyTorch's float32, in a process of tools/bench/torch_ops.py.
class OpPeer {
  public:
    /// python  its interpreter; empty: there is no peer
    explicit OpPeer(const std::string& python);

    /// Empty without a peer, or for an operator that it does not have.
    [[nodiscard]] PeerResults results_of(const OpCase& op_case);

  private:
    TemporaryFolder folder_;
    std::unique_ptr<bench::ModelPeer> peer_;
};

}  // namespace vkrun::stress
