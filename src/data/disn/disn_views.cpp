#include "data/disn/disn_views.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/number_in.h"
#include "core/os/path.h"
#include "data/folder.h"
#include "io/file.h"

namespace splat::data::disn {
namespace {

constexpr std::uint64_t kMaxMetadataBytes = 1U << 20;

Result<View> view_of_line(std::string_view line) {
    std::array<double, 10> numbers{};
    std::string text(line);
    for (char& c : text)
        if (c == '[' || c == ']' || c == ',') c = ' ';
    std::size_t at = 0, count = 0;
    while ((at = text.find_first_not_of(" \t\r", at)) != text.npos) {
        const std::size_t end = std::min(text.find_first_of(" \t\r", at), text.size());
        const auto number = number_in<double>(std::string_view(text).substr(at, end - at));
        if (!number || !std::isfinite(*number) || count == numbers.size())
            return damaged("'%s', expected 10 numbers", shown(line, 80).c_str());
        numbers[count++] = *number;
        at = end;
    }
    const auto [azimuth, elevation, roll, ratio, lens, sensor, distance, x, y, z] = numbers;
    if (count != numbers.size() || roll != 0 || !(std::abs(elevation) < 89) || !(ratio > 0) ||
        !(lens > 0) || !(sensor > 0) || !(distance > 0) || distance * ratio > kMostDistance)
        return damaged(
            "'%s', expected azimuth, elevation below 89 degrees, 0, a ratio of distances, the "
            "lengths of lens and sensor, a distance, and a shift",
            shown(line, 80).c_str());
    constexpr double kDegree = 0.017453292519943295;
    // The shift has Blender's axes, z up.
    return View{azimuth * kDegree, elevation * kDegree, distance * ratio, lens / sensor,
                scene::Vec3{x, z, -y}};
}

/// Differences of depth where the points of view `a` are seen by view `b`; 1 where there is only background.
void add_differences(const Depth& a, const Camera& from, const Depth& b, const Camera& to,
                     std::vector<double>& differences) {
    const double half = a.side / 2.0, focal_a = from.focal * a.side, focal_b = to.focal * b.side;
    for (std::uint32_t row = 0; row < a.side; row += 2)
        for (std::uint32_t column = 0; column < a.side; column += 2) {
            const auto z = static_cast<double>(a.z[std::size_t{row} * a.side + column]);
            if (z == 0) continue;
            const scene::Vec3 seen = {(column + 0.5 - half) / focal_a * z,
                                      (row + 0.5 - half) / focal_a * z, z};
            const scene::Vec3 there = (from.turn * seen + from.place - to.place) * to.turn;
            if (!(there.z > 0)) continue;
            const double x = there.x / there.z * focal_b + b.side / 2.0;
            const double y = there.y / there.z * focal_b + b.side / 2.0;
            if (!(x >= 0 && x < b.side && y >= 0 && y < b.side)) continue;
            const std::size_t at =
                static_cast<std::size_t>(y) * b.side + static_cast<std::size_t>(x);
            if (!b.object[at])
                differences.push_back(1);
            else if (b.z[at] > 0)
                differences.push_back(std::abs(static_cast<double>(b.z[at]) - there.z));
        }
}

double median_of(std::vector<double>& values) {
    const auto middle = values.begin() + std::ssize(values) / 2;
    std::ranges::nth_element(values, middle);
    return *middle;
}

}  // namespace

Result<std::vector<View>> read_views(const std::filesystem::path& path) {
    const std::string name = os::text_of(path);
    SPLAT_ASSIGN(const io::Buffer file, io::read_file(name, kMaxMetadataBytes));
    io::Lines lines(file, "rendering_metadata");
    std::vector<View> views;
    std::string_view line;
    while (lines.next_record(line)) {
        const auto view = view_of_line(line);
        if (!view.ok()) return in_file(lines.bad(view.status().message()), name);
        views.push_back(view.value());
    }
    return views;
}

Camera camera_of(const View& view, Shift shift) {
    const scene::Vec3 seen_from =
        view.distance * scene::Vec3(std::cos(view.elevation) * std::cos(view.azimuth),
                                    std::sin(view.elevation),
                                    std::cos(view.elevation) * std::sin(view.azimuth));
    const scene::Vec3 forward = -glm::normalize(seen_from);
    const scene::Vec3 right = glm::normalize(glm::cross(forward, scene::Vec3(0, 1, 0)));
    return {scene::Mat3(right, glm::cross(forward, right), forward),
            shift == Shift::kMoved ? seen_from - view.shift : seen_from, view.focal};
}

scene::Mat4 pose_of(const Camera& camera) {
    scene::Mat4 pose{};
    for (std::size_t k = 0; k < 4; ++k) {
        const scene::Vec3 from = k < 3 ? camera.turn[k] : camera.place;
        pose[k] = from.x;
        pose[4 + k] = -from.z;
        pose[8 + k] = from.y;
    }
    pose[15] = 1;
    return pose;
}

Depth depth_of(const io::Image& stored, const io::Image& image) {
    Depth depth{stored.width, {}, {}};
    const std::size_t count = std::size_t{stored.width} * stored.height;
    for (std::size_t i = 0; i < count; ++i) {
        const bool has_alpha = image.channels == 2 || image.channels == 4;
        const bool object = !has_alpha || image.samples[(i + 1) * image.channels - 1] >= 128;
        const std::uint16_t value = stored.samples[i * stored.channels];
        depth.object.push_back(object);
        depth.z.push_back(object && value < 255 ? static_cast<float>(0.7 + value / 255.0 / 1.4)
                                                : 0);
    }
    return depth;
}

void ShiftTest::add(const View& view, Depth depth) {
    constexpr std::size_t kEnoughPixels = 200;
    const std::size_t had = differences_[0].size();
    for (const Shift shift : {Shift::kNone, Shift::kMoved})
        if (before_.side != 0)
            add_differences(before_, camera_of(last_, shift), depth, camera_of(view, shift),
                            differences_[static_cast<std::size_t>(shift)]);
    pairs_ += differences_[0].size() >= had + kEnoughPixels ? 1 : 0;
    before_ = std::move(depth);
    last_ = view;
}

Result<Shift> ShiftTest::result(const std::string& object) {
    constexpr double kSameDepth = 0.02;  // steps are 0.003; a wrong choice has some 0.15
    if (pairs_ == 0)
        return damaged("'%s': no two hard views show enough depth to tell whether the object moved",
                       object.c_str());
    const double still = median_of(differences_[0]);
    const double moved = differences_[1].empty() ? 1 : median_of(differences_[1]);
    if (std::min(still, moved) < kSameDepth) return still <= moved ? Shift::kNone : Shift::kMoved;
    return damaged(
        "'%s': points of hard views are %.3f apart in depth without the shift of %s and %.3f with "
        "it, expected less than %g for one of them",
        object.c_str(), still, kMetadata, moved, kSameDepth);
}

}  // namespace splat::data::disn
