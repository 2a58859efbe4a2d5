// Models through tensors that share their memory.
#include <array>
#include <functional>
#include <limits>
#include <map>
#include <numeric>

#include "api/api_calls.h"
#include "api/raster_calls.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

constexpr std::uint32_t kModelPixels = 16 * 16;  // pixels of the small model, and its Gaussians
constexpr const char* kBias = "network_with_offset.out.bias";
constexpr const char* kFirst = "network_with_offset.encoder.enc.16x16_conv.weight";
constexpr std::array<const char*, 5> kOutputs = {"means", "opacities", "scales", "rotations", "sh"};

class ApiModelTensors : public testing::Test {
  protected:
    Model make(std::uint32_t flags = 0, std::uint32_t objects = 1, const std::string& keys = "") {
        return random_model(device_, keys, flags, objects);
    }
    static Tensor tensor(const Model& model, const std::string& name) {
        return got(splat_model_tensor, model, name.c_str());
    }
    static Floats read(const Model& model, const char* name, std::size_t count) {
        return floats_of(count, splat_model_read, model, name);
    }
    static Floats raw(const Model& model) { return read(model, "raw", 24 * kModelPixels); }
    static std::vector<splat_port> ports_of(const Model& model, splat_port_kind kind) {
        std::uint32_t count = 0;
        EXPECT_EQ(splat_model_ports(model, kind, nullptr, 0, &count), SPLAT_INCOMPLETE);
        std::vector<splat_port> ports(count);
        EXPECT_DONE(splat_model_ports(model, kind, ports.data(), count, &count));
        EXPECT_EQ(count, ports.size());
        return ports;
    }
    static std::size_t size_of(const Dims& dims) {
        return static_cast<std::size_t>(
            std::accumulate(dims.begin(), dims.end(), std::int64_t{1}, std::multiplies<>()));
    }
    static Dims dims_of(const splat_port& port) { return {port.dims, port.dims + port.rank}; }
    static Dims dims_of(splat_tensor tensor) { return test::dims_of(tensor); }
    static splat_result forward_tensors(const Model& model) {
        auto input = sized<splat_model_input>();
        input.flags = SPLAT_PASS_TENSORS;
        return splat_model_forward(model, &input);
    }
    static splat_result backward_tensors(const Model& model) {
        auto gradients = sized<splat_model_gradients>();
        gradients.flags = SPLAT_PASS_TENSORS;
        return splat_model_backward(model, &gradients);
    }

    Device device_ = open_device();
    const Floats image_ = normal_fill(3 * kModelPixels, 4);
};

TEST_F(ApiModelTensors, TakeInputsAndGiveOutputs) {
    const Model host = make();
    forward(host, image_);
    const Model model = make();
    const Tensor images = tensor(model, "images");
    EXPECT_EQ(dims_of(images), (Dims{1, 3, 16, 16}));
    EXPECT_EQ(download(images), Floats(3 * kModelPixels, 0.0F));
    EXPECT_EQ(download(tensor(model, "quaternions")), (Floats{1, 0, 0, 0}));
    EXPECT_DONE(forward_tensors(model)) << "zeros and identity poses";
    EXPECT_NE(raw(model), raw(host));
    write(images, image_);
    ASSERT_DONE(forward_tensors(model));
    EXPECT_EQ(raw(model), raw(host));
    EXPECT_EQ(dims_of(tensor(model, "sh")), (Dims{1, kModelPixels, 4, 3}));
    EXPECT_EQ(dims_of(tensor(model, "sh[0]")), (Dims{kModelPixels, 4, 3}));
    EXPECT_EQ(dims_of(tensor(model, "opacities[0]")), (Dims{kModelPixels}));
    for (const char* name : kOutputs) {
        const Floats values = download(tensor(model, name));
        EXPECT_EQ(values, read(host, name, values.size())) << name;
    }
    // Arrays go to the same place.
    const Floats other = normal_fill(image_.size(), 5);
    forward(model, other);
    EXPECT_EQ(download(images), other);

    auto input = sized<splat_model_input>();
    input.flags = SPLAT_PASS_TENSORS;
    input.images = other.data();
    EXPECT_REFUSED(splat_model_forward(model, &input), kArgument,
                   "splat_model_input.flags has SPLAT_PASS_TENSORS, but an array is given");
    input.flags = 2;
    EXPECT_REFUSED(splat_model_forward(model, &input), kArgument,
                   "splat_model_input.flags has unknown bits 0x2");
}

/// Every optional input, as a tensor and as an array.
TEST_F(ApiModelTensors, TakeTheInputsOfTheConfiguration) {
    const char* const configurations[] = {
        "\n  fov: 0\n  input_images: 2",
        "\n  custom_embedding: true\ncam_embd: {embedding: pose, dimension: 2}",
        "\n  input_images: 2\ncam_embd: {embedding: pose, dimension: 4}",
        "\nmodel.token_dim: 3\nmodel.tokens: 5"};
    for (const char* keys : configurations) {
        const Model host = make(0, 2, keys);
        const Model model = make(0, 2, keys);
        std::map<std::string, Floats> values;
        for (const splat_port& port : ports_of(model, SPLAT_PORT_KIND_INPUT)) {
            const std::size_t size = size_of(dims_of(port));
            values[port.name] = normal_fill(size, 7 + size, 1, 0.1);
            const Tensor input = tensor(model, port.name);
            EXPECT_EQ(dims_of(input), dims_of(port));
            write(input, values[port.name]);
        }
        auto input = sized<splat_model_input>();
        const auto give = [&](const char* name, const float*& array, std::uint64_t& size) {
            if (values.count(name) == 0) return;
            array = values[name].data();
            size = values[name].size();
        };
        give("images", input.images, input.images_count);
        give("view_to_world", input.view_to_world, input.view_to_world_count);
        give("quaternions", input.quaternions, input.quaternions_count);
        give("focals", input.focals, input.focals_count);
        give("embedding", input.embedding, input.embedding_count);
        give("tokens", input.tokens, input.tokens_count);
        ASSERT_DONE(splat_model_forward(host, &input)) << keys;
        ASSERT_DONE(forward_tensors(model)) << keys;
        const Tensor expected = tensor(host, "means");
        EXPECT_EQ(download(tensor(model, "means")), download(expected)) << keys;
    }
}

/// Prepared forms of weights are made anew, whoever writes the parameter.
TEST_F(ApiModelTensors, ParametersThatAreWrittenCount) {
    const Model host = make();
    const Model model = make();
    const Tensor weight = tensor(model, kFirst);
    EXPECT_EQ(dims_of(weight), (Dims{8, 3, 3, 3}));
    const auto expect_same = [&](const Floats& values, const char* how) {
        ASSERT_DONE(splat_model_write(host, kFirst, values.data(), values.size() * sizeof(float)));
        forward(host, image_);
        for (int pass = 0; pass < 3; ++pass) {  // the second keeps prepared weights
            forward(model, image_);
            EXPECT_EQ(raw(model), raw(host)) << how;
        }
    };
    forward(model, image_);
    forward(model, image_);
    const Floats written = normal_fill(216, 6);
    write(weight, written);
    expect_same(written, "splat_tensor_write");
    mapped(weight, SPLAT_ACCESS_READ_WRITE)[5] = 0.75F;
    EXPECT_REFUSED(forward_tensors(model), kState, "a tensor of the model is mapped");
    ASSERT_DONE(splat_tensor_unmap(weight));
    Floats changed = written;
    changed[5] = 0.75F;
    expect_same(changed, "splat_tensor_map");
    const Tensor negative = upload(device_, {8, 3, 3, 3}, normal_fill(216, 8));
    const OpRequest request("silu", {negative}, {weight});
    const Op op = make_op(device_, request);
    ASSERT_DONE(splat_op_forward(op));
    expect_same(download(weight), "splat_op_forward");
    mapped(weight, SPLAT_ACCESS_WRITE);
    mapped(tensor(model, "images"), SPLAT_ACCESS_READ);  // destroyed while mapped
    EXPECT_REFUSED(forward_tensors(model), kState, "mapped");
    ASSERT_DONE(splat_tensor_unmap(weight));
    EXPECT_DONE(forward_tensors(model));
}

/// Draws the Gaussians of each object on the device, with the gradient of the sum of all colours times
/// `share`.
class Renderer {
  public:
    explicit Renderer(const Device& device)
        : rasterizer_(make_rasterizer(
              device, rasterizer_desc(kModelPixels, 16, 16, SPLAT_RASTERIZER_BACKWARD))),
          rgb_(make_tensor(device, {1, 16, 16, 3})),
          grad_rgb_(upload(device, {1, 16, 16, 3}, Floats(3 * kModelPixels, 1.0F))) {
        camera_.width = camera_.height = 16;
        camera_.fx = camera_.fy = 16;
        camera_.cx = camera_.cy = 8;
        for (int k = 0; k < 16; ++k) camera_.world_to_camera[k] = k % 5 == 0 ? 1 : 0;
    }

    /// The sum of the image's colours; gradients in the given tensors, in the order of kOutputs.
    double run(const std::vector<Tensor>& gaussians, const std::vector<Tensor>& gradients) {
        auto drawn = sized<splat_gaussians_desc>();
        drawn.means = gaussians[0];
        drawn.opacities = gaussians[1];
        drawn.scales = gaussians[2];
        drawn.rotations = gaussians[3];
        drawn.sh = gaussians[4];
        EXPECT_DONE(draw(rasterizer_, drawn, camera_));
        EXPECT_DONE(splat_rasterizer_output(rasterizer_, nullptr, SPLAT_OUTPUT_RGB, rgb_));
        auto back = sized<splat_gradients_desc>();
        back.grad_rgb = grad_rgb_;
        back.grad_means = gradients[0];
        back.grad_opacities = gradients[1];
        back.grad_scales = gradients[2];
        back.grad_rotations = gradients[3];
        back.grad_sh = gradients[4];
        EXPECT_DONE(splat_rasterizer_backward(rasterizer_, nullptr, &back));
        const auto stats = got(splat_tensor_check, rgb_);
        return stats.mean * 3 * kModelPixels;
    }

  private:
    Rasterizer rasterizer_;
    Tensor rgb_, grad_rgb_;
    splat_camera camera_{};
};

/// A training loop of the caller's own: two objects, the rasterizer between the model's tensors, plain
/// gradient descent. Gradients have the bits of those that go through host arrays.
TEST_F(ApiModelTensors, ALoopStaysOnTheDevice) {
    const Floats images = normal_fill(2 * 3 * kModelPixels, 9);
    const std::string keys = "\nmodel.opacity_bias: 0.0\nmodel.scale_bias: 0.1";
    const Model model = make(SPLAT_MODEL_GRADIENTS, 2, keys);
    write(tensor(model, "images"), images);
    Renderer renderer(device_);
    std::vector<Tensor> gaussians[2], gradients[2], copies[2];
    for (std::size_t object : {0U, 1U})
        for (const char* name : kOutputs) {
            const std::string part = std::string(name) + "[" + std::to_string(object) + "]";
            gaussians[object].push_back(tensor(model, part));
            gradients[object].push_back(tensor(model, "grad:" + part));
            copies[object].push_back(make_tensor(device_, dims_of(gaussians[object].back())));
        }
    const Tensor bias = tensor(model, kBias);
    const Tensor grad_bias = tensor(model, std::string("grad:") + kBias);
    double first = 0;
    double last = 0;
    for (int step = 0; step < 4; ++step) {
        ASSERT_DONE(splat_model_zero_gradients(model));
        ASSERT_DONE(forward_tensors(model));
        last = 0;
        for (std::size_t object : {0U, 1U})
            last += renderer.run(gaussians[object], gradients[object]);
        if (step == 0) first = last;
        ASSERT_DONE(backward_tensors(model));
        Floats values = download(bias);
        const Floats slope = download(grad_bias);
        for (std::size_t i = 0; i < values.size(); ++i) values[i] -= 3e-4F * slope[i];
        write(bias, values);
    }
    EXPECT_LT(last, 0.9 * first);

    // The same gradients through host arrays.
    const Model host = make(SPLAT_MODEL_GRADIENTS, 2, keys);
    const Floats trained = download(bias);
    ASSERT_DONE(splat_model_write(host, kBias, trained.data(), trained.size() * sizeof(float)));
    forward(host, images);
    ASSERT_DONE(forward_tensors(model));
    std::array<Floats, 5> arrays;
    for (std::size_t object : {0U, 1U}) {
        renderer.run(gaussians[object], copies[object]);
        renderer.run(gaussians[object], gradients[object]);
        for (std::size_t i = 0; i < 5; ++i) {
            const Floats part = download(copies[object][i]);
            arrays[i].insert(arrays[i].end(), part.begin(), part.end());
        }
    }
    for (std::size_t i = 0; i < 5; ++i)
        EXPECT_EQ(download(tensor(model, std::string("grad:") + kOutputs[i])), arrays[i]);
    auto given = sized<splat_model_gradients>();
    given.means = arrays[0].data();
    given.opacities = arrays[1].data();
    given.scales = arrays[2].data();
    given.rotations = arrays[3].data();
    given.sh = arrays[4].data();
    for (const Model* each : {&host, &model}) ASSERT_DONE(splat_model_zero_gradients(*each));
    ASSERT_DONE(splat_model_backward(host, &given));
    ASSERT_DONE(backward_tensors(model));
    for (const char* name : {kBias, kFirst}) {
        const std::string gradient = std::string("grad:") + name;
        const Floats expected = download(tensor(host, gradient));
        EXPECT_TRUE(same_bits(download(tensor(model, gradient)), expected)) << name;
        EXPECT_NE(expected, Floats(expected.size(), 0.0F)) << name;
    }
}

TEST_F(ApiModelTensors, InputGradientsAreTensors) {
    const std::string keys =
        "\n  custom_embedding: true\nmodel.token_dim: 3\nmodel.tokens: 5\n"
        "cam_embd: {embedding: pose, dimension: 2}";
    const Model model = make(SPLAT_MODEL_GRADIENTS | SPLAT_MODEL_INPUT_GRADIENTS, 1, keys);
    write(tensor(model, "images"), image_);
    write(tensor(model, "embedding"), normal_fill(12, 11));
    write(tensor(model, "tokens"), normal_fill(15, 12));
    for (const char* name : kOutputs) {
        const Tensor gradient = tensor(model, std::string("grad:") + name);
        const std::size_t size = size_of(dims_of(gradient));
        EXPECT_EQ(download(gradient), Floats(size, 0.0F)) << "at first";
        write(gradient, normal_fill(size, 13));
    }
    ASSERT_DONE(forward_tensors(model));
    ASSERT_DONE(backward_tensors(model));
    for (const char* name : {"grad:images", "grad:embedding", "grad:tokens"}) {
        const Floats values = download(tensor(model, name));
        EXPECT_EQ(values, read(model, name, values.size())) << name;
        // Attention to tokens starts without effect.
        const bool zero = values == Floats(values.size(), 0.0F);
        EXPECT_EQ(zero, std::string(name) == "grad:tokens") << name;
    }
    EXPECT_EQ(dims_of(tensor(model, "grad:embedding")), (Dims{1, 12}));
    EXPECT_EQ(dims_of(tensor(model, "grad:tokens")), (Dims{1, 3, 5}));

    // New inputs or results end what backward needs.
    for (const char* name : {"images", "scales"}) {
        ASSERT_DONE(forward_tensors(model));
        const Tensor changed = tensor(model, name);
        write(changed, download(changed));
        EXPECT_REFUSED(backward_tensors(model), kState, "after new inputs");
    }
    ASSERT_DONE(forward_tensors(model));
    const Tensor weight = tensor(model, kFirst);
    write(weight, download(weight));
    EXPECT_REFUSED(backward_tensors(model), kState, "after parameters had changed");
}

TEST_F(ApiModelTensors, OutliveTheModel) {
    Model model = make();
    forward(model, image_);
    const Floats expected = read(model, "means", 3 * kModelPixels);
    const Tensor means = tensor(model, "means");
    const Tensor weight = tensor(model, kFirst);
    model.destroy();
    device_.destroy();
    EXPECT_EQ(download(means), expected);
    write(weight, Floats(216, 0.5F));
    EXPECT_EQ(download(weight), Floats(216, 0.5F));
}

/// Two handles of one memory are not two results.
TEST_F(ApiModelTensors, SharedMemoryIsNotGivenTwice) {
    const Model model = make();
    const Tensor all = tensor(model, kFirst);
    const Tensor x = make_tensor(device_, {8, 3, 3, 3});
    const Op op = make_op(device_, OpRequest("add", {x, x}, {all}));
    EXPECT_DONE(splat_op_forward(op));
    const Rasterizer rasterizer =
        make_rasterizer(device_, rasterizer_desc(kModelPixels, 16, 16, SPLAT_RASTERIZER_BACKWARD));
    const auto camera = sample_camera(16, 16);
    const Scene scene = SampleScene(kModelPixels).create();
    EXPECT_DONE(draw(rasterizer, scene, camera));
    auto desc = sized<splat_gradients_desc>();
    const Tensor means = tensor(model, "means[0]"), same = tensor(model, "means[0]");
    desc.grad_means = means;
    desc.grad_scales = same;
    EXPECT_REFUSED(splat_rasterizer_backward(rasterizer, nullptr, &desc), kArgument,
                   "grad_scales shares its memory with grad_means");
}

TEST_F(ApiModelTensors, PortsAndInfoTellTheModel) {
    const std::string keys =
        "\n  use_pred_depth: true\nopt: {freeze: [out.bias]}\nmodel.token_dim: 3\n"
        "model.tokens: 5";
    const Model model = make(SPLAT_MODEL_GRADIENTS, 2, keys);
    auto info = got(splat_model_get_info, model);
    EXPECT_EQ(info.flags, std::uint32_t{SPLAT_MODEL_GRADIENTS});
    EXPECT_EQ(info.objects, 2U);
    EXPECT_EQ(info.resolution, 16U);
    EXPECT_EQ(info.channels, 4U);
    EXPECT_EQ(info.image_channels, 4U);
    EXPECT_EQ(info.output_channels, 24U);
    EXPECT_EQ(info.gaussians, kModelPixels);
    EXPECT_EQ(info.sh_degree, 1U);
    EXPECT_EQ(info.tokens, 5U);
    EXPECT_EQ(info.trainable, info.parameters - 24);
    EXPECT_EQ(info.predicted, 0U) << "before the first pass";
    ASSERT_DONE(forward_tensors(model));
    ASSERT_DONE(splat_model_get_info(model, &info));
    EXPECT_EQ(info.predicted, 2 * kModelPixels);
    EXPECT_EQ(info.non_finite, 0U);
    const Tensor bias = tensor(model, kBias);
    write(bias, Floats(24, std::numeric_limits<float>::max()));
    ASSERT_DONE(forward_tensors(model));
    ASSERT_DONE(splat_model_get_info(model, &info));
    EXPECT_GT(info.non_finite, 0U);

    const std::uint32_t trained = SPLAT_PORT_TRAINABLE | SPLAT_PORT_GRADIENT;
    std::uint64_t numbers = 0;
    for (const splat_port& port : ports_of(model, SPLAT_PORT_KIND_PARAMETER)) {
        EXPECT_EQ(port.flags, std::string(port.name) == kBias ? 0U : trained) << port.name;
        numbers += size_of(dims_of(port));
    }
    EXPECT_EQ(numbers, info.parameters);
    std::vector<splat_port> outputs = ports_of(model, SPLAT_PORT_KIND_OUTPUT);
    std::uint32_t count = 0;
    ASSERT_EQ(outputs.size(), 6U);
    EXPECT_STREQ(outputs[1].name, "opacities");
    EXPECT_EQ(outputs[1].flags, std::uint32_t{SPLAT_PORT_GRADIENT});
    EXPECT_EQ(splat_model_ports(model, SPLAT_PORT_KIND_OUTPUT, outputs.data(), 5, &count),
              SPLAT_INCOMPLETE);
    const std::string text = text_of(splat_model_report, model);
    for (const char* part :
         {R"({"name": "view_to_world", "shape": [2, 4, 4], "optional": true})",
          R"({"name": "tokens", "shape": [2, 3, 5], "optional": false})",
          R"({"name": "rotations", "shape": [2, 256, 4]})",
          R"({"name": "network_with_offset.out.bias", "shape": [24], "trainable": false})",
          R"("ledger": {"gaussians": 512, "non_finite": )"})
        EXPECT_TRUE(holds(text, part)) << part << " is not in " << text;
}

/// Pictures in the caller's layout become the planes of the input.
TEST_F(ApiModelTensors, PicturesAreInputs) {
    const Model model = make(0, 1, "\n  use_pred_depth: true");
    std::vector<std::uint8_t> bytes(3 * kModelPixels);
    Floats planes(4 * kModelPixels);
    for (std::uint32_t i = 0; i < kModelPixels; ++i)
        for (std::uint32_t c = 0; c < 3; ++c) {
            bytes[3 * i + c] = static_cast<std::uint8_t>(7 * i + 31 * c);
            planes[c * kModelPixels + i] = static_cast<float>(bytes[3 * i + c]) / 255.0F;
        }
    const Floats depth = normal_fill(kModelPixels, 14);
    std::copy(depth.begin(), depth.end(), planes.begin() + 3 * kModelPixels);
    forward(model, planes);
    const Floats expected = raw(model);
    splat_image pictures[] = {packed_image(bytes, 16, 16, 3), packed_image(depth, 16, 16, 1)};
    for (splat_image& picture : pictures) picture.bytes = 0;
    auto input = sized<splat_model_input>();
    input.pictures = pictures;
    input.picture_count = 2;
    ASSERT_DONE(splat_model_forward(model, &input));
    EXPECT_EQ(raw(model), expected);
    input.picture_count = 1;
    EXPECT_REFUSED(
        splat_model_forward(model, &input), kShape,
        "splat_model_input.pictures has 3 planes in 1 pictures, expected 4: 1 images of 4 "
        "channels");
    pictures[1].channels = 2;
    input.picture_count = 2;
    EXPECT_REFUSED(splat_model_forward(model, &input), kShape,
                   "splat_model_input.pictures[1] has 2 channels, expected at most 1");
    pictures[1].channels = 1;
    pictures[1].width = 8;
    EXPECT_REFUSED(splat_model_forward(model, &input), kShape, "pictures[1]");
    pictures[1].width = 16;
    input.images = planes.data();
    EXPECT_REFUSED(splat_model_forward(model, &input), kArgument,
                   "images and pictures are both given");
    input = sized<splat_model_input>();
    input.picture_count = 1;
    EXPECT_REFUSED(splat_model_forward(model, &input), kArgument,
                   "pictures is NULL, but picture_count is 1");
    EXPECT_EQ(raw(model), expected);
}

}  // namespace
}  // namespace splat::test
