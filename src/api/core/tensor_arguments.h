#pragma once

#include <initializer_list>

#include "api/handles.h"

namespace splat::api {

/// A live float32 tensor of this context. Errors: kInvalidHandle and kInvalidArgument, naming
/// `argument` and, for another device, the `owner`.
Result<std::shared_ptr<TensorObject>> find_tensor(splat_tensor tensor, const char* argument,
                                                  const vk::Context& context, const char* owner);

/// Errors: kInvalidState.
Status check_unmapped(const TensorObject& tensor);

/// The tensors of one call. Checks each and keeps it alive until the call ends.
class TensorArguments {
  public:
    TensorArguments(const vk::Context& context, const char* owner)
        : context_(context), owner_(owner) {}

    /// Set `view` to a tensor of this shape; NULL leaves it empty. Errors: those of find_tensor();
    /// kShape.
    Status read(splat_tensor tensor, const char* name, std::initializer_list<std::int64_t> dims,
                vk::BufferView& view);
    /// The same for a tensor that the call writes. Errors: also kInvalidArgument if another
    /// argument of the call shares its memory. Add the tensors that are read first.
    Status write(splat_tensor tensor, const char* name, std::initializer_list<std::int64_t> dims,
                 vk::BufferView& view);

    /// Call with the context's mutex held, before the device starts: also tells the owners of tensors
    /// that the call writes. Errors: kInvalidState.
    [[nodiscard]] Status check_unmapped() const;

  private:
    struct Argument {
        const char* name;
        std::shared_ptr<TensorObject> tensor;
        bool written = false;
    };

    const vk::Context& context_;
    const char* owner_;
    std::vector<Argument> arguments_;
};

}  // namespace splat::api
