#include "ops/gather_rows.h"

#include <gtest/gtest.h>

#include "ops/op_harness.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

class GatherRows : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(GatherRows);

/// Against plain loops. The memory after the last row stays unchanged.
void compare(vk::Context& context, const std::vector<std::uint32_t>& index, std::uint32_t length,
             bool fresh) {
    constexpr std::size_t kRows = 300;
    const auto bits = [&](std::uint64_t seed) {
        std::vector<std::uint32_t> words;
        for (const float value : normal_fill(kRows * length, seed))
            words.push_back(std::bit_cast<std::uint32_t>(value));
        words[length - 1] = 0x7FC01234;  // a NaN with a payload
        return words;
    };
    const std::vector<std::uint32_t> old = bits(1), other = bits(2);
    std::vector<std::uint32_t> expected = bits(3);
    const vk::Buffer rows = upload(context, index), x = upload(context, old),
                     from = upload(context, other), y = upload(context, expected);
    vk::Recorder recorder(context);
    const auto count = static_cast<std::uint32_t>(index.size());
    ASSERT_OK(ops::gather_rows(recorder, {count, length}, rows.range(), x.range(),
                               fresh ? from.range() : vk::BufferView(), y.range()));
    vk::CommandList list = std::move(recorder.finish().value());
    ASSERT_OK(context.run(list));
    for (std::size_t i = 0; i < index.size(); ++i)
        for (std::size_t c = 0; c < length; ++c) {
            const std::size_t at = i * length + c;
            expected[at] = index[i] != ops::kNewRow ? old[index[i] * length + c]
                           : fresh                  ? other[at]
                                                    : 0;
        }
    EXPECT_EQ(download_words(context, y.range(), expected.size()), expected)
        << index.size() << " rows of " << length;
}

TEST_P(GatherRows, MatchesPlainLoops) {
    for (const std::uint32_t length : {1U, 3U, 4U, 45U})
        for (const std::size_t count : {1U, 2U, 255U, 300U})
            for (const bool fresh : {false, true}) {
                std::vector<std::uint32_t> index;
                for (std::size_t i = 0; i < count; ++i)
                    index.push_back(i % 5 == 1 ? ops::kNewRow
                                               : static_cast<std::uint32_t>(i * 7 % 300));
                compare(context(), index, length, fresh);
            }
}

TEST_P(GatherRows, RefusesWhatDoesNotFit) {
    const vk::Buffer small = device_buffer(context(), 8), large = device_buffer(context(), 16);
    vk::Recorder recorder(context());
    const auto gather = [&](std::uint32_t rows, const vk::Buffer& index,
                            const vk::BufferView& fresh, const vk::Buffer& y) {
        const vk::Buffer x = device_buffer(context(), 4);
        return ops::gather_rows(recorder, {rows, 2}, index.range(), x.range(), fresh, y.range());
    };
    EXPECT_ERROR(gather(9, small, {}, large), Code::kShape, "index has 32 bytes");
    EXPECT_ERROR(gather(8, small, small.range(), large), Code::kShape, "fresh has 32 bytes");
    EXPECT_ERROR(gather(5, large, large.range(), small), Code::kShape, "y has 32 bytes");
    EXPECT_TRUE(recorder.finish().value().empty()) << "nothing is recorded on error";
}

}  // namespace
}  // namespace splat::test
