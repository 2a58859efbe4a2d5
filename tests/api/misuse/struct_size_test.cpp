// Structs of a caller that knows more, or less, than the library.
#include "api/api_calls.h"

namespace splat::test {
namespace {

/// A struct as a later version of the library may have it.
template <class Known>
struct LaterStruct {
    LaterStruct(const Known& known_members, std::uint64_t first, std::uint64_t second)
        : known(known_members), added{first, second} {
        known.struct_size = sizeof *this;
    }
    Known known;
    std::uint64_t added[2];
};

TEST(ApiStructSize, ALaterStructWithAZeroTailIsTaken) {
    const LaterStruct desc(tensor_desc({2}), 0, 0);
    got(splat_tensor_create, shared_device(), &desc.known);
}

TEST(ApiStructSize, AMemberThatTheLibraryDoesNotKnowIsRefused) {
    for (const std::size_t i : {0, 1}) {
        LaterStruct desc(tensor_desc({2}), 0, 0);
        desc.added[i] = std::uint64_t{1} << 63;
        Tensor tensor;
        EXPECT_REFUSED(splat_tensor_create(shared_device(), &desc.known, tensor.out()),
                       kUnsupported, "splat_tensor_desc.struct_size");
    }
}

TEST(ApiStructSize, TheSameHoldsForStructsOfInputs) {
    const Device device = open_device();
    const LaterStruct input(sized<splat_model_input>(), 0, 1);
    EXPECT_REFUSED(splat_model_forward(make_model(device), &input.known), kUnsupported,
                   "splat_model_input.struct_size");
}

TEST(ApiStructSize, ALaterInfoIsFilledAndItsTailStays) {
    const Tensor tensor = make_tensor(shared_device(), {2, 3});
    LaterStruct info(sized<splat_tensor_info>(), 7, 7);
    ASSERT_DONE(splat_tensor_get_info(tensor, &info.known));
    EXPECT_EQ(info.known.struct_size, sizeof info);
    EXPECT_EQ(info.known.elements, 6U);
    EXPECT_EQ(info.added[0], 7U);
    EXPECT_EQ(info.added[1], 7U);
}

/// A struct that a call fills may hold anything; only its size is read.
TEST(ApiStructSize, AReservedMemberIsRefusedWhereTheStructIsRead) {
    const Dataset dataset = make_dataset();
    const Evaluator evaluator = make_evaluator(dataset);
    const auto refuse = [](auto value, const auto& call, const char* part) {
        value.reserved = 7;
        EXPECT_REFUSED(call(&value), kArgument, std::string(part) + ".reserved");
    };
    refuse(
        sized<splat_evaluated_views>(),
        [&](auto* views) { return splat_evaluator_read(evaluator, 0, views); },
        "splat_evaluated_views");
    EXPECT_TRUE(holds(splat_last_error_message(), "reserved is 7, expected 0"));
    refuse(
        sized<splat_dataset_views>(),
        [&](auto* views) { return splat_dataset_read(dataset, 0, nullptr, 0, views); },
        "splat_dataset_views");
    refuse(
        sized<splat_prediction>(),
        [](auto* made) { return splat_prediction_report(made, nullptr, 0, nullptr); },
        "splat_prediction");
    refuse(
        sized<splat_camera_bytes>(),
        [](auto* files) { return splat_camera_load_memory(files, nullptr, nullptr, 0, nullptr); },
        "splat_camera_bytes");
    Weights weights;
    refuse(
        named_array("a", {}, {}),
        [&](auto* array) { return splat_weights_from_arrays(array, 1, weights.out()); },
        "arrays[0]");
    auto batch = sized<splat_trainer_batch>();
    batch.reserved = 1;
    EXPECT_DONE(splat_batches_next(make_batches(), 0, &batch));
    EXPECT_EQ(batch.reserved, 0U);
    batch.reserved = 1;
    const Device device = open_device();
    auto info = sized<splat_trainer_info>();
    EXPECT_REFUSED(splat_trainer_step(make_trainer(device), &batch, &info), kArgument,
                   "splat_trainer_batch.reserved");
}

TEST(ApiStructSize, ATailOfAStructThatIsFilledMayHoldAnything) {
    const Batches batches = make_batches();
    LaterStruct batch(sized<splat_trainer_batch>(), 7, 7);
    ASSERT_DONE(splat_batches_next(batches, 0, &batch.known));
    EXPECT_NE(batch.known.images, nullptr);
    EXPECT_EQ(batch.added[0], 7U);
    const Dataset dataset = make_dataset();
    LaterStruct summary(sized<splat_evaluation_summary>(), 7, 7);
    EXPECT_DONE(splat_evaluator_summary(make_evaluator(dataset), &summary.known));
    EXPECT_EQ(summary.added[1], 7U);
}

}  // namespace
}  // namespace splat::test
