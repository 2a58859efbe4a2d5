#include <algorithm>

#include "ops/attention.h"
#include "ref/attention_ref.h"
#include "self_test/parts.h"

namespace splat::self_test {
namespace {

/// One head of 8 channels, 9 queries, 12 keys.
struct Attention {
    static constexpr std::size_t kC = 8, kL = 9, kJ = 12;
    ops::AttentionDesc desc{1, kC, 1, kL, kJ};
    Floats q = eighths(kC * kL, 12), k = eighths(kC * kJ, 13), v = eighths(kC * kJ, 14);
    Floats grad_y = eighths(kC * kL, 15);
    ref::AttentionInput<double> reference{1, kC, 1, kL, kJ, wide(q), wide(k), wide(v)};

    static Floats eighths(std::size_t count, std::uint32_t seed) {
        Floats values = integers(count, seed);
        for (float& value : values) value /= 8;
        return values;
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
    SPLAT_ASSIGN(const vk::BufferView space,
                 trial.room(ops::attention_forward_bytes(trial.recorder(), of.desc)));
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
    return trial.error(at.y, Attention::kC, Attention::kL,
                       ref::attention_forward(of.reference).value);
}

Result<double> attention_gradient_error(vk::Context& context) {
    using A = Attention;
    const A of;
    const auto expected = ref::attention_backward(of.reference, wide(of.grad_y));
    Trial trial(context);
    SPLAT_ASSIGN(const AttentionViews at, record_attention(trial, of));
    SPLAT_ASSIGN(const vk::BufferView grad_y, trial.put(to_quads(of.grad_y, A::kC, A::kL)));
    ops::AttentionGradients gradients;
    SPLAT_ASSIGN(gradients.q, trial.room(of.q.size() * 4));
    SPLAT_ASSIGN(gradients.k, trial.room(of.k.size() * 4));
    SPLAT_ASSIGN(gradients.v, trial.room(of.v.size() * 4));
    SPLAT_ASSIGN(const vk::BufferView space,
                 trial.room(ops::attention_backward_bytes(trial.recorder(), of.desc)));
    SPLAT_TRY(ops::attention_backward(trial.recorder(), of.desc, at.q, at.k, at.v, at.weights,
                                      grad_y, gradients, space));
    SPLAT_TRY(trial.run());
    SPLAT_ASSIGN(const double error_q,
                 trial.error(gradients.q, A::kC, A::kL, expected.grad_q.value));
    SPLAT_ASSIGN(const double error_k,
                 trial.error(gradients.k, A::kC, A::kJ, expected.grad_k.value));
    SPLAT_ASSIGN(const double error_v,
                 trial.error(gradients.v, A::kC, A::kJ, expected.grad_v.value));
    return std::max({error_q, error_k, error_v});
}

}  // namespace splat::self_test
