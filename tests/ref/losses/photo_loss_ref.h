#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "ref/losses/ssim_ref.h"

/// The loss of a view against a photograph with a mask m, M = sum m, forward and backward; Number is double, or
/// Rounded for the magnitudes too.
///
///   loss = (1 - s) A / (3 M) + s U / (3 M),  A = sum m |a - t|,  U = sum m (1 - S),  S the SSIM of m a and m t
///
/// a(p) gets  m(p) (1 - s) / (3 M) sign(a - t)(p)
///          - m(p) s / (3 M) sum_q w(p - q) m(q) (D_a + 2 a(p) D_aa + t(p) D_at)(q)
/// with the slopes D of ssim_ref.h. Through an exposure of gains G and offsets o, a = G c + o for the image c, which
/// gets transpose(G) times the gradient of a; G gets the sum of that times transpose(c), and o the sum.
namespace splat::ref {

struct PhotoLossInput {
    std::size_t height = 1;
    std::size_t width = 1;
    double ssim_weight = 0.2;
    std::vector<double> image;                    ///< [3,height,width]
    std::vector<std::uint32_t> truth;  ///< [height,width]: R | G << 8 | B << 16 | A << 24
    /// [3,4]: gains and an offset in a row.
    std::optional<std::vector<double>> exposure = {};
    [[nodiscard]] std::size_t pixels() const { return height * width; }
    [[nodiscard]] bool counts(std::size_t pixel) const { return truth[pixel] >> 24 == 255; }
    [[nodiscard]] std::uint32_t valid() const {
        std::uint32_t sum = 0;
        for (std::size_t p = 0; p < pixels(); ++p) sum += counts(p) ? 1 : 0;
        return sum;
    }
    /// What the sums are divided by; 1 where they are empty.
    [[nodiscard]] double divisor() const { return valid() > 0 ? 3.0 * valid() : 1; }
};

/// The image through the exposure.
inline std::vector<double> exposed_image(const PhotoLossInput& in) {
    if (!in.exposure) return in.image;
    std::vector<double> made(in.image.size());
    for (std::size_t i = 0; i < made.size(); ++i) {
        const double* const row = &(*in.exposure)[4 * (i / in.pixels())];
        made[i] = row[3];
        for (std::size_t c = 0; c < 3; ++c)
            made[i] += row[c] * in.image[c * in.pixels() + i % in.pixels()];
    }
    return made;
}

/// Image and truth as SSIM sees them: three planes, zero outside the mask.
inline SsimInput photo_loss_planes(const PhotoLossInput& in) {
    SsimInput planes{3, in.height, in.width, std::vector<double>(in.image.size()), {}};
    planes.b = planes.a;
    const std::vector<double> image = exposed_image(in);
    for (std::size_t i = 0; i < in.image.size(); ++i) {
        const std::size_t pixel = i % in.pixels();
        if (!in.counts(pixel)) continue;
        planes.a[i] = image[i];
        planes.b[i] = (in.truth[pixel] >> (8 * (i / in.pixels())) & 255) / 255.0;
    }
    return planes;
}

/// The sums of |a - t|, 1 - S and (a - t)^2 over the mask.
template <class Number>
std::array<Number, 3> photo_loss_sums(const PhotoLossInput& in) {
    const SsimInput planes = photo_loss_planes(in);
    std::array<Number, 3> sums{Number(0), Number(0), Number(0)};
    for (std::size_t i = 0; i < planes.a.size(); ++i) {
        if (!in.counts(i % in.pixels())) continue;
        const Number d = Number(planes.a[i]) - Number(planes.b[i]);
        sums[0] = sums[0] + (number_of(d) < 0 ? -d : d);
        sums[1] = sums[1] + (Number(1) - ssim_at<Number>(planes, i)[0]);
        sums[2] = sums[2] + d * d;
    }
    return sums;
}

template <class Number>
Number photo_loss_forward(const PhotoLossInput& in) {
    const std::array<Number, 3> sums = photo_loss_sums<Number>(in);
    const Number count(in.divisor());
    return Number(1 - in.ssim_weight) * sums[0] / count + Number(in.ssim_weight) * sums[1] / count;
}

/// Gradient of the image through the exposure, [3,height,width].
template <class Number>
std::vector<Number> photo_loss_exposed_backward(const PhotoLossInput& in) {
    const SsimInput planes = photo_loss_planes(in);
    std::vector<std::array<Number, 4>> slopes(planes.a.size());
    for (std::size_t i = 0; i < slopes.size(); ++i)
        if (in.counts(i % in.pixels())) slopes[i] = ssim_at<Number>(planes, i);
    const double count = in.divisor();
    std::vector<Number> grad(planes.a.size(), Number(0));
    for (std::size_t i = 0; i < grad.size(); ++i) {
        if (!in.counts(i % in.pixels())) continue;
        const double d = planes.a[i] - planes.b[i];
        Number sum(0);
        ssim_taps(planes, i, [&](std::size_t q, double weight) {
            const auto& [similarity, by_a, by_aa, by_ab] = slopes[q];
            sum = sum + Number(weight) *
                            (by_a + Number(2 * planes.a[i]) * by_aa + Number(planes.b[i]) * by_ab);
        });
        grad[i] = Number((1 - in.ssim_weight) / count *
                         (d > 0   ? 1
                          : d < 0 ? -1
                                  : 0)) -
                  Number(in.ssim_weight / count) * sum;
    }
    return grad;
}

/// Gradient of the image, [3,height,width].
template <class Number>
std::vector<Number> photo_loss_backward(const PhotoLossInput& in) {
    const std::vector<Number> grad = photo_loss_exposed_backward<Number>(in);
    if (!in.exposure) return grad;
    std::vector<Number> made(grad.size(), Number(0));
    for (std::size_t i = 0; i < made.size(); ++i)
        for (std::size_t c = 0; c < 3; ++c)
            made[i] = made[i] + Number((*in.exposure)[4 * c + i / in.pixels()]) *
                                    grad[c * in.pixels() + i % in.pixels()];
    return made;
}

/// Gradient of the exposure, [3,4].
template <class Number>
std::vector<Number> photo_loss_exposure_backward(const PhotoLossInput& in) {
    const std::vector<Number> grad = photo_loss_exposed_backward<Number>(in);
    std::vector<Number> made(12, Number(0));
    for (std::size_t i = 0; i < grad.size(); ++i) {
        if (!in.counts(i % in.pixels())) continue;
        Number* const row = &made[4 * (i / in.pixels())];
        for (std::size_t c = 0; c < 3; ++c)
            row[c] = row[c] + Number(in.image[c * in.pixels() + i % in.pixels()]) * grad[i];
        row[3] = row[3] + grad[i];
    }
    return made;
}

}  // namespace splat::ref
