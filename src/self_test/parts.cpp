#include "self_test/parts.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace splat::self_test {

Floats integers(std::size_t count, std::uint32_t seed) {
    Floats values(count);
    std::uint32_t state = seed;
    for (float& value : values) {
        state = state * 1664525U + 1013904223U;  // Numerical Recipes, section 7.1
        value = static_cast<float>(static_cast<int>(state >> 28) - 8);
    }
    return values;
}

Doubles wide(const Floats& values) {
    return Doubles(values.begin(), values.end());
}

double distance(const Floats& a, const Doubles& b) {
    double most = 0;
    for (std::size_t i = 0; i < b.size(); ++i) {
        const double each = std::abs(wide(a[i]) - b[i]);
        if (!(each <= most))
            most = std::isnan(each) ? std::numeric_limits<double>::infinity() : each;
    }
    return most;
}

Floats to_quads(const Floats& rows, std::size_t c, std::size_t p) {
    Floats quads((c + 3) / 4 * p * 4, 0.0F);
    for (std::size_t i = 0; i < c; ++i)
        for (std::size_t j = 0; j < p; ++j) quads[(i / 4 * p + j) * 4 + i % 4] = rows[i * p + j];
    return quads;
}

Result<vk::BufferView> Trial::put(const Floats& values) {
    SPLAT_ASSIGN(const vk::BufferView view, room(values.size() * 4));
    SPLAT_TRY(context_.write(view, values.data(), values.size() * 4));
    return view;
}

Result<vk::BufferView> Trial::room(std::uint64_t bytes) {
    SPLAT_ASSIGN(vk::Buffer buffer,
                 context_.memory().allocate(std::max<std::uint64_t>(bytes, 16),
                                            vk::MemoryKind::kDevice, "self-test"));
    buffers_.push_back(std::move(buffer));
    return buffers_.back().range();
}

Status Trial::run() {
    SPLAT_ASSIGN(vk::CommandList list, recorder_.finish());
    return context_.run(list);
}

Result<Floats> Trial::get(const vk::BufferView& view, std::size_t count) {
    Floats values(count);
    SPLAT_TRY(context_.read(view, values.data(), count * 4));
    return values;
}

Result<double> Trial::error(const vk::BufferView& view, std::size_t c, std::size_t p,
                            const Doubles& expected) {
    SPLAT_ASSIGN(const Floats quads, get(view, (c + 3) / 4 * 4 * p));
    Floats rows(c * p);
    for (std::size_t i = 0; i < c; ++i)
        for (std::size_t j = 0; j < p; ++j) rows[i * p + j] = quads[(i / 4 * p + j) * 4 + i % 4];
    return distance(rows, expected);
}

}  // namespace splat::self_test
