#include "io/sample_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "scene/arrays.h"

namespace splat::test {
namespace {

/// Uniform in [-1, 1).
class Random {
  public:
    explicit Random(std::uint32_t seed) : state_(seed * 2654435761U + 1) {}
    float next() {
        state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
        return static_cast<float>(static_cast<std::int32_t>(state_ >> 32U)) / 2147483648.0F;
    }

  private:
    std::uint64_t state_;
};

}  // namespace

scene::Gaussians sample_scene(std::size_t count, std::uint32_t sh_degree, std::uint32_t seed) {
    scene::Gaussians g = scene::make_gaussians(count, sh_degree);
    Random random(seed);
    for (float& value : g.means) value = 4 * random.next();
    for (float& value : g.log_scales) value = -2.5F + 3.5F * random.next();
    for (float& value : g.rotations) value = random.next();
    for (float& value : g.opacity_logits) value = 4 * random.next();
    for (float& value : g.sh) value = 0.99F * random.next();
    scene::normalise_rotations(g);
    return g;
}

double max_difference(const std::vector<float>& a, const std::vector<float>& b) {
    if (a.size() != b.size()) return std::numeric_limits<double>::infinity();
    double largest = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        largest =
            std::max(largest, std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i])));
    return largest;
}

double max_angle(const std::vector<float>& a, const std::vector<float>& b) {
    if (a.size() != b.size()) return std::numeric_limits<double>::infinity();
    double largest = 0;
    for (std::size_t i = 0; i < a.size(); i += 4) {
        double along = 0;
        double aa = 0;
        double bb = 0;
        for (std::size_t k = i; k < i + 4; ++k) {
            const auto x = static_cast<double>(a[k]);
            const auto y = static_cast<double>(b[k]);
            along += x * y;
            aa += x * x;
            bb += y * y;
        }
        const double cosine = std::min(1.0, std::abs(along) / std::sqrt(aa * bb));
        largest = std::max(largest, 2 * std::acos(cosine));
    }
    return largest;
}

void expect_same_bits(const scene::Gaussians& a, const scene::Gaussians& b) {
    EXPECT_EQ(a.sh_degree, b.sh_degree);
    const auto same = [](const std::vector<float>& x, const std::vector<float>& y) {
        return x.size() == y.size() &&
               (x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof(float)) == 0);
    };
    EXPECT_TRUE(same(a.means, b.means));
    EXPECT_TRUE(same(a.log_scales, b.log_scales));
    EXPECT_TRUE(same(a.rotations, b.rotations));
    EXPECT_TRUE(same(a.opacity_logits, b.opacity_logits));
    EXPECT_TRUE(same(a.sh, b.sh));
}

void expect_prefixes_refused(const io::Buffer& file, const Accepts& accepts) {
    for (std::size_t size = 0; size < file.size(); ++size) {
        const io::Buffer prefix(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(size));
        EXPECT_FALSE(accepts(prefix)) << "the first " << size << " of " << file.size() << " bytes";
    }
}

void parse_damaged(const io::Buffer& file, const Accepts& accepts) {
    for (std::size_t i = 0; i < file.size(); ++i)
        for (const std::byte value : {std::byte{0}, std::byte{255}, file[i] ^ std::byte{16}}) {
            io::Buffer damaged = file;
            damaged[i] = value;
            static_cast<void>(accepts(damaged));
        }
}

io::Buffer bytes_of(const std::string& text) {
    io::Buffer bytes;
    io::put_text(bytes, text);
    return bytes;
}

}  // namespace splat::test
