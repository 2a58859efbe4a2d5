#include "eval/image_scores.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace splat::eval {
namespace {

constexpr std::int64_t kReach = 5;  ///< pixels of the window on each side of its centre

std::array<double, 2 * kReach + 1> window() {
    std::array<double, 2 * kReach + 1> weights{};
    double sum = 0;
    for (std::int64_t i = -kReach; i <= kReach; ++i) {
        const auto x = static_cast<double>(i) / 1.5;
        weights[static_cast<std::size_t>(i + kReach)] = std::exp(-x * x / 2);
        sum += weights[static_cast<std::size_t>(i + kReach)];
    }
    for (double& weight : weights) weight /= sum;
    return weights;
}

/// Window along rows, then along columns; zero outside.
class Blur {
  public:
    Blur(std::int64_t height, std::int64_t width)
        : height_(height), width_(width), rows_(static_cast<std::size_t>(height * width)) {}

    void run(std::vector<double>& plane) {
        along(plane, rows_, 1, width_);
        along(rows_, plane, width_, height_);
    }

  private:
    void along(const std::vector<double>& from, std::vector<double>& to, std::int64_t stride,
               std::int64_t length) const {
        const std::int64_t total = height_ * width_;
        for (std::int64_t at = 0; at < total; ++at) {
            const std::int64_t place = at / stride % length;
            const std::int64_t first = std::max(-kReach, -place);
            const std::int64_t last = std::min(kReach, length - 1 - place);
            double sum = 0;
            for (std::int64_t i = first; i <= last; ++i)
                sum += weights_[static_cast<std::size_t>(i + kReach)] *
                       from[static_cast<std::size_t>(at + i * stride)];
            to[static_cast<std::size_t>(at)] = sum;
        }
    }

    std::int64_t height_, width_;
    std::vector<double> rows_;
    std::array<double, 2 * kReach + 1> weights_ = window();
};

/// Sum over the pixels of a channel that count.
double similarity(std::span<const float> a, std::span<const float> b,
                  std::span<const std::uint8_t> valid, Blur& blur) {
    constexpr double kC1 = 0.01 * 0.01, kC2 = 0.03 * 0.03;
    std::vector<double> x(a.begin(), a.end());
    std::vector<double> y(b.begin(), b.end());
    for (std::size_t i = 0; i < valid.size(); ++i)
        if (valid[i] == 0) x[i] = y[i] = 0;
    std::vector<double> ma = x, mb = y, aa(x.size()), bb(x.size()), ab(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) {
        aa[i] = x[i] * x[i];
        bb[i] = y[i] * y[i];
        ab[i] = x[i] * y[i];
    }
    for (std::vector<double>* plane : {&ma, &mb, &aa, &bb, &ab}) blur.run(*plane);
    double sum = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        if (!valid.empty() && valid[i] == 0) continue;
        const double mm = ma[i] * mb[i];
        const double squares = ma[i] * ma[i] + mb[i] * mb[i];
        sum += (2 * mm + kC1) * (2 * (ab[i] - mm) + kC2) /
               ((squares + kC1) * (aa[i] + bb[i] - squares + kC2));
    }
    return sum;
}

}  // namespace

Result<ImageScores> compare_images(std::span<const float> a, std::span<const float> b,
                                   std::uint32_t channels, std::uint32_t height,
                                   std::uint32_t width, std::span<const std::uint8_t> valid) {
    const std::size_t pixels = std::size_t{height} * width;
    if (pixels == 0 || channels == 0 || a.size() != pixels * channels || a.size() != b.size())
        return error(Code::kShape,
                     "images of %zu and %zu numbers, expected %u x %u x %u of each, none of them 0",
                     a.size(), b.size(), channels, height, width);
    if (!valid.empty() && valid.size() != pixels)
        return error(Code::kShape, "a mask of %zu pixels, expected %zu", valid.size(), pixels);
    const std::size_t counted =
        valid.empty()
            ? pixels
            : pixels - static_cast<std::size_t>(std::count(valid.begin(), valid.end(), 0));
    if (counted == 0) return invalid("no pixel counts");
    const auto samples = static_cast<double>(counted * channels);
    double squares = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        if (!std::isfinite(a[i]) || !std::isfinite(b[i]))
            return invalid("images hold a number that is not finite, at %zu", i);
        const double difference = static_cast<double>(a[i]) - static_cast<double>(b[i]);
        if (valid.empty() || valid[i % pixels] != 0) squares += difference * difference;
    }
    ImageScores scores;
    scores.squared_error = squares / samples;
    scores.psnr = -10 * std::log10(scores.squared_error);
    Blur blur(height, width);
    for (std::size_t c = 0; c < channels; ++c)
        scores.ssim +=
            similarity(a.subspan(c * pixels, pixels), b.subspan(c * pixels, pixels), valid, blur);
    scores.ssim /= samples;
    return scores;
}

}  // namespace splat::eval
