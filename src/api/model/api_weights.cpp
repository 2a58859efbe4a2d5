#include <cmath>
#include <cstring>

#include "api/api_guard.h"
#include "api/handles.h"
#include "core/json_writer.h"
#include "model/adapters.h"
#include "predict/published.h"
#include "predict/weights_place.h"
#include "vision/moge_sizes.h"

using namespace splat;

Result<std::shared_ptr<api::WeightsObject>> api::weights_to_use(splat_weights weights,
                                                                const char* argument) {
    SPLAT_ASSIGN(auto object, api::Weights::find(weights, argument));
    SPLAT_TRY(object->file.tensors.unchanged());
    return object;
}

namespace {

Result<const io::NamedTensor*> tensor_of(const api::WeightsObject& object, std::uint32_t index) {
    const io::NamedTensors& tensors = object.file.tensors;
    if (index < tensors.size()) return &tensors[index];
    return invalid("index is %u, expected less than %zu, the number of tensors", index,
                   tensors.size());
}

Result<io::WeightsFormat> format_to_write(splat_weights_format format) {
    switch (format) {
        case SPLAT_WEIGHTS_SAFETENSORS:
            return io::WeightsFormat::kSafetensors;
        case SPLAT_WEIGHTS_NPZ:
            return io::WeightsFormat::kNpz;
        case SPLAT_WEIGHTS_PTH:
            return io::WeightsFormat::kPth;
        default:
            return invalid(
                "format is %d, expected SPLAT_WEIGHTS_SAFETENSORS, SPLAT_WEIGHTS_NPZ or "
                "SPLAT_WEIGHTS_PTH",
                format);
    }
}

/// The preset of prior models that weights are for; empty if there is none.
std::string prior_preset_of(const io::NamedTensors& tensors) {
    const auto sizes = vision::moge_sizes(tensors, {});
    return sizes.ok() ? vision::moge_preset(sizes.value()) : "";
}

std::string weights_report(const api::WeightsObject& object) {
    const io::WeightsFile& file = object.file;
    JsonWriter json;
    json.begin_object().member("format", object.from).key("metadata").begin_object();
    for (const auto& [key, value] : file.metadata) json.member(key, value);
    json.end().key("warnings").list(file.warnings).key("published");
    predict::PublishedFit fit = predict::published_fit(file.tensors, object.path);
    if (const std::string prior = prior_preset_of(file.tensors); !prior.empty())
        fit.look += ", of the preset " + prior + " of prior models";
    fit.write(json);
    return json.end().text();
}

std::shared_ptr<api::WeightsObject> weights_of(io::WeightsFile file, const char* path = "") {
    auto object = std::make_shared<api::WeightsObject>();
    object->file = std::move(file);
    object->from = io::weights_format_name(object->file.format);
    object->path = path;
    return object;
}

/// A copy of an array. Errors: kInvalidArgument, kShape, naming `argument`.
Result<io::NamedTensor> named_tensor(const splat_named_array& array, const std::string& argument) {
    SPLAT_TRY(api::require(array.name, (argument + ".name").c_str()));
    SPLAT_TRY(api::check_reserved(array.reserved, argument.c_str()));
    if (array.rank > SPLAT_MAX_RANK)
        return invalid("%s.rank is %u, expected at most %d", argument.c_str(), array.rank,
                       SPLAT_MAX_RANK);
    io::NamedTensor tensor;
    tensor.name = array.name;
    tensor.dims.assign(array.dims, array.dims + array.rank);
    SPLAT_ASSIGN(const std::uint64_t count, io::count_elements(tensor.dims, array.name));
    if (array.value_count != count)
        return error(Code::kShape, "%s.value_count is %llu, '%s' of shape %s has %llu",
                     argument.c_str(), llu(array.value_count), array.name,
                     io::dims_text(tensor.dims).c_str(), llu(count));
    if (count > 0) SPLAT_TRY(api::require(array.values, (argument + ".values").c_str()));
    tensor.values.own().assign(array.values, array.values + count);
    return tensor;
}

}  // namespace

splat_result splat_weights_load(const char* path, uint32_t flags, splat_weights* weights) {
    return api::create(weights, [&]() -> api::Weights::Made {
        SPLAT_TRY(api::require(path, "path"));
        SPLAT_TRY(api::check_flags(flags, SPLAT_WEIGHTS_COPY));
        SPLAT_ASSIGN(const std::string file_path, predict::weights_named(path));
        const bool mapped = (flags & SPLAT_WEIGHTS_COPY) == 0;
        SPLAT_ASSIGN(io::WeightsFile file, io::load_weights(file_path, decode_limits(), mapped));
        return weights_of(std::move(file), file_path.c_str());
    });
}

splat_result splat_weights_load_memory(const void* data, size_t bytes, splat_weights* weights) {
    return api::create(weights, [&]() -> api::Weights::Made {
        SPLAT_TRY(api::require(data, "data"));
        SPLAT_ASSIGN(io::WeightsFile file,
                     io::read_weights(
                         io::MemorySource({static_cast<const std::byte*>(data), bytes}), "memory"));
        return weights_of(std::move(file));
    });
}

splat_result splat_weights_from_arrays(const splat_named_array* arrays, uint64_t count,
                                       splat_weights* weights) {
    return api::create(weights, [&]() -> api::Weights::Made {
        if (count > 0) SPLAT_TRY(api::require(arrays, "arrays"));
        auto object = std::make_shared<api::WeightsObject>();
        for (std::uint64_t i = 0; i < count; ++i) {
            SPLAT_ASSIGN(io::NamedTensor tensor,
                         named_tensor(arrays[i], format("arrays[%llu]", llu(i))));
            SPLAT_TRY(object->file.tensors.add(std::move(tensor)));
        }
        object->from = "arrays";
        return object;
    });
}

splat_result splat_weights_save(splat_weights weights, const char* path, uint32_t flags) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, api::weights_to_use(weights, "weights"));
        SPLAT_TRY(api::require(path, "path"));
        SPLAT_TRY(api::check_flags(flags, SPLAT_WEIGHTS_HALF));
        return io::save_weights(object->file, path, (flags & SPLAT_WEIGHTS_HALF) != 0);
    });
}

splat_result splat_weights_save_memory(splat_weights weights, splat_weights_format format,
                                       uint32_t flags, void* buffer, size_t capacity,
                                       size_t* needed) {
    return api::guarded_bytes(buffer, capacity, needed, [&](auto give) -> Status {
        SPLAT_ASSIGN(const auto object, api::weights_to_use(weights, "weights"));
        SPLAT_TRY(api::check_flags(flags, SPLAT_WEIGHTS_HALF));
        SPLAT_ASSIGN(const io::WeightsFormat wanted, format_to_write(format));
        SPLAT_ASSIGN(const io::FilePieces file,
                     io::write_weights(object->file, wanted, (flags & SPLAT_WEIGHTS_HALF) != 0));
        return give(file.pieces());
    });
}

splat_result splat_weights_count(splat_weights weights, uint32_t* count) {
    return api::with(weights, [&](const auto& object) -> Status {
        SPLAT_TRY(api::require(count, "count"));
        *count = static_cast<std::uint32_t>(object->file.tensors.size());
        return {};
    });
}

splat_result splat_weights_get_info(splat_weights weights, uint32_t index,
                                    splat_weights_info* info) {
    return api::with(weights, [&](const auto& object) -> Status {
        SPLAT_ASSIGN(const io::NamedTensor* tensor, tensor_of(*object, index));
        SPLAT_TRY(api::check_fill(info, "info"));
        splat_weights_info filled{};
        filled.rank = static_cast<std::uint32_t>(tensor->dims.size());
        for (std::size_t i = 0; i < tensor->dims.size(); ++i) filled.dims[i] = tensor->dims[i];
        filled.elements = tensor->values.size();
        filled.name = tensor->name.c_str();
        filled.dtype = io::type_name(tensor->type);
        api::give(filled, info);
        return {};
    });
}

splat_result splat_weights_find(splat_weights weights, const char* name, uint32_t* index) {
    return api::with(weights, [&](const auto& object) -> Status {
        SPLAT_TRY(api::require(name, "name", index, "index"));
        const io::NamedTensors& tensors = object->file.tensors;
        const io::NamedTensor* found = tensors.find(name);
        if (found == nullptr) return not_found("the weights have no tensor '%s'", name);
        *index = static_cast<std::uint32_t>(found - &tensors[0]);
        return {};
    });
}

splat_result splat_weights_read(splat_weights weights, uint32_t index, float* values,
                                size_t bytes) {
    return api::with(weights, [&](const auto& object) -> Status {
        SPLAT_ASSIGN(const io::NamedTensor* tensor, tensor_of(*object, index));
        const std::size_t wanted = tensor->values.size() * sizeof(float);
        if (wanted > 0 || bytes > 0) SPLAT_TRY(api::require(values, "values"));
        if (bytes < wanted)
            return invalid("bytes is %zu, the tensor '%s' has %zu", bytes, tensor->name.c_str(),
                           wanted);
        SPLAT_TRY(object->file.tensors.unchanged());
        if (wanted != 0) std::memcpy(values, tensor->values.data(), wanted);
        return {};
    });
}

splat_result splat_weights_data(splat_weights weights, uint32_t index, const float** values,
                                uint64_t* count) {
    return api::with(weights, [&](const auto& object) -> Status {
        SPLAT_ASSIGN(const io::NamedTensor* tensor, tensor_of(*object, index));
        SPLAT_TRY(api::require(values, "values"));
        SPLAT_TRY(object->file.tensors.unchanged());
        *values = tensor->values.empty() ? nullptr : tensor->values.data();
        if (count != nullptr) *count = tensor->values.size();
        return {};
    });
}

splat_result splat_weights_report(splat_weights weights, char* buffer, size_t capacity,
                                  size_t* needed) {
    return api::report(weights, buffer, capacity, needed,
                       [](auto& object) { return weights_report(object); });
}

splat_result splat_weights_fold(splat_weights weights, splat_weights adapters, double alpha,
                                uint32_t flags, splat_weights* folded) {
    return api::create(folded, "folded", [&]() -> api::Weights::Made {
        SPLAT_ASSIGN(const auto from, api::weights_to_use(weights, "weights"));
        auto given = from;
        if (adapters != nullptr) SPLAT_SET(given, api::weights_to_use(adapters, "adapters"));
        if (!std::isfinite(alpha)) return invalid("alpha is %g, expected a finite number", alpha);
        SPLAT_TRY(api::check_flags(flags, SPLAT_FOLD_OUT));
        if (!model::has_adapters(given->file.tensors))
            return invalid(
                "%s no tensors '<layer>.lora_A'",
                adapters == nullptr ? "adapters is NULL, and weights has" : "adapters has");
        auto made = std::make_shared<api::WeightsObject>();
        SPLAT_ASSIGN(made->file.tensors,
                     model::merge_adapters(from->file.tensors, given->file.tensors, alpha,
                                           (flags & SPLAT_FOLD_OUT) ? -1 : 1));
        SPLAT_TRY(from->file.tensors.unchanged());  // files may have changed during the fold
        SPLAT_TRY(given->file.tensors.unchanged());
        for (const auto& entry : from->file.metadata)  // the result has no adapters
            if (entry.first != "lora_alpha" && entry.first != "lora_rank")
                made->file.metadata.push_back(entry);
        made->from = "model";
        return made;
    });
}
