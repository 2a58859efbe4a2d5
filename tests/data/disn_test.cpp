#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "data/formats.h"
#include "data/sample_formats.h"
#include "scene/srgb.h"
#include "support/expect_status.h"

namespace splat::test {
namespace {

namespace fs = std::filesystem;
using data::MapKind;
using scene::Vec3;

constexpr std::uint32_t kSide = 64;
constexpr double kFocal = 35.0 / 32 * kSide;
constexpr const char* kObject = "03001627/1a2b";

struct View {
    double azimuth, elevation, ratio;  ///< degrees
    Vec3 shift;                        ///< in the axes of the file
};

/// What a ray of direction `d` from `from` meets of a box around `center`: distance along d, outward normal.
struct Hit {
    double t;
    Vec3 normal;
};
std::optional<Hit> meet(const Vec3& from, const Vec3& d, const Vec3& center) {
    const Vec3 half(0.3, 0.15, 0.22);
    double enter = -1e9, leave = 1e9;
    Vec3 normal{};
    for (std::size_t k = 0; k < 3; ++k) {
        const double a = (center[k] - half[k] - from[k]) / d[k];
        const double b = (center[k] + half[k] - from[k]) / d[k];
        if (std::min(a, b) > enter) {
            enter = std::min(a, b);
            normal = {};
            normal[k] = d[k] > 0 ? -1 : 1;
        }
        leave = std::min(leave, std::max(a, b));
    }
    if (enter > leave) return std::nullopt;
    return Hit{enter, normal};
}

double radians(double degrees) {
    return degrees * std::acos(-1.0) / 180;
}

Vec3 eye_of(const View& view) {
    const double a = radians(view.azimuth), e = radians(view.elevation);
    return 1.75 * view.ratio *
           Vec3(std::cos(e) * std::cos(a), std::sin(e), std::cos(e) * std::sin(a));
}

std::uint16_t byte_of(double value) {
    return static_cast<std::uint16_t>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
}

/// Draws the images of a view: 0 image, 1 depth, 2 normal, 3 albedo.
std::vector<io::Image> draw(const View& view, bool moved) {
    const Vec3 eye = eye_of(view), forward = -glm::normalize(eye);
    const Vec3 right = glm::normalize(glm::cross(forward, Vec3(0, 1, 0)));
    const Vec3 up = glm::cross(right, forward);
    const Vec3& s = view.shift;
    const Vec3 center = moved ? Vec3(s.x, s.z, -s.y) : Vec3{};
    std::vector<io::Image> images(4, io::Image{kSide, kSide, 4, 8, {}});
    for (std::uint32_t row = 0; row < kSide; ++row)
        for (std::uint32_t column = 0; column < kSide; ++column) {
            const Vec3 d = forward + (column + 0.5 - kSide / 2.0) / kFocal * right -
                           (row + 0.5 - kSide / 2.0) / kFocal * up;
            const auto hit = meet(eye, d, center);
            const auto add = [&](std::size_t i, const Vec3& color) {
                for (std::size_t k = 0; k < 3; ++k) images[i].samples.push_back(byte_of(color[k]));
                images[i].samples.push_back(hit ? 255 : 0);
            };
            add(0, hit ? Vec3(0.2, 0.4, 0.6) : Vec3{});
            add(1, Vec3(hit ? (hit->t - 0.7) * 1.4 : 1));
            Vec3 coded(0.5);
            if (hit)
                coded = (Vec3(-glm::dot(hit->normal, right), glm::dot(hit->normal, up),
                              -glm::dot(hit->normal, forward)) +
                         1.0) /
                        2.0;
            for (std::size_t k = 0; k < 3; ++k)
                coded[k] = static_cast<double>(scene::srgb_of_linear(static_cast<float>(coded[k])));
            add(2, coded);
            add(3, hit ? Vec3(0.9, 0.8, 0.7) : Vec3{});
        }
    return images;
}

std::string line_of(const View& v) {
    return format("[%.17g,%.17g,0,%.17g,35,32,1.75,%.17g,%.17g,%.17g], \n", v.azimuth, v.elevation,
                  v.ratio, v.shift.x, v.shift.y, v.shift.z);
}

std::vector<View> easy_views() {
    return {{12, 25, 0.7, {}}, {21, 28, 0.75, {}}, {33, 22, 0.72, {}}};
}

std::vector<View> hard_views() {
    return {{10, 5, 0.7, {0.1, -0.15, 0.05}},
            {20, 40, 0.75, {-0.12, 0.1, -0.1}},
            {31, 20, 0.72, {0.15, 0.1, 0.08}},
            {40, 10, 0.68, {-0.1, -0.1, 0.12}},
            {50, 30, 0.7, {0.05, 0.15, -0.1}}};
}

constexpr const char* kKinds[] = {"image", "depth", "normal", "albedo"};

/// The views of a set in all kinds of the list.
void put_views(const fs::path& root, const char* set, const std::vector<View>& views, bool moved,
               const std::vector<std::size_t>& kinds = {0, 1, 2, 3}) {
    std::string text;
    for (const View& view : views) text += line_of(view);
    for (std::size_t i = 0; i < views.size(); ++i) {
        const auto images = draw(views[i], moved);
        for (const std::size_t kind : kinds)
            put_png(root / kKinds[kind] / kObject / set / format("%02zu.png", i), images[kind]);
    }
    for (const std::size_t kind : kinds)
        put_text(root / kKinds[kind] / kObject / set / "rendering_metadata.txt", text);
}

Vec3 place_of(const data::StoredView& view) {
    return {view.camera_to_world[3], view.camera_to_world[7], view.camera_to_world[11]};
}

/// The camera's place in our world of a place in the axes of the .obj.
void expect_place(const data::StoredView& view, const Vec3& obj) {
    EXPECT_LT(glm::length(place_of(view) - Vec3(obj.x, -obj.z, obj.y)), 1e-12);
}

std::unique_ptr<data::Dataset> open_as(const fs::path& path, const char* format) {
    data::DatasetDesc desc = data_desc(path);
    desc.format = format;
    return open_data(desc);
}

TEST(Disn, EasyAndHardViewsHaveTheirCamerasAndMaps) {
    const SampleFolder folder;
    put_views(folder.path(), "easy", easy_views(), false);
    put_views(folder.path(), "hard", hard_views(), true);
    const auto set = open_data(folder.path());
    EXPECT_EQ(set->index().format, "disn");
    EXPECT_EQ(set->index().names, std::vector<std::string>{"03001627_1a2b"});
    EXPECT_EQ(set->index().views_of, std::vector<std::uint32_t>{8});
    EXPECT_EQ(set->index().maps, data::kAllMaps & ~data::flag_of(MapKind::kPlane));
    EXPECT_EQ(set->index().lacking(MapKind::kPlane), "") << "no place of theirs is read";
    EXPECT_EQ(set->index().plane_remedy(), "");
    EXPECT_FALSE(set->index().has_splits);
    EXPECT_EQ(set->resolution(), kSide);
    const auto views = need(set->reader().cameras(0));
    ASSERT_EQ(views.size(), 8U);
    EXPECT_DOUBLE_EQ(views[0].focal_x, 1.09375);
    for (std::size_t i = 0; i < 3; ++i) expect_place(views[i], eye_of(easy_views()[i]));
    for (std::size_t i = 0; i < 5; ++i) {
        const View view = hard_views()[i];
        const Vec3& s = view.shift;
        expect_place(views[3 + i], eye_of(view) - Vec3(s.x, s.z, -s.y));
    }
}

/// Columns and rows that show something.
struct Extent {
    double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;

    void add(double x, double y) {
        left = std::min(left, x);
        right = std::max(right, x);
        top = std::min(top, y);
        bottom = std::max(bottom, y);
    }
};

TEST(Disn, CamerasSeeTheObjectWhereItsMaskIs) {
    for (const bool moved : {false, true}) {
        const SampleFolder folder;
        put_views(folder.path(), "hard", hard_views(), moved);
        const auto set = open_as(folder.path(), "disn_hard");
        const auto views = need(set->reader().cameras(0));
        for (std::uint32_t i = 0; i < views.size(); ++i) {
            const scene::Mat4& pose = views[i].camera_to_world;
            Extent corners, mask;
            for (int corner = 0; corner < 8; ++corner) {
                const Vec3 obj((corner & 1) != 0 ? 0.3 : -0.3, (corner & 2) != 0 ? 0.15 : -0.15,
                               (corner & 4) != 0 ? 0.22 : -0.22);
                const Vec3 d = Vec3(obj.x, -obj.z, obj.y) - place_of(views[i]);
                Vec3 seen{};
                for (std::size_t k = 0; k < 3; ++k)
                    seen[k] = d.x * pose[k] + d.y * pose[4 + k] + d.z * pose[8 + k];
                corners.add(std::clamp(seen.x / seen.z * kFocal + kSide / 2.0, 0.0, 1.0 * kSide),
                            std::clamp(seen.y / seen.z * kFocal + kSide / 2.0, 0.0, 1.0 * kSide));
            }
            const auto image = need(set->reader().map(0, i, MapKind::kMask));
            for (std::uint32_t at = 0; at < kSide * kSide; ++at)
                if (image.samples[at] > 0) mask.add(at % kSide + 0.5, at / kSide + 0.5);
            EXPECT_NEAR(corners.left, mask.left, 1.6) << moved << " " << i;
            EXPECT_NEAR(corners.right, mask.right, 1.6) << moved << " " << i;
            EXPECT_NEAR(corners.top, mask.top, 1.6) << moved << " " << i;
            EXPECT_NEAR(corners.bottom, mask.bottom, 1.6) << moved << " " << i;
        }
    }
}

TEST(Disn, MapsHaveTheConventionsOfHere) {
    const SampleFolder folder;
    std::vector<View> views = easy_views();
    views[1].ratio = 0.65;  // nothing is beyond what depth holds
    put_views(folder.path(), "easy", views, false);
    const auto set = open_data(folder.path());
    const auto depth = need(set->reader().map(0, 1, MapKind::kDepth));
    const auto normal = need(set->reader().map(0, 1, MapKind::kNormal));
    const auto mask = need(set->reader().map(0, 1, MapKind::kMask));
    EXPECT_EQ(depth.channels, 1U);
    const View& view = views[1];
    const Vec3 eye = eye_of(view), forward = -glm::normalize(eye);
    const Vec3 right = glm::normalize(glm::cross(forward, Vec3(0, 1, 0)));
    const Vec3 down = glm::cross(forward, right);
    double nearest = 1e9, farthest = 0;
    std::vector<std::optional<Hit>> hits;
    for (std::uint32_t i = 0; i < kSide * kSide; ++i) {
        const Vec3 d = forward + (i % kSide + 0.5 - kSide / 2.0) / kFocal * right +
                       (i / kSide + 0.5 - kSide / 2.0) / kFocal * down;
        hits.push_back(meet(eye, d, {}));
        if (!hits.back()) continue;
        nearest = std::min(nearest, hits.back()->t);
        farthest = std::max(farthest, hits.back()->t);
    }
    ASSERT_LT(farthest, 1.41);
    for (std::size_t i = 0; i < hits.size(); ++i) {
        EXPECT_EQ(mask.samples[i], hits[i] ? 255 : 0);
        const double nearness =
            hits[i] ? (1 / hits[i]->t - 1 / farthest) / (1 / nearest - 1 / farthest) : 0;
        ASSERT_NEAR(depth.samples[i], 255 * nearness, 3) << i;
        Vec3 n{};
        if (hits[i])
            n = {glm::dot(hits[i]->normal, right), glm::dot(hits[i]->normal, down),
                 glm::dot(hits[i]->normal, forward)};
        for (std::size_t k = 0; k < 3; ++k)
            ASSERT_NEAR(normal.samples[3 * i + k], 127.5 * (n[k] + 1), 2) << i << " " << k;
    }
}

TEST(Disn, DepthBeyondTheRangeIsNotKnown) {
    const SampleFolder folder;
    auto views = easy_views();
    views[0].ratio = 0.9;  // some of the box is beyond 1.414
    put_views(folder.path(), "easy", views, false);
    const auto set = open_data(folder.path());
    const auto depth = need(set->reader().map(0, 0, MapKind::kDepth));
    const auto mask = need(set->reader().map(0, 0, MapKind::kMask));
    std::size_t unknown = 0, known = 0;
    for (std::size_t i = 0; i < depth.samples.size(); ++i)
        if (mask.samples[i] > 0) ++(depth.samples[i] == 0 ? unknown : known);
    EXPECT_GT(unknown, 50U);
    EXPECT_GT(known, 50U);
}

TEST(Disn, PartsAreFormatsOfTheirOwn) {
    const SampleFolder folder;
    put_views(folder.path(), "easy", easy_views(), false);
    put_views(folder.path(), "hard", hard_views(), false);
    EXPECT_EQ(open_as(folder.path(), "disn_easy")->index().views_of[0], 3U);
    EXPECT_EQ(open_as(folder.path(), "disn_hard")->index().views_of[0], 5U);
    const auto albedo = open_as(folder.path(), "disn_albedo");
    const auto image = need(albedo->reader().image(0, 0, MapKind::kRgb, false));
    const auto* const middle = &image.samples[(kSide / 2 * kSide + kSide / 2) * 4];
    EXPECT_EQ(middle[0], byte_of(0.9));
    fs::remove_all(folder / "image");
    EXPECT_EQ(open_data(folder.path())->index().format, "disn_albedo");
    data::DatasetDesc desc = data_desc(folder.path());
    desc.format = "disn_easy";
    EXPECT_ERROR(data_status(desc), Code::kNotFound, "image");
    fs::remove_all(folder / "albedo/03001627/1a2b/easy");
    fs::remove_all(folder / "normal");
    const auto hard = open_data(folder.path());
    EXPECT_EQ(hard->index().views_of[0], 5U);
    EXPECT_EQ(hard->index().maps, data::flag_of(MapKind::kDepth) | data::flag_of(MapKind::kMask));
}

/// The status of the cameras of the first object.
Status cameras_status(const fs::path& path) {
    return open_data(path)->reader().cameras(0).status();
}

TEST(Disn, AShiftThatCannotBeToldIsRefused) {
    const SampleFolder other, without, far;
    // The images have another shift than the file.
    auto views = hard_views();
    put_views(other.path(), "hard", views, true);
    std::string text;
    for (View& view : views) {
        view.shift = Vec3(view.shift.y, -view.shift.z, view.shift.x) * 1.5;
        text += line_of(view);
    }
    put_text(other / "image" / kObject / "hard/rendering_metadata.txt", text);
    EXPECT_ERROR(cameras_status(other.path()), Code::kFormat, "apart in depth without the shift");
    put_views(without.path(), "hard", hard_views(), true, {0});
    EXPECT_ERROR(cameras_status(without.path()), Code::kFormat,
                 "read the easy views (format disn_easy)");
    auto behind = hard_views();
    for (View& view : behind) view.ratio = 1.2;
    put_views(far.path(), "hard", behind, true);
    EXPECT_ERROR(cameras_status(far.path()), Code::kFormat, "show enough depth");
}

TEST(Disn, DamageIsNamed) {
    const auto refused = [](const std::function<void(const fs::path&)>& damage, const char* part) {
        const SampleFolder folder;
        put_views(folder.path(), "easy", easy_views(), false);
        damage(folder.path());
        EXPECT_ERROR(data_status(folder.path()), Code::kFormat, part);
    };
    const auto metadata = [&](const std::string& text, const char* part) {
        refused(
            [&](const fs::path& root) {
                put_text(root / "image" / kObject / "easy/rendering_metadata.txt", text);
            },
            part);
    };
    metadata("[1,2,0,0.7,35,32,1.75,0,0], \n", "rendering_metadata line 1: '[1,2,0,0.7,35");
    metadata("[1,2,0,0.7,35,32,1.75,0,0,0,0], \n", "expected 10 numbers");
    metadata("[1,x,0,0.7,35,32,1.75,0,0,0], \n", "expected 10 numbers");
    metadata("[1,90,0,0.7,35,32,1.75,0,0,0], \n", "elevation below 89 degrees");
    metadata("[1,2,0,-0.7,35,32,1.75,0,0,0], \n", "a ratio of distances");
    metadata("[1,2,3,0.7,35,32,1.75,0,0,0], \n", "elevation below 89 degrees, 0,");
    metadata(line_of(easy_views()[0]) + line_of(easy_views()[0]),
             "images without pose: 1 (first 'easy/02.png')");
    refused([](const fs::path& root) { fs::remove(root / "image" / kObject / "easy/01.png"); },
            "poses without image: 1 (first 'easy/01.png')");
    refused([](const fs::path& root) { fs::remove(root / "depth" / kObject / "easy/01.png"); },
            "poses without image: 1 (first 'easy/01.png')");
    refused(
        [](const fs::path& root) {
            fs::remove(root / "image" / kObject / "easy/rendering_metadata.txt");
            put_text(root / "image/03001627/b/easy/rendering_metadata.txt", "");
        },
        "rendering_metadata.txt");
}

}  // namespace
}  // namespace splat::test
