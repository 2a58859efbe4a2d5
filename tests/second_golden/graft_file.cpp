#include <cmath>
#include <numbers>

#include "second_golden/layer_files.h"

namespace splat::golden {
namespace {

constexpr std::size_t kSide = 24;
constexpr std::size_t kPixels = kSide * kSide;
constexpr std::size_t kViews = 2;             ///< views of one object
constexpr std::size_t kPriors = 5;            ///< depth, normal, mask
constexpr std::size_t kRank = 3;              ///< rank of the adapters
constexpr double kField = 51.98948897809546;  ///< degrees, that of the cars

const Layers::Network kNetwork = {8, 2, {1, 2, 3, 3}, {12}, kViews, 15};
const char* const kFirst = "network_with_offset.encoder.enc.24x24_conv.weight";

/// A set of channels behind RGB, by the letters of its name, and their planes among the priors.
struct Variant {
    const char* name;
    std::vector<std::size_t> planes;
};
const std::vector<Variant> kVariants = {
    {"m", {4}}, {"d", {0}}, {"nm", {1, 2, 3, 4}}, {"dnm", {0, 1, 2, 3, 4}}};

/// Images, cameras and weights.
struct Session {
    Values rgb, priors, rays, poses, quaternions;
    std::map<std::string, std::pair<Dims, Values>> state;
};

Values rays() {
    const double focal = kSide / 2.0 / std::tan(kField * std::numbers::pi / 360);
    Values all(3 * kPixels, 1);
    for (std::size_t i = 0; i < kPixels; ++i) {
        all[i] = (static_cast<double>(i % kSide) + 0.5 - kSide / 2.0) / focal;
        all[kPixels + i] = (static_cast<double>(i / kSide) + 0.5 - kSide / 2.0) / focal;
    }
    for (double& value : all) value = static_cast<double>(static_cast<float>(value));
    return all;
}

/// Quaternions w x y z, and the row-vector matrices of their rotations with translations.
void put_cameras(Session& session, Numbers& numbers) {
    for (std::size_t view = 0; view < kViews; ++view) {
        const Values q = numbers.normal(4);
        const double size = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        const double w = q[0] / size, x = q[1] / size, y = q[2] / size, z = q[3] / size;
        const Values rotation = {
            1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
            2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
        const Values t = numbers.normal(3);
        for (std::size_t row = 0; row < 3; ++row) {
            for (std::size_t column = 0; column < 3; ++column)
                session.poses.push_back(rotation[3 * column + row]);
            session.poses.push_back(0);
        }
        session.poses.insert(session.poses.end(), {t[0], t[1], t[2], 1});
        session.quaternions.insert(session.quaternions.end(), {w, x, y, z});
    }
    for (Values* values : {&session.poses, &session.quaternions})
        for (double& value : *values) value = static_cast<double>(static_cast<float>(value));
}

/// One pass of the network of RGB and the given planes.
struct Pass {
    Tape tape;
    Id x = 0, first = 0;
    std::vector<Id> outputs;  ///< means, opacities, scales, rotations, sh
};

/// Weights that the session lacks are made by `numbers`; those of the first convolution are widened by zeros.
Pass run(Session& session, const std::vector<std::size_t>& planes, Numbers& numbers) {
    Pass pass;
    Tape& tape = pass.tape;
    const std::size_t channels = 3 + planes.size();
    Values images;
    for (std::size_t view = 0; view < kViews; ++view) {
        const auto take = [&](const Values& from, std::size_t plane) {
            const auto at = from.begin() + static_cast<std::ptrdiff_t>(plane * kPixels);
            images.insert(images.end(), at, at + static_cast<std::ptrdiff_t>(kPixels));
        };
        for (std::size_t c = 0; c < 3; ++c) take(session.rgb, 3 * view + c);
        for (const std::size_t plane : planes) take(session.priors, kPriors * view + plane);
    }
    pass.x = tape.leaf({kViews, channels, kSide, kSide}, images);
    Layers layers(tape, [&](const std::string& name, const Dims& dims, Role role) {
        if (!session.state.contains(name))
            session.state[name] = {dims, numbers.parameter(dims, role)};
        Values values = session.state.at(name).second;
        if (name == kFirst) {
            Values wide(elements_of(dims), 0);
            const std::size_t taps = dims[2] * dims[3];
            for (std::size_t i = 0; i < values.size(); ++i)
                wide[i / (3 * taps) * dims[1] * taps + i % (3 * taps)] = values[i];
            return pass.first = tape.leaf(dims, wide);
        }
        return tape.leaf(dims, values);
    });
    const Id raw = layers.network(pass.x, kNetwork);
    const std::size_t all = kViews * kPixels;
    pass.outputs = tape.op(
        "gaussian_head",
        {raw, tape.leaf({3, kSide, kSide}, session.rays), tape.leaf({kViews, 4, 4}, session.poses),
         tape.leaf({kViews, 4}, session.quaternions), Tape::kNone, Tape::kNone},
        {{"offset", 1},
         {"sh_degree", 0},
         {"isotropic", 0},
         {"activate", 1},
         {"znear", 0.8},
         {"zfar", 1.8},
         {"positions", 0},
         {"scales", 2},
         {"direct", 0},
         {"per_pixel", 1}},
        {{1, all, 3}, {1, all, 1}, {1, all, 3}, {1, all, 4}, {1, all, 1, 3}});
    return pass;
}

void put_outputs(Arrays& arrays, const std::string& prefix, const Pass& pass) {
    const char* names[] = {"xyz", "opacity", "scaling", "rotation", "features_dc"};
    for (std::size_t i = 0; i < pass.outputs.size(); ++i)
        arrays[prefix + names[i]] =
            test::npy_f32(pass.tape.dims(pass.outputs[i]), pass.tape.values(pass.outputs[i]));
    arrays[prefix + "features_rest"] = test::npy_f32({1, kViews * kPixels, 0, 3}, {});
}

/// Fresh adapters: A uniform within 1 / sqrt(columns), B zero.
void put_adapters(Arrays& arrays, const Session& session, Numbers& numbers) {
    for (const auto& [name, tensor] : session.state) {
        const auto& [dims, values] = tensor;
        const std::string layer = name.substr(0, name.rfind('.'));
        const bool resampled = layer.ends_with("_down.conv0") || layer.ends_with("_up.conv0");
        const bool adapted = layer.ends_with(".conv0") || layer.ends_with(".conv1") ||
                             layer.ends_with(".qkv") || layer.ends_with(".proj");
        if (!name.ends_with(".weight") || !adapted || resampled) continue;
        const std::size_t columns = values.size() / dims[0];
        Values a = numbers.normal(kRank * columns);
        for (double& value : a)
            value = std::tanh(value) * 0.99 / std::sqrt(static_cast<double>(columns));
        arrays["lora_init." + layer + ".lora_A"] = test::npy_f32({kRank, columns}, a);
        arrays["lora_init." + layer + ".lora_B"] =
            test::npy_f32({dims[0], kRank}, Values(dims[0] * kRank, 0));
    }
}

}  // namespace

Arrays graft_file() {
    Arrays arrays;
    Numbers numbers(5);
    Session session;
    session.rgb = numbers.normal(kViews * 3 * kPixels);
    session.priors = numbers.normal(kViews * kPriors * kPixels);
    session.rays = rays();
    put_cameras(session, numbers);
    arrays["first_name"] = test::npy_text(kFirst);
    arrays["x_rgb"] = test::npy_f32({1, kViews, 3, kSide, kSide}, session.rgb);
    arrays["x_prior"] = test::npy_f32({1, kViews, kPriors, kSide, kSide}, session.priors);
    arrays["v2w"] = test::npy_f32({1, kViews, 4, 4}, session.poses);
    arrays["quat"] = test::npy_f32({1, kViews, 4}, session.quaternions);
    put_outputs(arrays, "o_old.", run(session, {}, numbers));
    for (const auto& [name, tensor] : session.state)
        arrays["old." + name] = test::npy_f32(tensor.first, tensor.second);
    arrays["old.ray_dirs"] = test::npy_f32({1, 3, kSide, kSide}, session.rays);
    for (const Variant& variant : kVariants) {
        Pass pass = run(session, variant.planes, numbers);
        Tape& tape = pass.tape;
        const std::string name = variant.name;
        put_outputs(arrays, "o_" + name + ".", pass);
        const auto ones = [&](Id id) { return Values(tape.values(id).size(), 1); };
        tape.backward(
            {{pass.outputs[0], ones(pass.outputs[0])}, {pass.outputs[4], ones(pass.outputs[4])}});
        arrays["new_" + name + "." + kFirst] =
            test::npy_f32(tape.dims(pass.first), tape.values(pass.first));
        arrays["dfirst_" + name] = test::npy_f32(tape.dims(pass.first), tape.gradient(pass.first));
        arrays["d_x_" + name] = test::npy_f32({1, kViews, 3 + variant.planes.size(), kSide, kSide},
                                              tape.gradient(pass.x));
    }
    put_outputs(arrays, "o_lora.", run(session, kVariants.back().planes, numbers));
    put_adapters(arrays, session, numbers);
    return arrays;
}

}  // namespace splat::golden
