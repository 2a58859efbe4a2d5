#include "model/adapters.h"

#include <algorithm>
#include <cmath>

namespace splat::model {
namespace {

using io::NamedTensor;
using io::NamedTensors;

constexpr std::string_view kPrefix = "base_model.model.";
constexpr std::string_view kSuffix = ".weight";
constexpr const char* kAlpha = "lora_alpha";

bool is_adapter(const std::string& name) {
    return name.ends_with(".lora_A") || name.ends_with(".lora_B");
}

/// "<layer>.lora_A" from either kind of name; other names are unchanged.
std::string plain_name(const std::string& name) {
    if (!name.starts_with(kPrefix) || !name.ends_with(kSuffix)) return name;
    return name.substr(kPrefix.size(), name.size() - kPrefix.size() - kSuffix.size());
}

/// The adapters among `tensors` under their plain names, as matrices.
Result<NamedTensors> plain_adapters(const NamedTensors& tensors) {
    NamedTensors plain;
    for (const NamedTensor& tensor : tensors) {
        NamedTensor made = tensor;
        made.name = plain_name(tensor.name);
        if (!is_adapter(made.name)) continue;
        if (tensor.dims.empty() || tensor.dims[0] < 1)
            return error(Code::kShape, "adapter '%s' has shape %s, expected a matrix",
                         tensor.name.c_str(), io::dims_text(tensor.dims).c_str());
        made.dims = {tensor.dims[0],
                     static_cast<std::int64_t>(tensor.values.size()) / tensor.dims[0]};
        SPLAT_TRY(plain.add(std::move(made)));
    }
    return plain;
}

/// "<layer>.weight" of an adapter's plain name.
std::string weight_of(const std::string& adapter) {
    return adapter.substr(0, adapter.rfind('.')) + std::string(kSuffix);
}

/// `adapters` renamed to the other network's names if the weights in `tensors` have those; see
/// under_own_names().
Result<NamedTensors> under_names_of(const NamedTensors& tensors, const NamedTensors& adapters) {
    ModelConfig with, without;
    without.offset = false;
    const std::string names[] = {std::string(with.network_name()) + ".",
                                 std::string(without.network_name()) + "."};
    NamedTensors result;
    for (NamedTensor adapter : adapters) {
        for (std::size_t i = 0; i < 2; ++i) {
            if (!adapter.name.starts_with(names[i])) continue;
            const std::string other = names[1 - i] + adapter.name.substr(names[i].size());
            if (tensors.find(weight_of(adapter.name)) != nullptr ||
                tensors.find(weight_of(other)) == nullptr)
                continue;
            adapter.name = other;
            break;
        }
        SPLAT_TRY(result.add(std::move(adapter)));
    }
    return result;
}

std::string number_text(double value) {
    return format("%.9g", value);
}

Status expect_adapters(Model& model) {
    if (model.config().lora.rank > 0) return {};
    return bad_state("the model has no adapters: its configuration lacks opt.lora_finetune");
}

/// Another factor would change the adapters' effect.
Status check_alpha(const Model& model, const io::WeightsFile& file) {
    const auto alpha = std::ranges::find_if(
        file.metadata, [](const auto& entry) { return entry.first == kAlpha; });
    const auto own = static_cast<double>(model.config().lora.alpha);
    if (alpha == file.metadata.end() || alpha->second == number_text(own)) return {};
    return invalid(
        "the file's adapters were trained with lora_alpha %s, the configuration has %s; set "
        "opt.lora_alpha",
        alpha->second.c_str(), number_text(own).c_str());
}

/// W + scale * (B A), rounded once.
Status fold(NamedTensor& weight, const NamedTensor& a, const NamedTensor& b, double factor) {
    if (a.dims[0] != b.dims[1] ||
        static_cast<std::uint64_t>(b.dims[0]) * static_cast<std::uint64_t>(a.dims[1]) !=
            weight.values.size())
        return error(Code::kShape, "layer of '%s': adapters %s and %s do not multiply to its %s",
                     weight.name.c_str(), io::dims_text(b.dims).c_str(),
                     io::dims_text(a.dims).c_str(), io::dims_text(weight.dims).c_str());
    const auto rank = static_cast<std::size_t>(a.dims[0]);
    const auto columns = static_cast<std::size_t>(a.dims[1]);
    const double scale = factor / static_cast<double>(rank);
    std::vector<double> sums(columns);
    LargeVector<float>& values = weight.values.own();
    for (std::size_t first = 0; first < values.size(); first += columns) {
        std::ranges::fill(sums, 0.0);
        for (std::size_t r = 0; r < rank; ++r) {
            const auto factor_b = static_cast<double>(b.values[first / columns * rank + r]);
            for (std::size_t i = 0; i < columns; ++i)
                sums[i] += factor_b * static_cast<double>(a.values[r * columns + i]);
        }
        for (std::size_t i = 0; i < columns; ++i) {
            float& value = values[first + i];
            value = static_cast<float>(static_cast<double>(value) + scale * sums[i]);
            if (!std::isfinite(value))
                return invalid(
                    "layer of '%s': element %zu of the folded weight is %g, expected a "
                    "finite number; check alpha and the files",
                    weight.name.c_str(), first + i, static_cast<double>(value));
        }
    }
    return {};
}

}  // namespace

Result<io::WeightsFile> save_adapters(Model& model) {
    SPLAT_TRY(expect_adapters(model));
    io::WeightsFile file;
    for (const nn::Parameter& parameter : model.parameters().all()) {
        if (!is_adapter(parameter.name)) continue;
        const std::string layer = parameter.name.substr(0, parameter.name.size() - 7);
        const nn::Parameter* weight = model.parameters().find(layer + ".weight");
        const std::int64_t rows = parameter.shape[0];
        NamedTensor tensor;
        tensor.name = std::string(kPrefix) + parameter.name + std::string(kSuffix);
        const bool is_a = parameter.name.ends_with("A");
        tensor.dims = {rows, is_a ? weight->shape[1] : parameter.shape[1]};
        for (std::uint32_t i = 2; i < weight->shape.rank(); ++i)  // taps of a convolution
            tensor.dims.push_back(is_a ? weight->shape[i] : 1);
        SPLAT_TRY(model.parameters().read(parameter.value, tensor.values.own()));
        SPLAT_TRY(file.tensors.add(std::move(tensor)));
    }
    const LoraConfig& lora = model.config().lora;
    file.metadata = {{"format", "pt"},
                     {kAlpha, number_text(static_cast<double>(lora.alpha))},
                     {"lora_rank", std::to_string(lora.rank)}};
    return file;
}

Status load_adapters(Model& model, const io::WeightsFile& file, LoadReport& report) {
    SPLAT_TRY(expect_adapters(model));
    SPLAT_TRY(check_alpha(model, file));
    SPLAT_ASSIGN(const NamedTensors plain, plain_adapters(file.tensors));
    for (const NamedTensor& tensor : file.tensors)
        if (plain.find(plain_name(tensor.name)) == nullptr)
            return invalid("tensor '%s' is not an adapter; load the file as a state dict",
                           tensor.name.c_str());
    NamedTensors renamed;
    SPLAT_ASSIGN(const NamedTensors* named, under_own_names(model.config(), plain, renamed));
    const NamedTensors& adapters = *named;
    LoadReport made;
    for (const nn::Parameter& parameter : model.parameters().all()) {
        if (!is_adapter(parameter.name)) continue;
        const NamedTensor* tensor = adapters.find(parameter.name);
        if (tensor == nullptr)
            return invalid("the file has no adapter '%s' %s", parameter.name.c_str(),
                           parameter.shape.text().c_str());
        if (tensor->dims[0] != parameter.shape[0] || tensor->dims[1] != parameter.shape[1])
            return error(Code::kShape, "adapter '%s' has shape %s, expected %s",
                         parameter.name.c_str(), io::dims_text(tensor->dims).c_str(),
                         parameter.shape.text().c_str());
        SPLAT_TRY(io::check_finite(*tensor));
        made.copied.push_back(parameter.name);
    }
    for (const NamedTensor& tensor : adapters)
        if (model.parameters().find(tensor.name) == nullptr)
            return invalid("the file's adapter '%s' belongs to no adapted layer of the model",
                           tensor.name.c_str());
    for (const std::string& name : made.copied)
        SPLAT_TRY(
            model.parameters().write(*model.parameters().find(name), adapters.find(name)->values));
    report = std::move(made);
    return {};
}

bool has_adapters(const NamedTensors& tensors) {
    return std::ranges::any_of(
        tensors, [](const NamedTensor& tensor) { return is_adapter(plain_name(tensor.name)); });
}

Result<NamedTensors> merge_adapters(const NamedTensors& tensors, const NamedTensors& given,
                                    double alpha, int sign) {
    SPLAT_ASSIGN(const NamedTensors plain, plain_adapters(given));
    SPLAT_ASSIGN(const NamedTensors adapters, under_names_of(tensors, plain));
    NamedTensors merged;
    for (const NamedTensor& tensor : tensors) {
        if (is_adapter(plain_name(tensor.name))) continue;
        NamedTensor result = tensor;
        if (tensor.name.ends_with(kSuffix)) {
            const std::string layer = tensor.name.substr(0, tensor.name.size() - kSuffix.size());
            const NamedTensor* a = adapters.find(layer + ".lora_A");
            const NamedTensor* b = adapters.find(layer + ".lora_B");
            if ((a == nullptr) != (b == nullptr))
                return invalid("layer '%s' has only one half of an adapter", layer.c_str());
            if (a != nullptr) SPLAT_TRY(fold(result, *a, *b, sign * alpha));
        }
        SPLAT_TRY(merged.add(std::move(result)));
    }
    for (const NamedTensor& adapter : adapters)
        if (merged.find(weight_of(adapter.name)) == nullptr)
            return invalid("the adapter '%s' belongs to no weight: the file has no '%s'",
                           adapter.name.c_str(), weight_of(adapter.name).c_str());
    return merged;
}

}  // namespace splat::model
