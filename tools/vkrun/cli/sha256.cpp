#include "vkrun/cli/sha256.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <vector>

#include "vkrun/cli/failure.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/text.h"

namespace vkrun {
namespace {

/// Fractions of the cube roots of the first 64 primes.
constexpr std::array<std::uint32_t, 64> kRound = {
    0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5,
    0xd807aa98, 0x12835b01, 0x243185be, 0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174,
    0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa, 0x5cb0a9dc, 0x76f988da,
    0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967,
    0x27b70a85, 0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85,
    0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3, 0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070,
    0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f, 0x682e6ff3,
    0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2};

std::uint32_t big_endian(const std::uint8_t* at) {
    return std::uint32_t{at[0]} << 24U | std::uint32_t{at[1]} << 16U | std::uint32_t{at[2]} << 8U |
           std::uint32_t{at[3]};
}

}  // namespace

void Sha256::take_block(const std::uint8_t* block) {
    std::array<std::uint32_t, 64> w{};
    for (std::size_t i = 0; i < 16; ++i) w[i] = big_endian(block + 4 * i);
    for (std::size_t i = 16; i < 64; ++i) {
        const std::uint32_t a = w[i - 15], b = w[i - 2];
        w[i] = w[i - 16] + (std::rotr(a, 7) ^ std::rotr(a, 18) ^ a >> 3U) + w[i - 7] +
               (std::rotr(b, 17) ^ std::rotr(b, 19) ^ b >> 10U);
    }
    auto [a, b, c, d, e, f, g, h] = state_;
    for (std::size_t i = 0; i < 64; ++i) {
        const std::uint32_t t1 = h + (std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25)) +
                                 ((e & f) ^ (~e & g)) + kRound[i] + w[i];
        const std::uint32_t t2 =
            (std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22)) + ((a & b) ^ (a & c) ^ (b & c));
        h = g;
        g = f;
        f = e;
        e = d + t1;
        d = c;
        c = b;
        b = a;
        a = t1 + t2;
    }
    const std::array<std::uint32_t, 8> now{a, b, c, d, e, f, g, h};
    for (std::size_t i = 0; i < 8; ++i) state_[i] += now[i];
}

void Sha256::add(const void* data, std::size_t bytes) {
    const auto* at = static_cast<const std::uint8_t*>(data);
    while (bytes > 0) {
        const std::size_t filled = bytes_ % kBlock;
        const std::size_t part = std::min(bytes, kBlock - filled);
        if (part == kBlock) {
            take_block(at);
        } else {
            std::memcpy(rest_.data() + filled, at, part);
            if (filled + part == kBlock) take_block(rest_.data());
        }
        at += part;
        bytes -= part;
        bytes_ += part;
    }
}

std::string Sha256::text() {
    const std::uint64_t bits = 8 * bytes_;
    constexpr std::uint8_t kEnd = 0x80, kZero = 0;
    add(&kEnd, 1);
    while (bytes_ % kBlock != kBlock - sizeof bits) add(&kZero, 1);
    for (std::size_t i = 0; i < sizeof bits; ++i) {
        const auto byte = static_cast<std::uint8_t>(bits >> (56 - 8 * i));
        add(&byte, 1);
    }
    std::string digits;
    for (const std::uint32_t word : state_) digits += format("%08x", word);
    return digits;
}

std::string sha256_of_file(const std::string& path) {
    std::ifstream file = open_to_read(path);
    Sha256 hash;
    std::vector<char> part(std::size_t{1} << 20U);
    while (file) {
        file.read(part.data(), static_cast<std::streamsize>(part.size()));
        hash.add(part.data(), static_cast<std::size_t>(file.gcount()));
    }
    if (!file.eof()) throw Failure(kBadData, "cannot read '" + path + "' to its end");
    return hash.text();
}

}  // namespace vkrun
