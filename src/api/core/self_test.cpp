#include "api/core/self_test.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <mutex>
#include <set>
#include <vector>

#include "core/environment.h"
#include "core/fault.h"
#include "core/log.h"
#include "ops/group_norm.h"
#include "ops/linear.h"
#include "raster/pack.h"
#include "raster/rasterizer.h"
#include "splat.h"
#include "vk/pipeline_cache_file.h"

namespace splat::api {
namespace {

using Floats = std::vector<float>;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Small integers in an order without pattern, so that sums of their products are exact.
Floats integers(std::size_t count, std::uint32_t seed) {
    Floats values(count);
    std::uint32_t state = seed;
    for (float& value : values) {
        state = state * 1664525U + 1013904223U;  // Numerical Recipes, section 7.1
        value = static_cast<float>(static_cast<int>(state >> 28) - 8);
    }
    return values;
}

Result<vk::Buffer> uploaded(vk::Context& context, const Floats& values) {
    SPLAT_ASSIGN(vk::Buffer buffer, context.memory().allocate(
                                        values.size() * 4, vk::MemoryKind::kDevice, "self-test"));
    SPLAT_TRY(context.write(buffer.range(), values.data(), values.size() * 4));
    return buffer;
}

Result<vk::Buffer> empty(vk::Context& context, std::size_t bytes) {
    return context.memory().allocate(std::max<std::size_t>(bytes, 16), vk::MemoryKind::kDevice,
                                     "self-test");
}

/// [c,p], one image, to quads.
Floats to_quads(const Floats& rows, std::size_t c, std::size_t p) {
    Floats quads((c + 3) / 4 * p * 4, 0.0F);
    for (std::size_t i = 0; i < c; ++i)
        for (std::size_t j = 0; j < p; ++j) quads[(i / 4 * p + j) * 4 + i % 4] = rows[i * p + j];
    return quads;
}

/// Greatest |a - b|; infinite if it is not a number.
double distance(const Floats& a, const Floats& b) {
    double most = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double each = std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i]));
        if (!(each <= most)) most = std::isnan(each) ? kInfinite : each;
    }
    return most;
}

/// Integers, so the product must be exact: 37 rows of 28 features to 19.
Result<double> linear_error(vk::Context& context) {
    const ops::LinearDesc desc{37, 28, 19, true, 1};
    const Floats x = integers(28 * 37, 1), weight = integers(19 * 28, 2), bias = integers(20, 3);
    Floats expected(19 * 37);
    for (std::size_t o = 0; o < 19; ++o)
        for (std::size_t r = 0; r < 37; ++r) {
            float sum = bias[o];
            for (std::size_t k = 0; k < 28; ++k) sum += weight[o * 28 + k] * x[k * 37 + r];
            expected[o * 37 + r] = sum;
        }
    expected = to_quads(expected, 19, 37);
    SPLAT_ASSIGN(const vk::Buffer x_buffer, uploaded(context, to_quads(x, 28, 37)));
    SPLAT_ASSIGN(const vk::Buffer weights, uploaded(context, weight));
    SPLAT_ASSIGN(const vk::Buffer biases, uploaded(context, bias));
    SPLAT_ASSIGN(const vk::Buffer y, empty(context, expected.size() * 4));
    vk::Recorder recorder(context);
    const std::uint64_t bytes = ops::linear_packed_bytes(recorder, desc, false);
    SPLAT_ASSIGN(const vk::Buffer packed, empty(context, bytes));
    SPLAT_TRY(ops::linear_pack_weight(recorder, desc, weights.range(), packed.range(), false));
    SPLAT_TRY(ops::linear_forward(recorder, desc, x_buffer.range(),
                                  bytes == 0 ? weights.range() : packed.range(), biases.range(),
                                  y.range()));
    SPLAT_ASSIGN(vk::CommandList list, recorder.finish());
    SPLAT_TRY(context.run(list));
    Floats got(expected.size());
    SPLAT_TRY(context.read(y.range(), got.data(), got.size() * 4));
    return distance(got, expected);
}

/// 16 channels in 4 groups of 63 pixels.
Result<double> group_norm_error(vk::Context& context) {
    constexpr std::size_t kC = 16, kP = 63, kGroup = 4 * kP;
    const ops::GroupNormDesc desc{{1, kC, kP}, 4, 1e-6F, false};
    const Floats x = integers(kC * kP, 4), gamma = integers(kC, 5), beta = integers(kC, 6);
    Floats expected(kC * kP);
    for (std::size_t g = 0; g < 4; ++g) {
        double mean = 0, square = 0;
        for (std::size_t i = g * kGroup; i < (g + 1) * kGroup; ++i)
            mean += static_cast<double>(x[i]) / kGroup;
        for (std::size_t i = g * kGroup; i < (g + 1) * kGroup; ++i)
            square += std::pow(static_cast<double>(x[i]) - mean, 2) / kGroup;
        for (std::size_t i = g * kGroup; i < (g + 1) * kGroup; ++i)
            expected[i] =
                static_cast<float>((static_cast<double>(x[i]) - mean) / std::sqrt(square + 1e-6) *
                                       static_cast<double>(gamma[i / kP]) +
                                   static_cast<double>(beta[i / kP]));
    }
    expected = to_quads(expected, kC, kP);
    SPLAT_ASSIGN(const vk::Buffer x_buffer, uploaded(context, to_quads(x, kC, kP)));
    SPLAT_ASSIGN(const vk::Buffer gammas, uploaded(context, gamma));
    SPLAT_ASSIGN(const vk::Buffer betas, uploaded(context, beta));
    SPLAT_ASSIGN(const vk::Buffer y, empty(context, expected.size() * 4));
    SPLAT_ASSIGN(const vk::Buffer mean, empty(context, 32));  // [2,1,4]
    SPLAT_ASSIGN(const vk::Buffer rstd, empty(context, 16));
    vk::Recorder recorder(context);
    SPLAT_TRY(ops::group_norm_forward(recorder, desc, x_buffer.range(), gammas.range(),
                                      betas.range(), y.range(), mean.range(), rstd.range()));
    SPLAT_ASSIGN(vk::CommandList list, recorder.finish());
    SPLAT_TRY(context.run(list));
    Floats got(expected.size());
    SPLAT_TRY(context.read(y.range(), got.data(), got.size() * 4));
    return distance(got, expected) / 20;  // relative to the values, which reach 20
}

/// Three Gaussians on the optical axis, the farthest first, in an image of 24 x 16 pixels. Each covers its pixels by
/// opacity * exp(-d^2 / (2 (f^2 s^2 / z^2 + 0.3))), and the nearer ones cover the farther.
Result<double> raster_error(vk::Context& context) {
    constexpr std::uint32_t kW = 24, kH = 16;
    constexpr double kF = 20, kScale = 0.2;
    const double depths[] = {4, 3, 2}, opacities[] = {0.9, 0.6, 0.3};
    const double colors[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    raster::RasterDesc desc;
    desc.gaussians = 3;
    desc.width = kW;
    desc.height = kH;
    desc.convention = raster::Convention::kGsplat;
    scene::Gaussians scene;
    constexpr double kY0 = 0.28209479177387814;  // 1 / (2 sqrt(pi)), of the constant harmonic
    for (std::size_t i = 0; i < 3; ++i) {
        scene.means.insert(scene.means.end(), {0, 0, static_cast<float>(depths[i])});
        scene.log_scales.insert(scene.log_scales.end(), 3, static_cast<float>(std::log(kScale)));
        scene.rotations.insert(scene.rotations.end(), {1, 0, 0, 0});
        scene.opacity_logits.push_back(
            static_cast<float>(std::log(opacities[i] / (1 - opacities[i]))));
        for (const double color : colors[i])
            scene.sh.push_back(static_cast<float>((color - 0.5) / kY0));
    }
    scene::Camera camera{"self-test", kW, kH, kF, kF, kW / 2.0, kH / 2.0, {}};
    for (std::size_t i = 0; i < 16; i += 5) camera.world_to_camera[i] = 1;
    SPLAT_ASSIGN(const auto rasterizer, raster::Rasterizer::create(context, desc));
    SPLAT_ASSIGN(const raster::PackedBuffers packed, raster::allocate_packed(context, desc));
    SPLAT_TRY(raster::upload_scene(context, desc, scene, packed));
    SPLAT_ASSIGN(const raster::PackedViews views,
                 raster::pack_views(desc, {&camera, 1}, {1, 1, 1}));
    SPLAT_TRY(rasterizer->forward(packed.scene(), views));
    Floats got(std::size_t{4} * kW * kH);
    SPLAT_TRY(context.read(rasterizer->workspace().image.range(), got.data(), got.size() * 4));
    double most = 0;
    for (std::size_t p = 0; p < std::size_t{kW} * kH; ++p) {
        const double dx = static_cast<double>(p % kW) + 0.5 - kW / 2.0;
        const double dy = static_cast<double>(p / kW) + 0.5 - kH / 2.0;
        double left = 1, rgb[3] = {};
        for (const std::size_t i : {2U, 1U, 0U}) {
            const double variance = kF * kF * kScale * kScale / (depths[i] * depths[i]) + 0.3;
            const double alpha = opacities[i] * std::exp(-(dx * dx + dy * dy) / (2 * variance));
            if (alpha < 1.0 / 255) continue;
            for (std::size_t c = 0; c < 3; ++c) rgb[c] += left * alpha * colors[i][c];
            left *= 1 - alpha;
        }
        for (std::size_t c = 0; c < 3; ++c) {
            const double error = std::abs(rgb[c] + left - static_cast<double>(got[4 * p + c]));
            if (!(error <= most)) most = std::isnan(error) ? kInfinite : error;
        }
    }
    return most;
}

/// Drivers and kernels that passed in this process.
std::mutex passed_mutex;
std::set<std::string>& passed_ones() {
    static std::set<std::string> all;
    return all;
}

std::string key_of(const vk::DeviceInfo& info, vk::Kernels kernels) {
    return std::string(splat_version_string()) + " " + info.driver + " " +
           std::to_string(info.driver_version) + " " + info.name + " " + kernels_name(kernels);
}

bool noted(const std::string& path, const std::string& key) {
    std::error_code none;
    if (!std::filesystem::is_regular_file(path, none)) return false;
    std::ifstream file(path);
    std::string line;
    while (std::getline(file, line))
        if (line == key) return true;
    return false;
}

/// A folder that cannot be written, or something else in the file's place, only means another test next time.
void note(const std::string& path, const std::string& key) {
    std::error_code none;
    if (path.empty()) return;
    std::filesystem::create_directories(std::filesystem::path(path).parent_path(), none);
    if (std::filesystem::exists(path, none) && !std::filesystem::is_regular_file(path, none))
        return;
    std::ofstream(path, std::ios::app) << key << "\n";
}

}  // namespace

Result<std::string> self_test(vk::Context& context) {
    struct Part {
        const char* what;
        Result<double> (*error)(vk::Context&);
        double most;  ///< roundings of float32; of the scene also a pixel at the threshold of 1/255
    };
    constexpr Part kParts[] = {{"a product of matrices", linear_error, 0},
                               {"a group normalisation", group_norm_error, 1e-6},
                               {"a scene of three Gaussians", raster_error, 5e-3}};
    for (const Part& part : kParts) {
        SPLAT_ASSIGN(double error, part.error(context));
        if (SPLAT_FAULT("self_test.wrong")) error = 1;
        if (error <= part.most) continue;
        char text[200];
        std::snprintf(text, sizeof text, "%s is off by %g, at most %g is right", part.what, error,
                      part.most);
        return std::string(text);
    }
    return std::string();
}

Result<std::shared_ptr<vk::Context>> tested_context(const vk::ContextDesc& desc) {
    SPLAT_ASSIGN(std::shared_ptr<vk::Context> context, vk::Context::create(desc));
    if (environment("SPLAT_SELF_TEST").value_or("1") == "0") return context;
    for (;;) {
        const vk::DeviceInfo& info = context->device().info();
        const vk::Kernels kernels = context->device().kernels();
        const std::string key = key_of(info, kernels);
        const std::string path = desc.cache_folder.empty()
                                     ? ""
                                     : vk::pipeline_cache_path(desc.cache_folder, info) + ".tested";
        const std::lock_guard lock(passed_mutex);
        if (passed_ones().count(key) != 0) return context;
        if (!path.empty() && noted(path, key)) {
            passed_ones().insert(key);
            return context;
        }
        SPLAT_ASSIGN(const std::string wrong, self_test(*context));
        if (wrong.empty()) {
            passed_ones().insert(key);
            note(path, key);
            return context;
        }
        const std::string who = info.name + " (" + info.driver + ")";
        const std::string named = std::string(kernels_name(kernels)) + " kernels";
        const bool chosen =
            desc.device.kernels != vk::Kernels::kAuto || environment("SPLAT_KERNELS");
        if (kernels == vk::Kernels::kPlain && !chosen)
            return error(Code::kNoDevice,
                         "%s computes wrongly: %s, with plain kernels; update or change the "
                         "driver, or choose "
                         "another device (SPLAT_SELF_TEST=0 uses it all the same)",
                         who.c_str(), wrong.c_str());
        if (chosen) {
            log(LogLevel::kWarning, who + " computes wrongly with the " + named +
                                        " that were chosen: " + wrong +
                                        "; results are not to be trusted");
            return context;
        }
        log(LogLevel::kWarning, who + " computes wrongly with " + named + ": " + wrong +
                                    "; plain ones are used, which are slower. Update the driver");
        vk::ContextDesc plain = desc;
        plain.device.kernels = vk::Kernels::kPlain;
        context.reset();
        SPLAT_ASSIGN(context, vk::Context::create(plain));
    }
}

}  // namespace splat::api
