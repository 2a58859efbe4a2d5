#pragma once

#include <initializer_list>
#include <string>
#include <vector>

#include "ops/op_table.h"

namespace splat::nn {

using ValueId = std::uint32_t;
inline constexpr ValueId kNoValue = ~ValueId{0};

enum class ValueKind : int {
    kInput,      ///< written by the caller before each forward pass
    kParameter,  ///< trained and saved, see parameters.h
    kActivation,
};

struct Value {
    std::string name;
    ValueKind kind = ValueKind::kActivation;
    Shape shape;
    ops::Layout layout = ops::Layout::kQuads;
    bool trainable = false;   ///< parameters: gets a gradient
    ValueId base = kNoValue;  ///< the value whose memory this one views in another shape
};

struct Node {
    const ops::OpRow* row = nullptr;
    ops::Attributes attributes;
    std::vector<ValueId> inputs;  ///< kNoValue for an absent optional one
    std::vector<ValueId> outputs;
    ops::OpPlan plan;
    std::uint32_t segment = 0;  ///< see Graph::begin_segment
};

/// Operators in the order of their execution, and the values between them. Built once per model and
/// shapes; executor.h runs it.
///
/// The first error sticks: building code reads like the formula and asks status() at its end.
class Graph {
  public:
    explicit Graph(vk::Context& context) : recorder_(context) {}

    ValueId input(std::string name, const Shape& shape, ops::Layout layout = ops::Layout::kQuads);

    /// Row-major. The name is that of the state dict. Errors: kInvalidArgument for a duplicate name.
    ValueId parameter(std::string name, const Shape& shape, bool trainable = true);

    /// One operator of the table. Errors: those of find_op, complete_attributes and the row's plan;
    /// kShape, naming operator and tensor, for a required input that is absent or has another layout.
    std::vector<ValueId> node(const char* op, std::vector<ValueId> inputs,
                              std::vector<JsonScalar> attributes = {});
    /// The same for a row that need not be in the table.
    std::vector<ValueId> node(const ops::OpRow& row, std::vector<ValueId> inputs,
                              std::vector<JsonScalar> attributes);

    /// The same for operators of one output.
    ValueId op(const char* op, std::vector<ValueId> inputs,
               std::vector<JsonScalar> attributes = {});

    /// The same memory in another shape: quads keep their channels and the product of the rest,
    /// row-major values their number of elements. Errors: kShape.
    ValueId reshape(ValueId value, const Shape& shape);

    /// Start a segment: the nodes from here to the next call, or the end, can be recomputed for the backward
    /// pass from the results of earlier nodes (ExecutorDesc::recompute).
    void begin_segment() { ++segment_; }

    /// Keep an error that the building code finds, unless there is one already.
    void fail(Status status);

    [[nodiscard]] const Status& status() const { return status_; }
    [[nodiscard]] const std::vector<Value>& values() const { return values_; }
    [[nodiscard]] const std::vector<Node>& nodes() const { return nodes_; }
    [[nodiscard]] const Value& value(ValueId id) const { return values_[id]; }

    /// Bytes that parameters take, and at least what a forward pass holds besides at its fullest: inputs, values until
    /// they are last read, workspaces, and parameters as kernels read them; all of the last, which later passes keep.
    struct Bytes {
        std::uint64_t parameters = 0, pass = 0, prepared = 0;
    };
    [[nodiscard]] Bytes forward_bytes() const;

    /// The value that owns the memory of `id`.
    [[nodiscard]] ValueId root(ValueId id) const;

    /// The parameter or input of this name, or kNoValue.
    [[nodiscard]] ValueId find(std::string_view name) const;

  private:
    ValueId add(Value value);
    Result<Node> make_node(const ops::OpRow& row, std::vector<ValueId> inputs,
                           std::span<const JsonScalar> attributes);

    vk::Recorder recorder_;  ///< tells plans the device and its kernels; records nothing
    Status status_;
    std::vector<Value> values_;
    std::vector<Node> nodes_;
    std::uint32_t segment_ = 0;
};

}  // namespace splat::nn
