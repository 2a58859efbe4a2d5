// The loss of planes of an object, and how Trainer makes and feeds those of a pass.

#include "train/scene_planes.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/finite.h"
#include "train/trainer.h"

namespace splat::train {
namespace {

/// The normal at a pixel of a view, in the axes of the first view.
Result<std::array<float, 4>> normal_at(std::span<const float> view, std::size_t pixels,
                                       std::size_t pixel, std::span<const float> view_to_world) {
    double n[3], squared = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        n[k] = 2 * static_cast<double>(view[k * pixels + pixel]) - 1;
        squared += n[k] * n[k];
    }
    if (squared < data::kLeastNormal * data::kLeastNormal)
        return invalid("pixel %zu is on a plane whose normal has the length %g, expected about 1",
                       pixel, std::sqrt(squared));
    std::array<float, 4> turned{};
    for (std::size_t j = 0; j < 3; ++j) {
        double sum = 0;
        for (std::size_t i = 0; i < 3; ++i)
            sum += n[i] * static_cast<double>(view_to_world[4 * i + j]);
        turned[j] = static_cast<float>(sum / std::sqrt(squared));
    }
    return turned;
}

/// Add the planes of a view, whose first Gaussian has the number `first`.
Status add_view(std::span<const float> view, std::span<const float> view_to_world,
                std::size_t pixels, std::size_t first, std::uint32_t per_pixel,
                PlaneMembers& made) {
    const std::span<const float> ids = view.subspan((data::kPlaneChannels - 1) * pixels, pixels);
    std::vector<float> known;  // ids, by their first pixels
    std::vector<std::vector<std::uint32_t>> members;
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
        if (ids[pixel] == 0) continue;
        const auto place =
            static_cast<std::size_t>(std::ranges::find(known, ids[pixel]) - known.begin());
        if (place == known.size()) {
            if (place == data::kMostPlanes)
                return invalid("pixel %zu begins plane %zu, expected at most %u planes", pixel,
                               place + 1, data::kMostPlanes);
            SPLAT_ASSIGN(const auto normal, normal_at(view, pixels, pixel, view_to_world));
            made.normals.insert(made.normals.end(), normal.begin(), normal.end());
            known.push_back(ids[pixel]);
            members.emplace_back();
        }
        for (std::uint32_t each = 0; each < per_pixel; ++each)
            members[place].push_back(
                static_cast<std::uint32_t>((first + pixel) * per_pixel + each));
    }
    for (const std::vector<std::uint32_t>& plane : members) {
        made.members.insert(made.members.end(), plane.begin(), plane.end());
        made.begins.push_back(static_cast<std::uint32_t>(made.members.size()));
    }
    return {};
}

}  // namespace

Result<PlaneMembers> plane_members(std::span<const float> channels,
                                   std::span<const float> view_to_world, std::size_t pixels,
                                   std::uint32_t per_pixel) {
    PlaneMembers made{{}, {0}, {}};
    const std::size_t each = data::kPlaneChannels * pixels;
    for (std::size_t view = 0; each * view < channels.size(); ++view) {
        const auto part = channels.subspan(each * view, each);
        Status added;
        if (const std::size_t bad = find_not_finite(part); bad < part.size())
            added = invalid("channel %zu of pixel %zu is %g, expected a finite number",
                            bad / pixels, bad % pixels, static_cast<double>(part[bad]));
        else
            added = add_view(part, view_to_world.subspan(16 * view, 16), pixels, pixels * view,
                             per_pixel, made);
        if (!added.ok())
            return Status(added.code(),
                          format("planes of input view %zu: ", view) + added.message());
    }
    return made;
}

Result<ScenePlanes> ScenePlanes::create(vk::Context& context, const config::ModelConfig& network,
                                        std::uint32_t first, const gaussians::SetViews& sets,
                                        const gaussians::SetViews& grad,
                                        const vk::BufferView& value, const vk::BufferView& factor) {
    if (network.output_resolution() != network.resolution || network.positions == kHeadBox)
        return invalid(
            "'opt.lambda_plane' is not 0, but the network's Gaussians are not those of the pixels "
            "of its input, of which maps of planes speak (%u x %u pixels, %u x %u of Gaussians%s); "
            "expected 0",
            network.resolution, network.resolution, network.output_resolution(),
            network.output_resolution(), network.positions == kHeadBox ? " anywhere in a box" : "");
    ScenePlanes made(context);
    made.first_ = first;
    const std::uint32_t planes = data::kMostPlanes * network.views;
    const auto allocate = [&](vk::Buffer& buffer, std::uint64_t words) -> Status {
        SPLAT_SET(buffer, context.memory().allocate(4 * words, vk::MemoryKind::kDevice,
                                                    "planes of Gaussians"));
        return {};
    };
    SPLAT_TRY(allocate(made.members_, network.gaussians()));
    SPLAT_TRY(allocate(made.begins_, planes + 1));
    SPLAT_TRY(allocate(made.normals_, std::uint64_t{4} * planes));
    SPLAT_TRY(allocate(made.offsets_, planes));
    SPLAT_TRY(allocate(made.partial_, planes));
    // Lists are recorded once, for the most planes; those that an object lacks are empty workgroups.
    const gaussians::PlaneViews views{made.members_.range(), made.begins_.range(),
                                      made.normals_.range(), made.offsets_.range(),
                                      made.partial_.range(), planes,
                                      network.gaussians()};
    vk::Recorder recorder(context);
    SPLAT_TRY(gaussians::plane_loss_forward(recorder, sets, views, value));
    SPLAT_SET(made.forward_, recorder.finish());
    SPLAT_TRY(gaussians::plane_loss_backward(recorder, sets, views, factor, grad));
    SPLAT_SET(made.backward_, recorder.finish());
    return made;
}

Status ScenePlanes::forward(const PlaneMembers& planes) {
    std::vector<std::uint32_t> members = planes.members, begins = planes.begins;
    for (std::uint32_t& member : members) member += first_;
    begins.resize(begins_.bytes() / sizeof(std::uint32_t), planes.begins.back());
    const auto put = [&](const vk::Buffer& buffer, const auto& values) -> Status {
        if (values.empty()) return {};
        const std::uint64_t bytes = values.size() * sizeof values[0];
        return context_->write(buffer.range().part(0, bytes), values.data(), bytes);
    };
    SPLAT_TRY(put(members_, members));
    SPLAT_TRY(put(begins_, begins));
    SPLAT_TRY(put(normals_, planes.normals));
    return context_->run(forward_);
}

Status Trainer::build_planes() {
    const model::ModelConfig& network = model_->config();
    for (std::uint32_t slot = 0; config_.plane_weight > 0 && slot < config_.micro_batch; ++slot) {
        SPLAT_ASSIGN(
            ScenePlanes made,
            ScenePlanes::create(context_, network, slot * network.gaussians(), model_->sets(),
                                model_->sets(true), loss_->plane_value(), loss_->plane_factor()));
        planes_.push_back(std::move(made));
    }
    return {};
}

Status Trainer::find_planes(const TrainBatch& batch) {
    members_.clear();
    const model::ModelConfig& c = model_->config();
    const std::size_t pixels = std::size_t{c.resolution} * c.resolution;
    const std::size_t each = data::kPlaneChannels * c.views * pixels,
                      poses = std::size_t{16} * c.views;
    for (std::uint32_t object = 0; !planes_.empty() && object < objects_; ++object) {
        auto made =
            plane_members(batch.planes.subspan(each * object, each),
                          batch.view_to_world.subspan(poses * object, poses), pixels, c.per_pixel);
        if (!made.ok())
            return {made.status().code(),
                    format("training batch: object %u: ", object) + made.status().message()};
        members_.push_back(std::move(made.value()));
    }
    return {};
}

}  // namespace splat::train
