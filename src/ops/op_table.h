#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "core/json.h"
#include "vk/recorder.h"

namespace splat::ops {

/// How an operator's tensor lies on the device.
enum class Layout : int {
    kQuads,     ///< activation [N, C, ...] as quads, see quads.h
    kRowMajor,  ///< parameter or statistic, row-major and padded to whole quads
};

struct Port {
    const char* name;
    Layout layout = Layout::kQuads;
    bool optional = false;
    bool constant = false;  ///< has no gradient: cameras, masks, counters of a random generator
};

struct Attribute {
    const char* name;
    const char* type;      ///< "integer", "number" or "boolean"
    const char* fallback;  ///< JSON text of the default
    const char* about;
};

/// Checked attribute values of one call: every attribute of the row, given or default.
class Attributes {
  public:
    explicit Attributes(std::vector<JsonScalar> values) : values_(std::move(values)) {}
    [[nodiscard]] std::int64_t integer(std::string_view name) const;
    [[nodiscard]] double number(std::string_view name) const;
    [[nodiscard]] bool boolean(std::string_view name) const;

  private:
    [[nodiscard]] const JsonScalar& find(std::string_view name) const;
    std::vector<JsonScalar> values_;
};

/// What an operator's outputs and workspaces look like for given inputs.
struct OpPlan {
    std::vector<Shape> outputs = {};
    std::vector<Shape> saved = {};         ///< computed by forward, read by backward; row-major
    std::uint64_t forward_workspace = 0;   ///< bytes
    std::uint64_t backward_workspace = 0;  ///< bytes
    std::uint64_t backward_least =
        0;  ///< with so many the gradients wait for each other; 0: no such form
    std::uint64_t forward_prepared = 0;   ///< bytes of parameters as forward's kernels read them
    std::uint64_t backward_prepared = 0;  ///< the same for backward's, for gradients of activations
    bool adds = false;                    ///< backward adds OpViews::addend to grad_inputs[0]
    /// Inputs, one bit each, whose gradient equals that of output 0. The caller can use that tensor instead, and
    /// request only the other gradients from backward.
    std::uint32_t passes = 0;
};

enum class Pass : int { kForward, kBackward };

/// The tensors of one call, in the order of the row's ports. A view without a buffer is an absent
/// optional tensor or, in backward, an input that it does not read.
struct OpViews {
    std::vector<vk::BufferView> inputs;
    std::vector<vk::BufferView> outputs;
    std::vector<vk::BufferView> saved;
    std::vector<vk::BufferView> grad_outputs;
    std::vector<vk::BufferView> grad_inputs;  ///< without a buffer if not needed: costs nothing
    vk::BufferView
        addend;  ///< added to grad_inputs[0], where the plan says that backward adds; may be absent
    vk::BufferView workspace;
    vk::BufferView forward_prepared;
    vk::BufferView backward_prepared;
    bool accumulate = false;  ///< gradients of row-major inputs are added to what is there
};

/// One differentiable operator. Attributes have been checked against the row and completed with
/// defaults. `prepare` reorders parameters for the kernels, once per change of the parameters; it may
/// be nullptr.
struct OpRow {
    const char* name;
    const char* equation = "";
    std::span<const Port> inputs = {};
    std::span<const Port> outputs = {};
    std::span<const char* const> saved = {};
    std::span<const Attribute> attributes = {};
    Result<OpPlan> (*plan)(const vk::Recorder&, const Attributes& attributes,
                           std::span<const Shape> inputs) = nullptr;
    Status (*prepare)(vk::Recorder&, const Attributes& attributes, const OpViews&,
                      Pass pass) = nullptr;
    Status (*forward)(vk::Recorder&, const Attributes& attributes, const OpViews&) = nullptr;
    Status (*backward)(vk::Recorder&, const Attributes& attributes, const OpViews&) = nullptr;

    /// True if backward reads input i, an activation, if gradients of the inputs marked in `wanted` are requested;
    /// nullptr: it may read every one. An input that it does not read may give its memory to other tensors.
    /// Outputs are never read: what backward needs is saved.
    bool (*backward_reads)(std::size_t i, const std::vector<bool>& wanted) = nullptr;
};

/// Shared by rows. Ports of operators from one tensor x to y:
inline constexpr Port kInputX[] = {{"x"}};
inline constexpr Port kOutputY[] = {{"y"}};

/// True if an optional tensor is present, or a gradient requested.
inline bool present(const vk::BufferView& view) {
    return view.block != nullptr;
}

/// OpRow::backward_reads of a product of the first two inputs: reads each for the gradient of the other.
bool product_backward_reads(std::size_t i, const std::vector<bool>& wanted);
/// OpRow::backward_reads of a fixed linear map: reads no activation, as it maps the output's gradient back.
bool no_backward_reads(std::size_t i, const std::vector<bool>& wanted);

/// Errors: kShape, naming operator and tensor, unless `got` is `expected`.
Status expect_shape(const char* op, const char* tensor, const Shape& got, const Shape& expected);

/// Errors: kShape, naming operator and tensor, unless `got` is [N, C, H, W].
Status expect_images(const char* op, const char* tensor, const Shape& got);

/// The row's answer; row-major inputs, which are parameters and constants, may always be read.
bool backward_reads(const OpRow& row, std::size_t i, const std::vector<bool>& wanted);

/// Remove the buffers of inputs that backward does not read, so that recording a read of one fails.
void drop_unread(const OpRow& row, const std::vector<bool>& wanted, OpViews& views);

/// All operators, by name: each `const OpRow kFooRow` of this layer (cmake/SplatRows.cmake).
std::span<const OpRow* const> op_table();

/// Errors: kInvalidArgument, listing the known names.
Result<const OpRow*> find_op(std::string_view name);

/// Check `given` against the row (unknown name, wrong type) and fill in the defaults. Errors:
/// kInvalidArgument.
Result<Attributes> complete_attributes(const OpRow& row, std::span<const JsonScalar> given);

}  // namespace splat::ops
