#include "model/weights.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <span>

#include "core/shown.h"

namespace splat::model {
namespace {

using io::NamedTensor;
using io::NamedTensors;

constexpr const char* kRays = "ray_dirs";

bool ends_with(const std::string& name, const char* end) {
    return name.ends_with(end);
}

/// Tensors of a state dict that are constants implied by the configuration, not parameters.
bool is_buffer(const std::string& name) {
    return name == kRays || name == "sh_to_v_transform" || name == "v_to_sh_transform" ||
           ends_with(name, ".resample_filter");
}

/// Parameters that may be absent from a file: without effect until they are trained.
bool may_be_fresh(const std::string& name) {
    for (const char* part : {".lora_A", ".lora_B", ".affine.", ".map_layer", ".cross_attention."})
        if (name.find(part) != std::string::npos) return true;
    return false;
}

/// Earlier networks with tokens also attended to them in the encoder.
bool is_of_earlier_networks(const std::string& name) {
    return name.find(".enc.") != std::string::npos &&
           name.find(".cross_attention.") != std::string::npos;
}

std::string first_conv_name(const ModelConfig& c) {
    if (c.network == config::Network::kLgmUnet) return "unet.conv_in.weight";
    const std::string r = std::to_string(c.names_resolution());
    return std::string(c.network_name()) + ".encoder.enc." + r + "x" + r + "_conv.weight";
}

bool same_dims(const NamedTensor& tensor, const Shape& shape) {
    if (tensor.dims.size() != shape.rank()) return false;
    for (std::uint32_t i = 0; i < shape.rank(); ++i)
        if (tensor.dims[i] != shape[i]) return false;
    return true;
}

/// For each input channel of a network of `from`, its index in one of `to`.
std::vector<std::uint32_t> places(const ImageChannels& from, const ImageChannels& to) {
    std::vector<std::uint32_t> result = {0, 1, 2};
    std::uint32_t at = 3;
    const auto take = [&](bool has, bool wants, std::uint32_t count) {
        for (std::uint32_t i = 0; has && i < count; ++i) result.push_back(at + i);
        if (wants) at += count;
    };
    take(from.depth, to.depth, 1);
    take(from.normal, to.normal, 3);
    take(from.mask, to.mask, 1);
    take(from.plane, to.plane, 5);
    return result;
}

bool has_all(const ImageChannels& to, const ImageChannels& from) {
    return (to.depth || !from.depth) && (to.normal || !from.normal) && (to.mask || !from.mask) &&
           (to.plane || !from.plane);
}

/// The first convolution's weight with each column moved to the channel of the same meaning.
Result<std::vector<float>> widened(const NamedTensor& tensor, const Shape& shape,
                                   const ImageChannels& from, const ImageChannels& to) {
    const bool plausible = tensor.dims.size() == 4 && tensor.dims[0] == shape[0] &&
                           tensor.dims[1] == from.count() && tensor.dims[2] == shape[2] &&
                           tensor.dims[3] == shape[3];
    if (!plausible || !has_all(to, from))
        return error(Code::kShape,
                     "grafting: tensor '%s' has shape %s, expected [%u, %u, %u, %u] or fewer input "
                     "channels, all of which the new network also has; name the file's channels",
                     tensor.name.c_str(), io::dims_text(tensor.dims).c_str(), shape[0], shape[1],
                     shape[2], shape[3]);
    const std::vector<std::uint32_t> where = places(from, to);
    const std::size_t taps = std::size_t{shape[2]} * shape[3];
    std::vector<float> wide(shape.elements(), 0.0F);
    for (std::size_t out = 0; out < shape[0]; ++out)
        for (std::size_t in = 0; in < where.size(); ++in)
            std::copy_n(
                tensor.values.begin() +
                    static_cast<std::ptrdiff_t>((out * where.size() + in) * taps),
                taps,
                wide.begin() + static_cast<std::ptrdiff_t>((out * shape[1] + where[in]) * taps));
    return wide;
}

Status check_rays(const Model& model, const NamedTensors& tensors, const LoadOptions& options,
                  LoadReport& report) {
    const NamedTensor* rays = tensors.find(kRays);
    if (rays == nullptr) return {};
    if (rays->values.size() != model.rays().size()) {
        report.rays_differ = true;
        if (options.graft && !options.take_rays) return {};
        return error(Code::kShape,
                     "tensor 'ray_dirs' has shape %s, expected [1, 3, %u, %u]: the file is for "
                     "another resolution",
                     io::dims_text(rays->dims).c_str(), model.config().resolution,
                     model.config().resolution);
    }
    SPLAT_TRY(io::check_finite(*rays));
    // Half an ulp of the file's numbers, plus float32 rounding of the reference's formula.
    const float rounding = rays->type == io::NumberType::kF16    ? 0x1p-11F
                           : rays->type == io::NumberType::kBf16 ? 0x1p-8F
                                                                 : 0.0F;
    for (std::size_t i = 0; i < rays->values.size(); ++i) {
        const float ray = model.rays()[i];
        if (std::abs(rays->values[i] - ray) > 1e-5F + rounding * std::abs(ray))
            report.rays_differ = true;
    }
    if (!report.rays_differ || options.graft || options.take_rays) return {};
    return invalid(
        "the file's ray_dirs are those of another field of view than the configuration's "
        "%g degrees; set the field of view, or ask to take over the file's rays",
        static_cast<double>(model.config().fov_degrees));
}

}  // namespace

std::uint32_t ImageChannels::count() const {
    return 3U + (depth ? 1U : 0U) + (normal ? 3U : 0U) + (mask ? 1U : 0U) + (plane ? 5U : 0U);
}

ImageChannels channels_of(const ModelConfig& config) {
    return {config.depth, config.normal, config.mask, config.plane};
}

ImageChannels likely_channels(const ModelConfig& config, const NamedTensors& tensors) {
    if (config.network == config::Network::kLgmUnet) return channels_of(config);
    const std::string name = first_conv_name(config);
    const std::string end =
        name.substr(name.find(".encoder."));  // the same for networks with and without offset
    const auto found = std::ranges::find_if(
        tensors, [&](const NamedTensor& tensor) { return tensor.name.ends_with(end); });
    const bool same = found != tensors.end() && found->dims.size() == 4 &&
                      found->dims[1] == config.image_channels();
    return same ? channels_of(config) : ImageChannels{};
}

Result<const NamedTensors*> under_own_names(const ModelConfig& c, const NamedTensors& tensors,
                                            NamedTensors& renamed) {
    const std::string old = std::string(ModelConfig().network_name()) + ".";
    const auto has_old = [&](const NamedTensor& tensor) { return tensor.name.starts_with(old); };
    if (c.offset || std::ranges::none_of(tensors, has_old)) return &tensors;
    for (NamedTensor tensor : tensors) {
        if (has_old(tensor))
            tensor.name = std::string(c.network_name()) + "." + tensor.name.substr(old.size());
        SPLAT_TRY(renamed.add(std::move(tensor)));
    }
    return &renamed;
}

namespace {

/// What becomes of each tensor, by names and shapes. Errors: those of load_state about these.
Result<LoadReport> matched(const ModelConfig& config, std::span<const nn::Parameter> parameters,
                           const NamedTensors& tensors, const LoadOptions& options) {
    const std::string first_conv = first_conv_name(config);
    LoadReport made;
    std::set<std::string> used;
    for (const nn::Parameter& parameter : parameters) {
        const NamedTensor* tensor = tensors.find(parameter.name);
        if (tensor == nullptr) {
            if (!may_be_fresh(parameter.name))
                return invalid("the file has no tensor '%s' %s: it is of another network",
                               parameter.name.c_str(), parameter.shape.text().c_str());
            made.fresh.push_back(parameter.name);
            continue;
        }
        used.insert(parameter.name);
        if (same_dims(*tensor, parameter.shape) &&
            (parameter.name != first_conv || !options.graft ||
             options.source == channels_of(config))) {
            made.copied.push_back(parameter.name);
        } else if (options.graft && parameter.name == first_conv) {
            made.widened.push_back(parameter.name);
        } else {
            return error(Code::kShape, "tensor '%s' has shape %s, expected %s; %s",
                         parameter.name.c_str(), io::dims_text(tensor->dims).c_str(),
                         parameter.shape.text().c_str(),
                         parameter.name == first_conv
                             ? "graft the file to take it over for other input channels"
                             : "the file is for another configuration");
        }
    }
    for (const NamedTensor& tensor : tensors)
        if (!used.contains(tensor.name) && !is_buffer(tensor.name))
            made.left_out.push_back(tensor.name);
    if (options.graft || made.left_out.empty()) return made;
    const auto unknown = std::ranges::find_if_not(made.left_out, is_of_earlier_networks);
    const bool earlier = unknown == made.left_out.end();
    return invalid("the file has %zu tensors that this network lacks, one is '%s'%s",
                   made.left_out.size(), shown(earlier ? made.left_out.front() : *unknown).c_str(),
                   earlier ? "; networks of earlier versions also attended to tokens in the "
                             "encoder: graft the file to leave that out"
                           : "");
}

}  // namespace

Status check_state(vk::Context& context, const ModelConfig& config, const NamedTensors& given,
                   const LoadOptions& options) {
    NamedTensors renamed;
    SPLAT_ASSIGN(const NamedTensors* named, under_own_names(config, given, renamed));
    SPLAT_ASSIGN(const std::vector<nn::Parameter> parameters,
                 Model::parameters_of(context, config));
    const Status fits = matched(config, parameters, *named, options).status();
    if (fits.code() != Code::kInvalidArgument) return fits;
    return damaged("%s", fits.message().c_str());
}

Status load_state(Model& model, const NamedTensors& given, const LoadOptions& options,
                  LoadReport& report) {
    NamedTensors renamed;
    SPLAT_ASSIGN(const NamedTensors* named, under_own_names(model.config(), given, renamed));
    const NamedTensors& tensors = *named;
    // Check everything before anything is written.
    SPLAT_ASSIGN(LoadReport made,
                 matched(model.config(), model.parameters().all(), tensors, options));
    for (const auto* names : {&made.copied, &made.widened})
        for (const std::string& name : *names) SPLAT_TRY(io::check_finite(*tensors.find(name)));
    std::vector<float> first_weight;
    const nn::Parameter* const first_conv =
        made.widened.empty() ? nullptr : model.parameters().find(made.widened.front());
    if (first_conv != nullptr)
        SPLAT_SET(first_weight, widened(*tensors.find(first_conv->name), first_conv->shape,
                                        options.source, channels_of(model.config())));
    SPLAT_TRY(check_rays(model, tensors, options, made));

    for (const std::string& name : made.copied)
        SPLAT_TRY(
            model.parameters().write(*model.parameters().find(name), tensors.find(name)->values));
    if (first_conv != nullptr) SPLAT_TRY(model.parameters().write(*first_conv, first_weight));
    if (made.rays_differ && options.take_rays) {
        SPLAT_TRY(model.set_rays(tensors.find(kRays)->values));
        made.rays_taken = true;
    }
    report = std::move(made);
    return {};
}

namespace {

Status add(NamedTensors& to, const std::string& name, const Shape& shape,
           LargeVector<float> values) {
    std::vector<std::int64_t> dims;
    for (std::uint32_t i = 0; i < shape.rank(); ++i) dims.push_back(shape[i]);
    return to.add({name, std::move(dims), io::NumberType::kF32, std::move(values)});
}

Status add_parameters(Model& model, NamedTensors& to) {
    for (const nn::Parameter& parameter : model.parameters().all()) {
        LargeVector<float> values;
        SPLAT_TRY(model.parameters().read(parameter.value, values));
        SPLAT_TRY(add(to, parameter.name, parameter.shape, std::move(values)));
    }
    return {};
}

/// "…conv0" and "…skip" of the blocks that resample.
std::vector<std::string> resampling_layers(const ModelConfig& c) {
    std::vector<std::string> layers;
    for (std::uint32_t level = 1; level < c.levels(); ++level)
        for (const bool down : {true, false}) {
            const std::string r =
                std::to_string(c.names_resolution() >> (down ? level : level - 1));
            const std::string block = std::string(c.network_name()) + ".encoder." +
                                      (down ? "enc." : "dec.") + r + "x" + r +
                                      (down ? "_down" : "_up");
            layers.push_back(block + ".conv0");
            layers.push_back(block + ".skip");
        }
    return layers;
}

}  // namespace

Result<NamedTensors> save_state(Model& model) {
    const ModelConfig& c = model.config();
    NamedTensors state;
    if (c.network == config::Network::kLgmUnet) {  // published files hold nothing else
        SPLAT_TRY(add_parameters(model, state));
        return state;
    }
    SPLAT_TRY(add(state, kRays, {1, 3, c.resolution, c.resolution}, model.rays()));
    if (c.sh_degree > 0) {
        // Degree-1 coefficients are in the order y, z, x with signs - + - of the axes.
        SPLAT_TRY(add(state, "sh_to_v_transform", {1, 3, 3}, {0, -1, 0, 0, 0, 1, -1, 0, 0}));
        SPLAT_TRY(add(state, "v_to_sh_transform", {1, 3, 3}, {0, 0, -1, -1, 0, 0, 0, 1, 0}));
    }
    SPLAT_TRY(add_parameters(model, state));
    for (const std::string& layer : resampling_layers(c))
        SPLAT_TRY(
            add(state, layer + ".resample_filter", {1, 1, 2, 2}, std::vector<float>(4, 0.25F)));
    return state;
}

}  // namespace splat::model
