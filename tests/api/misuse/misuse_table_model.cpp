// The rows of models.
#include "api/misuse/misuse_table.h"

namespace splat::test {

namespace {

constexpr float kValues[4] = {1, 2, 3, 4};

}  // namespace

void MisuseTable::model_rows() {
    const splat_model_desc good = model_desc();
    handles<splat_device>(
        "splat_model_create", "device",
        [this, good](splat_device d) { return splat_model_create(d, &good, outputs.model.out()); },
        kHandle);
    descs<splat_model_desc>("splat_model_create", good, [this](const splat_model_desc* desc) {
        return splat_model_create(device_, desc, outputs.model.out());
    });
    add("splat_model_create", "desc", "NULL", kArgument,
        [this] { return splat_model_create(device_, nullptr, outputs.model.out()); });
    add("splat_model_create", "model", "NULL", kArgument,
        [this, good] { return splat_model_create(device_, &good, nullptr); });
    const auto invalid = [&](const char* what, void (*change)(splat_model_desc&)) {
        splat_model_desc desc = good;
        change(desc);
        add("splat_model_create", "desc", what, kArgument,
            [this, desc] { return splat_model_create(device_, &desc, outputs.model.out()); });
    };
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
    const auto on_model = [this](const char* name, std::function<splat_result(splat_model)> call) {
        handles<splat_model>(name, "model", std::move(call), kHandle);
    };
    on_model("splat_model_get_info",
             [this](splat_model m) { return splat_model_get_info(m, outputs.model_info.out()); });
    infos<splat_model_info>("splat_model_get_info", "info", [this](splat_model_info* info) {
        return splat_model_get_info(model_, info);
    });
    on_model("splat_model_ports", [this](splat_model m) {
        return splat_model_ports(m, SPLAT_PORT_KIND_INPUT, outputs.port.out(), 1,
                                 outputs.count.out());
    });
    for (const splat_port_kind kind : {0, 4})
        add("splat_model_ports", "kind", "none", kArgument, [this, kind] {
            return splat_model_ports(model_, kind, outputs.port.out(), 1, outputs.count.out());
        });
    add("splat_model_ports", "ports", "NULL", kArgument, [this] {
        return splat_model_ports(model_, SPLAT_PORT_KIND_INPUT, nullptr, 1, outputs.count.out());
    });
    for (const char* parameter : {"capacity", "count"})
        add("splat_model_ports", parameter, "NULL or 0", SPLAT_INCOMPLETE, [this] {
            return splat_model_ports(model_, SPLAT_PORT_KIND_INPUT, nullptr, 0, nullptr);
        });
    on_model("splat_model_tensor", [this](splat_model m) {
        return splat_model_tensor(m, "means", outputs.tensor.out());
    });
    add("splat_model_tensor", "tensor", "NULL", kArgument,
        [this] { return splat_model_tensor(model_, "means", nullptr); });
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
            [this, name = name] { return splat_model_tensor(model_, name, outputs.tensor.out()); });
}

void MisuseTable::model_state_rows() {
    const auto on_model = [this](const char* name, std::function<splat_result(splat_model)> call) {
        handles<splat_model>(name, "model", std::move(call), kHandle);
    };
    on_model("splat_model_init", [](splat_model m) { return splat_model_init(m, 1); });
    add("splat_model_init", "seed", "any", SPLAT_OK,
        [this] { return splat_model_init(model_, ~std::uint64_t{0}); });
    on_model("splat_model_load",
             [this](splat_model m) { return splat_model_load(m, weights_, 0); });
    handles<splat_weights>(
        "splat_model_load", "weights",
        [this](splat_weights w) { return splat_model_load(model_, w, 0); }, kHandle);
    add("splat_model_load", "weights", "of another network", kArgument,
        [this] { return splat_model_load(model_, weights_, 0); });
    add("splat_model_load", "flags", "unknown", kArgument,
        [this] { return splat_model_load(model_, weights_, 1U << 6); });
    add("splat_model_load", "flags", "adapters and more", kArgument, [this] {
        return splat_model_load(model_, weights_, SPLAT_LOAD_ADAPTERS | SPLAT_LOAD_GRAFT);
    });
    add("splat_model_load", "flags", "adapters for a network without them", kState,
        [this] { return splat_model_load(model_, weights_, SPLAT_LOAD_ADAPTERS); });
    on_model("splat_model_store",
             [this](splat_model m) { return splat_model_store(m, outputs.weights.out()); });
    add("splat_model_store", "weights", "NULL", kArgument,
        [this] { return splat_model_store(model_, nullptr); });
    on_model("splat_model_export", [this](splat_model m) {
        return splat_model_export(m, SPLAT_EXPORT_ADAPTERS, outputs.weights.out());
    });
    for (const std::uint32_t what : {0U, 3U})
        add("splat_model_export", "what", "none", kArgument,
            [this, what] { return splat_model_export(model_, what, outputs.weights.out()); });
    for (const std::uint32_t what : {SPLAT_EXPORT_ADAPTERS, SPLAT_EXPORT_MERGED})
        add("splat_model_export", "what", "without adapters", kState,
            [this, what] { return splat_model_export(model_, what, outputs.weights.out()); });
    add("splat_model_export", "weights", "NULL", kArgument,
        [this] { return splat_model_export(model_, SPLAT_EXPORT_ADAPTERS, nullptr); });
    on_model("splat_model_report", [this](splat_model m) {
        return splat_model_report(m, *outputs.text.out(), 16, outputs.size.out());
    });
    for (const char* parameter : {"buffer", "capacity", "needed"})
        add("splat_model_report", parameter, "NULL or 0", SPLAT_INCOMPLETE,
            [this] { return splat_model_report(model_, nullptr, 0, nullptr); });
    handles<splat_model>("splat_model_destroy", "model", splat_model_destroy, SPLAT_OK);
}

void MisuseTable::model_pass_rows() {
    const auto on_model = [this](const char* name, std::function<splat_result(splat_model)> call) {
        handles<splat_model>(name, "model", std::move(call), kHandle);
    };
    const splat_model_input input = sized<splat_model_input>();
    on_model("splat_model_forward",
             [input](splat_model m) { return splat_model_forward(m, &input); });
    add("splat_model_forward", "input", "NULL", kArgument,
        [this] { return splat_model_forward(model_, nullptr); });
    add("splat_model_forward", "input", "struct_size cut", kArgument, [this, input] {
        splat_model_input cut = input;
        cut.struct_size -= 1;  // less than the first version
        return splat_model_forward(model_, &cut);
    });
    add("splat_model_forward", "input", "no images", kArgument,
        [this, input] { return splat_model_forward(model_, &input); });
    on_model("splat_model_write",
             [](splat_model m) { return splat_model_write(m, "means", kValues, sizeof kValues); });
    add("splat_model_write", "name", "NULL", kArgument,
        [this] { return splat_model_write(model_, nullptr, kValues, sizeof kValues); });
    add("splat_model_write", "name", "a result", SPLAT_ERROR_NOT_FOUND,
        [this] { return splat_model_write(model_, "means", kValues, sizeof kValues); });
    add("splat_model_write", "values", "NULL", kArgument,
        [this] { return splat_model_write(model_, "means", nullptr, sizeof kValues); });
    add("splat_model_write", "bytes", "too few", SPLAT_ERROR_SHAPE_MISMATCH, [this] {
        return splat_model_write(model_, "network_with_offset.out.bias", kValues, sizeof kValues);
    });
    on_model("splat_model_read", [this](splat_model m) {
        return splat_model_read(m, "means", *outputs.values.out(), 64);
    });
    add("splat_model_read", "name", "NULL", kArgument,
        [this] { return splat_model_read(model_, nullptr, *outputs.values.out(), 64); });
    add("splat_model_read", "name", "an unknown name", SPLAT_ERROR_NOT_FOUND,
        [this] { return splat_model_read(model_, "mean", *outputs.values.out(), 64); });
    add("splat_model_read", "name", "before the first pass", kState,
        [this] { return splat_model_read(model_, "means", *outputs.values.out(), 64); });
    add("splat_model_read", "values", "NULL", kArgument,
        [this] { return splat_model_read(model_, "means", nullptr, 64); });
    add("splat_model_read", "bytes", "too few", kArgument, [this] {
        return splat_model_read(model_, "network_with_offset.out.bias", *outputs.values.out(), 64);
    });
    on_model("splat_model_scene",
             [this](splat_model m) { return splat_model_scene(m, 0, outputs.scene.out()); });
    add("splat_model_scene", "scene", "NULL", kArgument,
        [this] { return splat_model_scene(model_, 0, nullptr); });
    add("splat_model_scene", "object", "before the first pass", kState,
        [this] { return splat_model_scene(model_, 0, outputs.scene.out()); });
    const splat_model_gradients none = sized<splat_model_gradients>();
    on_model("splat_model_backward",
             [none](splat_model m) { return splat_model_backward(m, &none); });
    add("splat_model_backward", "gradients", "NULL", kArgument,
        [this] { return splat_model_backward(model_, nullptr); });
    add("splat_model_backward", "gradients", "before the first pass", kState,
        [this, none] { return splat_model_backward(model_, &none); });
    const auto wrong = [&](const char* what, splat_result expected,
                           void (*change)(splat_model_gradients&)) {
        splat_model_gradients given = none;
        change(given);
        add("splat_model_backward", "gradients", what, expected,
            [this, given] { return splat_model_backward(model_, &given); });
    };
    wrong("struct_size cut", kArgument, [](splat_model_gradients& g) { g.struct_size -= 1; });
    wrong("unknown flags", kArgument, [](splat_model_gradients& g) { g.flags = 2; });
    on_model("splat_model_zero_gradients",
             [](splat_model m) { return splat_model_zero_gradients(m); });
}

void MisuseTable::module_rows() {
    const splat_module_desc good = module_desc();
    handles<splat_device>(
        "splat_module_create", "device",
        [this, good](splat_device d) {
            return splat_module_create(d, &good, outputs.module.out());
        },
        kHandle);
    descs<splat_module_desc>("splat_module_create", good, [this](const splat_module_desc* desc) {
        return splat_module_create(device_, desc, outputs.module.out());
    });
    add("splat_module_create", "desc", "NULL", kArgument,
        [this] { return splat_module_create(device_, nullptr, outputs.module.out()); });
    add("splat_module_create", "module", "NULL", kArgument,
        [this, good] { return splat_module_create(device_, &good, nullptr); });
    const auto invalid = [&](const char* what, void (*change)(splat_module_desc&)) {
        splat_module_desc desc = good;
        change(desc);
        add("splat_module_create", "desc", what, kArgument,
            [this, desc] { return splat_module_create(device_, &desc, outputs.module.out()); });
    };
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
    const auto on_module = [this](const char* name,
                                  std::function<splat_result(splat_module)> call) {
        handles<splat_module>(name, "module", std::move(call), kHandle);
    };
    on_module("splat_module_init", [](splat_module m) { return splat_module_init(m, 1); });
    add("splat_module_init", "seed", "any", SPLAT_OK,
        [this] { return splat_module_init(module_, ~std::uint64_t{0}); });
    on_module("splat_module_report", [this](splat_module m) {
        return splat_module_report(m, *outputs.text.out(), 16, outputs.size.out());
    });
    for (const char* parameter : {"buffer", "capacity", "needed"})
        add("splat_module_report", parameter, "NULL or 0", SPLAT_INCOMPLETE,
            [this] { return splat_module_report(module_, nullptr, 0, nullptr); });
    on_module("splat_module_write",
              [](splat_module m) { return splat_module_write(m, "x", kValues, sizeof kValues); });
    on_module("splat_module_read", [this](splat_module m) {
        return splat_module_read(m, "x", *outputs.values.out(), 16);
    });
    for (const char* name : {static_cast<const char*>(nullptr), "z", "grad:z", ""}) {
        const splat_result expected = name == nullptr ? kArgument : SPLAT_ERROR_NOT_FOUND;
        add("splat_module_write", "name", "none", expected,
            [this, name] { return splat_module_write(module_, name, kValues, sizeof kValues); });
        add("splat_module_read", "name", "none", expected,
            [this, name] { return splat_module_read(module_, name, *outputs.values.out(), 16); });
    }
    on_module("splat_module_ports", [this](splat_module m) {
        return splat_module_ports(m, SPLAT_PORT_KIND_INPUT, outputs.port.out(), 1,
                                  outputs.count.out());
    });
    for (const splat_port_kind kind : {0, 4})
        add("splat_module_ports", "kind", "none", kArgument, [this, kind] {
            return splat_module_ports(module_, kind, outputs.port.out(), 1, outputs.count.out());
        });
    add("splat_module_ports", "ports", "NULL", kArgument, [this] {
        return splat_module_ports(module_, SPLAT_PORT_KIND_INPUT, nullptr, 1, outputs.count.out());
    });
    for (const char* parameter : {"capacity", "count"})
        add("splat_module_ports", parameter, "NULL or 0", SPLAT_INCOMPLETE, [this] {
            return splat_module_ports(module_, SPLAT_PORT_KIND_INPUT, nullptr, 0, nullptr);
        });
    add("splat_module_read", "name", "before the first pass", kState,
        [this] { return splat_module_read(module_, "y", *outputs.values.out(), 16); });
    add("splat_module_write", "values", "NULL", kArgument,
        [this] { return splat_module_write(module_, "x", nullptr, 16); });
    add("splat_module_read", "values", "NULL", kArgument,
        [this] { return splat_module_read(module_, "x", nullptr, 16); });
    for (const std::size_t bytes : {std::size_t{0}, std::size_t{12}, std::size_t{64}}) {
        add("splat_module_write", "bytes", "others", SPLAT_ERROR_SHAPE_MISMATCH,
            [this, bytes] { return splat_module_write(module_, "x", kValues, bytes); });
        add("splat_module_read", "bytes", "others", SPLAT_ERROR_SHAPE_MISMATCH, [this, bytes] {
            return splat_module_read(module_, "x", *outputs.values.out(), bytes);
        });
    }
    on_module("splat_module_forward", splat_module_forward);
    on_module("splat_module_backward", splat_module_backward);
    add("splat_module_backward", "module", "made without gradients", kState,
        [this] { return splat_module_backward(module_); });
    on_module("splat_module_zero_gradients", splat_module_zero_gradients);
    handles<splat_module>("splat_module_destroy", "module", splat_module_destroy, SPLAT_OK);
}

}  // namespace splat::test
