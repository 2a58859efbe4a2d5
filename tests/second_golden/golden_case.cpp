#include "second_golden/golden_case.h"

#include <bit>
#include <cmath>

namespace splat::golden {
namespace {

/// Rounded to the nearest bfloat16, halves away from zero.
double bfloat16(double value) {
    const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(value));
    return static_cast<double>(std::bit_cast<float>((bits + 0x8000U) & 0xFFFF0000U));
}

}  // namespace

Values Numbers::normal(std::size_t count, double mean, double spread) {
    Values values(count);
    for (double& value : values) value = bfloat16(mean + spread * rng_.normal());
    return values;
}

Values Numbers::parameter(const Dims& dims, Role role) {
    const std::size_t count = elements_of(dims);
    if (role == Role::kScale) return normal(count, 1, 0.25);
    if (role == Role::kBias) return normal(count, 0, 0.25);
    const std::size_t columns = count / dims[0];
    return normal(count, 0, 1 / std::sqrt(static_cast<double>(columns)));
}

Values Numbers::mask(std::size_t count, double p) {
    Values values(count);
    for (double& value : values)
        value = rng_.uniform() < p ? 0 : static_cast<double>(static_cast<float>(1 / (1 - p)));
    return values;
}

void put_both(Arrays& arrays, const std::string& key, const Dims& dims, const Values& values) {
    arrays[key] = test::npy_f32(dims, values);
    arrays[key + "64"] = test::npy_f64(dims, values);
}

Id Case::input(const std::string& key, const Dims& dims) {
    const Values values = numbers_.normal(elements_of(dims));
    put(key, test::npy_f32(dims, values));
    return inputs_[key] = tape_.leaf(dims, values);
}

Id Case::parameter(const std::string& name, const Dims& dims, Role role) {
    const Values values = numbers_.parameter(dims, role);
    put("p." + name, test::npy_f32(dims, values));
    return parameters_[name] = tape_.leaf(dims, values);
}

Layers Case::layers() {
    return {tape_, [this](const std::string& name, const Dims& dims, Role role) {
                return parameter(name, dims, role);
            }};
}

void Case::put_config(const std::vector<std::size_t>& cfg) {
    put("cfg", test::npy_i32({cfg.begin(), cfg.end()}));
}

void Case::finish(Id y) {
    const Dims& dims = tape_.dims(y);
    const Values g = numbers_.normal(elements_of(dims));
    put("g", test::npy_f32(dims, g));
    put_both(arrays_, name_ + ".y", dims, tape_.values(y));
    tape_.backward({{y, g}});
    for (const auto& [key, id] : inputs_)
        put_both(arrays_, name_ + ".d_" + key, tape_.dims(id), tape_.gradient(id));
    for (const auto& [name, id] : parameters_)
        if (!frozen(name))
            put_both(arrays_, name_ + ".d." + name, tape_.dims(id), tape_.gradient(id));
}

}  // namespace splat::golden
