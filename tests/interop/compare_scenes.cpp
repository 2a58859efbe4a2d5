// The part of splat_transform.sh that reads and writes our formats.
//
//   compare_scenes write FOLDER                 a sample scene as reference.ply (degree 3), ours.splat,
//                                               ours-v3.spz, ours-v4.spz, ours.compressed.ply, degree2.ply,
//                                               ours.sog, ours.gltf and ours.glb
//   compare_scenes REFERENCE OTHER FORMAT       compares OTHER (a scene, or a .csv of another program)
//                                               within the quantisation of FORMAT: ply, splat, spz,
//                                               compressed, ksplat, sog, glb

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <sstream>
#include <string>

#include "io/file.h"
#include "io/sample_scene.h"
#include "io/scene_file.h"
#include "scene/activate.h"
#include "scene/arrays.h"

namespace {

using namespace splat;
using scene::Gaussians;

constexpr std::size_t kCount = 700;

/// Largest differences; the reasons are in the docstrings of the formats.
struct Bounds {
    const char* format;
    double mean, log_scale, angle, opacity, color, band1, band2;
    bool bands;
};

// Half a step of what the format stores, twice that for colours and opacities: some programs truncate.
constexpr Bounds kBounds[] = {
    {"ply", 1e-6, 1e-6, 1e-3, 1e-6, 1e-6, 1e-6, 1e-6, true},
    {"splat", 1e-6, 1e-5, 4.0 / 128, 1.0 / 255, 1.0 / 255 / 0.28209479, 0, 0, false},
    {"spz", 0.5 / 4096 + 1e-6, 1.0 / 32 + 1e-6, 0.005, 1.0 / 255, 1.0 / 255 / 0.15, 4.5 / 128,
     8.5 / 128, true},
    // Ranges of the sample: positions 8, log scales 7, colours 2; y has 10 bits, others 11.
    {"compressed", 0.5 * 8 / 1023, 0.5 * 7 / 1023, 0.005, 1.0 / 255, 2.0 / 255, 1.0 / 64, 1.0 / 64,
     true},
    // Cubes of 5 units in 65534 steps; scales and rotations have 11 bits, which three.js truncates: a scale may lose
    // 1 / 1024 of itself; bands of level 2 are 2 / 255, truncated.
    {"ksplat", 2.5 / 32767, 1.0 / 1023, 2.0 / 1024, 1.0 / 255, 1.0 / 255 / 0.28209479, 2.0 / 255,
     2.0 / 255, true},
    // 256 numbers for log scales in a range of 7, and for colours and bands in one of 2.
    {"sog", 2.5e-4, 7.0 / 256, 0.02, 1.0 / 255, 2.0 / 256, 2.0 / 256, 2.0 / 256, true},
    // Rounding of float32, through other frames: only exp and log of scales, and the sigmoid.
    {"glb", 1e-6, 1e-6, 1e-3, 1e-6, 1e-6, 1e-6, 1e-6, true}};

void fail(const std::string& problem) {
    std::fprintf(stderr, "compare_scenes: %s\n", problem.c_str());
    std::exit(1);
}

template <class T>
T value_or_exit(Result<T> result) {
    if (!result.ok()) fail(result.status().message());
    return std::move(result.value());
}

Gaussians load(const std::string& path) {
    return value_or_exit(io::read_scene(value_or_exit(io::read_file(path)), path)).gaussians;
}

void save(const std::string& path, const Gaussians& scene, std::uint32_t spz_version = 3) {
    io::SaveOptions options;
    options.spz_version = spz_version;
    const io::SceneFormat& format = *value_or_exit(io::written_scene_format(path));
    const io::Buffer file = value_or_exit(io::write_scene(scene, format, options));
    const Status status = io::write_file(path, file);
    if (!status.ok()) fail(status.message());
}

/// Numbers of a .csv file with a line of names.
struct Csv {
    std::vector<std::string> names;
    std::vector<std::vector<float>> rows;

    [[nodiscard]] std::size_t column(const std::string& name) const {
        for (std::size_t i = 0; i < names.size(); ++i)
            if (names[i] == name) return i;
        fail("the csv has no column " + name);
        return 0;
    }
    [[nodiscard]] bool has(const std::string& name) const {
        return std::find(names.begin(), names.end(), name) != names.end();
    }
};

Csv parse_csv(const std::string& path) {
    const io::Buffer bytes = value_or_exit(io::read_file(path));
    std::istringstream text{std::string(io::as_text(bytes))};
    Csv csv;
    std::string line;
    std::string cell;
    for (std::size_t number = 0; std::getline(text, line); ++number) {
        std::istringstream cells(line);
        if (number > 0) csv.rows.emplace_back();
        while (std::getline(cells, cell, ','))
            if (number == 0)
                csv.names.push_back(cell);
            else
                csv.rows.back().push_back(std::strtof(cell.c_str(), nullptr));
        if (number > 0 && csv.rows.back().size() != csv.names.size()) fail("a short csv row");
    }
    return csv;
}

std::string numbered(const char* prefix, std::size_t i) {
    return prefix + std::to_string(i);
}

Gaussians from_csv(const Csv& csv) {
    std::size_t rest = 0;
    while (csv.has(numbered("f_rest_", rest))) ++rest;
    std::uint32_t degree = 0;
    while (3 * std::size_t{scene::sh_coefficients(degree)} - 3 < rest) ++degree;
    Gaussians g = scene::make_gaussians(csv.rows.size(), degree);
    const std::size_t count = scene::sh_coefficients(degree);
    const auto fill = [&](const std::string& name, std::vector<float>& to, std::size_t each,
                          std::size_t place) {
        const std::size_t column = csv.column(name);
        for (std::size_t i = 0; i < csv.rows.size(); ++i)
            to[i * each + place] = csv.rows[i][column];
    };
    const char* const axes[] = {"x", "y", "z"};
    fill("opacity", g.opacity_logits, 1, 0);
    for (std::size_t k = 0; k < 4; ++k) fill(numbered("rot_", k), g.rotations, 4, k);
    for (std::size_t k = 0; k < 3; ++k) {
        fill(axes[k], g.means, 3, k);
        fill(numbered("scale_", k), g.log_scales, 3, k);
        fill(numbered("f_dc_", k), g.sh, count * 3, k);
        for (std::size_t j = 1; j < count; ++j)
            fill(numbered("f_rest_", k * (count - 1) + j - 1), g.sh, count * 3, j * 3 + k);
    }
    return g;
}

/// Index in `other` of the nearest mean to each one of `reference`: some programs reorder.
std::vector<std::size_t> match(const Gaussians& reference, const Gaussians& other) {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < reference.count(); ++i) {
        std::size_t best = 0;
        double least = std::numeric_limits<double>::infinity();
        for (std::size_t j = 0; j < other.count(); ++j) {
            double squared = 0;
            for (std::size_t k = 0; k < 3; ++k)
                squared += std::pow(static_cast<double>(reference.means[i * 3 + k]) -
                                        static_cast<double>(other.means[j * 3 + k]),
                                    2);
            if (squared < least) best = j;
            least = std::min(least, squared);
        }
        order.push_back(best);
    }
    auto sorted = order;
    std::sort(sorted.begin(), sorted.end());
    if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end())
        fail("two Gaussians match the same one");
    return order;
}

/// Prints one line; false if the difference is over the bound.
bool report(const char* attribute, double difference, double bound) {
    const bool good = difference <= bound;
    std::printf("  %-10s %.3g (bound %.3g)%s\n", attribute, difference, bound,
                good ? "" : "  FAILED");
    return good;
}

double max_opacity_difference(const Gaussians& a, const Gaussians& b) {
    double largest = 0;
    for (std::size_t i = 0; i < a.count(); ++i)
        largest = std::max(largest,
                           std::abs(scene::opacity_of(static_cast<double>(a.opacity_logits[i])) -
                                    scene::opacity_of(static_cast<double>(b.opacity_logits[i]))));
    return largest;
}

/// Largest difference of coefficients first .. last - 1.
double max_sh_difference(const Gaussians& a, const Gaussians& b, std::size_t first,
                         std::size_t last) {
    const std::size_t each = std::size_t{scene::sh_coefficients(a.sh_degree)} * 3;
    double largest = 0;
    for (std::size_t i = 0; i < a.sh.size(); ++i)
        if (i % each >= first * 3 && i % each < last * 3)
            largest = std::max(
                largest, std::abs(static_cast<double>(a.sh[i]) - static_cast<double>(b.sh[i])));
    return largest;
}

/// Replaces each rotation by the nearest one of the same Gaussian: half turns about its own axes change nothing, and
/// programs that turn a scene choose among them.
void choose_half_turns(const Gaussians& reference, Gaussians& other) {
    for (std::size_t i = 0; i < reference.rotations.size(); i += 4) {
        float* const q = &other.rotations[i];
        const auto [w, x, y, z] = std::array{q[0], q[1], q[2], q[3]};
        float most = -1;
        for (const std::array<float, 4>& equal :
             {std::array{w, x, y, z}, {-x, w, z, -y}, {-y, -z, w, x}, {-z, y, -x, w}}) {
            float inner = 0;
            for (std::size_t k = 0; k < 4; ++k) inner += equal[k] * reference.rotations[i + k];
            if (std::abs(inner) <= most) continue;
            most = std::abs(inner);
            std::copy(equal.begin(), equal.end(), q);
        }
    }
}

bool compare(const Gaussians& reference, const Gaussians& unordered, const Bounds& bounds) {
    if (unordered.count() != reference.count())
        fail(std::to_string(unordered.count()) + " Gaussians, expected " +
             std::to_string(reference.count()));
    if (bounds.bands && unordered.sh_degree != reference.sh_degree)
        fail("SH degree " + std::to_string(unordered.sh_degree));
    Gaussians other = scene::with_sh_degree(scene::gather(unordered, match(reference, unordered)),
                                            reference.sh_degree);
    choose_half_turns(reference, other);
    bool good = report("mean", test::max_difference(reference.means, other.means), bounds.mean);
    good &= report("log scale", test::max_difference(reference.log_scales, other.log_scales),
                   bounds.log_scale);
    good &= report("rotation", test::max_angle(reference.rotations, other.rotations), bounds.angle);
    good &= report("opacity", max_opacity_difference(reference, other), bounds.opacity);
    good &= report("colour", max_sh_difference(reference, other, 0, 1), bounds.color);
    if (!bounds.bands) return good;
    good &= report("band 1", max_sh_difference(reference, other, 1, 4), bounds.band1);
    good &= report("bands 2, 3", max_sh_difference(reference, other, 4, 16), bounds.band2);
    return good;
}

void write_samples(const std::string& folder) {
    const Gaussians scene = test::sample_scene(kCount, 3);
    save(folder + "/reference.ply", scene);
    save(folder + "/ours.splat", scene);
    save(folder + "/ours-v3.spz", scene, 3);
    save(folder + "/ours-v4.spz", scene, 4);
    save(folder + "/ours.compressed.ply", scene);
    save(folder + "/degree2.ply", scene::with_sh_degree(scene, 2));
    save(folder + "/ours.gltf", scene);
    save(folder + "/ours.glb", scene);
    save(folder + "/ours.sog", scene);
}

}  // namespace

int main(int argc, char** argv) {
    if (argc == 3 && std::string(argv[1]) == "write") {
        write_samples(argv[2]);
        return 0;
    }
    if (argc != 4) fail("usage: compare_scenes write FOLDER | REFERENCE OTHER FORMAT");
    const std::string other = argv[2];
    const Gaussians reference = load(argv[1]);
    for (const Bounds& bounds : kBounds) {
        if (std::string(argv[3]) != bounds.format) continue;
        if (other.ends_with(".csv"))
            return compare(reference, from_csv(parse_csv(other)), bounds) ? 0 : 1;
        return compare(reference, load(other), bounds) ? 0 : 1;
    }
    fail(std::string("format ") + argv[3]);
}
