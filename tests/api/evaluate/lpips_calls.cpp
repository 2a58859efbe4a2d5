#include "api/evaluate/lpips_calls.h"

#include <cmath>
#include <deque>

#include "support/rng_fill.h"

namespace splat::test {
namespace {

/// Named arrays that live as long as this.
class LpipsArrays {
  public:
    void add(std::string name, const Dims& dims, Floats values) {
        names_.push_back(std::move(name));
        values_.push_back(std::move(values));
        list_.push_back(named_array(names_.back().c_str(), values_.back(), dims));
    }
    [[nodiscard]] Weights weights() const {
        return got(splat_weights_from_arrays, list_.data(), list_.size());
    }

  private:
    std::deque<std::string> names_;
    std::deque<Floats> values_;
    std::vector<splat_named_array> list_;
};

}  // namespace

Weights lpips_weights() {
    LpipsArrays arrays;
    const std::pair<int, int> layers[] = {{0, 64},   {2, 64},   {5, 128},  {7, 128},  {10, 256},
                                          {12, 256}, {14, 256}, {17, 512}, {19, 512}, {21, 512},
                                          {24, 512}, {26, 512}, {28, 512}};
    int in = 3;
    for (const auto& [layer, out] : layers) {
        const std::string name = "features." + std::to_string(layer);
        const auto seed = static_cast<std::uint64_t>(layer);
        const auto features = static_cast<std::size_t>(out), inputs = static_cast<std::size_t>(in);
        // Variance 2 / (9 in): activations neither grow nor fade.
        arrays.add(name + ".weight", {out, in, 3, 3},
                   normal_fill(9 * features * inputs, seed, 0, std::sqrt(2.0 / (9.0 * in))));
        arrays.add(name + ".bias", {out}, normal_fill(features, seed + 100, 0, 0.1));
        in = out;
    }
    const int channels[] = {64, 128, 256, 512, 512};
    for (int k = 0; k < 5; ++k)
        arrays.add("lin" + std::to_string(k) + ".model.1.weight", {1, channels[k], 1, 1},
                   Floats(static_cast<std::size_t>(channels[k]), 0.5F));
    return arrays.weights();
}

Lpips make_lpips(const Device& device) {
    const Weights weights = lpips_weights();
    const splat_weights given = weights;
    auto desc = sized<splat_lpips_desc>();
    desc.weights = &given;
    desc.weight_count = 1;
    desc.side = kLpipsSide;
    return got(splat_lpips_create, device, &desc);
}

}  // namespace splat::test
