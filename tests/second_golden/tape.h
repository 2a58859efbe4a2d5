#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace splat::golden {

using Dims = std::vector<std::size_t>;
using Values = std::vector<double>;

std::size_t elements_of(const Dims& dims);

/// Operations in float64 by the references of tests/ref in the order of their calls, and their gradients
/// in reverse order. It shares nothing with the library.
class Tape {
  public:
    using Id = std::size_t;
    static constexpr Id kNone = ~Id{0};  ///< an optional input that is absent

    /// An input or a parameter, row-major.
    Id leaf(const Dims& dims, const Values& values);

    /// An operator of tests/ref/ by its name; `dims` are those of its outputs.
    std::vector<Id> op(const char* name, const std::vector<Id>& inputs,
                       const std::map<std::string, double>& attributes,
                       const std::vector<Dims>& dims);

    /// a + factor * b.
    Id sum(Id a, Id b, double factor);
    /// Times constants of the same shape.
    Id times(Id a, const Values& factors);
    /// Element i of the result is element index[i] of `from`.
    Id gathered(Id from, const Dims& dims, const std::vector<std::size_t>& index);
    Id reshaped(Id from, const Dims& dims);

    [[nodiscard]] const Dims& dims(Id id) const { return nodes_.at(id).dims; }
    [[nodiscard]] const Values& values(Id id) const { return nodes_.at(id).values; }

    /// Gradients of the sum of grad * value over the given pairs.
    void backward(const std::vector<std::pair<Id, Values>>& grads);
    /// Zeros where the outputs do not depend on the value.
    [[nodiscard]] const Values& gradient(Id id) const { return nodes_.at(id).gradient; }

  private:
    struct Node {
        Dims dims;
        Values values;
        Values gradient;
    };
    /// Adds to the gradients of the inputs of a value.
    using Step = std::function<void()>;

    Id add(const Dims& dims, Values values);
    void accumulate(Id id, const Values& grad);

    std::vector<Node> nodes_;
    std::vector<Step> steps_;
};

}  // namespace splat::golden
