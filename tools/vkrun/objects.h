#pragma once

#include <splat.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "vkrun/command.h"

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

using Device = Owner<splat_device, splat_device_destroy>;
using Tensor = Owner<splat_tensor, splat_tensor_destroy>;
using Op = Owner<splat_op, splat_op_destroy>;
using Model = Owner<splat_model, splat_model_destroy>;

/// A zeroed struct of the library with its size set.
template <class T>
T sized() {
    T value{};
    value.struct_size = sizeof value;
    return value;
}

/// Throws a Failure with the library's message unless `result` is a success; `blame` is its code where
/// the library refuses what it was given, as a file that is damaged or does not fit.
void check(splat_result result, ExitCode blame = kFailed);

/// Make a folder and those above it, unless they are there. Throws a Failure.
void make_folder(const std::filesystem::path& path);

/// Every device of this machine, usable or not. Throws if there is no loader or no driver.
std::vector<splat_device_info> all_devices();

Device open_device(const splat_device_desc& desc);
splat_device_info info_of(splat_device device);

/// `data` may be empty: zeros.
Tensor make_tensor(splat_device device, const std::string& name,
                   const std::vector<std::int64_t>& dims, const std::vector<float>& data);
std::vector<float> read_tensor(splat_tensor tensor);

/// The text of a function that takes (buffer, capacity, needed).
std::string whole_text(const std::function<splat_result(char*, std::size_t, std::size_t*)>& get);

/// The text of a configuration. Throws a usage Failure if it cannot be read, or is empty.
std::string read_text(const std::string& path);

/// Write a file; nothing if the path is empty. Throws a Failure.
void write_text(const std::string& path, const std::string& text);

/// Send the library's warnings, all its messages if verbose, to standard error.
void log_to_stderr();
void set_verbose(bool verbose);

}  // namespace vkrun
