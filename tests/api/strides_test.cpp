// Strided host memory, through splat_tensor_write and splat_tensor_read.
#include <numeric>

#include "api/api_calls.h"

namespace splat::test {
namespace {

Floats numbers(std::size_t count) {
    Floats values(count);
    std::iota(values.begin(), values.end(), 1.0F);
    return values;
}

struct Layout {
    Dims dims;
    Dims strides;
    std::size_t span;  ///< elements of host memory that the layout spans
};

/// Place in host memory of row-major element i.
std::size_t place(const Layout& layout, std::size_t i) {
    std::int64_t at = 0;
    for (std::size_t axis = layout.dims.size(); axis-- > 0;) {
        const auto dim = static_cast<std::size_t>(layout.dims[axis]);
        at += static_cast<std::int64_t>(i % dim) * layout.strides[axis];
        i /= dim;
    }
    return static_cast<std::size_t>(at);
}

const Layout kDistinct[] = {
    {{4, 5}, {5, 1}, 20},         // the default
    {{4, 5}, {1, 4}, 20},         // transposed
    {{2, 3, 4}, {1, 2, 6}, 24},   // fully reversed
    {{2, 3, 4}, {12, 1, 3}, 24},  // NHWC of one kind
    {{4, 5}, {8, 1}, 29},         // rows padded
    {{4, 5}, {16, 3}, 61},        // columns padded too
    {{3, 1, 2}, {2, 99, 1}, 6},   // any stride where there is one element
    {{1, 1}, {0, 0}, 1},          // no stride where there is one element
    {{2, 2}, {3, 2}, 6},          // steps over what the smaller stride spans
    {{2, 2, 2, 2, 2, 2, 2, 2}, {1, 2, 4, 8, 16, 32, 64, 128}, 256},
};

TEST(Strides, WriteGathersAndReadScatters) {
    for (const Layout& layout : kDistinct) {
        const Tensor tensor = make_tensor(shared_device(), layout.dims);
        const Floats host = numbers(layout.span);
        ASSERT_DONE(
            splat_tensor_write(tensor, host.data(), host.size() * 4, layout.strides.data()));
        const Floats flat = download(tensor);
        for (std::size_t i = 0; i < flat.size(); ++i)
            ASSERT_EQ(flat[i], host[place(layout, i)]) << i;
        Floats back(layout.span, -1.0F);
        ASSERT_DONE(splat_tensor_read(tensor, back.data(), back.size() * 4, layout.strides.data()));
        Floats expected(layout.span, -1.0F);
        for (std::size_t i = 0; i < flat.size(); ++i) expected[place(layout, i)] = flat[i];
        EXPECT_EQ(back, expected) << "and the padding is left alone";
    }
}

TEST(Strides, ScalarNeedsNone) {
    const Tensor scalar = make_tensor(shared_device(), {});
    const float value = 3;
    const std::int64_t unused = -7;
    EXPECT_DONE(splat_tensor_write(scalar, &value, sizeof value, &unused));
    float back = 0;
    EXPECT_DONE(splat_tensor_read(scalar, &back, sizeof back, &unused));
    EXPECT_EQ(back, value);
}

TEST(Strides, ZeroRepeatsOnWrite) {
    const Tensor tensor = make_tensor(shared_device(), {2, 3});
    const Floats row = {1, 2, 3};
    const std::int64_t rows[] = {0, 1};
    ASSERT_DONE(splat_tensor_write(tensor, row.data(), 12, rows));
    EXPECT_EQ(download(tensor), (Floats{1, 2, 3, 1, 2, 3}));
    const std::int64_t all[] = {0, 0};
    ASSERT_DONE(splat_tensor_write(tensor, row.data() + 1, 4, all));
    EXPECT_EQ(download(tensor), Floats(6, 2.0F));
    const std::int64_t overlapping[] = {1, 1};
    const Floats window = {1, 2, 3, 4};
    ASSERT_DONE(splat_tensor_write(tensor, window.data(), 16, overlapping));
    EXPECT_EQ(download(tensor), (Floats{1, 2, 3, 2, 3, 4}));
}

TEST(Strides, FromHostTakesThemToo) {
    const splat_tensor_desc desc = tensor_desc({2, 2});
    const Floats host = {1, 2, 3, 4};
    const std::int64_t transposed[] = {1, 2};
    const Tensor tensor =
        got(splat_tensor_from_host, shared_device(), &desc, host.data(), 16, transposed);
    EXPECT_EQ(download(tensor), (Floats{1, 3, 2, 4}));
}

/// Write, read and from_host refuse it, and nothing changes.
void expect_refused(const Dims& dims, const Dims& strides, std::size_t bytes,
                    const std::string& part, bool on_write = true) {
    const Floats before = numbers(64);
    const Tensor tensor = make_tensor(shared_device(), dims);
    std::size_t elements = 1;
    for (const std::int64_t dim : dims) elements *= static_cast<std::size_t>(dim);
    ASSERT_DONE(splat_tensor_write(tensor, before.data(), elements * 4, nullptr));
    Floats host(64, -5.0F);
    EXPECT_REFUSED(splat_tensor_read(tensor, host.data(), bytes, strides.data()), kArgument, part);
    EXPECT_EQ(host, Floats(64, -5.0F));
    if (!on_write) return;
    EXPECT_REFUSED(splat_tensor_write(tensor, host.data(), bytes, strides.data()), kArgument, part);
    EXPECT_EQ(download(tensor),
              Floats(before.begin(), before.begin() + static_cast<std::ptrdiff_t>(elements)));
    const splat_tensor_desc desc = tensor_desc(dims);
    Output<splat_tensor> created;
    EXPECT_REFUSED(splat_tensor_from_host(shared_device(), &desc, host.data(), bytes,
                                          strides.data(), created.out()),
                   kArgument, part);
    EXPECT_TRUE(created.untouched());
}

TEST(Strides, NegativeOnesAreRefused) {
    expect_refused({4, 5}, {-5, 1}, 80, "strides[0] is -5");
    expect_refused({4, 5}, {5, -1}, 80, "strides[1] is -1");
    expect_refused({1, 5}, {INT64_MIN, 1}, 80, "strides[0]");
}

TEST(Strides, TooFewBytesAreRefused) {
    expect_refused({4, 5}, {5, 1}, 79, "takes 80");
    expect_refused({4, 5}, {5, 1}, 0, "bytes is 0");
    expect_refused({4, 5}, {8, 1}, 115, "takes 116");
    expect_refused({2, 3}, {100, 1}, 256, "takes 412");
}

TEST(Strides, BeyondTheAddressSpaceIsRefused) {
    const std::size_t any = std::size_t{0} - 1;
    expect_refused({4, 5}, {INT64_MAX, 1}, any, "strides[0]");
    expect_refused({2, 2}, {INT64_MAX / 4 + 1, INT64_MAX / 4 + 1}, any, "strides[1]");
    expect_refused({3}, {INT64_MAX / 2}, 256, "");
}

TEST(Strides, OverlapIsRefusedOnRead) {
    expect_refused({2, 3}, {0, 1}, 24, "one place", false);
    expect_refused({2, 3}, {1, 0}, 24, "one place", false);
    expect_refused({2, 3}, {1, 1}, 24, "one place", false);
    expect_refused({2, 3}, {2, 1}, 24, "one place", false);
    expect_refused({3, 2}, {1, 2}, 24, "one place", false);
    expect_refused({2, 2, 2}, {4, 4, 1}, 64, "one place", false);
}

TEST(Strides, MoreBytesThanNeededAreFine) {
    const Tensor tensor = make_tensor(shared_device(), {2});
    const Floats host = {1, 2, 3, 4};
    write(tensor, host);
    Floats back(4, -1.0F);
    EXPECT_DONE(splat_tensor_read(tensor, back.data(), 16, nullptr));
    EXPECT_EQ(back, (Floats{1, 2, -1, -1}));
}

TEST(Strides, LargeTensorsToo) {
    const std::int64_t rows = 512;
    const std::int64_t columns = 3000;
    const Floats host = numbers(static_cast<std::size_t>(rows * columns));
    const Tensor tensor = make_tensor(shared_device(), {columns, rows});
    const std::int64_t transposed[] = {1, columns};
    ASSERT_DONE(splat_tensor_write(tensor, host.data(), host.size() * 4, transposed));
    const Floats flat = download(tensor);
    EXPECT_EQ(flat[1], host[3000]);
    Floats back(host.size());
    ASSERT_DONE(splat_tensor_read(tensor, back.data(), back.size() * 4, transposed));
    EXPECT_EQ(back, host);
}

}  // namespace
}  // namespace splat::test
