// The rasterizer's sort gives exactly the order of std::stable_sort.
#include "raster/radix_sort.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "ops/op_harness.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

using Words = std::vector<std::uint32_t>;

constexpr std::uint32_t kLeftOut = 0xFFFFFFFFU;

/// Kinds of keys, each of which is hard to sort for another reason.
enum class Keys { kRandom, kConstant, kSorted, kReversed, kFew, kLeftOutSome, kLeftOutAll };
constexpr Keys kAllKeys[] = {Keys::kRandom, Keys::kConstant,    Keys::kSorted,    Keys::kReversed,
                             Keys::kFew,    Keys::kLeftOutSome, Keys::kLeftOutAll};

Words make_keys(Keys kind, std::size_t count, std::uint32_t bits) {
    Rng rng(count + bits);
    const std::uint64_t range = std::uint64_t{1} << bits;
    Words keys(count);
    for (std::uint32_t& key : keys) key = static_cast<std::uint32_t>(rng.below(range));
    if (kind == Keys::kConstant) std::fill(keys.begin(), keys.end(), range / 2 & 0xFFFFFFFFU);
    if (kind == Keys::kSorted) std::sort(keys.begin(), keys.end());
    if (kind == Keys::kReversed) std::sort(keys.rbegin(), keys.rend());
    for (std::uint32_t& key : keys) {
        if (kind == Keys::kFew)
            key = static_cast<std::uint32_t>(range - 1 - key % 3) & (kLeftOut - 1);
        if (kind == Keys::kLeftOutSome && rng.below(3) == 0) key = kLeftOut;
        if (kind == Keys::kLeftOutAll) key = kLeftOut;
    }
    return keys;
}

struct Sorted {
    Words keys;
    Words values;
    Words seconds;  ///< may be empty
};

/// The value of an entry. The second value is its complement.
std::uint32_t value_of(std::uint32_t position) {
    return position * 2654435761U;
}

Sorted expected_of(const Words& keys, std::size_t entries) {
    Sorted sorted;
    for (std::size_t i = 0; i < entries; ++i)
        if (keys[i] != kLeftOut) sorted.values.push_back(static_cast<std::uint32_t>(i));
    std::stable_sort(sorted.values.begin(), sorted.values.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
    for (const std::uint32_t i : sorted.values) sorted.keys.push_back(keys[i]);
    return sorted;
}

class RadixSort : public KernelsTest {
  protected:
    /// Sorts the first `entries` of the keys, in arrays that hold them all.
    Sorted sort(const Words& keys, std::size_t entries, std::uint32_t bits, bool second) {
        const raster::RadixSortDesc desc = {
            static_cast<std::uint32_t>(std::max<std::size_t>(keys.size(), 1)), bits, second};
        vk::Recorder recorder(context());
        Words words, complements;
        for (std::uint32_t i = 0; i < keys.size(); ++i) {
            words.insert(words.end(), {keys[i], value_of(i)});
            complements.push_back(~value_of(i));
        }
        const std::size_t size = 2 * raster::radix_sort_entries(desc.capacity);
        const vk::Buffer input = device_buffer(context(), size);
        const vk::Buffer sides[2] = {device_buffer(context(), size),
                                     device_buffer(context(), size)};
        const std::size_t second_size = second ? desc.capacity : 4;
        const vk::Buffer seconds[2] = {device_buffer(context(), second_size),
                                       device_buffer(context(), second_size)};
        const vk::Buffer& from = bits == 32 ? input : sides[1];
        if (!words.empty()) {
            EXPECT_OK(context().write(from.range(), words.data(), words.size() * 4));
        }
        if (second && !words.empty()) {
            EXPECT_OK(context().write(seconds[1].range(), complements.data(), words.size() * 2));
        }
        const auto space = need(raster::allocate_radix_sort(context(), desc));
        const vk::Buffer count = upload(context(), Words{static_cast<std::uint32_t>(entries)});
        const vk::Buffer kept = device_buffer(context(), 1);
        EXPECT_OK(raster::radix_sort(recorder, desc,
                                     {from.range(),
                                      {sides[0].range(), sides[1].range()},
                                      {seconds[0].range(), seconds[1].range()},
                                      count.range(),
                                      kept.range()},
                                     space));
        const std::uint32_t side = raster::radix_sort_side(recorder, desc);
        auto list = need(recorder.finish());
        EXPECT_OK(context().run(list));
        const std::size_t stayed = download_words(context(), kept.range(), 1)[0];
        EXPECT_LE(stayed, entries);
        const std::size_t n = std::min(stayed, entries);
        const Words got = download_words(context(), sides[side].range(), 2 * n);
        Sorted sorted;
        for (std::size_t i = 0; i < got.size(); i += 2) {
            sorted.keys.push_back(got[i]);
            sorted.values.push_back(got[i + 1]);
        }
        sorted.seconds = download_words(context(), seconds[side].range(), second ? n : 0);
        return sorted;
    }

    void expect_sorted(const Words& keys, std::size_t entries, std::uint32_t bits,
                       const std::string& what, bool second = false) {
        const Sorted got = sort(keys, entries, bits, second);
        Sorted expected = expected_of(keys, entries);
        // Not EXPECT_EQ, which would print millions of numbers.
        EXPECT_EQ(got.values.size(), expected.values.size()) << what << ": entries that stayed";
        EXPECT_TRUE(got.keys == expected.keys) << what << ": keys";
        for (std::uint32_t& value : expected.values) value = value_of(value);
        EXPECT_TRUE(got.values == expected.values) << what << ": order";
        if (!second) return;
        for (std::uint32_t& value : expected.values) value = ~value;
        EXPECT_TRUE(got.seconds == expected.values) << what << ": second values";
    }

    /// A sort of millions takes minutes there; small sizes run everywhere.
    [[nodiscard]] bool is_gpu_on_cpu() const {
        return GetParam() == vk::Kernels::kGpu &&
               context().device().info().kind == vk::DeviceKind::kCpu;
    }

    void expect_all_kinds(std::size_t count, std::uint32_t bits) {
        for (const Keys kind : kAllKeys)
            expect_sorted(make_keys(kind, count, bits), count, bits,
                          std::to_string(count) + " keys of kind " +
                              std::to_string(static_cast<int>(kind)) + ", " + std::to_string(bits) +
                              " bits");
    }
};
SPLAT_INSTANTIATE_KERNELS(RadixSort);

TEST_P(RadixSort, IsStableAtEverySize) {
    for (const std::size_t count : {0, 1, 2, 31, 255, 256, 257, 1023, 4097, 65537, 200003})
        expect_all_kinds(count, 32);
}

TEST_P(RadixSort, TakesKeysOfSomeWidths) {
    for (const std::uint32_t bits : {1U, 4U, 5U, 8U, 9U, 13U, 17U}) expect_all_kinds(1500, bits);
}

TEST_P(RadixSort, SortsFewerEntriesThanItHolds) {
    const Words keys = make_keys(Keys::kLeftOutSome, 40000, 32);
    for (const std::size_t entries : {0, 1, 7, 257, 30011, 39999})
        expect_sorted(keys, entries, 32, std::to_string(entries) + " of 40000");
}

TEST_P(RadixSort, CarriesASecondValue) {
    for (const std::size_t count : {1, 3, 257, 20001})
        for (const std::uint32_t bits : {7U, 13U, 20U})
            for (const Keys kind : {Keys::kRandom, Keys::kFew, Keys::kLeftOutSome}) {
                const std::string what =
                    std::to_string(count) + " keys of " + std::to_string(bits) + " bits";
                expect_sorted(make_keys(kind, count, bits), count, bits, what, true);
                expect_sorted(make_keys(kind, count, bits), count - 1, bits, what, true);
            }
}

/// Digits cover the bits in which keys differ, also for close keys anywhere in the range.
TEST_P(RadixSort, TakesKeysOfAnyRange) {
    for (const std::uint32_t bits : {0U, 1U, 3U, 7U, 8U, 9U, 10U, 18U, 24U, 25U, 27U, 28U, 31U})
        for (const std::uint32_t low : {0U, 0x3F7FFFF0U, 0x7FFFFFFFU}) {
            Words keys = make_keys(Keys::kRandom, 2500, bits);
            for (std::size_t i = 0; i < keys.size(); ++i) {
                keys[i] = i == 1700 ? low : std::min(low + keys[i], kLeftOut - 1);
                if (i % 5 == 2) keys[i] = kLeftOut;
            }
            expect_sorted(keys, keys.size(), 32,
                          std::to_string(bits) + " bits from " + std::to_string(low));
        }
}

class RadixSortFull : public RadixSort {};
SPLAT_INSTANTIATE_KERNELS(RadixSortFull);

TEST_P(RadixSortFull, TakesKeysOfEveryWidth) {
    for (std::uint32_t bits = 1; bits <= 32; ++bits) expect_all_kinds(3001, bits);
}

/// One more than one workgroup of 256 for each of the 65535 that a dispatch may have.
TEST_P(RadixSortFull, SortsMoreThanOneDispatchOfWorkgroups) {
    if (is_gpu_on_cpu()) GTEST_SKIP() << "kernels for GPUs take minutes on a CPU device";
    constexpr std::size_t kCount = std::size_t{65535} * 256 + 1;
    expect_sorted(make_keys(Keys::kRandom, kCount, 32), kCount, 32, "65535 * 256 + 1 random keys");
    // Ranks of all 16 bits.
    expect_sorted(make_keys(Keys::kConstant, kCount, 8), kCount, 8, "65535 * 256 + 1 equal keys");
}

TEST_P(RadixSortFull, SortsTheLongestChunks) {
    if (is_gpu_on_cpu()) GTEST_SKIP() << "kernels for GPUs take minutes on a CPU device";
    constexpr std::size_t kCount =
        8388607;  // 128 chunks of 65536 on CPU devices, the last one shorter
    expect_sorted(make_keys(Keys::kConstant, kCount, 8), kCount, 8, "8388607 equal keys");
}

TEST_P(RadixSortFull, SortsTenMillion) {
    if (is_gpu_on_cpu()) GTEST_SKIP() << "kernels for GPUs take minutes on a CPU device";
    constexpr std::size_t kCount = 10000000;
    for (const Keys kind : {Keys::kReversed, Keys::kFew, Keys::kLeftOutSome})
        expect_sorted(make_keys(kind, kCount, 20), kCount, 20, "10^7 keys");
    expect_sorted(make_keys(Keys::kRandom, kCount, 13), kCount, 13, "with second values", true);
}

}  // namespace
}  // namespace splat::test
