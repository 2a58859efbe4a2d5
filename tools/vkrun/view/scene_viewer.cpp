#include "vkrun/view/scene_viewer.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/matrix.hpp>

#include "vkrun/cli/svg.h"
#include "vkrun/cli/text.h"
#include "vkrun/scene/scene_file.h"
#include "vkrun/view/embedded_page.h"

namespace vkrun {
namespace {

Json pose_json(const splat_camera& camera) {
    const double* const m = camera.world_to_camera;
    return {{"size", {camera.width, camera.height}},
            {"intrinsics", {camera.fx, camera.fy, camera.cx, camera.cy}},
            {"world_to_camera", std::vector<double>(m, m + 12)}};
}

/// The point that all cameras look at, if there is one. With eyes e and axes d it is the nearest to all axes:
/// sum (I - d d') (x - e) = 0. The middle of a scene with stray Gaussians lies beside its object.
std::optional<glm::dvec3> common_target(const std::vector<splat_camera>& cameras) {
    constexpr double kLeast = 1e-3;  ///< least determinant: two axes 4 degrees apart
    constexpr double kMiss = 0.05;   ///< how far an axis may pass by, as a part of the depth
    std::vector<std::pair<glm::dvec3, glm::dvec3>> axes;
    glm::dmat3 matrix(0);
    glm::dvec3 right(0);
    for (const splat_camera& camera : cameras) {
        const glm::dmat4 rows = glm::make_mat4(camera.world_to_camera);
        const glm::dvec3 d(rows[2]), shift(rows[0][3], rows[1][3], rows[2][3]);
        const glm::dvec3 e = -(glm::dmat3(rows) * shift);
        const glm::dmat3 part = glm::dmat3(1) - glm::outerProduct(d, d);
        matrix += part;
        for (int k = 0; k < 3; ++k) right += part[k] * e[k];
        axes.emplace_back(e, d);
    }
    const double determinant = glm::determinant(matrix);
    if (!(determinant > kLeast * std::pow(static_cast<double>(cameras.size()), 3)))
        return std::nullopt;
    const glm::dvec3 x = glm::dvec3(glm::dot(right, glm::cross(matrix[1], matrix[2])),
                                    glm::dot(matrix[0], glm::cross(right, matrix[2])),
                                    glm::dot(matrix[0], glm::cross(matrix[1], right))) /
                         determinant;
    for (const auto& [e, d] : axes)
        if (!(glm::length(glm::cross(x - e, d)) < kMiss * glm::dot(x - e, d))) return std::nullopt;
    return x;
}

std::string bytes_of(const std::vector<std::uint32_t>& words) {
    std::string bytes;
    bytes.reserve(4 * words.size());
    for (const std::uint32_t word : words)
        for (unsigned shift = 0; shift < 32; shift += 8)
            bytes += static_cast<char>(word >> shift & 255U);
    return bytes;
}

}  // namespace

ViewerFacts add_viewer(HtmlPage& page, ScenePayload payload, const ViewerOptions& options) {
    Json facts = std::move(payload.facts);
    facts["name"] = options.name;
    facts["file"] = options.file;
    facts["notes"] = payload.notes;
    facts["background"] = options.background;
    facts["up"] = options.up;
    facts["turning"] = options.turning;
    facts["drawn_as"] = drawn_names(options.drawn_as.value_or(payload.drawn_as));
    if (const auto target = common_target(options.cameras))
        facts["center"] = {target->x, target->y, target->z};
    facts["poses"] = Json::array();
    for (const std::size_t i : view_numbers(options.cameras.size()))
        facts["poses"].push_back(pose_json(options.cameras[i]));
    const splat_camera& first = options.cameras.front();
    std::string stills;
    for (const std::string& file : options.stills) stills += image_tag(file, options.name);
    const std::string instead = !options.instead.empty()  ? options.instead
                                : !options.stills.empty() ? "The pictures show it."
                                                          : "";
    page.embed(format("<div class=\"splat %s\" style=\"--ratio:%u/%u\" data-instead=\"%s\" "
                      "data-splat=\"%s\">\n",
                      options.full_window ? "splat-full" : "splat-frame", first.width, first.height,
                      xml_escaped(instead).c_str(), xml_escaped(json_text(facts)).c_str()) +
                   "<div class=\"splat-stills\"><p class=\"splat-why\">The scene turns in browsers "
                   "that run "
                   "scripts and have WebGL2. " +
                   xml_escaped(instead) + "</p>" + stills +
                   "</div>\n<script type=\"text/plain\" class=\"splat-data\">" +
                   base64(bytes_of(payload.words)) + "</script></div>\n",
               kViewerStyle, kViewerScript);
    return {facts.at("count").get<std::uint64_t>(), facts.at("faint").get<std::uint64_t>(),
            facts.at("poses").size(), std::move(payload.notes)};
}

ViewerFacts add_viewer(HtmlPage& page, splat_scene scene, const ViewerOptions& options) {
    return add_viewer(page, pack_scene(scene, kPageGaussians), options);
}

std::vector<std::size_t> view_numbers(std::size_t cameras) {
    constexpr std::size_t kMost = 9, kSpread = 6;  // a digit each
    const std::size_t views = cameras > kMost ? kSpread : cameras;
    std::vector<std::size_t> numbers;
    for (std::size_t i = 0; i < views; ++i) numbers.push_back(i * cameras / views);
    return numbers;
}

void up_of(const std::vector<splat_camera>& cameras, double* up) {
    double sum[3] = {0, 0, 0};
    for (const splat_camera& camera : cameras)
        for (int k = 0; k < 3; ++k) sum[k] -= camera.world_to_camera[4 + k];
    const double length = std::hypot(sum[0], sum[1], sum[2]);
    // Cameras that look from all sides have no common one.
    const bool clear = length > 0.3 * static_cast<double>(cameras.size());
    for (int k = 0; k < 3; ++k) up[k] = clear ? sum[k] / length : k == 1 ? -1 : 0;
}

}  // namespace vkrun
