#pragma once

#include <cstddef>
#include <vector>

#include "ref/raster_scene_ref.h"
#include "ref/summed.h"

/// The loss of planes, forward and backward, over packed Gaussians g = (mean, opacity; scale, 0; rotation w x y z):
///
///   loss = 1 / N sum over planes p and members i of (n_p . mean_i - o_p)^2 + sum over k of (s_ik a_ik)^2
///   o_p = mean of n_p . mean_i     a_ik = n_p . column k of R(q_i)
///
/// dL/dmean_i = 2 (n . mean_i - o) n / N: what passes through o is the sum of deviations from a mean, 0.
/// dL/ds_ik = 2 s_ik a_ik^2 / N and dL/dR_i = n (2 s_ik^2 a_ik / N)^T, from there to q. Magnitudes hold the rounding of
/// n . mean_i and o_p, from which the deviation is a small difference.
namespace splat::ref {

inline constexpr std::size_t kPackedGaussian = 12;

struct PlaneLossInput {
    std::size_t gaussians = 0;
    std::vector<double> packed;                     ///< [N,12]
    std::vector<std::vector<std::size_t>> members;  ///< numbers of Gaussians, by plane
    std::vector<Vec3<double>> normals;
};

struct PlaneLossResult {
    Summed<double> loss, grad;  ///< [1], [N,12]
};

inline Vec3<double> packed3(const PlaneLossInput& in, std::size_t at) {
    return {in.packed[at], in.packed[at + 1], in.packed[at + 2]};
}

inline double wide_dot(const Vec3<double>& a, const Vec3<double>& b) {
    return std::abs(a[0] * b[0]) + std::abs(a[1] * b[1]) + std::abs(a[2] * b[2]);
}

/// A member of a plane: its terms and its gradient.
inline void add_member(const PlaneLossInput& in, std::size_t i, const Vec3<double>& n,
                       double offset, double wide_offset, double factor, PlaneLossResult& out) {
    const std::size_t at = kPackedGaussian * i;
    const Vec3<double> mean = packed3(in, at), scale = packed3(in, at + 4);
    const std::array<double, 4> q{in.packed[at + 8], in.packed[at + 9], in.packed[at + 10],
                                  in.packed[at + 11]};
    const Mat3<double> r = quaternion_matrix(q);
    const double off = dot(n, mean) - offset, wide = wide_dot(n, mean) + wide_offset;
    out.loss.add(0, factor * off * off, factor * (off * off + 2 * std::abs(off) * wide));
    Mat3<double> grad_r{};
    double grad_r_size = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3<double> axis{r[0][k], r[1][k], r[2][k]};
        const double a = dot(n, axis), s = scale[k], wide_a = wide_dot(n, axis) + 1;
        out.loss.add(0, factor * s * s * a * a,
                     factor * s * s * (a * a + 2 * std::abs(a) * wide_a));
        out.grad.add(at + k, 2 * factor * off * n[k], 2 * factor * wide * std::abs(n[k]));
        out.grad.add(at + 4 + k, 2 * factor * s * a * a,
                     2 * factor * s * (a * a + 2 * std::abs(a) * wide_a));
        for (std::size_t j = 0; j < 3; ++j) grad_r[j][k] = 2 * factor * s * s * a * n[j];
        grad_r_size += 2 * factor * s * s * wide_a;
    }
    const std::array<double, 4> grad_q = quaternion_matrix_backward(q, grad_r);
    for (std::size_t k = 0; k < 4; ++k) out.grad.add(at + 8 + k, grad_q[k], 8 * grad_r_size);
}

inline PlaneLossResult plane_loss(const PlaneLossInput& in, double grad_loss) {
    PlaneLossResult out{Summed<double>(1, 4 * in.gaussians),
                        Summed<double>(kPackedGaussian * in.gaussians, 12)};
    const double factor = 1 / static_cast<double>(in.gaussians);
    for (std::size_t p = 0; p < in.members.size(); ++p) {
        double offset = 0, wide = 0;
        for (const std::size_t i : in.members[p]) {
            const Vec3<double> mean = packed3(in, kPackedGaussian * i);
            offset += dot(in.normals[p], mean) / static_cast<double>(in.members[p].size());
            wide += wide_dot(in.normals[p], mean) / static_cast<double>(in.members[p].size());
        }
        for (const std::size_t i : in.members[p])
            add_member(in, i, in.normals[p], offset, wide, factor, out);
    }
    for (std::size_t i = 0; i < out.grad.value.size(); ++i) {
        out.grad.value[i] *= grad_loss;
        out.grad.magnitude[i] *= std::abs(grad_loss);
    }
    return out;
}

}  // namespace splat::ref
