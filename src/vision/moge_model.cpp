#include "vision/moge_model.h"

#include <algorithm>
#include <cmath>

#include "data/resample.h"
#include "vision/moge_weights.h"

namespace splat::vision {
namespace {

using Dims = std::vector<std::int64_t>;

constexpr const char* kPositions = "encoder.backbone.pos_embed";
constexpr const char* kClassToken = "encoder.backbone.cls_token";
constexpr const char* kMaskToken = "encoder.backbone.mask_token";  // for DINOv2's training
constexpr const char* kMean = "encoder.image_mean";
constexpr const char* kDeviation = "encoder.image_std";

/// Tensors that no layer has.
std::map<std::string, Dims> other_tensors(const MogeSizes& sizes, const io::NamedTensors& tensors) {
    const std::int64_t width = sizes.encoder.width, side = sizes.encoder.side;
    std::map<std::string, Dims> others = {{kPositions, {1, 1 + side * side, width}},
                                          {kClassToken, {1, 1, width}},
                                          {kMean, {1, 3, 1, 1}},
                                          {kDeviation, {1, 3, 1, 1}}};
    if (tensors.find(kMaskToken) != nullptr) others[kMaskToken] = {1, width};
    return others;
}

struct Extent {
    std::uint32_t width = 0, height = 0;
};

/// [height,width,channels] in another size.
Result<std::vector<double>> resized(std::span<const float> values, std::uint32_t channels,
                                    Extent from, Extent to, data::ValueFilter filter) {
    return data::resample_values(values, from.width, from.height, channels, to.width, to.height,
                                 filter);
}

/// Channels together: [channels,area] to [area,channels].
std::vector<float> interleaved(std::span<const float> planes, std::size_t channels) {
    const std::size_t area = planes.size() / channels;
    std::vector<float> values(planes.size());
    for (std::size_t i = 0; i < area; ++i)
        for (std::size_t c = 0; c < channels; ++c) values[i * channels + c] = planes[c * area + i];
    return values;
}

std::vector<float> remapped_points(const std::vector<double>& raw) {
    std::vector<float> points(raw.size());
    for (std::size_t i = 0; i < raw.size(); i += 3) {
        const double z = std::exp(raw[i + 2]);
        points[i] = static_cast<float>(raw[i] * z);
        points[i + 1] = static_cast<float>(raw[i + 1] * z);
        points[i + 2] = static_cast<float>(z);
    }
    return points;
}

std::vector<float> unit_normals(const std::vector<double>& raw) {
    constexpr double kLeastLength = 1e-12;
    std::vector<float> normals(raw.size());
    for (std::size_t i = 0; i < raw.size(); i += 3) {
        const double length = std::max(std::hypot(raw[i], raw[i + 1], raw[i + 2]), kLeastLength);
        for (std::size_t c = 0; c < 3; ++c)
            normals[i + c] = static_cast<float>(raw[i + c] / length);
    }
    return normals;
}

std::vector<float> sigmoids(const std::vector<double>& raw) {
    std::vector<float> values(raw.size());
    std::ranges::transform(raw, values.begin(),
                           [](double x) { return static_cast<float>(1 / (1 + std::exp(-x))); });
    return values;
}

}  // namespace

Result<std::unique_ptr<MogeModel>> MogeModel::create(vk::Context& context,
                                                     const io::NamedTensors& tensors,
                                                     const MogeConfig& config,
                                                     std::int64_t precision) {
    SPLAT_ASSIGN(MogeSizes sizes, moge_sizes(tensors, config));
    std::unique_ptr<MogeModel> model(new MogeModel(context, std::move(sizes), precision));
    SPLAT_TRY(model->check(tensors));
    return model;
}

/// Parameters belong to values by their numbers, which are the same in the graph of any size.
Status MogeModel::check(const io::NamedTensors& tensors) {
    first_graph_ = std::make_unique<nn::Graph>(context_);
    Layers layers(*first_graph_, precision_);
    constexpr std::uint32_t kAnySide = 2;
    add_moge(layers, sizes_, kAnySide, kAnySide);
    SPLAT_TRY(first_graph_->status());
    origins_ = layers.origins();
    SPLAT_TRY(check_tensors(tensors, origins_, other_tensors(sizes_, tensors)));
    const auto values = [&](const char* name) -> std::vector<float> {
        return tensors.find(name)->values;
    };
    const std::size_t width = sizes_.encoder.width;
    std::vector<float> table = values(kPositions);
    first_token_ = values(kClassToken);
    for (std::size_t c = 0; c < width; ++c) first_token_[c] += table[c];
    table.erase(table.begin(), table.begin() + static_cast<std::ptrdiff_t>(width));
    const std::size_t area = table.size() / width;
    positions_.resize(table.size());
    for (std::size_t i = 0; i < area; ++i)
        for (std::size_t c = 0; c < width; ++c) positions_[c * area + i] = table[i * width + c];
    mean_ = values(kMean);
    deviation_ = values(kDeviation);
    for (const float deviation : deviation_)
        if (!(deviation > 0)) return damaged("tensor '%s' holds a number <= 0", kDeviation);
    return {};
}

Status MogeModel::load(const io::NamedTensors& tensors) {
    SPLAT_ASSIGN(nn::Parameters made, nn::Parameters::create(context_, *first_graph_, false));
    parameters_ = std::make_unique<nn::Parameters>(std::move(made));
    for (const nn::Parameter& parameter : parameters_->all())
        SPLAT_TRY(parameters_->write(parameter, values_of(origins_.at(parameter.name), tensors)));
    return {};
}

Status MogeModel::prepare(std::uint32_t rows, std::uint32_t columns) {
    if (executor_ && rows == rows_ && columns == columns_) return {};
    executor_.reset();  // frees its memory first
    graph_ = std::make_unique<nn::Graph>(context_);
    Layers layers(*graph_, precision_);
    values_ = add_moge(layers, sizes_, rows, columns);
    SPLAT_TRY(graph_->status());
    nn::ExecutorDesc desc;
    desc.outputs = values_.heads;
    desc.outputs.push_back(values_.scale);
    desc.outputs.push_back(values_.encoder.features);
    desc.outputs.push_back(values_.encoder.class_token);
    desc.label = "MoGe-2";
    SPLAT_ASSIGN(executor_, nn::Executor::create(context_, *graph_, *parameters_, desc));
    rows_ = rows;
    columns_ = columns;
    return {};
}

Status MogeModel::put_inputs(std::span<const float> image, std::uint32_t width,
                             std::uint32_t height) {
    const auto put = [&](nn::ValueId value, const std::vector<float>& values) {
        return context_.write(executor_->tensor(value), values.data(),
                              values.size() * sizeof(float));
    };
    const std::uint32_t patch = sizes_.encoder.patch;
    const Extent to{columns_ * patch, rows_ * patch};
    const std::size_t area = std::size_t{width} * height;
    std::vector<float> normalised;
    for (std::size_t c = 0; c < 3; ++c) {
        SPLAT_ASSIGN(const std::vector<double> plane,
                     resized(image.subspan(c * area, area), 1, {width, height}, to,
                             data::ValueFilter::kPillowBilinear));
        for (const double value : plane)
            normalised.push_back(static_cast<float>((value - static_cast<double>(mean_[c])) /
                                                    static_cast<double>(deviation_[c])));
    }
    SPLAT_TRY(put(values_.encoder.image, normalised));
    SPLAT_TRY(put(values_.encoder.positions, positions_));
    SPLAT_TRY(put(values_.encoder.first_token, first_token_));
    const double aspect = static_cast<double>(width) / height;
    for (std::uint32_t l = 0; l < sizes_.levels(); ++l)
        SPLAT_TRY(put(values_.views[l], view_plane(columns_ << l, rows_ << l, aspect)));
    return {};
}

Result<std::vector<float>> MogeModel::take(nn::ValueId value) {
    std::vector<float> values;
    SPLAT_TRY(parameters_->read(executor_->tensor(value), values));
    return values;
}

Result<std::vector<float>> MogeModel::features() {
    return take(values_.encoder.features);
}

Result<std::vector<float>> MogeModel::class_token() {
    return take(values_.encoder.class_token);
}

Result<MogeMaps> MogeModel::run(std::span<const float> image, std::uint32_t width,
                                std::uint32_t height, std::int64_t tokens) {
    if (width == 0 || height == 0 || image.size() != std::size_t{3} * width * height)
        return invalid("%zu numbers of a picture of %u x %u pixels, expected 3 for each pixel",
                       image.size(), width, height);
    const double aspect = static_cast<double>(width) / height;
    const double count = static_cast<double>(tokens);
    const double rows = std::nearbyint(std::sqrt(count / aspect));
    const double columns = std::nearbyint(std::sqrt(count * aspect));
    if (!(rows >= 1 && columns >= 1 && rows * columns <= kMostTokens))
        return invalid(
            "%lld tokens make %.0f x %.0f patches of a picture of %u x %u pixels, expected at "
            "least 1 each way and at most %lld together",
            lld(tokens), columns, rows, width, height, lld(kMostTokens));
    const Status ready =
        prepare(static_cast<std::uint32_t>(rows), static_cast<std::uint32_t>(columns));
    if (ready.code() == Code::kOutOfDeviceMemory || ready.code() == Code::kUnsupported ||
        ready.code() == Code::kInvalidArgument)
        return Status(ready.code(),
                      splat::format("%lld tokens (%.0f x %.0f patches) are too many: ", lld(tokens),
                                    columns, rows) +
                          ready.message());
    SPLAT_TRY(ready);
    SPLAT_TRY(put_inputs(image, width, height));
    SPLAT_TRY(executor_->forward());
    MogeMaps maps;
    const std::uint32_t last = sizes_.levels() - 1;
    for (std::size_t i = 0; i < values_.heads.size(); ++i) {
        const StackSizes& head = sizes_.heads[i];
        SPLAT_ASSIGN(const std::vector<float> planes, take(values_.heads[i]));
        SPLAT_ASSIGN(
            const std::vector<double> raw,
            resized(interleaved(planes, head.out), head.out, {columns_ << last, rows_ << last},
                    {width, height}, data::ValueFilter::kLinear));
        if (head.name == "points_head") maps.points = remapped_points(raw);
        if (head.name == "normal_head") maps.normals = unit_normals(raw);
        if (head.name == "mask_head") maps.mask = sigmoids(raw);
    }
    SPLAT_ASSIGN(const std::vector<float> scale, take(values_.scale));
    maps.scale = std::exp(scale[0]);
    return maps;
}

}  // namespace splat::vision
