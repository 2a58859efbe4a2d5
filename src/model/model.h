#pragma once

#include <array>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "model/object_slices.h"
#include "model/output_ledger.h"
#include "model/song_unet.h"
#include "nn/executor.h"

namespace splat::model {

/// Options of running a model.
struct ModelOptions {
    std::uint32_t objects = 1;  ///< objects per batch, with as many views as configured
    /// Maximal bytes of an activation: larger batches run in slices of objects, see object_slices.h. 0: the
    /// size of one binding of the device.
    std::uint64_t most_bytes = 0;
    bool gradients = false;  ///< plan and record the backward pass; else parameters have none
    bool input_gradient = false;
    bool keep_prepared = true;         ///< see nn::ExecutorDesc
    bool recompute = false;            ///< see nn::ExecutorDesc
    std::uint32_t backward_parts = 1;  ///< see nn::ExecutorDesc
    BuildOptions build;
};

/// The images and cameras of a batch in host memory, with the views of each object consecutive; N = objects *
/// views images of R x R pixels.
struct ModelInput {
    std::span<const float> images;         ///< [N, input_channels, R, R]
    std::span<const float> view_to_world;  ///< [N, 4, 4], row vectors: p_world = p_view M
    std::span<const float> quaternions;    ///< [N, 4] w x y z of the view-to-world rotation
    std::span<const float> focals;         ///< [N, 2] pixels if fov_degrees is 0; else empty
    std::span<const float> embedding;  ///< [N, embedding_length] for Embedding::kCustom; else empty
    std::span<const float> tokens;     ///< [N, token_dim, tokens], or empty
    std::uint64_t seed = 0;            ///< seed of dropout
    std::uint32_t step = 0;            ///< step of dropout
};

/// Poses of cameras that all are their object's frame, as a ModelInput takes them.
struct IdentityPoses {
    std::vector<float> view_to_world, quaternions;

    explicit IdentityPoses(std::size_t images)
        : view_to_world(16 * images), quaternions(4 * images) {
        for (std::size_t i = 0; i < images; ++i) {
            for (std::size_t axis = 0; axis < 4; ++axis) view_to_world[16 * i + 5 * axis] = 1;
            quaternions[4 * i] = 1;
        }
    }
};

/// Splatter Image, or LGM: images to Gaussians of pixels, M = ModelConfig::gaussians() of them per object.
///
/// Source  Szymanowicz et al. 2024, arXiv:2312.13150, with the depth, normal, mask and plane channels,
///         modulation and adapters of ModelConfig; Tang et al. 2024, arXiv:2402.05054
class Model {
  public:
    /// Parameters are zero until init() or weights are loaded (weights.h). Errors: those of check();
    /// kOutOfDeviceMemory.
    static Result<std::unique_ptr<Model>> create(vk::Context& context, const ModelConfig& config,
                                                 const ModelOptions& options);

    /// Names and shapes of its parameters, without memory. Errors: those of check().
    static Result<std::vector<nn::Parameter>> parameters_of(vk::Context& context,
                                                            const ModelConfig& config);

    /// Initialise the parameters from a seed, as the paper's code does.
    Status init(std::uint64_t seed);

    /// All or nothing: a refused call keeps the input of the last pass and its saved values for backward. Errors:
    /// kShape, naming the field, its size and the expected one; kInvalidArgument for numbers that are not finite.
    Status set_input(const ModelInput& input);

    /// Take what the tensors of inputs hold, unchecked. Seed and step are those of dropout. Errors: those of
    /// Context::read and write.
    Status use_tensors(std::uint64_t seed, std::uint32_t step);

    /// Errors: kInvalidState while a tensor of it is mapped; those of Context::run.
    Status forward();

    /// forward() without reading the ledger, which output_ledger() counted and takes.
    Status forward_unread();
    [[nodiscard]] OutputLedger& output_ledger() { return *counts_; }

    /// Compute the gradients of parameters from the written gradients of outputs, or `of_sets` from those of
    /// sets(true). Errors: kInvalidState after new inputs without their forward pass, or while a tensor of it is
    /// mapped. After other errors the gradients may hold part of the batch and must be zeroed. `between`: see
    /// nn::Executor::backward; gradients of parameters are final as executor().parts() says.
    Status backward(bool of_sets = false, const nn::BetweenParts& between = {});

    /// Errors: kInvalidState while a tensor that shares its memory is mapped.
    [[nodiscard]] Status check_unmapped() const;

    /// The tensor from which a pass takes an input, row-major in the shape of ModelInput, except that
    /// images lack the plane of origin distances, which are "origin_distance" [N]. The first call sets
    /// inputs that were never given to zeros and identity poses. Errors: kInvalidArgument for a name that
    /// the configuration does not have; those of Context::write.
    Result<vk::BufferView> input_tensor(std::string_view name);

    /// Inputs that the caller gives, and their shapes.
    struct Port {
        const char* name;
        Shape shape;
        bool optional;  ///< it has a default: poses
        bool graded;    ///< a pass computes its gradient
    };
    [[nodiscard]] std::vector<Port> inputs() const;
    [[nodiscard]] vk::BatchScope one_list() { return {context_, batch_}; }

    /// Outside use of inputs and results, and of gradients other than those of parameters, by tensors that share
    /// their memory; nn::Parameters::outside has that of parameters.
    [[nodiscard]] const std::shared_ptr<vk::OutsideUse>& outside() const { return outside_; }
    [[nodiscard]] const std::shared_ptr<vk::OutsideUse>& outside_gradients() const {
        return outside_gradients_;
    }

    /// Row-major results of forward, and the tensors from which backward reads their gradients.
    ///
    /// means [objects,M,3]  opacities [objects,M,1]  scales [objects,M,3]  rotations [objects,M,4] (w x
    /// y z)  sh [objects,M,K,3], K = (sh_degree + 1)^2, the first coefficient first
    struct Outputs {
        vk::BufferView means, opacities, scales, rotations, sh;
    };
    /// Made by the first call, filled by each pass from then on. Errors: those of Memory::allocate and Context::run.
    Result<Outputs> outputs();
    Result<Outputs> output_gradients();

    /// The Gaussians of all objects of the latest pass, or of one, as a rasterizer takes them; with `gradients`,
    /// the memory from which backward(true) takes their gradients.
    [[nodiscard]] gaussians::SetViews sets(bool gradients = false) const;
    [[nodiscard]] gaussians::SetViews set(std::uint32_t object, bool gradients = false) const;
    /// What such a set holds.
    [[nodiscard]] const gaussians::SetDesc& set_desc() const { return set_desc_; }

    /// Counts of the latest forward pass that was read. May be called during a pass.
    [[nodiscard]] Ledger ledger() const { return counts_->latest(); }

    /// Output of the network, input of the head: [N, output_channels, R, R], row-major.
    [[nodiscard]] const vk::BufferView& raw_output() const { return tensor(raw_); }

    enum class Input : int { kImages, kEmbedding, kTokens };

    /// The tensor of an input's gradient, as input_gradient() reads it. Errors: kInvalidState without
    /// input_gradient or that input.
    [[nodiscard]] Result<vk::BufferView> input_gradient_tensor(Input input) const;

    /// Read the gradient of the images [N, image_channels, R, R], the embedding [N, embedding_length] of
    /// Embedding::kCustom or the tokens [N, token_dim, tokens], in the order of the caller's numbers. Errors:
    /// kInvalidState without input_gradient or that input; those of reading.
    [[nodiscard]] Result<std::vector<float>> input_gradient(Input input) const;

    /// Forward passes of a batch; its backward pass repeats all except one.
    [[nodiscard]] std::uint32_t slices() const { return options_.objects / slice_; }

    [[nodiscard]] bool has_gradients() const { return options_.gradients; }
    [[nodiscard]] const ModelConfig& config() const { return config_; }
    [[nodiscard]] vk::Context& context() const { return context_; }
    [[nodiscard]] nn::Parameters& parameters() { return *parameters_; }
    [[nodiscard]] const nn::Executor& executor() const { return *executor_; }

    /// The direction of each pixel's ray at depth 1, [3,R,R]: ray_dirs of the state dict.
    [[nodiscard]] const std::vector<float>& rays() const { return rays_; }
    Status set_rays(std::vector<float> rays);

  private:
    Model(vk::Context& context, const ModelConfig& config, const ModelOptions& options,
          std::uint32_t slice)
        : context_(context), config_(config), options_(options), slice_(slice), graph_(context) {}
    Status build();
    Status plan();
    [[nodiscard]] std::uint32_t objects_that_fit() const;
    nn::ValueId build_embedding();
    /// Numbers for an input of the graph.
    struct InputValues {
        nn::ValueId id;
        std::vector<float> owned;  ///< memory of `values`, unless that is the caller's
        std::span<const float> values;
        const char* name;
    };
    Status check_values(const InputValues& input) const;
    Status add_images(std::span<const float> images, std::vector<InputValues>& inputs) const;
    [[nodiscard]] std::uint32_t images() const { return options_.objects * config_.views; }
    Status write_input(nn::ValueId id, std::span<const std::byte> bytes);
    Status write_counters(std::uint64_t seed, std::uint32_t step);
    Status record_exchange();
    Status start_inputs();
    [[nodiscard]] std::vector<nn::ValueId> sliced_inputs() const;
    /// Where an input's numbers go: for custom embeddings, a tensor in the caller's order.
    [[nodiscard]] const vk::BufferView& input(nn::ValueId id) const {
        if (id == embedding_ && exchanged_.bytes() > 0) return exchanged_view_;
        return id == rays_value_ ? executor_->tensor(id) : tensor(id);
    }
    [[nodiscard]] const vk::BufferView& tensor(nn::ValueId id) const {
        return sliced_ == nullptr ? executor_->tensor(id) : sliced_->tensor(id);
    }
    [[nodiscard]] const vk::BufferView& gradient(nn::ValueId id) const {
        return sliced_ == nullptr ? executor_->gradient(id) : sliced_->gradient(id);
    }

    vk::Context& context_;
    ModelConfig config_;
    ModelOptions options_;
    std::uint32_t slice_;  ///< objects per pass of the graph; divides those of a batch
    nn::Graph graph_;
    std::map<std::string, Init> inits_;
    std::unique_ptr<nn::Parameters> parameters_;
    std::unique_ptr<nn::Executor> executor_;
    std::unique_ptr<ObjectSlices> sliced_;  ///< nullptr for one slice
    gaussians::SetDesc set_desc_;           ///< describes the set of one object
    std::uint64_t version_ = 0;             ///< changes with each forward pass
    /// A set, or its gradients, of all objects as one array per attribute.
    struct Rows {
        std::array<vk::Buffer, 5> memory;
        Outputs views;
        vk::CommandList pack, unpack;
    };
    Result<Outputs> rows(std::unique_ptr<Rows>& rows, bool gradients);
    std::unique_ptr<Rows> rows_, gradient_rows_;
    std::unique_ptr<OutputLedger> counts_;
    vk::Batch batch_;
    std::vector<float> rays_;
    /// A custom embedding and its gradient in the caller's order, with the lists that exchange the halves
    /// of each vector. The published network takes them exchanged.
    vk::Buffer exchanged_, exchanged_gradient_;
    vk::BufferView exchanged_view_, exchanged_gradient_view_;
    vk::CommandList exchange_, exchange_gradient_;
    bool input_changed_ = false;  ///< since the last forward pass
    bool input_given_ = false;
    std::shared_ptr<vk::OutsideUse> outside_ = std::make_shared<vk::OutsideUse>();
    std::shared_ptr<vk::OutsideUse> outside_gradients_ = std::make_shared<vk::OutsideUse>();
    std::uint64_t outside_writes_ = 0;  ///< when the latest forward pass began
    nn::ValueId image_ = nn::kNoValue, rays_value_ = nn::kNoValue, view_to_world_ = nn::kNoValue,
                quaternion_ = nn::kNoValue, focal_ = nn::kNoValue, origin_ = nn::kNoValue,
                embedding_ = nn::kNoValue, tokens_ = nn::kNoValue, counter_ = nn::kNoValue,
                raw_ = nn::kNoValue;
    std::vector<std::pair<nn::ValueId, std::vector<float>>> constants_;  ///< inputs that stay
    std::vector<nn::ValueId> outputs_;                                   ///< arrays of the set
};

}  // namespace splat::model
