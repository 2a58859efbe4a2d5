#include "api/api_guard.h"
#include "api/handles.h"
#include "api/model/model_tensors.h"
#include "api/model/port_list.h"

using namespace splat;

namespace {

splat_model_info info_of(const api::ModelObject& object) {
    model::Model& network = *object.model;
    const config::ModelConfig& c = network.config();
    splat_model_info info{};
    info.flags = object.flags;
    info.objects = object.objects;
    SPLAT_COPY(info, c, views, resolution, sh_degree, token_dim, tokens);
    info.channels = c.input_channels();
    info.image_channels = c.image_channels();
    info.output_channels = network.raw_output().shape[1];
    info.gaussians = c.gaussians();
    info.embedding_length = c.embedding == config::Embedding::kCustom ? c.embedding_length() : 0;
    info.slices = network.slices();
    info.fov = c.fov_degrees;
    info.parameters = network.parameters().elements();
    for (const nn::Parameter& parameter : network.parameters().all())
        if (parameter.trainable) info.trainable += parameter.shape.elements();
    const model::Ledger ledger = network.ledger();
    info.predicted = ledger.gaussians;
    info.non_finite = ledger.non_finite();
    info.faint = ledger.set.faint;
    return info;
}

Result<std::vector<splat_port>> ports_of(const api::ModelObject& object, splat_port_kind kind) {
    model::Model& network = *object.model;
    std::vector<splat_port> ports;
    switch (kind) {
        case SPLAT_PORT_KIND_INPUT:
            for (const model::Model::Port& port : network.inputs())
                ports.push_back(api::port_of(port.name, port.shape,
                                             {.optional = port.optional, .graded = port.graded}));
            return ports;
        case SPLAT_PORT_KIND_OUTPUT:
            for (const api::ModelOutput& output : api::model_outputs(network))
                ports.push_back(
                    api::port_of(output.name, output.shape,
                                 {.graded = output.rows != nullptr && network.has_gradients()}));
            return ports;
        case SPLAT_PORT_KIND_PARAMETER:
            for (const nn::Parameter& p : network.parameters().all())
                ports.push_back(
                    api::port_of(p.name.c_str(), p.shape,
                                 {.trainable = p.trainable, .graded = p.grad.block != nullptr}));
            return ports;
        default:
            return api::unknown_port_kind(kind);
    }
}

}  // namespace

splat_result splat_model_get_info(splat_model model, splat_model_info* info) {
    return api::describe(model, info, "info", [](auto& object) { return info_of(object); });
}

splat_result splat_model_ports(splat_model model, splat_port_kind kind, splat_port* ports,
                               uint32_t capacity, uint32_t* count) {
    return api::list_ports(model, ports, capacity, count,
                           [&](auto& object) { return ports_of(object, kind); });
}

splat_result splat_model_tensor(splat_model model, const char* name, splat_tensor* tensor) {
    return api::with(model, [&](const auto& object) -> Status {
        SPLAT_TRY(api::require(name, "name", tensor, "tensor"));
        auto made = std::make_shared<api::TensorObject>(object->context);
        {
            const std::lock_guard lock(object->context->mutex);
            SPLAT_ASSIGN(api::ModelTensor found,
                         api::find_model_tensor(*object->model, object->objects, name));
            SPLAT_TRY(api::bind_model_tensor(*object->model, found));
            made->view = found.view;
            made->use = std::move(found.use);
        }
        made->name = name;
        made->owner = object;
        *tensor = api::Tensors::add(std::move(made));
        return {};
    });
}
