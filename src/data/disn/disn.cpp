#include <algorithm>
#include <array>
#include <filesystem>

#include "core/os/path.h"
#include "data/disn/disn_views.h"
#include "data/folder.h"
#include "data/formats.h"
#include "data/map_files.h"
#include "io/folder.h"
#include "scene/srgb.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;
using disn::kMetadata;
using disn::Shift;

constexpr std::size_t kMostDisnViews = 100;  ///< two digits number them
constexpr const char* kSets[] = {"easy", "hard"};

struct DisnObject {
    std::string below;                        ///< <category>/<object>
    std::array<std::uint32_t, 2> views = {};  ///< easy ones, hard ones
    bool has_depth = false;
};

/// Parts of a data set that a format reads.
struct DisnParts {
    const char* name;
    const char* colors;  ///< "image" or "albedo"
    bool easy, hard;
};

class DisnReader : public ObjectsReader<DisnObject> {
  public:
    DisnReader(const ReaderDesc& desc, const DisnParts& parts)
        : ObjectsReader(parts.name, desc, Filter::kBicubic), parts_(parts) {
        index_.has_splits = false;
        index_.maps &= ~flag_of(MapKind::kPlane);  // the layout has no place for them
    }

    Status open();
    [[nodiscard]] Result<std::vector<StoredView>> cameras(std::uint32_t object) const override;
    [[nodiscard]] Result<io::Image> image(std::uint32_t object, std::uint32_t view, MapKind kind,
                                          bool header_only) const override;

  private:
    Result<bool> add_object(const std::string& below, const std::string& name);
    Status find_maps(MapKind kind, DisnObject& object, const std::vector<std::string>& stems);
    [[nodiscard]] Result<Shift> find_shift(const DisnObject& object,
                                           const std::vector<disn::View>& views) const;
    [[nodiscard]] Result<disn::Depth> load_depth(const DisnObject& object,
                                                 const std::string& file) const;

    /// <kind>/<category>/<object>
    [[nodiscard]] fs::path folder(const char* kind, const std::string& below) const {
        return os::path_of(desc_.path) / kind / os::path_of(below);
    }
    /// "easy/07.png": the easy views come first.
    static std::string file_of(const DisnObject& object, std::uint32_t view) {
        const bool hard = view >= object.views[0];
        return format("%s/%02u.png", kSets[hard ? 1 : 0], hard ? view - object.views[0] : view);
    }

    DisnParts parts_;
};

Status DisnReader::open() {
    const fs::path root = os::path_of(desc_.path) / parts_.colors;
    SPLAT_ASSIGN(std::vector<std::string> categories, candidates_in(root));
    if (std::ranges::find(categories, desc_.category) != categories.end())
        categories = {desc_.category};
    for (const std::string& category : categories) {
        SPLAT_ASSIGN(const std::vector<std::string> names, candidates_in(root / category));
        for (const std::string& name : names) {
            if (is_full()) break;
            const std::string below = category + "/" + name;
            const std::string whole = category + "_" + name;
            SPLAT_TRY(take(whole, folder(parts_.colors, below),
                           [&] { return add_object(below, whole); }));
        }
    }
    SPLAT_TRY(index_.check_any());
    if (objects_.empty())
        return no_split(
            desc_, not_found("'%s' has no objects in %s/<category>/<object>/%s/",
                             desc_.path.c_str(), parts_.colors, parts_.easy ? "easy" : "hard"));
    return index_.find_resolution(*this, desc_.lenient);
}

Result<bool> DisnReader::add_object(const std::string& below, const std::string& name) {
    const fs::path colors = folder(parts_.colors, below);
    SPLAT_ASSIGN(const io::PathKind there, io::kind_of(os::text_of(colors)));
    SPLAT_TRY(check_link(there, colors));
    DisnObject object;
    object.below = below;
    ViewNames names;
    bool begun = false;
    for (std::size_t set = 0; set < 2; ++set) {
        if (!(set == 0 ? parts_.easy : parts_.hard)) continue;
        const fs::path part = colors / kSets[set];
        SPLAT_ASSIGN(const io::PathKind kind, io::kind_of(os::text_of(part)));
        SPLAT_TRY(check_link(kind, part));
        if (kind == io::PathKind::kNothing) continue;
        begun = true;
        SPLAT_ASSIGN(const std::vector<disn::View> views, disn::read_views(part / kMetadata));
        if (views.size() > kMostDisnViews)
            return damaged("'%s': %zu views, expected at most %zu",
                           os::text_of(part / kMetadata).c_str(), views.size(), kMostDisnViews);
        object.views[set] = static_cast<std::uint32_t>(views.size());
        for (std::size_t i = 0; i < views.size(); ++i)
            names.cameras.push_back(format("%s/%02zu.png", kSets[set], i));
        SPLAT_ASSIGN(const std::vector<std::string> images, images_in(part));
        for (const std::string& image : images)
            names.images.push_back(std::string(kSets[set]) + "/" + image);
    }
    if (!begun) return false;
    SPLAT_TRY(check_same(os::text_of(colors), parts_.colors, names.cameras, names.images));
    SPLAT_TRY(index_.add(name, os::text_of(colors), names, desc_.lenient).status());
    SPLAT_TRY(find_maps(MapKind::kDepth, object, names.cameras));
    SPLAT_TRY(find_maps(MapKind::kNormal, object, names.cameras));
    index_.add_lacking(MapKind::kMask, os::text_of(colors));  // they are the images' opacity
    objects_.push_back(std::move(object));
    return true;
}

/// Looks for the maps of all views. Errors: kFormat where some are missing.
Status DisnReader::find_maps(MapKind kind, DisnObject& object,
                             const std::vector<std::string>& stems) {
    const fs::path maps = folder(map_name(kind), object.below);
    std::vector<std::string> found;
    for (std::size_t set = 0; set < 2; ++set) {
        if (object.views[set] == 0) continue;
        const auto names = images_in(maps / kSets[set]);
        if (names.status().code() == Code::kNotFound) continue;
        if (!names.ok()) return names.status();
        for (const std::string& name : names.value())
            found.push_back(std::string(kSets[set]) + "/" + name);
    }
    if (found.empty()) {
        index_.add_lacking(kind, os::text_of(maps));
        return {};
    }
    SPLAT_TRY(check_same(os::text_of(maps), map_name(kind), stems, found));
    object.has_depth = object.has_depth || kind == MapKind::kDepth;
    return {};
}

Result<disn::Depth> DisnReader::load_depth(const DisnObject& object,
                                           const std::string& file) const {
    SPLAT_ASSIGN(const io::Image stored, load_square(folder("depth", object.below) / file, false));
    const fs::path path = folder(parts_.colors, object.below) / file;
    SPLAT_ASSIGN(const io::Image image, load_square(path, false));
    if (image.width == stored.width) return disn::depth_of(stored, image);
    return damaged("'%s': %u pixels a side, but its depth has %u", os::text_of(path).c_str(),
                   image.width, stored.width);
}

Result<Shift> DisnReader::find_shift(const DisnObject& object,
                                     const std::vector<disn::View>& views) const {
    if (std::ranges::all_of(views, [](const disn::View& v) { return v.shift == scene::Vec3{}; }))
        return Shift::kNone;
    const std::string name = os::text_of(folder("depth", object.below));
    if (!object.has_depth)
        return damaged(
            "there is no '%s': depth tells whether the object of the hard views moved, as their %s "
            "has it; get it, or read the easy views (format disn_easy)",
            name.c_str(), kMetadata);
    disn::ShiftTest test;
    for (std::uint32_t i = 0; i < views.size() && !test.is_done(); ++i) {
        SPLAT_ASSIGN(disn::Depth depth, load_depth(object, file_of(object, object.views[0] + i)));
        test.add(views[i], std::move(depth));
    }
    return test.result(name);
}

Result<std::vector<StoredView>> DisnReader::cameras(std::uint32_t object) const {
    const DisnObject& found = objects_[object];
    std::vector<StoredView> views;
    for (std::size_t set = 0; set < 2; ++set) {
        if (found.views[set] == 0) continue;
        const fs::path path = folder(parts_.colors, found.below) / kSets[set] / kMetadata;
        SPLAT_ASSIGN(const std::vector<disn::View> lines, disn::read_views(path));
        if (lines.size() != found.views[set])
            return damaged("'%s': %zu lines, but there were %u", os::text_of(path).c_str(),
                           lines.size(), found.views[set]);
        Shift shift = Shift::kNone;
        if (set == 1) SPLAT_SET(shift, find_shift(found, lines));
        for (const disn::View& line : lines)
            views.push_back(
                {disn::pose_of(disn::camera_of(line, shift)), line.focal, line.focal, 0});
    }
    return views;
}

Result<io::Image> DisnReader::image(std::uint32_t object, std::uint32_t view, MapKind kind,
                                    bool header_only) const {
    const DisnObject& found = objects_[object];
    const std::string file = file_of(found, view);
    const char* const stored = kind == MapKind::kRgb ? parts_.colors : map_name(kind);
    const fs::path path = folder(stored, found.below) / file;
    SPLAT_ASSIGN(io::Image image, load_square(path, header_only));
    if (kind == MapKind::kRgb || header_only) return image;
    io::Image map{image.width, image.height, channels_of(kind), 8, {}};
    if (kind == MapKind::kDepth) {
        SPLAT_ASSIGN(const disn::Depth depth, load_depth(found, file));
        return nearness_of_distances(depth.z, map.width, map.height);
    }
    if (image.channels < 3)
        return damaged("'%s': %u channels, expected colours", os::text_of(path).c_str(),
                       image.channels);
    // sRGB holds (n + 1) / 2 of x to the left, y up and z to the camera: the negatives of the axes here.
    for (std::size_t i = 0; i < image.samples.size(); i += image.channels)
        for (std::size_t k = 0; k < 3; ++k) {
            const float coded = static_cast<float>(image.samples[i + k]) / 255;
            map.samples.push_back(
                io::to_byte(255 * (1 - static_cast<double>(scene::linear_of_srgb(coded)))));
        }
    return map;
}

constexpr DisnParts kAllOfDisn = {"disn", "image", true, true};
constexpr DisnParts kEasyOfDisn = {"disn_easy", "image", true, false};
constexpr DisnParts kHardOfDisn = {"disn_hard", "image", false, true};
constexpr DisnParts kAlbedoOfDisn = {"disn_albedo", "albedo", true, true};

/// True if an object below the folder has views of the set.
Result<bool> has_views(const fs::path& folder, const char* set) {
    SPLAT_ASSIGN(const io::PathKind kind, io::kind_of(os::text_of(folder)));
    if (kind != io::PathKind::kFolder) return false;
    SPLAT_ASSIGN(const std::vector<std::string> categories, io::folders_in(os::text_of(folder)));
    return io::holds_for_any(categories, [&](const std::string& category) -> Result<bool> {
        SPLAT_ASSIGN(const std::vector<std::string> objects,
                     io::folders_in(os::text_of(folder / category)));
        return io::holds_for_any(objects, [&](const std::string& object) {
            return io::has_file(os::text_of(folder / category / object / set / kMetadata));
        });
    });
}

}  // namespace

Result<bool> is_disn(const std::string& path) {
    return io::holds_for_any({"easy", "hard"}, [&](const std::string& set) {
        return has_views(os::path_of(path) / kAllOfDisn.colors, set.c_str());
    });
}

Result<bool> is_disn_albedo(const std::string& path) {
    return io::holds_for_any({"easy", "hard"}, [&](const std::string& set) {
        return has_views(os::path_of(path) / kAlbedoOfDisn.colors, set.c_str());
    });
}

Result<bool> is_part_of_disn(const std::string&) {
    return false;
}

Result<std::unique_ptr<DatasetReader>> open_disn(const ReaderDesc& desc) {
    return opened<DisnReader>(desc, kAllOfDisn);
}

Result<std::unique_ptr<DatasetReader>> open_disn_easy(const ReaderDesc& desc) {
    return opened<DisnReader>(desc, kEasyOfDisn);
}

Result<std::unique_ptr<DatasetReader>> open_disn_hard(const ReaderDesc& desc) {
    return opened<DisnReader>(desc, kHardOfDisn);
}

Result<std::unique_ptr<DatasetReader>> open_disn_albedo(const ReaderDesc& desc) {
    return opened<DisnReader>(desc, kAlbedoOfDisn);
}

}  // namespace splat::data
