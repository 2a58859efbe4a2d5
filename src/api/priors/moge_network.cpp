#include "api/priors/moge_network.h"

#include <array>

#include "io/weights_file.h"
#include "vision/moge_model.h"

namespace splat::api {
namespace {

using prior_models::NetworkPort;
using prior_models::NetworkTensor;

/// Outputs, in their order.
enum Output : std::size_t { kPoints, kNormal, kMask, kScale };

class MogeNetwork : public prior_models::Network, public OfDevice {
  public:
    MogeNetwork(const std::shared_ptr<vk::Context>& owner, std::string path)
        : OfDevice(owner), path_(std::move(path)) {}

    Status open(const io::WeightsFile& file, DeviceObject& device) {
        SPLAT_ASSIGN(const vision::MogeConfig config, vision::moge_config(file.metadata));
        SPLAT_TRY(context->mutex.call([&]() -> Status {
            SPLAT_ASSIGN(model_, vision::MogeModel::create(*context, file.tensors, config));
            return {};
        }));
        SPLAT_TRY(device.test(kNetworkKernels));
        const std::lock_guard lock(context->mutex);
        SPLAT_TRY(context->device().alive());
        SPLAT_TRY(model_->load(file.tensors));
        preset_ = vision::moge_preset(model_->sizes());
        inputs_ = {{"image", prior_models::kOrtFloat, {1, 3, -1, -1}},
                   {"num_tokens", prior_models::kOrtInt64, {}}};
        outputs_ = {{"points", prior_models::kOrtFloat, {1, -1, -1, 3}},
                    {"normal", prior_models::kOrtFloat, {1, -1, -1, 3}},
                    {"mask", prior_models::kOrtFloat, {1, -1, -1}},
                    {"metric_scale", prior_models::kOrtFloat, {1}}};
        if (!model_->makes_normals()) outputs_[kNormal].name = "(no normal)";
        return {};
    }

    [[nodiscard]] const std::vector<NetworkPort>& inputs() const override { return inputs_; }
    [[nodiscard]] const std::vector<NetworkPort>& outputs() const override { return outputs_; }
    [[nodiscard]] const std::string& path() const override { return path_; }
    [[nodiscard]] const std::string& runtime_version() const override { return no_runtime_; }
    [[nodiscard]] std::string preset() const override { return preset_; }

    Result<std::vector<NetworkTensor>> run(const NetworkTensor& input, std::int64_t tokens,
                                           std::span<const std::size_t> wanted) const override {
        const std::int64_t height = input.dims[2], width = input.dims[3];
        vision::MogeMaps maps;
        {
            const std::lock_guard lock(context->mutex);
            SPLAT_TRY(context->device().alive());
            SPLAT_ASSIGN(maps, model_->run(input.values, static_cast<std::uint32_t>(width),
                                           static_cast<std::uint32_t>(height), tokens));
        }
        std::vector<NetworkTensor> results;
        for (const std::size_t output : wanted) switch (output) {
                case kPoints:
                    results.push_back({{1, height, width, 3}, maps.points});
                    break;
                case kNormal:
                    results.push_back({{1, height, width, 3}, maps.normals});
                    break;
                case kMask:
                    results.push_back({{1, height, width}, maps.mask});
                    break;
                default:
                    results.push_back({{1}, {maps.scale}});
            }
        return results;
    }

  private:
    std::string path_, preset_, no_runtime_;
    std::vector<NetworkPort> inputs_, outputs_;
    OnDevice<std::unique_ptr<vision::MogeModel>> model_{*this};
};

}  // namespace

Result<std::unique_ptr<prior_models::Network>> open_moge(DeviceObject& device,
                                                         const std::string& path) {
    SPLAT_ASSIGN(const io::WeightsFile file, io::load_weights(path, decode_limits(), true));
    auto network = std::make_unique<MogeNetwork>(device.context, path);
    const Status opened = network->open(file, device);
    if (!opened.ok()) return Status(opened.code(), "'" + path + "': " + opened.message());
    return std::unique_ptr<prior_models::Network>(std::move(network));
}

}  // namespace splat::api
