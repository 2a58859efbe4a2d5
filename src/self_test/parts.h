#pragma once

#include <vector>

#include "vk/context.h"

/// The computations of the self-test. Each returns its greatest error, relative to values of about 1, or infinity if a
/// result is not a number. Errors: those of the calls.
namespace splat::self_test {

using Floats = std::vector<float>;
using Doubles = std::vector<double>;

inline double wide(float value) {
    return static_cast<double>(value);
}

Result<double> linear_error(vk::Context& context);                ///< integers: must be exact
Result<double> convolution_error(vk::Context& context);           ///< integers: must be exact
Result<double> convolution_gradient_error(vk::Context& context);  ///< integers: must be exact
Result<double> group_norm_error(vk::Context& context);
Result<double> group_norm_gradient_error(vk::Context& context);
Result<double> attention_error(vk::Context& context);
Result<double> attention_gradient_error(vk::Context& context);
Result<double> sort_error(vk::Context& context);    ///< entries in a wrong place
Result<double> raster_error(vk::Context& context);  ///< includes a pixel at the threshold of 1/255
Result<double> raster_gradient_error(vk::Context& context);
Result<double> raster_list_error(vk::Context& context);  ///< longer than a batch of blending
Result<double> raster_list_gradient_error(vk::Context& context);

/// Small integers in an order without pattern, so that sums of their products are exact.
Floats integers(std::size_t count, std::uint32_t seed);

Doubles wide(const Floats& values);

/// Greatest |a - b|; infinite if it is not a number.
double distance(const Floats& a, const Doubles& b);

/// [c,p], one image, to the kernels' layout.
Floats to_quads(const Floats& rows, std::size_t c, std::size_t p);

/// Buffers of one computation, and one list of it.
class Trial {
  public:
    explicit Trial(vk::Context& context) : context_(context), recorder_(context) {}

    vk::Recorder& recorder() { return recorder_; }
    Result<vk::BufferView> put(const Floats& values);
    Result<vk::BufferView> room(std::uint64_t bytes);
    Status run();
    Result<Floats> get(const vk::BufferView& view, std::size_t count);
    /// The distance of [c,p] in the kernels' layout from what is expected.
    Result<double> error(const vk::BufferView& view, std::size_t c, std::size_t p,
                         const Doubles& expected);

  private:
    vk::Context& context_;
    std::vector<vk::Buffer> buffers_;
    vk::Recorder recorder_;
};

}  // namespace splat::self_test
