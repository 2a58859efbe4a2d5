#include "api/api_guard.h"
#include "api/core/tensor_arguments.h"
#include "api/handles.h"
#include "core/json_writer.h"
#include "ops/op_table.h"

using namespace splat;

namespace {

using TensorPointer = std::shared_ptr<api::TensorObject>;

/// Collects the tensors of a splat_op_desc, checked one by one.
class TensorList {
  public:
    TensorList(const char* op, const vk::Context& context) : op_(op), context_(context) {}

    /// Errors: kInvalidHandle, kInvalidArgument (NULL where required, dtype, other device).
    Status add(splat_tensor tensor, const char* prefix, const char* name, bool optional,
               std::vector<vk::BufferView>& views, std::vector<TensorPointer>* written = nullptr) {
        if (tensor == nullptr && optional) {
            views.emplace_back();
            return {};
        }
        const std::string argument = format("%s: tensor '%s%s'", op_, prefix, name);
        SPLAT_ASSIGN(TensorPointer object,
                     api::find_tensor(tensor, argument.c_str(), context_, "operator"));
        views.push_back(object->view);
        if (written != nullptr) {
            for (const TensorPointer& other : *written)
                if (other->view.overlaps(object->view))
                    return invalid("%s: tensor '%s%s' shares its memory with another result", op_,
                                   prefix, name);
            written->push_back(object);
        }
        tensors.push_back(std::move(object));
        return {};
    }

    std::vector<TensorPointer> tensors, outputs, grad_inputs;

  private:
    const char* op_;
    const vk::Context& context_;
};

/// Refuse a tensor that is given for two results. NULLs are skipped.
Status check_distinct(const char* op, const char* field, std::span<const splat_tensor> tensors) {
    for (std::size_t i = 0; i < tensors.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
            if (tensors[i] != nullptr && tensors[i] == tensors[j])
                return invalid("%s: %s[%zu] and %s[%zu] are the same tensor", op, field, j, field,
                               i);
    return {};
}

Status check_counts(const ops::OpRow& row, const splat_op_desc& desc) {
    if (desc.input_count != row.inputs.size() || desc.inputs == nullptr)
        return invalid("%s: input_count is %u, expected %zu tensors", row.name, desc.input_count,
                       row.inputs.size());
    if (desc.output_count != row.outputs.size() || desc.outputs == nullptr)
        return invalid("%s: output_count is %u, expected %zu tensors", row.name, desc.output_count,
                       row.outputs.size());
    if ((desc.grad_outputs == nullptr) != (desc.grad_inputs == nullptr))
        return invalid("%s: grad_outputs and grad_inputs must be given together", row.name);
    SPLAT_TRY(check_distinct(row.name, "outputs", {desc.outputs, desc.output_count}));
    if (desc.grad_inputs == nullptr) return {};
    return check_distinct(row.name, "grad_inputs", {desc.grad_inputs, desc.input_count});
}

Result<std::shared_ptr<api::OpObject>> create(splat_device device, const splat_op_desc* desc) {
    SPLAT_ASSIGN(const auto owner, api::find(device));
    SPLAT_TRY(api::check_desc(desc, SPLAT_OP_ACCUMULATE));
    SPLAT_TRY(api::require(desc->type, "splat_op_desc.type"));
    SPLAT_ASSIGN(const ops::OpRow* row, ops::find_op(desc->type));
    SPLAT_TRY(check_counts(*row, *desc));
    std::vector<JsonScalar> attributes;
    if (desc->attributes != nullptr)
        SPLAT_SET(attributes, parse_flat_json(desc->attributes, "splat_op_desc.attributes"));

    TensorList list(row->name, *owner->context);
    nn::OpInstance::Tensors tensors;
    tensors.accumulate = (desc->flags & SPLAT_OP_ACCUMULATE) != 0;
    for (std::size_t i = 0; i < row->inputs.size(); ++i) {
        const ops::Port& port = row->inputs[i];
        SPLAT_TRY(list.add(desc->inputs[i], "", port.name, port.optional, tensors.inputs));
        if (desc->grad_inputs != nullptr)
            SPLAT_TRY(list.add(desc->grad_inputs[i], "grad_", port.name, true, tensors.grad_inputs,
                               &list.grad_inputs));
    }
    for (std::size_t i = 0; i < row->outputs.size(); ++i) {
        const ops::Port& port = row->outputs[i];
        SPLAT_TRY(list.add(desc->outputs[i], "", port.name, false, tensors.outputs, &list.outputs));
        if (desc->grad_outputs != nullptr)
            SPLAT_TRY(
                list.add(desc->grad_outputs[i], "grad_", port.name, false, tensors.grad_outputs));
    }
    SPLAT_TRY(owner->test(api::kNetworkKernels |
                          (desc->grad_inputs != nullptr ? api::kNetworkGradientKernels : 0U)));
    auto object = std::make_shared<api::OpObject>(owner->context);
    object->tensors = std::move(list.tensors);
    object->outputs = std::move(list.outputs);
    object->grad_inputs = std::move(list.grad_inputs);
    const std::lock_guard lock(object->context->mutex);
    SPLAT_ASSIGN(object->op, nn::OpInstance::create(*object->context, *row, attributes, tensors));
    return object;
}

splat_result run_op(splat_op op, Status (nn::OpInstance::*pass)(),
                    std::vector<TensorPointer> api::OpObject::*written) {
    return api::with(op, [&](const auto& object) -> Status {
        const std::lock_guard lock(object->context->mutex);
        for (const TensorPointer& tensor : object->tensors) SPLAT_TRY(api::check_unmapped(*tensor));
        for (const TensorPointer& tensor : (*object).*written) tensor->written();
        return ((*object->op).*pass)();
    });
}

void add_ports(JsonWriter& json, const char* key, std::span<const ops::Port> ports) {
    json.key(key).begin_array();
    for (const ops::Port& port : ports)
        json.value(std::string(port.name) + (port.optional ? "?" : ""));
    json.end();
}

void describe(JsonWriter& json, const ops::OpRow& row) {
    json.newline(1).begin_object().member("name", row.name).member("equation", row.equation);
    json.newline(2);
    add_ports(json, "inputs", row.inputs);
    add_ports(json, "outputs", row.outputs);
    json.key("saved").list(row.saved);
    json.newline(2).key("attributes").begin_array();
    for (const ops::Attribute& a : row.attributes) {
        json.begin_object().member("name", a.name).member("type", a.type);
        json.key("default").raw(a.fallback).member("about", a.about).end();
    }
    json.end().end();
}

std::string make_list() {
    JsonWriter json;
    json.begin_array();
    for (const ops::OpRow* row : ops::op_table()) describe(json, *row);
    json.end();
    return json.text();
}

}  // namespace

splat_result splat_op_list(char* buffer, size_t capacity, size_t* needed) {
    return api::guarded_text(buffer, capacity, needed, [] { return make_list(); });
}

splat_result splat_op_create(splat_device device, const splat_op_desc* desc, splat_op* op) {
    return api::create(op, [&] { return create(device, desc); });
}

splat_result splat_op_forward(splat_op op) {
    return run_op(op, &nn::OpInstance::forward, &api::OpObject::outputs);
}

splat_result splat_op_backward(splat_op op) {
    return run_op(op, &nn::OpInstance::backward, &api::OpObject::grad_inputs);
}
