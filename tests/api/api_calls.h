#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "splat.h"

/// Shared by all tests of the C API. Uses only the header of the library.
namespace splat::test {

/// Expects SPLAT_OK; a failure shows the code and its text.
testing::AssertionResult succeeded(splat_result got);

/// Expects this code, and `part` in the text of the last error.
testing::AssertionResult refused(splat_result got, splat_result expected, const std::string& part);

#define EXPECT_DONE(call) EXPECT_TRUE(::splat::test::succeeded(call))
#define ASSERT_DONE(call) ASSERT_TRUE(::splat::test::succeeded(call))
#define EXPECT_REFUSED(call, code, part) EXPECT_TRUE(::splat::test::refused(call, code, part))

/// A zeroed struct with its size set.
template <class Struct>
Struct sized() {
    Struct made;
    std::memset(&made, 0, sizeof made);
    made.struct_size = sizeof made;
    return made;
}

/// Planes [3,side,side] as a picture that is read.
inline splat_image planes_image(const float* planes, std::uint32_t side) {
    const std::int64_t row = std::int64_t{sizeof(float)} * side;
    return {const_cast<float*>(planes),
            3 * sizeof(float) * side * side,
            SPLAT_PIXEL_F32,
            side,
            side,
            3,
            row,
            sizeof(float),
            row * side};
}

/// Owns a handle. A destroy that fails also fails the test.
template <class Handle, splat_result (*Destroy)(Handle)>
class Owned {
  public:
    Owned() = default;
    Owned(Owned&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
    Owned& operator=(Owned&& other) noexcept {
        std::swap(handle_, other.handle_);
        return *this;
    }
    Owned(const Owned&) = delete;
    Owned& operator=(const Owned&) = delete;
    ~Owned() { destroy(); }

    operator Handle() const { return handle_; }
    [[nodiscard]] Handle get() const { return handle_; }

    /// For a create function to store its handle in.
    Handle* out() {
        destroy();
        return &handle_;
    }

    /// Destroys it now; returns the stale handle.
    Handle destroy() {
        const Handle stale = std::exchange(handle_, nullptr);
        if (stale == nullptr) return stale;
        EXPECT_EQ(Destroy(stale), SPLAT_OK);
        return stale;
    }

  private:
    Handle handle_ = nullptr;
};

using Device = Owned<splat_device, splat_device_destroy>;
using Tensor = Owned<splat_tensor, splat_tensor_destroy>;
using Op = Owned<splat_op, splat_op_destroy>;
using Scene = Owned<splat_scene, splat_scene_destroy>;
using Optimizer = Owned<splat_optimizer, splat_optimizer_destroy>;
using Rasterizer = Owned<splat_rasterizer, splat_rasterizer_destroy>;
using RasterState = Owned<splat_raster_state, splat_raster_state_destroy>;
using Weights = Owned<splat_weights, splat_weights_destroy>;
using Model = Owned<splat_model, splat_model_destroy>;
using Module = Owned<splat_module, splat_module_destroy>;
using Trainer = Owned<splat_trainer, splat_trainer_destroy>;
using Lpips = Owned<splat_lpips, splat_lpips_destroy>;
using Dataset = Owned<splat_dataset, splat_dataset_destroy>;
using Evaluator = Owned<splat_evaluator, splat_evaluator_destroy>;
using Comparison = Owned<splat_comparison, splat_comparison_destroy>;
using Predictor = Owned<splat_predictor, splat_predictor_destroy>;
using Batches = Owned<splat_batches, splat_batches_destroy>;
using Training = Owned<splat_run, splat_run_destroy>;
using Dims = std::vector<std::int64_t>;

/// Defaults, but without a pipeline cache file.
splat_device_desc device_desc(std::uint32_t flags = 0);
Device open_device(std::uint32_t flags = 0);
Device open_device(const splat_device_desc& desc);

/// One device for the whole program, opened on first use and closed after the last test. It runs
/// plain kernels: the fast ones of linear take a minute to compile under GPU-assisted validation.
splat_device shared_device();

splat_tensor_desc tensor_desc(const Dims& dims, const char* name = nullptr,
                              splat_dtype dtype = SPLAT_DTYPE_F32);
Tensor make_tensor(splat_device device, const Dims& dims, const char* name = nullptr,
                   splat_dtype dtype = SPLAT_DTYPE_F32);
Tensor upload(splat_device device, const Dims& dims, const std::vector<float>& values,
              const char* name = nullptr);
std::vector<float> download(splat_tensor tensor);

/// Two tensors, "a" = [[1, 2], [3, 4]] and "b" = 0.5 as float16 in the file, with metadata {"k":
/// "v"}.
Weights make_weights();

/// A file with one tensor, "w" [300,1000], whose data are used in the file.
std::vector<float> write_large_weights(const std::string& path);

/// A folder of procedural cars of 8 x 8 pixels, two to train on with 3 views and one to test on
/// with 2; written on first use and removed at the end of the program.
const char* data_folder();
splat_synthetic_desc synthetic_desc(const char* path);
splat_dataset_desc dataset_desc();
Dataset make_dataset();

/// The same data as the networks of trainer_desc() take it.
Dataset make_training_dataset();
Batches make_batches();

/// A new folder for a run, which is removed at the end of the program.
std::string run_folder();
/// Two steps of trainer_desc() on that data; `folder` lives as long as the desc.
splat_training_desc training_desc(splat_dataset dataset, const std::string& folder);
Training make_training(const Device& device);

/// A model of 16 x 16 pixels, two levels and attention at 8: its configuration and description.
inline constexpr const char* kSmallModel =
    "model: {base_dim: 8, num_blocks: 1, channel_mult: [1, 2], attention_resolutions: [8]}\n"
    "data:\n"
    "  training_resolution: 16";
splat_model_desc model_desc();
Model make_model(const Device& device);

/// A predictor of such a model with random weights, for white backgrounds.
Predictor make_predictor(const Device& device);
Predictor make_predictor(const Device& device, const Model& model);
/// A port of a splat_module_desc.
splat_port port_desc(const Dims& dims, const char* name);

/// An evaluator of the caller's images of a data set.
Evaluator make_evaluator(splat_dataset dataset);

/// Two methods on the objects "x" and "y".
splat_compare_desc compare_desc();
Comparison make_comparison();

/// silu of "x" [1,4], and its description; the port lives as long as the program.
splat_module_desc module_desc();
Module make_module(const Device& device);

/// A trainer of the same model, two objects with two targets a step.
splat_trainer_desc trainer_desc();
Trainer make_trainer(const Device& device);

/// A batch for it: grey images, all from the first camera.
struct TrainerBatch {
    TrainerBatch();
    [[nodiscard]] splat_trainer_batch desc() const;

    std::vector<float> images, targets, poses, quaternions;
    std::vector<splat_camera> cameras;
};

/// A splat_op_desc with the vectors that it points to.
struct OpRequest {
    OpRequest(const char* type, std::vector<splat_tensor> in, std::vector<splat_tensor> out);

    /// The desc for the current vectors; without gradients if both are empty.
    splat_op_desc desc() const;

    const char* type;
    const char* attributes = nullptr;
    std::uint32_t flags = 0;
    std::vector<splat_tensor> inputs;
    std::vector<splat_tensor> outputs;
    std::vector<splat_tensor> grad_outputs;
    std::vector<splat_tensor> grad_inputs;
};

Op make_op(splat_device device, const OpRequest& request);

/// An output filled with a pattern, which a failed call must leave unchanged.
template <class Value>
class Output {
  public:
    Output() { std::memset(&value_, kPattern, sizeof value_); }

    Value* out() { return &value_; }
    [[nodiscard]] const Value& value() const { return value_; }

    /// For structs that calls fill: the rest keeps the pattern.
    void set_struct_size(std::uint32_t size) {
        if constexpr (requires { value_.struct_size; }) value_.struct_size = size;
        size_ = size;
    }

    [[nodiscard]] bool untouched() const {
        Output fresh;
        if constexpr (requires { value_.struct_size; })
            if (size_ != kNoSize) fresh.value_.struct_size = size_;
        return std::memcmp(&fresh.value_, &value_, sizeof value_) == 0;
    }

  private:
    static constexpr int kPattern = 0xA5;
    static constexpr std::uint32_t kNoSize = 0xFFFFFFFFU;
    Value value_;
    std::uint32_t size_ = kNoSize;
};

/// The whole text of a function that takes (buffer, capacity, needed).
template <class Call>
std::string whole_text(Call&& call) {
    std::size_t needed = 0;
    EXPECT_EQ(call(nullptr, 0, &needed), SPLAT_INCOMPLETE);
    std::string text(needed, '\xA5');
    EXPECT_EQ(call(text.data(), text.size(), &needed), SPLAT_OK);
    EXPECT_EQ(needed, text.size());
    EXPECT_EQ(text.find('\0'), text.size() - 1) << "one NUL, at the end";
    text.pop_back();
    return text;
}

/// Messages of the validation layer in the log so far. Any message fails the program at its end.
std::uint64_t validation_messages();

/// The log callback that counts them. A test that sets its own callback restores this one.
void listen_to_log(splat_log_level min_level = SPLAT_LOG_WARNING);

/// Bit by bit.
inline bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
    return a.size() == b.size() &&
           (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0);
}

}  // namespace splat::test
