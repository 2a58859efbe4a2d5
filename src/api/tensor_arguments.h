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

/// The tensors of one call, checked one by one and kept alive until it ends.
class TensorArguments {
  public:
    TensorArguments(const vk::Context& context, const char* owner)
        : context_(context), owner_(owner) {}

    /// The view of a tensor of this shape; of NULL, no view. Errors: those of find_tensor(); kShape.
    Status read(splat_tensor tensor, const char* name, std::initializer_list<std::int64_t> dims,
                vk::BufferView& view);
    /// The same for a tensor that is written. Errors: also kInvalidArgument if it is another
    /// argument of the call too; what is read is added first.
    Status write(splat_tensor tensor, const char* name, std::initializer_list<std::int64_t> dims,
                 vk::BufferView& view);

    /// To be called with the context's mutex held. Errors: kInvalidState.
    [[nodiscard]] Status check_unmapped() const;

  private:
    struct Argument {
        const char* name;
        std::shared_ptr<TensorObject> tensor;
    };

    const vk::Context& context_;
    const char* owner_;
    std::vector<Argument> arguments_;
};

}  // namespace splat::api
