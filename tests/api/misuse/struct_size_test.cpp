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
                       kUnsupported, "splat_tensor_desc.struct_size");
    }
}

TEST(ApiStructSize, TheSameHoldsForStructsOfInputs) {
    const Device device = open_device();
    const Model model = make_model(device);
    LaterStruct<splat_model_input> input = {sized<splat_model_input>(), {0, 1}};
    input.known.struct_size = sizeof input;
    EXPECT_REFUSED(splat_model_forward(model, &input.known), kUnsupported,
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

/// A struct that a call fills may hold anything; only its size is read.
TEST(ApiStructSize, AReservedMemberIsRefusedWhereTheStructIsRead) {
    const Dataset dataset = make_dataset();
    const Evaluator evaluator = make_evaluator(dataset);
    auto evaluated = sized<splat_evaluated_views>();
    evaluated.reserved = 7;
    EXPECT_REFUSED(splat_evaluator_read(evaluator, 0, &evaluated), kArgument,
                   "splat_evaluated_views.reserved is 7, expected 0");
    auto views = sized<splat_dataset_views>();
    views.reserved = 1;
    EXPECT_REFUSED(splat_dataset_read(dataset, 0, nullptr, 0, &views), kArgument,
                   "splat_dataset_views.reserved");
    auto prediction = sized<splat_prediction>();
    prediction.reserved = 1;
    EXPECT_REFUSED(splat_prediction_report(&prediction, nullptr, 0, nullptr), kArgument,
                   "splat_prediction.reserved");
    auto files = sized<splat_camera_bytes>();
    files.reserved = 1;
    EXPECT_REFUSED(splat_camera_load_memory(&files, nullptr, nullptr, 0, nullptr), kArgument,
                   "splat_camera_bytes.reserved");
    splat_named_array array{};
    array.name = "a";
    array.reserved = 1;
    Weights weights;
    EXPECT_REFUSED(splat_weights_from_arrays(&array, 1, weights.out()), kArgument,
                   "arrays[0].reserved");
    splat_scene_desc scene = sized<splat_scene_desc>();
    scene.reserved = 1;
    Scene made;
    EXPECT_REFUSED(splat_scene_create(&scene, made.out()), kArgument, "splat_scene_desc.reserved");
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
    LaterStruct<splat_trainer_batch> batch = {sized<splat_trainer_batch>(), {7, 7}};
    batch.known.struct_size = sizeof batch;
    ASSERT_DONE(splat_batches_next(batches, 0, &batch.known));
    EXPECT_NE(batch.known.images, nullptr);
    EXPECT_EQ(batch.added[0], 7U);
    const Dataset dataset = make_dataset();
    LaterStruct<splat_evaluation_summary> summary = {sized<splat_evaluation_summary>(), {7, 7}};
    summary.known.struct_size = sizeof summary;
    EXPECT_DONE(splat_evaluator_summary(make_evaluator(dataset), &summary.known));
    EXPECT_EQ(summary.added[1], 7U);
}

}  // namespace
}  // namespace splat::test
