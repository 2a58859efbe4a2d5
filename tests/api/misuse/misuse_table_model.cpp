// The rows of models.
#include "api/misuse/misuse_table.h"

namespace splat::test {

namespace {

constexpr float kValues[4] = {1, 2, 3, 4};

}  // namespace

void MisuseTable::model_rows() {
    const auto invalid = wrong_descs<splat_model_desc>("splat_model_create");
    invalid("an unknown precision", [](splat_model_desc& d) { d.precision = 4; });
    invalid("too many objects", [](splat_model_desc& d) { d.objects = 4097; });
    invalid("an invalid configuration", [](splat_model_desc& d) { d.config = "]"; });
    invalid("an unknown key", [](splat_model_desc& d) { d.config = "model: {base_dims: 8}"; });
    invalid("an unknown section", [](splat_model_desc& d) { d.config = "modle: {base_dim: 8}"; });
    invalid("an unknown key of training",
            [](splat_model_desc& d) { d.config = "opt: {lora_rnak: 8}"; });
    invalid("a resolution that does not fit the levels",
            [](splat_model_desc& d) { d.config = "data: {training_resolution: 30}"; });

    model_state_rows();
    model_pass_rows();
    model_tensor_rows();
}

void MisuseTable::model_tensor_rows() {
    for (const splat_port_kind kind : {0, 4})
        add("splat_model_ports", "kind", "none", kArgument, [this, kind] {
            return splat_model_ports(model_, kind, out<splat_port>(), 1, out<std::uint32_t>());
        });
    add("splat_model_ports", "ports", "NULL", kArgument, [this] {
        return splat_model_ports(model_, SPLAT_PORT_KIND_INPUT, nullptr, 1, out<std::uint32_t>());
    });
    for (const char* parameter : {"capacity", "count"})
        add("splat_model_ports", parameter, "NULL or 0", SPLAT_INCOMPLETE, [this] {
            return splat_model_ports(model_, SPLAT_PORT_KIND_INPUT, nullptr, 0, nullptr);
        });
    const std::pair<const char*, splat_result> names[] = {
        {nullptr, kArgument},
        {"", SPLAT_ERROR_NOT_FOUND},
        {"mean", SPLAT_ERROR_NOT_FOUND},
        {"means[", SPLAT_ERROR_NOT_FOUND},
        {"means[]", SPLAT_ERROR_NOT_FOUND},
        {"means[-1]", SPLAT_ERROR_NOT_FOUND},
        {"means[4294967296]", SPLAT_ERROR_NOT_FOUND},
        {"images[0]", SPLAT_ERROR_NOT_FOUND},
        {"focals", SPLAT_ERROR_NOT_FOUND},
        {"grad:raw", SPLAT_ERROR_NOT_FOUND},
        {"means[1]", kArgument},
        {"grad:means", kState},
        {"grad:images", kState},
        {"grad:network_with_offset.out.bias", kState}};
    for (const auto& [name, expected] : names)
        add("splat_model_tensor", "name", name == nullptr ? "NULL" : name, expected,
            [this, name = name] { return splat_model_tensor(model_, name, out<splat_tensor>()); });
}

void MisuseTable::model_state_rows() {
    add("splat_model_init", "seed", "any", SPLAT_OK,
        [this] { return splat_model_init(model_, ~std::uint64_t{0}); });
    add("splat_model_load", "weights", "of another network", kArgument,
        [this] { return splat_model_load(model_, weights_, 0); });
    add("splat_model_load", "flags", "adapters and more", kArgument, [this] {
        return splat_model_load(model_, weights_, SPLAT_LOAD_ADAPTERS | SPLAT_LOAD_GRAFT);
    });
    add("splat_model_load", "flags", "adapters for a network without them", kState,
        [this] { return splat_model_load(model_, weights_, SPLAT_LOAD_ADAPTERS); });
    for (const std::uint32_t what : {0U, 3U})
        add("splat_model_export", "what", "none", kArgument,
            [this, what] { return splat_model_export(model_, what, out<splat_weights>()); });
    for (const std::uint32_t what : {SPLAT_EXPORT_ADAPTERS, SPLAT_EXPORT_MERGED})
        add("splat_model_export", "what", "without adapters", kState,
            [this, what] { return splat_model_export(model_, what, out<splat_weights>()); });
}

void MisuseTable::model_pass_rows() {
    const splat_model_input input = sized<splat_model_input>();
    add("splat_model_forward", "input", "no images", kArgument,
        [this, input] { return splat_model_forward(model_, &input); });
    add("splat_model_write", "name", "a result", SPLAT_ERROR_NOT_FOUND,
        [this] { return splat_model_write(model_, "means", kValues, sizeof kValues); });
    add("splat_model_write", "bytes", "too few", SPLAT_ERROR_SHAPE_MISMATCH, [this] {
        return splat_model_write(model_, "network_with_offset.out.bias", kValues, sizeof kValues);
    });
    add("splat_model_read", "name", "an unknown name", SPLAT_ERROR_NOT_FOUND,
        [this] { return splat_model_read(model_, "mean", values_out(), 64); });
    add("splat_model_read", "name", "before the first pass", kState,
        [this] { return splat_model_read(model_, "means", values_out(), 64); });
    add("splat_model_read", "bytes", "too few", kArgument, [this] {
        return splat_model_read(model_, "network_with_offset.out.bias", values_out(), 64);
    });
    add("splat_model_scene", "object", "before the first pass", kState,
        [this] { return splat_model_scene(model_, 0, out<splat_scene>()); });
    const splat_model_gradients none = sized<splat_model_gradients>();
    add("splat_model_backward", "gradients", "before the first pass", kState,
        [this, none] { return splat_model_backward(model_, &none); });
}

void MisuseTable::module_rows() {
    const auto invalid = wrong_descs<splat_module_desc>("splat_module_create");
    static const splat_port kNameless = port_desc({1, 4}, nullptr);
    static splat_port flagged = port_desc({1, 4}, "x");
    static const splat_port kScalar = port_desc({}, "x");
    static splat_port empty = port_desc({1, 4}, "x");
    flagged.flags = SPLAT_PORT_OPTIONAL;
    empty.dims[1] = 0;
    invalid("no type", [](splat_module_desc& d) { d.type = nullptr; });
    invalid("an unknown type", [](splat_module_desc& d) { d.type = "sil"; });
    invalid("invalid attributes", [](splat_module_desc& d) { d.attributes = "]"; });
    invalid("no ports", [](splat_module_desc& d) { d.ports = nullptr; });
    invalid("too many ports", [](splat_module_desc& d) { d.port_count = 65; });
    invalid("an unknown precision", [](splat_module_desc& d) { d.precision = 4; });
    invalid("a port without a name", [](splat_module_desc& d) { d.ports = &kNameless; });
    invalid("a port with flags", [](splat_module_desc& d) { d.ports = &flagged; });
    invalid("a scalar port", [](splat_module_desc& d) { d.ports = &kScalar; });
    invalid("an empty port", [](splat_module_desc& d) { d.ports = &empty; });
    module_tensor_rows();
}

void MisuseTable::module_tensor_rows() {
    add("splat_module_init", "seed", "any", SPLAT_OK,
        [this] { return splat_module_init(module_, ~std::uint64_t{0}); });
    for (const char* name : {static_cast<const char*>(nullptr), "z", "grad:z", ""}) {
        const splat_result expected = name == nullptr ? kArgument : SPLAT_ERROR_NOT_FOUND;
        add("splat_module_write", "name", "none", expected,
            [this, name] { return splat_module_write(module_, name, kValues, sizeof kValues); });
        add("splat_module_read", "name", "none", expected,
            [this, name] { return splat_module_read(module_, name, values_out(), 16); });
    }
    for (const splat_port_kind kind : {0, 4})
        add("splat_module_ports", "kind", "none", kArgument, [this, kind] {
            return splat_module_ports(module_, kind, out<splat_port>(), 1, out<std::uint32_t>());
        });
    add("splat_module_ports", "ports", "NULL", kArgument, [this] {
        return splat_module_ports(module_, SPLAT_PORT_KIND_INPUT, nullptr, 1, out<std::uint32_t>());
    });
    for (const char* parameter : {"capacity", "count"})
        add("splat_module_ports", parameter, "NULL or 0", SPLAT_INCOMPLETE, [this] {
            return splat_module_ports(module_, SPLAT_PORT_KIND_INPUT, nullptr, 0, nullptr);
        });
    add("splat_module_read", "name", "before the first pass", kState,
        [this] { return splat_module_read(module_, "y", values_out(), 16); });
    for (const std::size_t bytes : {std::size_t{0}, std::size_t{12}, std::size_t{64}}) {
        add("splat_module_write", "bytes", "others", SPLAT_ERROR_SHAPE_MISMATCH,
            [this, bytes] { return splat_module_write(module_, "x", kValues, bytes); });
        add("splat_module_read", "bytes", "others", SPLAT_ERROR_SHAPE_MISMATCH,
            [this, bytes] { return splat_module_read(module_, "x", values_out(), bytes); });
    }
    add("splat_module_backward", "module", "made without gradients", kState,
        [this] { return splat_module_backward(module_); });
}

}  // namespace splat::test
