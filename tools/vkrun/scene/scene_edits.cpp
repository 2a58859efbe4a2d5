#include "vkrun/scene/scene_edits.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <numbers>

#include "core/os/path.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/table.h"
#include "vkrun/cli/text.h"

namespace vkrun {

/// A row of the table of edits.
struct EditKind {
    const char* option;
    const char* value;    ///< in the help; "" for a flag
    std::size_t numbers;  ///< how many the value has; 0 for a flag or a text
    double least, most;   ///< range of each number
    const char* help;
    const char* function;             ///< name in the C API
    void (*check)(const SceneEdit&);  ///< for more than the range; may be null
    /// False if the scene is as before.
    bool (*apply)(SceneFile&, const SceneEdit&, const EditOptions&);
};

namespace {

constexpr double kLargestNumber = std::numeric_limits<float>::max();  // means are float32
constexpr double kSmallestScale = std::numeric_limits<float>::min();

std::uint64_t count_of(const Scene& scene) {
    std::uint64_t count = 0;
    check(splat_scene_get_size(scene.get(), &count, nullptr));
    return count;
}

std::string text_of(const SceneEdit& edit) {
    return edit.kind->option + (edit.text.empty() ? "" : " " + edit.text);
}

/// -1 for each axis of the edits that points the other way in memory.
std::array<double, 3> axis_signs(splat_frame frame) {
    std::array<double, 3> signs{};
    for (std::size_t k = 0; k < 3; ++k)
        signs[k] = frame_name(frame)[k] == frame_name(SPLAT_FRAME_RDF)[k] ? 1 : -1;
    return signs;
}

/// Three numbers of an edit, from the one of this index on, in the axes of memory.
std::array<double, 3> in_memory(const SceneEdit& edit, std::size_t first,
                                const EditOptions& options) {
    std::array<double, 3> v = axis_signs(options.frame);
    for (std::size_t k = 0; k < 3; ++k) v[k] *= edit.numbers[first + k];
    return v;
}

bool transform(SceneFile& file, const splat_similarity& similarity) {
    check(splat_scene_transform(file.scene.get(), &similarity), kUsageError);
    return true;
}

bool all_zero(const SceneEdit& edit) {
    return std::all_of(edit.numbers.begin(), edit.numbers.end(), [](double v) { return v == 0; });
}

bool translate(SceneFile& file, const SceneEdit& edit, const EditOptions& options) {
    if (all_zero(edit)) return false;
    const auto [x, y, z] = in_memory(edit, 0, options);
    return transform(file, {{1, 0, 0, 0}, {x, y, z}, 1});
}

/// About the axes of the edits, which do not turn: x, then y, then z.
bool rotate(SceneFile& file, const SceneEdit& edit, const EditOptions& options) {
    if (all_zero(edit)) return false;
    glm::dquat q(1, 0, 0, 0);
    for (int k = 0; k < 3; ++k) {
        glm::dvec3 axis(0);
        axis[k] = 1;
        const double angle = edit.numbers[static_cast<std::size_t>(k)] * std::numbers::pi / 180;
        q = glm::angleAxis(angle, axis) * q;
    }
    // The mirror F turns the rotation R into F R F.
    const auto [x, y, z] = axis_signs(options.frame);
    return transform(file, {{q.w, q.x * y * z, q.y * x * z, q.z * x * y}, {0, 0, 0}, 1});
}

bool scale(SceneFile& file, const SceneEdit& edit, const EditOptions& /*options*/) {
    if (edit.numbers[0] == 1) return false;
    return transform(file, {{1, 0, 0, 0}, {0, 0, 0}, edit.numbers[0]});
}

/// Calls a function that keeps some of the Gaussians.
template <class Call>
bool select(SceneFile& file, Call&& call) {
    const std::uint64_t before = count_of(file.scene);
    check(call(file.scene.get()), kUsageError);
    return count_of(file.scene) != before;
}

void check_box(const SceneEdit& edit) {
    for (std::size_t k = 0; k < 3; ++k)
        if (edit.numbers[k] > edit.numbers[k + 3])
            throw Failure(kUsageError,
                          format("%s: axis %c from %g to %g, expected low <= high; the "
                                 "value is x,y,z of the low corner, then of the high one",
                                 text_of(edit).c_str(), static_cast<char>('x' + k), edit.numbers[k],
                                 edit.numbers[k + 3]));
}

bool crop_box(SceneFile& file, const SceneEdit& edit, const EditOptions& options) {
    auto low = in_memory(edit, 0, options), high = in_memory(edit, 3, options);
    for (std::size_t k = 0; k < 3; ++k)
        if (low[k] > high[k]) std::swap(low[k], high[k]);
    return select(file,
                  [&](splat_scene s) { return splat_scene_crop(s, low.data(), high.data()); });
}

void check_sphere(const SceneEdit& edit) {
    if (edit.numbers[3] < 0)
        throw Failure(kUsageError, format("%s: radius %g, expected >= 0", text_of(edit).c_str(),
                                          edit.numbers[3]));
}

bool crop_sphere(SceneFile& file, const SceneEdit& edit, const EditOptions& options) {
    const auto center = in_memory(edit, 0, options);
    return select(file, [&](splat_scene s) {
        return splat_scene_crop_sphere(s, center.data(), edit.numbers[3]);
    });
}

bool min_opacity(SceneFile& file, const SceneEdit& edit, const EditOptions& /*options*/) {
    return select(file, [&](splat_scene s) { return splat_scene_filter(s, 0, edit.numbers[0]); });
}

bool filter_nan(SceneFile& file, const SceneEdit& /*edit*/, const EditOptions& /*options*/) {
    return select(file,
                  [](splat_scene s) { return splat_scene_filter(s, SPLAT_FILTER_FINITE, 0); });
}

void check_degree(const SceneEdit& edit) {
    if (edit.numbers[0] != std::floor(edit.numbers[0]))
        throw Failure(kUsageError, text_of(edit) + ": expected 0, 1, 2 or 3");
}

bool sh_degree(SceneFile& file, const SceneEdit& edit, const EditOptions& /*options*/) {
    const auto degree = static_cast<std::uint32_t>(edit.numbers[0]);
    std::uint32_t before = 0;
    check(splat_scene_get_size(file.scene.get(), nullptr, &before));
    check(splat_scene_set_sh_degree(file.scene.get(), degree));
    return degree != before;
}

void check_file(const SceneEdit& edit) {
    std::error_code none;
    if (!std::filesystem::exists(splat::os::path_of(edit.text), none))
        throw Failure(kBadData, text_of(edit) + ": there is no such file");
}

bool merge(SceneFile& file, const SceneEdit& edit, const EditOptions& options) {
    const auto desc = scene_file_desc(options.lenient);
    const SceneFile other = load_scene(edit.text, &desc);
    warn_ignored(other, edit.text);
    if (other.report.at("drawn_as") != file.report.at("drawn_as"))
        std::fprintf(
            stderr,
            "vkrun: warning: '%s' is to be drawn otherwise (%s) than IN (%s), as which all "
            "Gaussians of OUT are drawn\n",
            edit.text.c_str(), drawn_as_text(other).c_str(), drawn_as_text(file).c_str());
    const splat_scene both[] = {file.scene.get(), other.scene.get()};
    Scene merged;
    check(splat_scene_merge(both, 2, merged.out()));
    file.scene = std::move(merged);
    return count_of(other.scene) > 0;
}

void check_order(const SceneEdit& edit) {
    if (edit.text != "morton")
        throw Failure(kUsageError, "there is no order '" + edit.text + "'; there is: morton");
}

bool order(SceneFile& file, const SceneEdit& /*edit*/, const EditOptions& /*options*/) {
    check(splat_scene_filter(file.scene.get(), SPLAT_FILTER_SORT, 0));
    return true;
}

constexpr EditKind kEdits[] = {
    {"--translate", "X,Y,Z", 3, -kLargestNumber, kLargestNumber, "Move by this, scene units",
     "splat_scene_transform", nullptr, translate},
    {"--rotate", "X,Y,Z", 3, -kLargestNumber, kLargestNumber,
     "Turn about the origin by angles in degrees: about the axis\nx (from y towards z), then about "
     "y (z to x), then z (x to y);\nthe axes do not turn",
     "splat_scene_transform", nullptr, rotate},
    {"--scale", "F", 1, kSmallestScale, kLargestNumber, "Scale about the origin",
     "splat_scene_transform", nullptr, scale},
    {"--crop-box", "x,y,z,X,Y,Z", 6, -kLargestNumber, kLargestNumber,
     "Keep the Gaussians whose centre is in a box: its low\ncorner, then its high one",
     "splat_scene_crop", check_box, crop_box},
    {"--crop-sphere", "X,Y,Z,R", 4, -kLargestNumber, kLargestNumber,
     "Keep those whose centre is in a sphere: its centre, then\nits radius",
     "splat_scene_crop_sphere", check_sphere, crop_sphere},
    {"--min-opacity", "P", 1, 0, 1, "Keep those of at least this opacity, 0 to 1",
     "splat_scene_filter", nullptr, min_opacity},
    {"--filter-nan", "", 0, 0, 0,
     "Drop those with NaN, infinities or a rotation of length 0;\nan infinite logit stays: opacity "
     "0 or 1",
     "splat_scene_filter", nullptr, filter_nan},
    {"--sh-degree", "N", 1, 0, 3,
     "Drop the bands of harmonics above this degree, 0 to 3;\nmissing ones become zeros",
     "splat_scene_set_sh_degree", check_degree, sh_degree},
    {"--merge", "FILE", 0, 0, 0,
     "Append the Gaussians of another scene; the degree of all\nis the highest",
     "splat_scene_merge", check_file, merge},
    {"--order", "morton", 0, 0, 0, "Sort along a Morton curve: neighbours in space come together",
     "splat_scene_filter", check_order, order},
};

/// The numbers of a value, "1,2,3". Throws a usage Failure.
std::vector<double> numbers_of(const EditKind& kind, const std::string& text) {
    std::vector<double> numbers;
    std::size_t at = 0;
    while (at <= text.size()) {
        const std::size_t end = std::min(text.find(',', at), text.size());
        const std::string word = text.substr(at, end - at);
        char* rest = nullptr;
        const double number = std::strtod(word.c_str(), &rest);
        if (word.empty() || *rest != '\0') break;
        check_number(kind.option, number, kind.least, kind.most);
        numbers.push_back(number);
        at = end + 1;
    }
    if (at <= text.size() || numbers.size() != kind.numbers)
        throw Failure(kUsageError,
                      format("%s is '%s', expected %s: %zu number%s%s", kind.option, text.c_str(),
                             kind.value, kind.numbers, kind.numbers == 1 ? "" : "s",
                             kind.numbers == 1 ? "" : " with commas between them"));
    return numbers;
}

}  // namespace

void add_edit_options(CLI::App& command) {
    for (const EditKind& kind : kEdits) {
        CLI::Option* const option =
            *kind.value == '\0'
                ? command.add_flag(kind.option, kind.help)
                : command
                      .add_option(
                          kind.option, [](const CLI::results_t&) { return true; }, kind.help)
                      ->type_name(kind.value)
                      ->take_all()
                      ->expected(1)
                      ->allow_extra_args(false);
        option->group("Edits, made in the order of the command line");
    }
}

std::string edits_text() {
    Table table({"edit", "in the C API"});
    for (const EditKind& kind : kEdits) table.add({kind.option, kind.function});
    return table.text();
}

std::vector<SceneEdit> edits_of(const CLI::App& command) {
    std::vector<SceneEdit> edits;
    std::map<const CLI::Option*, std::size_t> seen;
    for (const CLI::Option* const option : command.parse_order())
        for (const EditKind& kind : kEdits) {
            if (option != command.get_option(kind.option)) continue;
            SceneEdit edit{&kind, {}, {}};
            if (*kind.value != '\0') edit.text = option->results().at(seen[option]++);
            if (kind.numbers > 0) edit.numbers = numbers_of(kind, edit.text);
            if (kind.check != nullptr) kind.check(edit);
            edits.push_back(std::move(edit));
        }
    return edits;
}

int sh_degree_of(const std::vector<SceneEdit>& edits) {
    int degree = -1;
    for (const SceneEdit& edit : edits)
        if (edit.kind->apply == sh_degree) degree = static_cast<int>(edit.numbers[0]);
    return degree;
}

std::vector<std::string> merged_files(const std::vector<SceneEdit>& edits) {
    std::vector<std::string> files;
    for (const SceneEdit& edit : edits)
        if (edit.kind->apply == merge) files.push_back(edit.text);
    return files;
}

std::vector<EditResult> apply_edits(SceneFile& file, const std::vector<SceneEdit>& edits,
                                    const EditOptions& options) {
    std::vector<EditResult> results;
    std::uint64_t before = count_of(file.scene);
    for (const SceneEdit& edit : edits) {
        EditResult result{text_of(edit), 0, false};
        try {
            result.changed = edit.kind->apply(file, edit, options);
        } catch (const Failure& failure) {
            throw Failure(failure.code(), result.edit + ": " + failure.what(), failure.result());
        }
        result.count = count_of(file.scene);
        if (result.count == 0 && before > 0)
            std::fprintf(stderr, "vkrun: warning: %s leaves none of %llu Gaussians\n",
                         result.edit.c_str(), static_cast<unsigned long long>(before));
        before = result.count;
        results.push_back(std::move(result));
    }
    return results;
}

}  // namespace vkrun
