#pragma once

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/decode_budget.h"
#include "core/large_vector.h"
#include "core/status.h"
#include "io/bytes.h"
#include "io/file.h"
#include "io/number_type.h"

namespace splat::io {

/// The numbers of a tensor, in its own memory or in a mapped file, which copies share.
class TensorValues {
  public:
    TensorValues() = default;
    // NOLINTBEGIN(google-explicit-constructor)
    TensorValues(LargeVector<float> own) : own_(std::move(own)) {}
    TensorValues(const std::vector<float>& own) : own_(own) {}
    TensorValues(std::initializer_list<float> own) : own_(own) {}
    operator std::vector<float>() const { return {begin(), end()}; }
    // NOLINTEND(google-explicit-constructor)
    TensorValues(std::shared_ptr<const MappedFile> file, std::span<const float> part)
        : file_(std::move(file)), part_(part) {}

    [[nodiscard]] const float* data() const { return file_ ? part_.data() : own_.data(); }
    [[nodiscard]] std::size_t size() const { return file_ ? part_.size() : own_.size(); }
    [[nodiscard]] bool empty() const { return size() == 0; }
    [[nodiscard]] const float* begin() const { return data(); }
    [[nodiscard]] const float* end() const { return data() + size(); }
    const float& operator[](std::size_t i) const { return data()[i]; }

    /// For writing; numbers of a file are copied first.
    LargeVector<float>& own() {
        if (file_) {
            own_.assign(part_.begin(), part_.end());
            file_.reset();
        }
        return own_;
    }

    /// nullptr for numbers in its own memory.
    [[nodiscard]] const std::shared_ptr<const MappedFile>& file() const { return file_; }

    friend bool operator==(const TensorValues& a, const TensorValues& b) {
        return std::equal(a.begin(), a.end(), b.begin(), b.end());
    }

  private:
    LargeVector<float> own_;
    std::shared_ptr<const MappedFile> file_;
    std::span<const float> part_;  ///< values in the file
};

/// A tensor of a file of weights, row-major.
struct NamedTensor {
    std::string name;
    std::vector<std::int64_t> dims;      ///< outermost first; empty: one number; 0: no numbers
    NumberType type = NumberType::kF32;  ///< in the file
    /// In memory float32: float64 and integers beyond 2^24 are rounded to the nearest, bool is 0 or 1.
    TensorValues values;
};

/// The product of dims. Errors: kInvalidArgument for more than kMaxRank dimensions, a negative one,
/// or more than kMaxElements elements; `what` names the tensor.
Result<std::uint64_t> count_elements(std::span<const std::int64_t> dims, const std::string& what);

std::string dims_text(std::span<const std::int64_t> dims);  ///< "[512, 512, 3, 3]"

/// Tensors with unique names, in the order of their file: common to all formats of weights.
class NamedTensors {
  public:
    /// Errors: kInvalidArgument for a name already used, and for values that do not fit dims.
    Status add(NamedTensor tensor);

    /// Take this start off the names, if all begin with it. Returns whether they did.
    bool drop_start(std::string_view start);

    /// nullptr if there is none. Valid until the next add().
    [[nodiscard]] const NamedTensor* find(const std::string& name) const;

    [[nodiscard]] std::size_t size() const { return tensors_.size(); }
    [[nodiscard]] bool empty() const { return tensors_.empty(); }
    [[nodiscard]] const NamedTensor& operator[](std::size_t i) const { return tensors_[i]; }
    [[nodiscard]] auto begin() const { return tensors_.begin(); }
    [[nodiscard]] auto end() const { return tensors_.end(); }

    /// Call it before using values of mapped files. Errors: as MappedFile::unchanged().
    [[nodiscard]] Status unchanged() const;

    /// Elements of all tensors together.
    [[nodiscard]] std::uint64_t elements() const;

  private:
    std::vector<NamedTensor> tensors_;
    std::unordered_map<std::string, std::size_t> places_;
    std::vector<std::shared_ptr<const MappedFile>> files_;  ///< files that hold values, mostly one
};

enum class WeightsFormat { kSafetensors, kPth, kNpz };

/// Texts that a file carries besides its tensors, in their order.
using Metadata = std::vector<std::pair<std::string, std::string>>;

/// Weights of any format, with the file's metadata.
struct WeightsFile {
    WeightsFormat format = WeightsFormat::kSafetensors;
    NamedTensors tensors;
    /// All of it from safetensors. From a .pth: iteration, loss and best_PSNR where given, as texts that
    /// parse to the same number, and model_config as JSON.
    Metadata metadata;
    std::vector<std::string> warnings;  ///< parts that are ignored
};

/// Errors: kInvalidArgument, naming the first tensor that holds NaN or infinity, and where.
Status check_finite(const NamedTensor& tensor);
Status check_finite(const NamedTensors& tensors);

/// Append the values as little-endian float16. Errors: kInvalidArgument for a finite value that
/// becomes infinite; NaN stays NaN.
Status put_halves(Buffer& to, const NamedTensor& tensor);

/// Over all names and values, in their order.
std::uint32_t crc32_of(const NamedTensors& tensors);

}  // namespace splat::io
