#include "api/api_calls.h"

#include <unistd.h>

#include <filesystem>
#include <fstream>

#include <atomic>
#include <cstdio>
#include <numeric>

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

const auto* const g_log = testing::AddGlobalTestEnvironment(new Log);  // gtest owns it

}  // namespace

testing::AssertionResult succeeded(splat_result got) {
    if (got == SPLAT_OK) return testing::AssertionSuccess();
    return testing::AssertionFailure()
           << splat_result_name(got) << ": " << splat_last_error_message();
}

testing::AssertionResult refused(splat_result got, splat_result expected, const std::string& part) {
    const std::string text = splat_last_error_message();
    if (got == expected && text.find(part) != std::string::npos) return testing::AssertionSuccess();
    return testing::AssertionFailure()
           << "got " << splat_result_name(got) << ": " << text << "\n  expected "
           << splat_result_name(expected) << " with '" << part << "'";
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
    Device device;
    EXPECT_DONE(splat_device_create(&desc, device.out()));
    return device;
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
    const splat_tensor_desc desc = tensor_desc(dims, name, dtype);
    Tensor tensor;
    EXPECT_DONE(splat_tensor_create(device, &desc, tensor.out()));
    return tensor;
}

Tensor upload(splat_device device, const Dims& dims, const std::vector<float>& values,
              const char* name) {
    const splat_tensor_desc desc = tensor_desc(dims, name);
    Tensor tensor;
    EXPECT_DONE(splat_tensor_from_host(device, &desc, values.data(), values.size() * sizeof(float),
                                       nullptr, tensor.out()));
    return tensor;
}

std::vector<float> download(splat_tensor tensor) {
    auto info = sized<splat_tensor_info>();
    EXPECT_DONE(splat_tensor_get_info(tensor, &info));
    std::vector<float> values(info.elements);
    EXPECT_DONE(splat_tensor_read(tensor, values.data(), values.size() * sizeof(float), nullptr));
    return values;
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
    const splat_op_desc desc = request.desc();
    Op op;
    EXPECT_DONE(splat_op_create(device, &desc, op.out()));
    return op;
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

Model make_model(const Device& device) {
    const splat_model_desc desc = model_desc();
    Model model;
    EXPECT_DONE(splat_model_create(device, &desc, model.out()));
    return model;
}

Predictor make_predictor(const Device& device) {
    const Model model = make_model(device);
    EXPECT_DONE(splat_model_init(model, 3));
    return make_predictor(device, model);
}

Predictor make_predictor(const Device& device, const Model& model) {
    Weights weights;
    EXPECT_DONE(splat_model_store(model, weights.out()));
    auto desc = sized<splat_predictor_desc>();
    desc.weights = weights;
    desc.config = kSmallModel;
    Predictor predictor;
    EXPECT_DONE(splat_predictor_create(device, &desc, predictor.out()));
    return predictor;
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
    Evaluator evaluator;
    EXPECT_DONE(splat_evaluator_create(&desc, evaluator.out()));
    return evaluator;
}

splat_compare_desc compare_desc() {
    static const splat_score a[] = {{"x", 20, 0.5, 0.2}, {"y", 22, 0.6, 0.1}};
    static const splat_score b[] = {{"x", 21, 0.6, 0.1}, {"y", 24, 0.6, 0.1}};
    auto desc = sized<splat_compare_desc>();
    desc.a = {nullptr, a, 2};
    desc.b = {nullptr, b, 2};
    return desc;
}

Comparison make_comparison() {
    const splat_compare_desc desc = compare_desc();
    Comparison comparison;
    EXPECT_DONE(splat_compare_scores(&desc, comparison.out()));
    return comparison;
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
    Module module;
    EXPECT_EQ(splat_module_create(device, &desc, module.out()), SPLAT_OK);
    return module;
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
    Trainer trainer;
    EXPECT_DONE(splat_trainer_create(device, &desc, trainer.out()));
    return trainer;
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
    const auto path =
        std::filesystem::temp_directory_path() / ("splat-weights-" + std::to_string(::getpid()));
    std::ofstream(path, std::ios::binary) << file;
    Weights weights;
    EXPECT_DONE(splat_weights_load(path.c_str(), 0, weights.out()));
    std::filesystem::remove(path);
    return weights;
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
    struct Folder {
        std::string path = (std::filesystem::temp_directory_path() /
                            ("splat-api-data-" + std::to_string(::getpid())))
                               .string();
        const pid_t owner = ::getpid();  // not a child that exits
        Folder() {
            const splat_synthetic_desc desc = synthetic_desc(path.c_str());
            for (std::uint32_t i = 0; i < 3; ++i) EXPECT_DONE(splat_synthetic_write(&desc, i));
        }
        Folder(const Folder&) = delete;
        Folder& operator=(const Folder&) = delete;
        ~Folder() {
            std::error_code code;
            if (owner == ::getpid()) std::filesystem::remove_all(path, code);
        }
    };
    static const Folder folder;
    return folder.path.c_str();
}

splat_dataset_desc dataset_desc() {
    auto desc = sized<splat_dataset_desc>();
    desc.path = data_folder();
    return desc;
}

Dataset make_dataset() {
    const splat_dataset_desc desc = dataset_desc();
    Dataset dataset;
    EXPECT_DONE(splat_dataset_open(&desc, dataset.out()));
    return dataset;
}

Dataset make_training_dataset() {
    splat_dataset_desc desc = dataset_desc();
    desc.resolution = 16;
    std::fill_n(desc.background, 3, 1.0F);
    Dataset dataset;
    EXPECT_DONE(splat_dataset_open(&desc, dataset.out()));
    return dataset;
}

Batches make_batches() {
    Batches batches;
    EXPECT_DONE(
        splat_batches_create(make_training_dataset(), trainer_desc().config, 1, batches.out()));
    return batches;
}

std::string run_folder() {
    struct Folder {
        std::string path = (std::filesystem::temp_directory_path() /
                            ("splat-api-runs-" + std::to_string(::getpid())))
                               .string();
        const pid_t owner = ::getpid();  // not a child that exits
        int runs = 0;
        Folder() = default;
        Folder(const Folder&) = delete;
        Folder& operator=(const Folder&) = delete;
        ~Folder() {
            std::error_code code;
            if (owner == ::getpid()) std::filesystem::remove_all(path, code);
        }
    };
    static Folder folder;
    return folder.path + "/" + std::to_string(folder.runs++);
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
    Training training;
    EXPECT_DONE(splat_training_open(device, &desc, training.out()));
    return training;
}

}  // namespace splat::test
