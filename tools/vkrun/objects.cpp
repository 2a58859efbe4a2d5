#include "vkrun/objects.h"

#include <cstdio>
#include <fstream>
#include <sstream>

namespace vkrun {
namespace {

splat_log_level g_level = SPLAT_LOG_WARNING;

const char* level_name(splat_log_level level) {
    if (level >= SPLAT_LOG_ERROR) return "error";
    if (level == SPLAT_LOG_WARNING) return "warning";
    return level == SPLAT_LOG_INFO ? "info" : "debug";
}

void print_message(void*, splat_log_level level, const char* message) {
    std::fprintf(stderr, "vkrun: %s: %s\n", level_name(level), message);
}

ExitCode code_of(splat_result result, ExitCode blame) {
    switch (result) {
        case SPLAT_ERROR_NO_DEVICE:
            return kNoDevice;
        case SPLAT_ERROR_OUT_OF_HOST_MEMORY:
        case SPLAT_ERROR_OUT_OF_DEVICE_MEMORY:
            return kOutOfMemory;
        case SPLAT_ERROR_INVALID_ARGUMENT:
        case SPLAT_ERROR_INVALID_STATE:
        case SPLAT_ERROR_SHAPE_MISMATCH:
        case SPLAT_ERROR_UNSUPPORTED:
            return blame;
        default:
            return kFailed;
    }
}

}  // namespace

void check(splat_result result, ExitCode blame) {
    if (result >= SPLAT_OK) return;
    const ExitCode code = code_of(result, blame);
    std::string sentence = splat_last_error_message();
    if (sentence.empty()) sentence = splat_result_sentence(result);
    throw Failure(code, sentence + " (" + splat_result_name(result) + ")");
}

void make_folder(const std::filesystem::path& path) {
    std::error_code failed;
    std::filesystem::create_directories(path, failed);
    if (failed)
        throw Failure(kFailed,
                      "cannot make the folder '" + path.string() + "': " + failed.message());
}

std::vector<splat_device_info> all_devices() {
    std::uint32_t count = 0;
    check(splat_device_count(&count));
    std::vector<splat_device_info> devices;
    for (std::uint32_t i = 0; i < count; ++i) {
        devices.push_back(sized<splat_device_info>());
        check(splat_device_describe(i, &devices.back()));
    }
    return devices;
}

Device open_device(const splat_device_desc& desc) {
    Device device;
    check(splat_device_create(&desc, device.out()));
    return device;
}

splat_device_info info_of(splat_device device) {
    auto info = sized<splat_device_info>();
    check(splat_device_get_info(device, &info));
    return info;
}

Tensor make_tensor(splat_device device, const std::string& name,
                   const std::vector<std::int64_t>& dims, const std::vector<float>& data) {
    auto desc = sized<splat_tensor_desc>();
    desc.name = name.c_str();
    for (const std::int64_t size : dims) desc.dims[desc.rank++] = size;
    Tensor tensor;
    check(splat_tensor_create(device, &desc, tensor.out()));
    if (!data.empty())
        check(splat_tensor_write(tensor.get(), data.data(), data.size() * sizeof(float), nullptr));
    return tensor;
}

std::vector<float> read_tensor(splat_tensor tensor) {
    auto info = sized<splat_tensor_info>();
    check(splat_tensor_get_info(tensor, &info));
    std::vector<float> data(info.elements);
    check(splat_tensor_read(tensor, data.data(), data.size() * sizeof(float), nullptr));
    return data;
}

std::string whole_text(const std::function<splat_result(char*, std::size_t, std::size_t*)>& get) {
    std::size_t needed = 0;
    std::string text(std::size_t{1} << 16U, '\0');  // mostly enough: each call may read a file
    check(get(text.data(), text.size(), &needed));
    if (needed > text.size()) {
        text.resize(needed);
        check(get(text.data(), text.size(), &needed));
    }
    text.resize(text.find('\0'));
    return text;
}

std::string read_text(const std::string& path) {
    std::ifstream file(path);
    std::ostringstream text;
    text << file.rdbuf();
    if (!file) throw Failure(kUsageError, path + ": cannot be read, or is empty");
    return text.str();
}

void write_text(const std::string& path, const std::string& text) {
    if (path.empty()) return;
    std::ofstream file(path);
    file << text;
    if (!file.flush()) throw Failure(kFailed, "cannot write " + path);
}

void log_to_stderr() {
    check(splat_log_set_callback(print_message, nullptr, g_level));
}

void set_verbose(bool verbose) {
    g_level = verbose ? SPLAT_LOG_DEBUG : SPLAT_LOG_WARNING;
    log_to_stderr();
}

}  // namespace vkrun
