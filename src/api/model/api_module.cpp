#include "api/api_guard.h"
#include "api/handles.h"
#include "api/model/port_list.h"
#include "core/json_writer.h"

using namespace splat;

namespace {

Result<model::ModuleDesc> desc_of(const splat_module_desc& given) {
    SPLAT_TRY(api::require(given.type, "splat_module_desc.type"));
    if (given.port_count > 64)
        return invalid("splat_module_desc.port_count is %u, expected at most 64", given.port_count);
    if (given.port_count > 0) SPLAT_TRY(api::require(given.ports, "splat_module_desc.ports"));
    model::ModuleDesc desc;
    desc.type = given.type;
    if (given.attributes != nullptr)
        SPLAT_SET(desc.attributes,
                  parse_flat_json(given.attributes, "splat_module_desc.attributes"));
    for (std::uint32_t i = 0; i < given.port_count; ++i) {
        const splat_port& port = given.ports[i];
        const std::string what = format("splat_module_desc.ports[%u]", i);
        SPLAT_TRY(api::require(port.name, (what + ".name").c_str()));
        if (port.flags != 0)
            return invalid("%s.flags is %#x, expected 0", what.c_str(), port.flags);
        if (port.rank < 1 || port.rank > SPLAT_MAX_RANK)
            return invalid("%s.rank is %u, expected 1 to %d", what.c_str(), port.rank,
                           SPLAT_MAX_RANK);
        SPLAT_ASSIGN(const Shape shape,
                     Shape::create({port.dims, port.rank}, format("port '%s'", port.name)));
        desc.ports.push_back({port.name, shape, false, false});
    }
    desc.gradients = (given.flags & SPLAT_MODULE_GRADIENTS) != 0;
    desc.input_gradients = (given.flags & SPLAT_MODULE_INPUT_GRADIENTS) != 0;
    desc.build.training = (given.flags & SPLAT_MODULE_TRAINING) != 0;
    if (desc.input_gradients && !desc.gradients)
        return invalid(
            "splat_module_desc.flags is %#x: SPLAT_MODULE_INPUT_GRADIENTS needs "
            "SPLAT_MODULE_GRADIENTS",
            given.flags);
    SPLAT_ASSIGN(desc.build.precision,
                 api::precision_of(given.precision, "splat_module_desc.precision"));
    return desc;
}

void begin_tensor(JsonWriter& json, const std::string& name, const Shape& shape) {
    json.begin_object().member("name", name).key("shape").raw(shape.text());
}

void add_inputs(JsonWriter& json, const std::vector<model::ModulePort>& ports) {
    json.newline(1).key("inputs").begin_array();
    for (const model::ModulePort& port : ports) {
        begin_tensor(json, port.name, port.shape);
        json.member("optional", port.optional).end();
    }
    json.end();
}

void add_outputs(JsonWriter& json, const std::vector<model::ModulePort>& ports) {
    json.newline(1).key("outputs").begin_array();
    for (const model::ModulePort& port : ports) {
        begin_tensor(json, port.name, port.shape);
        json.end();
    }
    json.end();
}

std::string report_of(model::Module& module) {
    JsonWriter json;
    json.begin_object().member("type", module.type());
    add_inputs(json, module.names().inputs);
    add_outputs(json, module.names().outputs);
    json.newline(1).key("parameters").begin_array();
    for (const nn::Parameter& p : module.parameters().all()) {
        json.newline(2);
        begin_tensor(json, p.name, p.shape);
        json.member("trainable", p.trainable).end();
    }
    json.end().newline(1);
    json.member("bytes", module.memory().arenas - module.memory().prepared).end();
    return json.text();
}

Result<std::vector<splat_port>> module_ports(model::Module& module, splat_port_kind kind) {
    std::vector<splat_port> ports;
    if (kind == SPLAT_PORT_KIND_PARAMETER) {
        for (const nn::Parameter& p : module.parameters().all())
            ports.push_back(
                api::port_of(p.name.c_str(), p.shape,
                             {.trainable = p.trainable, .graded = p.grad.block != nullptr}));
        return ports;
    }
    if (kind != SPLAT_PORT_KIND_INPUT && kind != SPLAT_PORT_KIND_OUTPUT)
        return api::unknown_port_kind(kind);
    for (const model::ModulePort& port :
         kind == SPLAT_PORT_KIND_INPUT ? module.names().inputs : module.names().outputs)
        ports.push_back(api::port_of(port.name.c_str(), port.shape,
                                     {.optional = port.optional, .graded = port.graded}));
    return ports;
}

}  // namespace

splat_result splat_module_create(splat_device device, const splat_module_desc* desc,
                                 splat_module* module) {
    const auto make = [&](const auto& owner) -> api::Modules::Made {
        SPLAT_TRY(api::check_desc(
            desc, SPLAT_MODULE_GRADIENTS | SPLAT_MODULE_INPUT_GRADIENTS | SPLAT_MODULE_TRAINING));
        SPLAT_ASSIGN(const model::ModuleDesc wanted, desc_of(*desc));
        constexpr std::uint32_t kBackward = SPLAT_MODULE_GRADIENTS | SPLAT_MODULE_INPUT_GRADIENTS;
        SPLAT_TRY(
            owner->test(api::kNetworkKernels |
                        ((desc->flags & kBackward) != 0 ? api::kNetworkGradientKernels : 0U)));
        auto object = std::make_shared<api::ModuleObject>(owner->context);
        const std::lock_guard lock(object->context->mutex);
        SPLAT_ASSIGN(object->module, model::Module::create(*object->context, wanted));
        return object;
    };
    return api::create_of(device, module, make);
}

splat_result splat_module_init(splat_module module, uint64_t seed) {
    return api::locked(module, [&](auto& object) { return object.module->init(seed); });
}

splat_result splat_module_report(splat_module module, char* buffer, size_t capacity,
                                 size_t* needed) {
    return api::report(module, buffer, capacity, needed,
                       [](auto& object) { return report_of(*object.module); });
}

splat_result splat_module_ports(splat_module module, splat_port_kind kind, splat_port* ports,
                                uint32_t capacity, uint32_t* count) {
    return api::list_ports(module, ports, capacity, count,
                           [&](auto& object) { return module_ports(*object.module, kind); });
}

splat_result splat_module_write(splat_module module, const char* name, const float* values,
                                size_t bytes) {
    return api::locked(module, [&](auto& object) -> Status {
        SPLAT_TRY(api::require(name, "name", values, "values"));
        return object.module->write(name, values, bytes);
    });
}

splat_result splat_module_read(splat_module module, const char* name, float* values, size_t bytes) {
    return api::locked(module, [&](auto& object) -> Status {
        SPLAT_TRY(api::require(name, "name", values, "values"));
        return object.module->read(name, values, bytes);
    });
}

splat_result splat_module_forward(splat_module module) {
    return api::locked(module, [](auto& object) { return object.module->forward(); });
}

splat_result splat_module_backward(splat_module module) {
    return api::locked(module, [](auto& object) { return object.module->backward(); });
}

splat_result splat_module_zero_gradients(splat_module module) {
    return api::locked(module,
                       [](auto& object) { return object.module->parameters().zero_gradients(); });
}
