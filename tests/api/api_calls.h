#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "splat.h"

/// Shared by all tests of the C API. Uses only the header of the library.
namespace splat::test {

inline constexpr splat_result kArgument = SPLAT_ERROR_INVALID_ARGUMENT;
inline constexpr splat_result kHandle = SPLAT_ERROR_INVALID_HANDLE;
inline constexpr splat_result kState = SPLAT_ERROR_INVALID_STATE;
inline constexpr splat_result kShape = SPLAT_ERROR_SHAPE_MISMATCH;
inline constexpr splat_result kUnsupported = SPLAT_ERROR_UNSUPPORTED;
inline constexpr splat_result kNotFound = SPLAT_ERROR_NOT_FOUND;
inline constexpr splat_result kIo = SPLAT_ERROR_IO;
inline constexpr splat_result kFormat = SPLAT_ERROR_FORMAT;

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

using Floats = std::vector<float>;

/// Packed pixels of a vector as a picture.
template <class Value>
splat_image packed_image(const std::vector<Value>& pixels, std::uint32_t width,
                         std::uint32_t height, std::uint32_t channels) {
    constexpr splat_pixel kTypes[] = {0, SPLAT_PIXEL_U8, SPLAT_PIXEL_F16, 0, SPLAT_PIXEL_F32};
    return {const_cast<Value*>(pixels.data()),
            pixels.size() * sizeof(Value),
            kTypes[sizeof(Value)],
            width,
            height,
            channels,
            0,
            0,
            0};
}

/// Planes [channels,side,side] as a picture.
inline splat_image planes_image(const float* planes, std::uint32_t side,
                                std::uint32_t channels = 3) {
    const std::int64_t row = std::int64_t{sizeof(float)} * side;
    return {const_cast<float*>(planes),
            channels * sizeof(float) * side * side,
            SPLAT_PIXEL_F32,
            side,
            side,
            channels,
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

/// The owner of a handle.
template <class Type>
struct OwnerOf {
    using Owner = Type;
};
#define SPLAT_OWNER(name, handle)                 \
    using name = Owned<handle, handle##_destroy>; \
    template <>                                   \
    struct OwnerOf<handle> {                      \
        using Owner = name;                       \
    };
SPLAT_OWNER(Device, splat_device)
SPLAT_OWNER(Tensor, splat_tensor)
SPLAT_OWNER(Op, splat_op)
SPLAT_OWNER(Scene, splat_scene)
SPLAT_OWNER(Mesh, splat_mesh)
SPLAT_OWNER(Optimizer, splat_optimizer)
SPLAT_OWNER(Rasterizer, splat_rasterizer)
SPLAT_OWNER(RasterState, splat_raster_state)
SPLAT_OWNER(Weights, splat_weights)
SPLAT_OWNER(Model, splat_model)
SPLAT_OWNER(Module, splat_module)
SPLAT_OWNER(Trainer, splat_trainer)
SPLAT_OWNER(Lpips, splat_lpips)
SPLAT_OWNER(Dataset, splat_dataset)
SPLAT_OWNER(Evaluator, splat_evaluator)
SPLAT_OWNER(Comparison, splat_comparison)
SPLAT_OWNER(Predictor, splat_predictor)
SPLAT_OWNER(Batches, splat_batches)
SPLAT_OWNER(Training, splat_run)
SPLAT_OWNER(PriorModel, splat_prior_model)
#undef SPLAT_OWNER
using Dims = std::vector<std::int64_t>;

/// An argument of a function: the value, or its address where the parameter is a pointer to it.
template <class Given>
struct Argument {
    const Given& given;
    template <class Type>
    operator Type() const {
        if constexpr (std::is_convertible_v<const Given&, Type>)
            return static_cast<Type>(given);
        else
            return &given;
    }
};

/// What a function stores by its last parameter: a value, a struct, or a handle with its owner.
template <class... Types, class... Given>
auto got(splat_result (*function)(Types...), const Given&... given) {
    using Last = std::tuple_element_t<sizeof...(Types) - 1, std::tuple<Types...>>;
    using Stored = std::remove_pointer_t<Last>;
    typename OwnerOf<Stored>::Owner stored{};
    if constexpr (requires { stored.struct_size; }) stored = sized<Stored>();
    if constexpr (requires { stored.out(); })
        EXPECT_DONE(function(Argument<Given>{given}..., stored.out()));
    else
        EXPECT_DONE(function(Argument<Given>{given}..., &stored));
    return stored;
}

/// Numbers that a function reads by its last two parameters, an array and its bytes.
template <class... Types, class... Given>
Floats floats_of(std::size_t count, splat_result (*function)(Types...), const Given&... given) {
    Floats values(count);
    EXPECT_DONE(function(Argument<Given>{given}..., values.data(), count * sizeof(float)));
    return values;
}

/// All bytes that a function writes by its last three parameters: buffer, capacity and needed.
template <class... Types, class... Given>
std::string bytes_of(splat_result (*function)(Types...), const Given&... given) {
    std::size_t needed = 0;
    EXPECT_EQ(function(Argument<Given>{given}..., nullptr, 0, &needed), SPLAT_INCOMPLETE);
    std::string bytes(needed, '\xA5');
    EXPECT_DONE(function(Argument<Given>{given}..., bytes.data(), bytes.size(), &needed));
    EXPECT_EQ(needed, bytes.size());
    std::string roomy(needed + 1, '\xA5');
    EXPECT_DONE(function(Argument<Given>{given}..., roomy.data(), roomy.size(), nullptr));
    EXPECT_EQ(roomy.back(), '\xA5') << "more than what is needed was written";
    return bytes;
}

/// The same for a text, without its NUL.
template <class... Types, class... Given>
std::string text_of(splat_result (*function)(Types...), const Given&... given) {
    std::string text = bytes_of(function, given...);
    EXPECT_EQ(text.find('\0'), text.size() - 1) << "one NUL, at the end";
    if (!text.empty()) text.pop_back();
    return text;
}

/// Expects `part` in a text.
testing::AssertionResult holds(const std::string& text, const std::string& part);

/// A path in the temporary folder for this process alone. What lies there is removed at the end.
class Temporary {
  public:
    explicit Temporary(const std::string& extension = "");
    Temporary(const Temporary&) = delete;
    Temporary& operator=(const Temporary&) = delete;
    ~Temporary();

    [[nodiscard]] const std::string& path() const { return path_; }
    [[nodiscard]] const char* c_str() const { return path_.c_str(); }
    /// A path in the folder of this path, which is made.
    std::string operator/(const std::string& name) const;

  private:
    const std::string path_;
    const std::int64_t owner_;  ///< not a child that exits
};

/// The bytes of a file.
std::string file_bytes(const std::string& path);

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
Floats download(splat_tensor tensor);
void write(splat_tensor tensor, const Floats& values);
Dims dims_of(splat_tensor tensor);
/// The memory of a tensor that is mapped until splat_tensor_unmap.
float* mapped(splat_tensor tensor, splat_access access);

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
/// The two training cars of synthetic_desc() with maps of two planes: the first 25 pixels, and the others.
void write_cars_with_planes(const std::string& folder);
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

/// With further lines of the configuration, and without parameters or with random ones.
Model make_model(splat_device device, const std::string& keys = "", std::uint32_t flags = 0,
                 std::uint32_t objects = 0);
Model random_model(splat_device device, const std::string& keys = "", std::uint32_t flags = 0,
                   std::uint32_t objects = 0);
/// A forward pass of these images.
void forward(splat_model model, const Floats& images);

/// A predictor of a model with random weights, for white backgrounds.
Predictor make_predictor(const Device& device);
Predictor make_predictor(const Device& device, const Model& model, const std::string& keys = "");
Predictor make_predictor(splat_device device, splat_weights weights, const std::string& keys = "");

/// An optimizer of these parameters.
splat_optimizer_desc optimizer_desc(const splat_optimizer_item* items, std::uint64_t count = 1);

splat_named_array named_array(const char* name, const Floats& values, const Dims& dims);
/// A port of a splat_module_desc.
splat_port port_desc(const Dims& dims, const char* name);

/// An evaluator of the caller's images of a data set.
Evaluator make_evaluator(splat_dataset dataset);

/// Two methods on the objects "x" and "y".
splat_compare_desc compare_desc();
Comparison make_comparison();

/// Two triangles: the square from -1 to 1 of the plane z = 3, which faces the origin; the arrays live as long as the
/// program.
splat_mesh_desc mesh_desc();
Mesh make_mesh();

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
