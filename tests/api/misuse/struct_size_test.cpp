// Structs of a caller that knows more, or less, than the library.
#include "api/api_calls.h"

namespace splat::test {
namespace {

/// A struct as a later version of the library may have it.
template <class Known>
struct LaterStruct {
    Known known;
    std::uint64_t added[2];
};

TEST(ApiStructSize, ALaterStructWithAZeroTailIsTaken) {
    LaterStruct<splat_tensor_desc> desc = {tensor_desc({2}), {0, 0}};
    desc.known.struct_size = sizeof desc;
    Tensor tensor;
    EXPECT_DONE(splat_tensor_create(shared_device(), &desc.known, tensor.out()));
}

TEST(ApiStructSize, AMemberThatTheLibraryDoesNotKnowIsRefused) {
    for (const std::size_t i : {0, 1}) {
        LaterStruct<splat_tensor_desc> desc = {tensor_desc({2}), {0, 0}};
        desc.known.struct_size = sizeof desc;
        desc.added[i] = std::uint64_t{1} << 63;
        Tensor tensor;
        EXPECT_REFUSED(splat_tensor_create(shared_device(), &desc.known, tensor.out()),
                       SPLAT_ERROR_UNSUPPORTED, "splat_tensor_desc.struct_size");
    }
}

TEST(ApiStructSize, TheSameHoldsForStructsOfInputs) {
    const Device device = open_device();
    const Model model = make_model(device);
    LaterStruct<splat_model_input> input = {sized<splat_model_input>(), {0, 1}};
    input.known.struct_size = sizeof input;
    EXPECT_REFUSED(splat_model_forward(model, &input.known), SPLAT_ERROR_UNSUPPORTED,
                   "splat_model_input.struct_size");
}

TEST(ApiStructSize, ALaterInfoIsFilledAndItsTailStays) {
    const Tensor tensor = make_tensor(shared_device(), {2, 3});
    LaterStruct<splat_tensor_info> info = {sized<splat_tensor_info>(), {7, 7}};
    info.known.struct_size = sizeof info;
    ASSERT_DONE(splat_tensor_get_info(tensor, &info.known));
    EXPECT_EQ(info.known.struct_size, sizeof info);
    EXPECT_EQ(info.known.elements, 6U);
    EXPECT_EQ(info.added[0], 7U);
    EXPECT_EQ(info.added[1], 7U);
}

}  // namespace
}  // namespace splat::test
