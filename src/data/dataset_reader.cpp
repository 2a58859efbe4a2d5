#include "data/dataset_reader.h"

#include <algorithm>
#include <cmath>

#include "core/shown.h"
#include "data/folder.h"
#include "io/photo/image_file.h"

namespace splat::data {
namespace {

/// Relative difference of focal lengths that counts as none.
constexpr double kSameFocal = 1e-6;

/// "123 (first 'x')" for the elements that only `a` has.
std::string only_in(const std::vector<std::string>& a, const std::vector<std::string>& b) {
    std::vector<std::string> rest;
    std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(rest));
    return rest.empty() ? "0" : format("%zu (first '%s')", rest.size(), rest.front().c_str());
}

/// Errors: kFormat for fewer views than one as input and one as target.
Status check_views(const std::string& folder, std::size_t views) {
    if (views >= 2) return {};
    return damaged("'%s': %zu views, expected 2 or more: one as input and one to compare with",
                   folder.c_str(), views);
}

}  // namespace

const char* map_name(MapKind kind) {
    constexpr const char* kNames[] = {"rgb", "depth", "normal", "mask", "plane"};
    return kNames[static_cast<std::size_t>(kind)];
}

Status check_same(const std::string& folder, const char* kind,
                  const std::vector<std::string>& cameras, const std::vector<std::string>& images) {
    if (cameras == images) return {};
    return damaged(
        "'%s': %zu poses and %zu images in %s; poses without image: %s, images without pose: %s",
        folder.c_str(), cameras.size(), images.size(), kind, only_in(cameras, images).c_str(),
        only_in(images, cameras).c_str());
}

DatasetReader::DatasetReader(const char* format, const ReaderDesc& desc, Filter filter)
    : desc_(desc) {
    index_.format = format;
    index_.split = desc.split;
    index_.filter = filter;
    index_.maps = kAllMaps;
}

Result<std::vector<std::string>> DatasetIndex::add(const std::string& name,
                                                   const std::string& folder,
                                                   const ViewNames& views, bool lenient) {
    std::vector<std::string> both;
    std::set_intersection(views.cameras.begin(), views.cameras.end(), views.images.begin(),
                          views.images.end(), std::back_inserter(both));
    std::vector<std::string> found;
    for (const Status& status : {check_same(folder, "rgb", views.cameras, views.images),
                                 check_views(folder, both.size())}) {
        if (!status.ok() && !lenient) return status;
        if (!status.ok()) found.push_back(status.message());
    }
    names.push_back(name);
    folders.push_back(folder);
    views_of.push_back(static_cast<std::uint32_t>(both.size()));
    problems.push_back(std::move(found));
    return both;
}

Status DatasetIndex::add_stored(std::string name, std::uint32_t views, const std::string& folder,
                                bool lenient) {
    const Status status = views >= 2 ? Status() : check_views(folder + " " + name, views);
    if (!status.ok() && !lenient) return status;
    names.push_back(std::move(name));
    views_of.push_back(views);
    if (lenient) problems.emplace_back();
    if (!status.ok()) problems.back().push_back(status.message());
    return {};
}

Status DatasetIndex::take(const ReaderDesc& desc, const std::string& name,
                          const std::string& folder, const std::function<Result<bool>()>& add) {
    const std::size_t count = names.size();
    const std::uint32_t maps_before = maps;
    const Result<bool> added = add();
    if (added.ok()) {
        if (!added.value()) others.push_back(name);
        return {};
    }
    const Status& problem = added.status();
    const bool incomplete = problem.code() == Code::kNotFound || problem.code() == Code::kFormat;
    if (desc.lenient) {
        if (names.size() == count) {
            names.push_back(name);
            folders.push_back(folder);
            views_of.push_back(0);
            problems.emplace_back();
        }
        problems.back().push_back(problem.message());
        return {};
    }
    if (!incomplete) return problem;
    if (!desc.allow_missing)
        return damaged(
            "%s; the object '%s' is incomplete or damaged: repair it, or allow missing "
            "objects, which leaves it out",
            problem.message().c_str(), name.c_str());
    names.resize(count);
    folders.resize(count);
    views_of.resize(count);
    problems.resize(count);
    maps = maps_before;
    while (!lacks.empty() && lacks.back().object >= count) lacks.pop_back();
    missing.emplace_back(name, problem.message());
    return {};
}

void Crop::add(std::uint32_t image_width, std::uint32_t image_height, std::uint32_t square) {
    ++images;
    if (image_width == square && image_height == square) return;
    if (cut == 0) {
        width = image_width;
        height = image_height;
        side = square;
    }
    alike = alike && width == image_width && height == image_height && side == square;
    ++cut;
}

std::string DatasetIndex::crop_note(std::uint32_t used) const {
    if (crop.cut == 0) return "";
    const double kept = 100.0 * crop.side * crop.side / (double{1} * crop.width * crop.height);
    std::string note = splat::format(
        "%zu of %zu images are cut to the largest square around the principal point%s %u x %u "
        "pixels to %u x %u (%.0f %% of them)",
        crop.cut, crop.images, crop.alike ? ":" : ", the first from", crop.width, crop.height,
        crop.side, crop.side, kept);
    if (used != crop.side) note += splat::format(", and scaled to %u x %u", used, used);
    return note;
}

std::string DatasetIndex::unread_note() const {
    if (unread.empty()) return "";
    const std::string remedy = io::unread_image_file(unread.front());
    return splat::format(
        "%zu files in folders of maps are not read, expected .png, .jpg, .webp, .pgm, .npy or "
        ".pfm: '%s'%s%s",
        unread_count, shown(unread.front()).c_str(), remedy.empty() ? "" : ", ", remedy.c_str());
}

void DatasetIndex::add_lacking(MapKind kind, const std::string& place) {
    maps &= ~flag_of(kind);
    lacks.push_back({names.size() - 1, kind, place});
}

std::string DatasetIndex::lacking(MapKind kind) const {
    const auto first =
        std::ranges::find_if(lacks, [kind](const Lack& lack) { return lack.kind == kind; });
    return first == lacks.end() ? "" : first->place;
}

std::string DatasetIndex::plane_remedy() const {
    const std::string place = lacking(MapKind::kPlane);
    if (place.empty() || place.ends_with(".npy")) return "";
    return "'vkrun priors plane' makes plane maps, beside rgb/ folders";
}

void DatasetIndex::compare_maps() {
    for (const MapKind kind : kMaps) {
        const auto counts = [&](const Lack& lack) {
            return lack.kind == kind && views_of[lack.object] > 0;
        };
        const auto without = static_cast<std::size_t>(std::ranges::count_if(lacks, counts));
        const auto read = static_cast<std::size_t>(
            std::ranges::count_if(views_of, [](std::uint32_t views) { return views > 0; }));
        if (without == 0 || without >= read) continue;
        for (const Lack& lack : lacks)
            if (counts(lack))
                problems[lack.object].push_back(
                    splat::format("there are no %s maps in '%s', which %zu other objects have",
                                  map_name(kind), lack.place.c_str(), read - without));
    }
}

Status no_split(const ReaderDesc& desc, Status status) {
    if (desc.lacks_split != nullptr) *desc.lacks_split = true;
    return status;
}

Status DatasetIndex::check_any() const {
    if (!names.empty() || missing.empty()) return {};
    return damaged("all %zu objects of the split %s are incomplete, the first: %s", missing.size(),
                   split.c_str(), missing.front().second.c_str());
}

Status DatasetIndex::find_resolution(const DatasetReader& reader, bool lenient) {
    if (lenient) compare_maps();
    SPLAT_TRY(check_any());
    for (std::uint32_t object = 0; object < names.size(); ++object) {
        if (views_of[object] == 0) continue;
        const auto first = reader.image(object, 0, MapKind::kRgb, true);
        if (first.ok()) {
            resolution = first.value().width;
            const bool has_alpha = first.value().channels == 2 || first.value().channels == 4;
            alpha_masks = has_alpha && (maps & flag_of(MapKind::kMask)) == 0;
            if (alpha_masks) maps |= flag_of(MapKind::kMask);
            return {};
        }
        if (!lenient) return as_damage(first.status());
    }
    return {};
}

Result<io::Image> DatasetReader::map(std::uint32_t object, std::uint32_t view, MapKind kind) const {
    if (kind != MapKind::kMask || !index().alpha_masks) {
        SPLAT_ASSIGN(io::Image found, image(object, view, kind, false));
        const bool binary =
            kind == MapKind::kMask &&
            std::ranges::none_of(found.samples, [](std::uint16_t sample) { return sample > 1; });
        for (std::uint16_t& sample : found.samples) sample = binary ? sample * 255 : sample;
        return found;
    }
    SPLAT_ASSIGN(const io::Image found, image(object, view, MapKind::kRgb, false));
    const std::uint32_t channels = found.channels;
    if (channels != 2 && channels != 4)
        return damaged(
            "object '%s', view %u: an image without alpha, which is the mask in the first "
            "image of the data "
            "set",
            index().names[object].c_str(), view);
    io::Image alpha{found.width, found.height, 1, found.bits, {}};
    for (std::size_t i = channels - 1; i < found.samples.size(); i += channels)
        alpha.samples.push_back(found.samples[i]);
    return alpha;
}

Result<std::uint32_t> DatasetReader::width(std::uint32_t object, std::uint32_t view,
                                           MapKind kind) const {
    const bool alpha = kind == MapKind::kMask && index().alpha_masks;
    SPLAT_ASSIGN(const io::Image found, image(object, view, alpha ? MapKind::kRgb : kind, true));
    return found.width;
}

Result<std::vector<scene::Vec3>> DatasetReader::points(std::uint32_t) const {
    return std::vector<scene::Vec3>();
}

Result<ObjectText> DatasetReader::text(std::uint32_t object) const {
    SPLAT_ASSIGN(const std::vector<StoredView> views, cameras(object));
    const double side = index().resolution;
    ObjectText text;
    for (const StoredView& view : views) {
        const StoredView& first = views.front();
        if (std::abs(view.focal_x - first.focal_x) > kSameFocal * first.focal_x ||
            std::abs(view.focal_y - first.focal_x) > kSameFocal * first.focal_x)
            return unsupported(
                "object '%s': focal lengths %g and %g, view %zu has %g; tables, stores and "
                "SRN's files hold one for each object: train on the folder itself, or "
                "export it as images",
                index().names[object].c_str(), first.focal_x * side, first.focal_y * side,
                text.views.size(), view.focal_x * side);
        std::string pose;
        for (const double value : view.camera_to_world)
            pose += format("%s%.17g", pose.empty() ? "" : " ", value);
        text.views.push_back({format("%06zu", text.views.size()), pose + "\n"});
    }
    if (views.empty()) return text;
    text.intrinsics = format("%.17g %.17g %.17g 0\n0 0 0\n1\n%.0f %.0f\n",
                             views.front().focal_x * side, side / 2, side / 2, side, side);
    return text;
}

}  // namespace splat::data
