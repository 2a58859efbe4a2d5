#pragma once

#include <array>
#include <cstring>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "vk/buffer.h"
#include "vk/pipeline.h"

namespace splat::vk {

enum class Use : int { kRead, kWrite, kReadWrite };

constexpr bool writes(Use use) {
    return use != Use::kRead;
}

/// One buffer range that a command touches.
struct Access {
    BufferView view;
    Use use = Use::kRead;
};

inline Access read(const BufferView& view) {
    return {view, Use::kRead};
}
inline Access write(const BufferView& view) {
    return {view, Use::kWrite};
}
inline Access read_write(const BufferView& view) {
    return {view, Use::kReadWrite};
}

/// Push constants of one dispatch: a struct of shaders/include/params.
class PushData {
  public:
    PushData() = default;
    template <class Params>
    PushData(const Params& params) : bytes_(sizeof(Params)) {
        static_assert(std::is_trivially_copyable_v<Params> && sizeof(Params) <= kMaxBytes);
        std::memcpy(data_.data(), &params, sizeof(Params));
    }
    [[nodiscard]] std::uint32_t bytes() const { return bytes_; }
    [[nodiscard]] const std::byte* data() const { return data_.data(); }

    static constexpr std::uint32_t kMaxBytes =
        128;  ///< the smallest maxPushConstantsSize that Vulkan allows

  private:
    std::array<std::byte, kMaxBytes> data_{};
    std::uint32_t bytes_ = 0;
};

/// Arithmetic and traffic of one dispatch, as the operator counts them: for profiles and for
/// splitting long work.
struct Work {
    double flops = 0;
    double bytes = 0;
};

using Groups = std::array<std::uint32_t, 3>;

/// One dispatch as an operator states it.
struct Dispatch {
    const char* op = "";      ///< profile label: the operator's function, "group_norm_forward"
    const char* shader = "";  ///< stem; the recorder finds the module for the kernels in use
    std::vector<SpecConstant> constants;
    PushData push;
    std::vector<Access> accesses;  ///< in the order of the shader's bindings
    Groups groups{1, 1, 1};
    Work work;             ///< an estimate is required: submits are cut by it
    Work most_group = {};  ///< one workgroup has no more, where data deals the work out
    /// Declared aliasing: an input and an output may be the same range, not merely overlap.
    bool may_alias = false;
    /// Instead of those for networks: of another family, or where a kernel does not fit the shapes or needs a missing
    /// feature.
    std::optional<Kernels> kernels = {};
};

/// What a command list consists of.
enum class CommandKind : int { kDispatch, kFill, kCopy, kBarrier, kToHost };

/// What uses memory, as bits: dispatches are shaders, fills and copies are transfers.
using Stages = std::uint32_t;
inline constexpr Stages kShaders = 1, kTransfers = 2, kAllStages = kShaders | kTransfers;
inline constexpr Stages kHost = 4;

struct Command {
    CommandKind kind = CommandKind::kBarrier;
    std::string op;
    std::vector<Access> accesses;
    Pipeline* pipeline = nullptr;
    const char* shader = "";  ///< name of the module
    PushData push;
    Groups groups{1, 1, 1};  ///< fills and copies have one a kTransferPiece
    std::uint32_t fill_word = 0;
    VkDescriptorSet set = VK_NULL_HANDLE;
    Work work;
    double seconds = 0;          ///< estimated
    double group_seconds = 0;    ///< estimated of most_group
    KernelPace* pace = nullptr;  ///< none for barriers
    std::size_t recorded = 0;    ///< number of the call of the recorder
    Stages from = 0;             ///< barriers: what before them they order ...
    Stages to = 0;               ///< ... against what after them
};

/// Bytes of a fill or copy that are not split further.
inline constexpr std::uint64_t kTransferPiece = 1U << 16;

/// A part of a list that one submit takes: a command, or some workgroups of a dispatch, which do not conflict with the
/// others of theirs, or some bytes of a fill or copy.
struct Piece {
    std::size_t command;
    Groups base{0, 0, 0};
    Groups groups{1, 1, 1};
    double seconds = 0;  ///< estimated
};

inline Stages stages_of(const Command& command) {
    return command.kind == CommandKind::kDispatch ? kShaders : kTransfers;
}

inline bool is_barrier(const Command& command) {
    return command.kind == CommandKind::kBarrier || command.kind == CommandKind::kToHost;
}

}  // namespace splat::vk
