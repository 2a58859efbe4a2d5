#pragma once

#include <splat.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "vkrun/cli/failure.h"

namespace vkrun {

/// Owner of a handle of the library.
template <class T, splat_result (*Destroy)(T)>
class Owner {
  public:
    Owner() = default;
    Owner(Owner&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
    Owner& operator=(Owner&& other) noexcept {
        std::swap(handle_, other.handle_);
        return *this;
    }
    Owner(const Owner&) = delete;
    Owner& operator=(const Owner&) = delete;
    ~Owner() {
        if (handle_ != nullptr) Destroy(handle_);
    }

    [[nodiscard]] T get() const { return handle_; }
    T* out() { return &handle_; }

  private:
    T handle_ = nullptr;
};

using Comparison = Owner<splat_comparison, splat_comparison_destroy>;
using Dataset = Owner<splat_dataset, splat_dataset_destroy>;
using Device = Owner<splat_device, splat_device_destroy>;
using Evaluator = Owner<splat_evaluator, splat_evaluator_destroy>;
using Lpips = Owner<splat_lpips, splat_lpips_destroy>;
using Mesh = Owner<splat_mesh, splat_mesh_destroy>;
using Model = Owner<splat_model, splat_model_destroy>;
using Op = Owner<splat_op, splat_op_destroy>;
using ScenePredictor = Owner<splat_predictor, splat_predictor_destroy>;
using Rasterizer = Owner<splat_rasterizer, splat_rasterizer_destroy>;
using PriorModel = Owner<splat_prior_model, splat_prior_model_destroy>;
using Scene = Owner<splat_scene, splat_scene_destroy>;
using Tensor = Owner<splat_tensor, splat_tensor_destroy>;
using Run = Owner<splat_run, splat_run_destroy>;
using Trainer = Owner<splat_trainer, splat_trainer_destroy>;
using Weights = Owner<splat_weights, splat_weights_destroy>;

/// A zeroed struct of the library with its size set.
template <class T>
T sized() {
    T value{};
    value.struct_size = sizeof value;
    return value;
}

/// A text of the library in the words of the command line: options and environment variables instead of C names.
std::string in_own_words(std::string text);

/// The message of the library's last error, in_own_words().
std::string library_message();

/// Throws a Failure with the library's message unless `result` is a success. `blame` is its exit
/// status where the library refuses its input, such as a damaged file.
void check(splat_result result, ExitCode blame = kFailed);

/// `data` may be empty: zeros.
Tensor make_tensor(splat_device device, const std::string& name,
                   const std::vector<std::int64_t>& dims, const std::vector<float>& data);
std::vector<float> read_tensor(splat_tensor tensor);

/// The file `path`. Throws a Failure of bad data.
Weights load_weights(const std::string& path);

}  // namespace vkrun
