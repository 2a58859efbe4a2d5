#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

/// Steps of Adam (Kingma & Ba 2015, algorithm 1), without weight decay, in plain loops.
namespace splat::ref {

struct AdamRules {
    double learning_rate = 5e-5;
    double beta1 = 0.9;
    double beta2 = 0.999;
    double eps = 1e-15;
};

struct AdamState {
    std::vector<double> value;
    std::vector<double> m;
    std::vector<double> v;
};

/// `step` counts from 1.
inline void adam_step(const AdamRules& rules, std::size_t step, const std::vector<double>& grad,
                      AdamState& state) {
    const auto t = static_cast<double>(step);
    for (std::size_t i = 0; i < grad.size(); ++i) {
        state.m[i] = rules.beta1 * state.m[i] + (1 - rules.beta1) * grad[i];
        state.v[i] = rules.beta2 * state.v[i] + (1 - rules.beta2) * grad[i] * grad[i];
        const double m_hat = state.m[i] / (1 - std::pow(rules.beta1, t));
        const double v_hat = state.v[i] / (1 - std::pow(rules.beta2, t));
        state.value[i] -= rules.learning_rate * m_hat / (std::sqrt(v_hat) + rules.eps);
    }
}

}  // namespace splat::ref
