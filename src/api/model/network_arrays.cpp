#include "api/model/network_arrays.h"

namespace splat::api {
namespace {

std::string channel_names(const config::ModelConfig& c) {
    return std::string("RGB") + (c.depth ? ", depth" : "") + (c.normal ? ", normal" : "") +
           (c.mask ? ", mask" : "") + (c.plane ? ", planes" : "") +
           (c.origin_distance ? ", origin distance" : "") +
           (c.positions == kHeadInputDepth ? ", depth in scene units" : "");
}

}  // namespace

Status check_array(const char* type, const char* name, const float* values, std::uint32_t wanted,
                   const std::string& use) {
    if ((values != nullptr) == (wanted > 0)) return {};
    if (wanted > 0)
        return invalid(
            "%s.%s is NULL, expected %u numbers for each image: the configuration has %s", type,
            name, wanted, use.c_str());
    return invalid("%s.%s is given, expected NULL: the configuration has %s", type, name,
                   use.c_str());
}

Result<std::span<const float>> host_array(const char* type, const char* name, HostArray array,
                                          const std::vector<std::uint64_t>& dims) {
    std::uint64_t expected = 1;
    std::string shape;
    for (const std::uint64_t size : dims) {
        expected *= size;
        shape += (shape.empty() ? "[" : ", ") + std::to_string(size);
    }
    if (array.values == nullptr && array.count == 0) return std::span<const float>();
    if (array.values == nullptr)
        return invalid("%s.%s is NULL, but %s_count is %llu", type, name, name, llu(array.count));
    if (array.count != 0 && array.count != expected)
        return error(Code::kShape, "%s.%s has %llu numbers, expected %llu: %s]", type, name,
                     llu(array.count), llu(expected), shape.c_str());
    return std::span(array.values, expected);
}

Status check_network_arrays(const NetworkArrays& given, const config::ModelConfig& c,
                            std::uint32_t objects) {
    if (given.channels != 0 && given.channels != c.input_channels())
        return error(Code::kShape, "%s.channels is %u, expected %u: %s", given.type, given.channels,
                     c.input_channels(), channel_names(c).c_str());
    if (given.objects != 0 && given.objects != objects)
        return error(Code::kShape, "%s.objects is %u, expected %u", given.type, given.objects,
                     objects);
    SPLAT_TRY(check_array(given.type, "focals", given.focals, c.fov_degrees == 0 ? 2 : 0,
                          format("data.fov %g", static_cast<double>(c.fov_degrees))));
    const bool custom = c.embedding == config::Embedding::kCustom;
    SPLAT_TRY(check_array(given.type, "embedding", given.embedding,
                          custom ? c.embedding_length() : 0,
                          custom ? "a custom embedding" : "no custom embedding"));
    return check_array(given.type, "tokens", given.tokens, c.token_dim * c.tokens,
                       format("model.token_dim %u and model.tokens %u", c.token_dim, c.tokens));
}

}  // namespace splat::api
