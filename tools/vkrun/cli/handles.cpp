#include "vkrun/cli/handles.h"

#include <regex>
#include <utility>

namespace vkrun {
namespace {

ExitCode code_of(splat_result result, ExitCode blame) {
    switch (result) {
        case SPLAT_ERROR_NO_DEVICE:
            return kNoDevice;
        case SPLAT_ERROR_OUT_OF_HOST_MEMORY:
        case SPLAT_ERROR_OUT_OF_DEVICE_MEMORY:
            return kOutOfMemory;
        case SPLAT_ERROR_INVALID_ARGUMENT:
        case SPLAT_ERROR_INVALID_STATE:
        case SPLAT_ERROR_SHAPE_MISMATCH:
        case SPLAT_ERROR_UNSUPPORTED:
        case SPLAT_ERROR_NOT_FOUND:
        case SPLAT_ERROR_IO:
        case SPLAT_ERROR_FORMAT:
            return blame;
        default:
            return kFailed;
    }
}

}  // namespace

std::string in_own_words(std::string text) {
    static const std::vector<std::pair<std::regex, const char*>> kWords = {
        // "(splat_decode_set_limits, --decode-scale)"
        {std::regex("\\b(SPLAT|splat)_\\w+, (--)"), "$2"},
        {std::regex("\"made_by\": \"splat_\\w+\", \"version\": 1, "), ""},  // marks folder values
        {std::regex("SPLAT_DEVICE_VALIDATION and "), ""},
        {std::regex("timeout_ns or (SPLAT_TIMEOUT_SCALE)"), "$1"},
        {std::regex("free tensors,? or raise max_device_bytes"),
         "make the work smaller, or choose another device (--device)"}};
    const auto has = [&text](const char* word) { return text.find(word) != std::string::npos; };
    if (!has("splat_") && !has("SPLAT_") && !has("max_device_bytes")) return text;  // mostly
    for (const auto& [found, instead] : kWords) text = std::regex_replace(text, found, instead);
    return text;
}

std::string library_message() {
    return in_own_words(splat_last_error_message());
}

void check(splat_result result, ExitCode blame) {
    if (result >= SPLAT_OK) return;
    const std::string sentence = library_message();
    throw Failure(code_of(result, blame),
                  sentence.empty() ? in_own_words(splat_result_sentence(result)) : sentence,
                  result);
}

Tensor make_tensor(splat_device device, const std::string& name,
                   const std::vector<std::int64_t>& dims, const std::vector<float>& data) {
    auto desc = sized<splat_tensor_desc>();
    desc.name = name.c_str();
    for (const std::int64_t size : dims) desc.dims[desc.rank++] = size;
    Tensor tensor;
    check(splat_tensor_create(device, &desc, tensor.out()));
    if (!data.empty())
        check(splat_tensor_write(tensor.get(), data.data(), data.size() * sizeof(float), nullptr));
    return tensor;
}

std::vector<float> read_tensor(splat_tensor tensor) {
    auto info = sized<splat_tensor_info>();
    check(splat_tensor_get_info(tensor, &info));
    std::vector<float> data(info.elements);
    check(splat_tensor_read(tensor, data.data(), data.size() * sizeof(float), nullptr));
    return data;
}

Weights load_weights(const std::string& path) {
    Weights weights;
    check(splat_weights_load(path.c_str(), 0, weights.out()), kBadData);
    return weights;
}

}  // namespace vkrun
