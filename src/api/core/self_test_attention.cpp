#include <algorithm>
#include <cmath>

#include "api/core/self_test_parts.h"
#include "ops/attention.h"

namespace splat::api::self_test {
namespace {

/// One head of 8 channels, 9 queries, 12 keys.
struct Attention {
    static constexpr std::size_t kC = 8, kL = 9, kJ = 12;
    ops::AttentionDesc desc{1, kC, 1, kL, kJ};
    Floats q = eighths(kC * kL, 12), k = eighths(kC * kJ, 13), v = eighths(kC * kJ, 14);
    Floats grad_y = eighths(kC * kL, 15);
    Doubles weights = Doubles(kL * kJ), y = Doubles(kC * kL);

    static Floats eighths(std::size_t count, std::uint32_t seed) {
        Floats values = integers(count, seed);
        for (float& value : values) value /= 8;
        return values;
    }

    Attention() {
        for (std::size_t l = 0; l < kL; ++l) {
            double sum = 0;
            for (std::size_t j = 0; j < kJ; ++j) {
                double score = 0;
                for (std::size_t c = 0; c < kC; ++c)
                    score += wide(q[c * kL + l]) * wide(k[c * kJ + j]);
                sum += weights[l * kJ + j] = std::exp(score / std::sqrt(double{kC}));
            }
            for (std::size_t j = 0; j < kJ; ++j) weights[l * kJ + j] /= sum;
            for (std::size_t c = 0; c < kC; ++c)
                for (std::size_t j = 0; j < kJ; ++j)
                    y[c * kL + l] += weights[l * kJ + j] * wide(v[c * kJ + j]);
        }
    }

    /// Gradients of q, k and v.
    void gradients(Doubles& grad_q, Doubles& grad_k, Doubles& grad_v) const {
        grad_q.assign(kC * kL, 0);
        grad_k.assign(kC * kJ, 0);
        grad_v.assign(kC * kJ, 0);
        for (std::size_t l = 0; l < kL; ++l) {
            Doubles by_weight(kJ);
            double mean = 0;
            for (std::size_t j = 0; j < kJ; ++j) {
                for (std::size_t c = 0; c < kC; ++c) {
                    by_weight[j] += wide(v[c * kJ + j]) * wide(grad_y[c * kL + l]);
                    grad_v[c * kJ + j] += weights[l * kJ + j] * wide(grad_y[c * kL + l]);
                }
                mean += weights[l * kJ + j] * by_weight[j];
            }
            for (std::size_t j = 0; j < kJ; ++j)
                for (std::size_t c = 0; c < kC; ++c) {
                    const double by_score =
                        weights[l * kJ + j] * (by_weight[j] - mean) / std::sqrt(double{kC});
                    grad_q[c * kL + l] += by_score * wide(k[c * kJ + j]);
                    grad_k[c * kJ + j] += by_score * wide(q[c * kL + l]);
                }
        }
    }
};

struct AttentionViews {
    vk::BufferView q, k, v, y, weights;
};

Result<AttentionViews> record_attention(Trial& trial, const Attention& of) {
    AttentionViews at;
    SPLAT_ASSIGN(at.q, trial.put(to_quads(of.q, Attention::kC, Attention::kL)));
    SPLAT_ASSIGN(at.k, trial.put(to_quads(of.k, Attention::kC, Attention::kJ)));
    SPLAT_ASSIGN(at.v, trial.put(to_quads(of.v, Attention::kC, Attention::kJ)));
    SPLAT_ASSIGN(at.y, trial.room(Attention::kC * Attention::kL * 4));
    SPLAT_ASSIGN(at.weights, trial.room(ops::attention_weights_shape(of.desc).elements() * 4));
    SPLAT_ASSIGN(const vk::BufferView space, trial.room(ops::attention_forward_bytes(of.desc)));
    SPLAT_TRY(ops::attention_forward(trial.recorder(), of.desc, at.q, at.k, at.v, at.y, at.weights,
                                     space));
    return at;
}

}  // namespace

Result<double> attention_error(vk::Context& context) {
    const Attention of;
    Trial trial(context);
    SPLAT_ASSIGN(const AttentionViews at, record_attention(trial, of));
    SPLAT_TRY(trial.run());
    return trial.error(at.y, Attention::kC, Attention::kL, of.y);
}

Result<double> attention_gradient_error(vk::Context& context) {
    using A = Attention;
    const A of;
    Doubles by_q, by_k, by_v;
    of.gradients(by_q, by_k, by_v);
    Trial trial(context);
    SPLAT_ASSIGN(const AttentionViews at, record_attention(trial, of));
    SPLAT_ASSIGN(const vk::BufferView grad_y, trial.put(to_quads(of.grad_y, A::kC, A::kL)));
    ops::AttentionGradients gradients;
    SPLAT_ASSIGN(gradients.q, trial.room(by_q.size() * 4));
    SPLAT_ASSIGN(gradients.k, trial.room(by_k.size() * 4));
    SPLAT_ASSIGN(gradients.v, trial.room(by_v.size() * 4));
    SPLAT_ASSIGN(const vk::BufferView space,
                 trial.room(ops::attention_backward_bytes(trial.recorder(), of.desc)));
    SPLAT_TRY(ops::attention_backward(trial.recorder(), of.desc, at.q, at.k, at.v, at.weights,
                                      grad_y, gradients, space));
    SPLAT_TRY(trial.run());
    SPLAT_ASSIGN(const double error_q, trial.error(gradients.q, A::kC, A::kL, by_q));
    SPLAT_ASSIGN(const double error_k, trial.error(gradients.k, A::kC, A::kJ, by_k));
    SPLAT_ASSIGN(const double error_v, trial.error(gradients.v, A::kC, A::kJ, by_v));
    return std::max({error_q, error_k, error_v});
}

}  // namespace splat::api::self_test
