#include "api/api_calls.h"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numeric>

#include "support/system.h"

namespace splat::test {
namespace {

std::atomic<std::uint64_t> g_messages{0};

void on_log(void*, splat_log_level level, const char* message) {
    const bool validation = std::strncmp(message, "[validation]", 12) == 0;
    if (validation) g_messages.fetch_add(1);
    if (validation || level >= SPLAT_LOG_ERROR) std::fprintf(stderr, "%s\n", message);
}

Device& shared_slot() {
    static Device device;
    return device;
}

class Log : public testing::Environment {
  public:
    void SetUp() override { listen_to_log(); }
    void TearDown() override {
        shared_slot().destroy();
        EXPECT_EQ(validation_messages(), 0U) << "the validation layer reported messages; see above";
        EXPECT_EQ(splat_log_set_callback(nullptr, nullptr, 0), SPLAT_OK);
    }
};

/// Appends a sentence to the file of SPLAT_SENTENCES: bindings/smoke/sentences.py tries it in each language.
void keep_sentence(std::string text) {
    static const char* const file = [] {
        const char* const path = std::getenv("SPLAT_SENTENCES");
        if (path != nullptr) std::ofstream{path};  // empty: an earlier run may have said others
        return path;
    }();
    if (file == nullptr) return;
    std::ranges::replace(text, '\n', ' ');
    std::ofstream(file, std::ios::app) << text << '\n';
}

const auto* const g_log = testing::AddGlobalTestEnvironment(new Log);  // gtest owns it

}  // namespace

testing::AssertionResult succeeded(splat_result got) {
    if (got == SPLAT_OK) return testing::AssertionSuccess();
    return testing::AssertionFailure()
           << splat_result_name(got) << ": " << splat_last_error_message();
}

testing::AssertionResult refused(splat_result got, splat_result expected, const std::string& part) {
    const std::string text = splat_last_error_message();
    keep_sentence(text);
    if (got == expected && text.find(part) != std::string::npos) return testing::AssertionSuccess();
    return testing::AssertionFailure()
           << "got " << splat_result_name(got) << ": " << text << "\n  expected "
           << splat_result_name(expected) << " with '" << part << "'";
}

testing::AssertionResult holds(const std::string& text, const std::string& part) {
    if (text.find(part) != std::string::npos) return testing::AssertionSuccess();
    return testing::AssertionFailure() << "'" << part << "' is not in " << text.c_str();
}

Temporary::Temporary(const std::string& extension)
    : path_([&] {
          static std::atomic<int> number = 0;
          const std::string name =
              "splat-api-" + test::process_text() + "-" + std::to_string(number++);
          return (std::filesystem::temp_directory_path() / (name + extension)).generic_string();
      }()),
      owner_(os::process_id()) {}

Temporary::~Temporary() {
    std::error_code code;
    if (owner_ == os::process_id()) std::filesystem::remove_all(path_, code);
}

std::string Temporary::operator/(const std::string& name) const {
    std::filesystem::create_directories(path_);
    return path_ + "/" + name;
}

std::string file_bytes(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

splat_device_desc device_desc(std::uint32_t flags) {
    auto desc = sized<splat_device_desc>();
    desc.flags = flags;
    desc.cache_folder = "";
    return desc;
}

Device open_device(std::uint32_t flags) {
    return open_device(device_desc(flags));
}

Device open_device(const splat_device_desc& desc) {
    return got(splat_device_create, desc);
}

splat_device shared_device() {
    if (shared_slot() != nullptr) return shared_slot();
    splat_device_desc desc = device_desc();
    desc.kernels = SPLAT_KERNELS_PLAIN;
    shared_slot() = open_device(desc);
    return shared_slot();
}

splat_tensor_desc tensor_desc(const Dims& dims, const char* name, splat_dtype dtype) {
    auto desc = sized<splat_tensor_desc>();
    desc.name = name;
    desc.dtype = dtype;
    desc.rank = static_cast<std::uint32_t>(dims.size());
    for (std::size_t i = 0; i < dims.size() && i < SPLAT_MAX_RANK; ++i) desc.dims[i] = dims[i];
    return desc;
}

Tensor make_tensor(splat_device device, const Dims& dims, const char* name, splat_dtype dtype) {
    return got(splat_tensor_create, device, tensor_desc(dims, name, dtype));
}

Tensor upload(splat_device device, const Dims& dims, const Floats& values, const char* name) {
    return got(splat_tensor_from_host, device, tensor_desc(dims, name), values.data(),
               values.size() * sizeof(float), nullptr);
}

Floats download(splat_tensor tensor) {
    Floats values(got(splat_tensor_get_info, tensor).elements);
    EXPECT_DONE(splat_tensor_read(tensor, values.data(), values.size() * sizeof(float), nullptr));
    return values;
}

void write(splat_tensor tensor, const Floats& values) {
    EXPECT_DONE(splat_tensor_write(tensor, values.data(), values.size() * sizeof(float), nullptr));
}

Dims dims_of(splat_tensor tensor) {
    const splat_tensor_info info = got(splat_tensor_get_info, tensor);
    return {info.dims, info.dims + info.rank};
}

float* mapped(splat_tensor tensor, splat_access access) {
    void* pointer = nullptr;
    EXPECT_DONE(splat_tensor_map(tensor, access, &pointer, nullptr));
    return static_cast<float*>(pointer);
}

OpRequest::OpRequest(const char* name, std::vector<splat_tensor> in, std::vector<splat_tensor> out)
    : type(name), inputs(std::move(in)), outputs(std::move(out)) {}

splat_op_desc OpRequest::desc() const {
    auto desc = sized<splat_op_desc>();
    desc.flags = flags;
    desc.type = type;
    desc.attributes = attributes;
    desc.input_count = static_cast<std::uint32_t>(inputs.size());
    desc.output_count = static_cast<std::uint32_t>(outputs.size());
    desc.inputs = inputs.data();
    desc.outputs = outputs.data();
    if (!grad_outputs.empty()) desc.grad_outputs = grad_outputs.data();
    if (!grad_inputs.empty()) desc.grad_inputs = grad_inputs.data();
    return desc;
}

Op make_op(splat_device device, const OpRequest& request) {
    return got(splat_op_create, device, request.desc());
}

std::uint64_t validation_messages() {
    return g_messages.load();
}

void listen_to_log(splat_log_level min_level) {
    EXPECT_EQ(splat_log_set_callback(on_log, nullptr, min_level), SPLAT_OK);
}

splat_model_desc model_desc() {
    auto desc = sized<splat_model_desc>();
    desc.config = kSmallModel;
    return desc;
}

Model make_model(splat_device device, const std::string& keys, std::uint32_t flags,
                 std::uint32_t objects) {
    splat_model_desc desc = model_desc();
    const std::string config = kSmallModel + keys;
    desc.config = config.c_str();
    desc.flags = flags;
    desc.objects = objects;
    return got(splat_model_create, device, desc);
}

Model random_model(splat_device device, const std::string& keys, std::uint32_t flags,
                   std::uint32_t objects) {
    Model model = make_model(device, keys, flags, objects);
    EXPECT_DONE(splat_model_init(model, 3));
    return model;
}

void forward(splat_model model, const Floats& images) {
    auto input = sized<splat_model_input>();
    input.images = images.data();
    input.images_count = images.size();
    EXPECT_DONE(splat_model_forward(model, &input));
}

Predictor make_predictor(const Device& device) {
    return make_predictor(device, random_model(device));
}

Predictor make_predictor(const Device& device, const Model& model, const std::string& keys) {
    const Weights weights = got(splat_model_store, model);
    return make_predictor(device.get(), weights.get(), keys);
}

Predictor make_predictor(splat_device device, splat_weights weights, const std::string& keys) {
    const std::string config = kSmallModel + keys;
    auto desc = sized<splat_predictor_desc>();
    desc.weights = weights;
    desc.config = config.c_str();
    return got(splat_predictor_create, device, desc);
}

splat_optimizer_desc optimizer_desc(const splat_optimizer_item* items, std::uint64_t count) {
    auto desc = sized<splat_optimizer_desc>();
    desc.items = items;
    desc.item_count = count;
    return desc;
}

splat_named_array named_array(const char* name, const Floats& values, const Dims& dims) {
    splat_named_array array{};
    array.name = name;
    array.values = values.data();
    array.value_count = values.size();
    array.rank = static_cast<std::uint32_t>(dims.size());
    std::copy(dims.begin(), dims.end(), array.dims);
    return array;
}

splat_port port_desc(const Dims& dims, const char* name) {
    splat_port port{};
    port.name = name;
    port.rank = static_cast<std::uint32_t>(dims.size());
    std::copy(dims.begin(), dims.end(), port.dims);
    return port;
}

Evaluator make_evaluator(splat_dataset dataset) {
    auto desc = sized<splat_evaluator_desc>();
    desc.dataset = dataset;
    desc.method = "mine";
    return got(splat_evaluator_create, &desc);
}

splat_compare_desc compare_desc() {
    static const splat_score a[] = {{"x", 20, 0.5, 0.2}, {"y", 22, 0.6, 0.1}};
    static const splat_score b[] = {{"x", 21, 0.6, 0.1}, {"y", 24, 0.6, 0.1}};
    auto desc = sized<splat_compare_desc>();
    desc.a = {nullptr, a, 2};
    desc.b = {nullptr, b, 2};
    return desc;
}

splat_mesh_desc mesh_desc() {
    // Counterclockwise, seen from the origin.
    static const double vertices[12] = {-1, -1, 3, 1, -1, 3, 1, 1, 3, -1, 1, 3};
    static const std::uint32_t triangles[6] = {0, 2, 1, 0, 3, 2};
    auto desc = sized<splat_mesh_desc>();
    desc.vertices = vertices;
    desc.vertex_count = 12;
    desc.triangles = triangles;
    desc.triangle_count = 6;
    return desc;
}

Mesh make_mesh() {
    const splat_mesh_desc desc = mesh_desc();
    return got(splat_mesh_create, &desc);
}

Comparison make_comparison() {
    const splat_compare_desc desc = compare_desc();
    return got(splat_compare_scores, &desc);
}

splat_module_desc module_desc() {
    static const splat_port port = port_desc({1, 4}, "x");
    auto desc = sized<splat_module_desc>();
    desc.type = "silu";
    desc.ports = &port;
    desc.port_count = 1;
    return desc;
}

Module make_module(const Device& device) {
    const splat_module_desc desc = module_desc();
    return got(splat_module_create, device, &desc);
}

splat_trainer_desc trainer_desc() {
    static const std::string config = std::string(kSmallModel) +
                                      "\nopt: {batch_size: 2, imgs_per_obj: 2, base_lr: 1e-3,"
                                      " ema: {update_every: 1, update_after_step: 0}}";
    auto desc = sized<splat_trainer_desc>();
    desc.config = config.c_str();
    return desc;
}

TrainerBatch::TrainerBatch() : images(2 * 3 * 16 * 16, 0.5F), targets(4 * 3 * 16 * 16, 0.25F) {
    splat_camera camera{};
    camera.width = camera.height = 16;
    camera.fx = camera.fy = 16;
    camera.cx = camera.cy = 8;
    for (int k = 0; k < 16; ++k) camera.world_to_camera[k] = k % 5 == 0 ? 1 : 0;
    cameras.assign(4, camera);
    for (int i = 0; i < 2; ++i) {
        for (int k = 0; k < 16; ++k) poses.push_back(k % 5 == 0 ? 1.0F : 0.0F);
        for (int k = 0; k < 4; ++k) quaternions.push_back(k == 0 ? 1.0F : 0.0F);
    }
}

splat_trainer_batch TrainerBatch::desc() const {
    auto batch = sized<splat_trainer_batch>();
    batch.images = images.data();
    batch.view_to_world = poses.data();
    batch.quaternions = quaternions.data();
    batch.targets = targets.data();
    batch.cameras = cameras.data();
    return batch;
}

Trainer make_trainer(const Device& device) {
    const splat_trainer_desc desc = trainer_desc();
    return got(splat_trainer_create, device, &desc);
}

std::vector<float> write_large_weights(const std::string& path) {
    std::vector<float> large(300000);
    std::iota(large.begin(), large.end(), 0.0F);
    std::string header = R"({"w":{"dtype":"F32","shape":[300,1000],"data_offsets":[0,1200000]}})";
    header.resize((header.size() + 7) / 8 * 8, ' ');
    const std::uint64_t size = header.size();
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(&size), sizeof size)
        .write(header.data(), static_cast<std::streamsize>(size))
        .write(reinterpret_cast<const char*>(large.data()), 1200000);
    return large;
}

Weights make_weights() {
    std::string header = R"({"__metadata__":{"k":"v"},"a":{"dtype":"F32","shape":[2,2],)"
                         R"("data_offsets":[0,16]},"b":{"dtype":"F16","shape":[],)"
                         R"("data_offsets":[16,18]}})";
    const std::uint64_t size = header.size();
    const float a[] = {1, 2, 3, 4};
    const std::uint16_t b = 0x3800;
    std::string file(reinterpret_cast<const char*>(&size), sizeof size);
    file += header + std::string(reinterpret_cast<const char*>(a), sizeof a) +
            std::string(reinterpret_cast<const char*>(&b), sizeof b);
    const Temporary path;
    std::ofstream(path.path(), std::ios::binary) << file;
    return got(splat_weights_load, path.c_str(), 0);
}

splat_synthetic_desc synthetic_desc(const char* path) {
    auto desc = sized<splat_synthetic_desc>();
    desc.path = path;
    desc.resolution = 8;
    desc.train_views = 3;
    desc.test_views = 2;
    desc.train_objects = 2;
    desc.test_objects = 1;
    return desc;
}

const char* data_folder() {
    static const Temporary folder;
    static const bool written = [] {
        const splat_synthetic_desc desc = synthetic_desc(folder.c_str());
        for (std::uint32_t i = 0; i < 3; ++i) EXPECT_DONE(splat_synthetic_write(&desc, i));
        return true;
    }();
    return written ? folder.c_str() : nullptr;
}

splat_dataset_desc dataset_desc() {
    auto desc = sized<splat_dataset_desc>();
    desc.path = data_folder();
    return desc;
}

void write_cars_with_planes(const std::string& folder) {
    const splat_synthetic_desc cars = synthetic_desc(folder.c_str());
    std::vector<std::uint8_t> pixels(std::size_t{4} * 64);
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = i % 4 == 3 ? 255 : i < 100 ? 7 : 9;
    const splat_image map = packed_image(pixels, 8, 8, 4);
    for (std::uint32_t object = 0; object < 2; ++object) {
        EXPECT_DONE(splat_synthetic_write(&cars, object));
        const std::filesystem::path planes =
            folder + "/srn_cars/cars_train/00000" + std::to_string(object) + "_car/plane";
        std::filesystem::create_directories(planes);
        for (const char* name : {"000000.png", "000001.png", "000002.png"})
            EXPECT_DONE(splat_image_save((planes / name).string().c_str(), &map));
    }
}

Dataset make_dataset() {
    const splat_dataset_desc desc = dataset_desc();
    return got(splat_dataset_open, &desc);
}

Dataset make_training_dataset() {
    splat_dataset_desc desc = dataset_desc();
    desc.resolution = 16;
    std::fill_n(desc.background, 3, 1.0F);
    return got(splat_dataset_open, &desc);
}

Batches make_batches() {
    return got(splat_batches_create, make_training_dataset(), trainer_desc().config, 1);
}

std::string run_folder() {
    static const Temporary folder;
    static int runs = 0;
    return folder.path() + "/" + std::to_string(runs++);
}

splat_training_desc training_desc(splat_dataset dataset, const std::string& folder) {
    static const char* const kTwoSteps[] = {"opt.iterations=2"};
    auto desc = sized<splat_training_desc>();
    desc.folder = folder.c_str();
    desc.config = trainer_desc().config;
    desc.values = kTwoSteps;
    desc.value_count = 1;
    desc.dataset = dataset;
    return desc;
}

Training make_training(const Device& device) {
    const Dataset dataset = make_training_dataset();
    const std::string folder = run_folder();
    const splat_training_desc desc = training_desc(dataset, folder);
    return got(splat_training_open, device, &desc);
}

}  // namespace splat::test
