#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "second_golden/layers.h"
#include "support/npz_writer.h"
#include "support/rng_fill.h"

namespace splat::golden {

/// Random bfloat16 values, as the index of tests/golden/net requires. Weights have the spread that keeps
/// activations near 1.
class Numbers {
  public:
    explicit Numbers(std::uint64_t seed) : rng_(seed) {}

    Values normal(std::size_t count, double mean = 0, double spread = 1);
    Values parameter(const Dims& dims, Role role);
    /// 0 or 1 / (1 - p).
    Values mask(std::size_t count, double p);

  private:
    test::Rng rng_;
};

using Arrays = std::map<std::string, test::NpyArray>;

/// `<key>` as float32, and `<key>64` as float64.
void put_both(Arrays& arrays, const std::string& key, const Dims& dims, const Values& values);

/// One case `<name>.…` of a file: inputs and parameters are stored as they are made, outputs and
/// gradients by finish().
class Case {
  public:
    Case(Arrays& arrays, Numbers& numbers, std::string name)
        : arrays_(arrays), numbers_(numbers), name_(std::move(name)) {}

    /// Parameters that match have no gradient in the file.
    std::function<bool(const std::string& name)> frozen = [](const std::string&) { return false; };

    /// An input `<name>.<key>`, with a gradient `d_<key>`.
    Id input(const std::string& key, const Dims& dims);
    [[nodiscard]] Layers layers();
    Tape& tape() { return tape_; }
    void put(const std::string& key, const test::NpyArray& array) {
        arrays_[name_ + "." + key] = array;
    }
    void put_config(const std::vector<std::size_t>& cfg);

    /// The loss is the sum of random weights times y.
    void finish(Id y);

  private:
    Id parameter(const std::string& name, const Dims& dims, Role role);

    Arrays& arrays_;
    Numbers& numbers_;
    std::string name_;
    Tape tape_;
    std::map<std::string, Id> inputs_;
    std::map<std::string, Id> parameters_;
};

}  // namespace splat::golden
