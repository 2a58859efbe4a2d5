// The rows of models and modules.
#include "api/misuse/misuse_table.h"

namespace splat::test {
namespace {

constexpr float kValues[4] = {1, 2, 3, 4};

/// Rows of the ports of models and of modules.
template <class Rows>
void port_rows(const Rows& ports) {
    ports.each("kind", "none", kArgument, 0, 4).each("ports", "NULL", kArgument, nullptr);
    const auto none = ports.given("ports", nullptr).given("capacity", 0U).given("count", nullptr);
    none.as_is("capacity", "NULL or 0", SPLAT_INCOMPLETE)
        .as_is("count", "NULL or 0", SPLAT_INCOMPLETE);
}

}  // namespace

void MisuseTable::model_rows() {
    const auto invalid = wrong_structs<splat_model_desc>("splat_model_create");
    invalid("an unknown precision", kArgument, [](auto& d) { d.precision = 4; });
    invalid("too many objects", kArgument, [](auto& d) { d.objects = 4097; });
    invalid("an invalid configuration", kArgument, [](auto& d) { d.config = "]"; });
    invalid("an unknown key", kArgument, [](auto& d) { d.config = "model: {base_dims: 8}"; });
    invalid("an unknown section", kArgument, [](auto& d) { d.config = "modle: {base_dim: 8}"; });
    invalid("an unknown key of training", kArgument,
            [](auto& d) { d.config = "opt: {lora_rnak: 8}"; });
    invalid("a resolution that does not fit the levels", kArgument,
            [](auto& d) { d.config = "data: {training_resolution: 30}"; });
    SPLAT_WRONG(splat_model_init).each("seed", "any", SPLAT_OK, ~std::uint64_t{0});
    SPLAT_WRONG(splat_model_load)
        .as_is("weights", "of another network", kArgument)
        .each("flags", "adapters and more", kArgument, SPLAT_LOAD_ADAPTERS | SPLAT_LOAD_GRAFT)
        .each("flags", "adapters for a network without them", kState, SPLAT_LOAD_ADAPTERS);
    SPLAT_WRONG(splat_model_export)
        .each("what", "none", kArgument, 0U, 3U)
        .each("what", "without adapters", kState, SPLAT_EXPORT_ADAPTERS, SPLAT_EXPORT_MERGED);
    port_rows(SPLAT_WRONG(splat_model_ports));
}

void MisuseTable::model_pass_rows() {
    const auto tensor = SPLAT_WRONG(splat_model_tensor);
    tensor.each("name", "NULL", kArgument, nullptr).each("name", "means[1]", kArgument, "means[1]");
    for (const char* name : {"", "mean", "means[", "means[]", "means[-1]", "means[4294967296]",
                             "images[0]", "focals", "grad:raw"})
        tensor.each("name", name, kNotFound, name);
    for (const char* name : {"grad:means", "grad:images", "grad:network_with_offset.out.bias"})
        tensor.each("name", name, kState, name);
    constexpr const char* kBias = "network_with_offset.out.bias";
    SPLAT_WRONG(splat_model_forward).as_is("input", "no images", kArgument);
    SPLAT_WRONG(splat_model_write)
        .given("bytes", sizeof kValues)
        .each("name", "a result", kNotFound, "means")
        .given("name", kBias)
        .as_is("bytes", "too few", kShape);
    SPLAT_WRONG(splat_model_read)
        .each("name", "an unknown name", kNotFound, "mean")
        .each("name", "before the first pass", kState, "means")
        .given("name", kBias)
        .as_is("bytes", "too few", kArgument);
    SPLAT_WRONG(splat_model_scene).as_is("object", "before the first pass", kState);
    SPLAT_WRONG(splat_model_backward).as_is("gradients", "before the first pass", kState);
}

void MisuseTable::module_rows() {
    const auto invalid = wrong_structs<splat_module_desc>("splat_module_create");
    static const splat_port kNameless = port_desc({1, 4}, nullptr), kScalar = port_desc({}, "x");
    static splat_port flagged = port_desc({1, 4}, "x"), empty = flagged;
    flagged.flags = SPLAT_PORT_OPTIONAL;
    empty.dims[1] = 0;
    invalid("no type", kArgument, [](auto& d) { d.type = nullptr; });
    invalid("an unknown type", kArgument, [](auto& d) { d.type = "sil"; });
    invalid("invalid attributes", kArgument, [](auto& d) { d.attributes = "]"; });
    invalid("no ports", kArgument, [](auto& d) { d.ports = nullptr; });
    invalid("too many ports", kArgument, [](auto& d) { d.port_count = 65; });
    invalid("an unknown precision", kArgument, [](auto& d) { d.precision = 4; });
    invalid("a port without a name", kArgument, [](auto& d) { d.ports = &kNameless; });
    invalid("a port with flags", kArgument, [](auto& d) { d.ports = &flagged; });
    invalid("a scalar port", kArgument, [](auto& d) { d.ports = &kScalar; });
    invalid("an empty port", kArgument, [](auto& d) { d.ports = &empty; });
    SPLAT_WRONG(splat_module_init).each("seed", "any", SPLAT_OK, ~std::uint64_t{0});
    port_rows(SPLAT_WRONG(splat_module_ports));
    const auto names = [](const auto& rows) {
        rows.given("bytes", 16)
            .each("name", "none", kArgument, nullptr)
            .each("name", "none", kNotFound, "z", "grad:z", "");
        rows.given("name", "x").each("bytes", "others", kShape, 0, 12, 64);
    };
    names(SPLAT_WRONG(splat_module_write));
    names(SPLAT_WRONG(splat_module_read));
    SPLAT_WRONG(splat_module_read)
        .given("bytes", 16)
        .each("name", "before the first pass", kState, "y");
    SPLAT_WRONG(splat_module_backward).as_is("module", "made without gradients", kState);
}

}  // namespace splat::test
