#include "api/core/tensor_arguments.h"

namespace splat::api {
namespace {

bool has_shape(const Shape& shape, std::initializer_list<std::int64_t> dims) {
    if (shape.rank() != dims.size()) return false;
    std::uint32_t axis = 0;
    for (const std::int64_t size : dims)
        if (shape[axis++] != size) return false;
    return true;
}

}  // namespace

Result<std::shared_ptr<TensorObject>> find_tensor(splat_tensor tensor, const char* argument,
                                                  const vk::Context& context, const char* owner) {
    SPLAT_ASSIGN(std::shared_ptr<TensorObject> object, Tensors::find(tensor, argument));
    if (object->context.get() != &context)
        return invalid("%s is on another device than the %s", argument, owner);
    if (object->dtype != SPLAT_DTYPE_F32)
        return invalid("%s has dtype %d, expected SPLAT_DTYPE_F32", argument, object->dtype);
    return object;
}

Status check_unmapped(const TensorObject& tensor) {
    if (tensor.mapped != 0)
        return bad_state("tensor '%s' is mapped; end that first (splat_tensor_unmap)",
                         tensor.name.c_str());
    if (tensor.use != nullptr && tensor.use->mapped(tensor.view))
        return bad_state(
            "tensor '%s' shares memory with a tensor that is mapped; end "
            "that first (splat_tensor_unmap)",
            tensor.name.c_str());
    return {};
}

Status TensorArguments::read(splat_tensor tensor, const char* name,
                             std::initializer_list<std::int64_t> dims, vk::BufferView& view) {
    if (tensor == nullptr) return {};
    SPLAT_ASSIGN(std::shared_ptr<TensorObject> object, find_tensor(tensor, name, context_, owner_));
    if (!has_shape(object->view.shape, dims))
        return error(Code::kShape, "%s has the shape %s, expected %s", name,
                     object->view.shape.text().c_str(),
                     io::dims_text({dims.begin(), dims.size()}).c_str());
    view = object->view;
    arguments_.push_back({name, std::move(object), false});
    return {};
}

Status TensorArguments::write(splat_tensor tensor, const char* name,
                              std::initializer_list<std::int64_t> dims, vk::BufferView& view) {
    SPLAT_TRY(read(tensor, name, dims, view));
    if (tensor == nullptr) return {};
    for (std::size_t i = 0; i + 1 < arguments_.size(); ++i) {
        if (arguments_[i].tensor == arguments_.back().tensor)
            return invalid("%s is the same tensor as %s", name, arguments_[i].name);
        if (arguments_[i].tensor->view.overlaps(view))
            return invalid("%s shares its memory with %s", name, arguments_[i].name);
    }
    arguments_.back().written = true;
    return {};
}

Status TensorArguments::check_unmapped() const {
    for (const Argument& argument : arguments_) SPLAT_TRY(api::check_unmapped(*argument.tensor));
    for (const Argument& argument : arguments_)
        if (argument.written) argument.tensor->written();
    return {};
}

}  // namespace splat::api
