#include "data/panoptic/mask_names.h"

#include <algorithm>
#include <optional>
#include <sstream>

#include "core/json.h"
#include "core/json_tree.h"
#include "core/number_in.h"
#include "core/shown.h"
#include "io/file.h"
#include "io/reader.h"

namespace splat::data {
namespace {

constexpr std::uint64_t kMaxPaletteBytes = 1U << 20;
constexpr MaskId kMostId = 0xFFFFFF;
constexpr const char* kVoid = "void";

std::string colour_text(MaskId id) {
    return format("(%u, %u, %u)", id & 255U, id >> 8U & 255U, id >> 16U);
}

/// A whole number of a member, at most `most`.
Result<std::uint64_t> count_in(const JsonTree& object, const char* member, std::uint64_t most,
                               const std::string& place) {
    const auto count = object[member].count();
    if (count && *count <= most) return *count;
    return damaged("%s: '%s' is missing or no whole number of at most %llu", place.c_str(), member,
                   llu(most));
}

Result<std::string> text_in(const JsonTree& object, const char* member, const std::string& place) {
    const std::string* const text = object[member].text();
    if (text != nullptr && !text->empty()) return *text;
    return damaged("%s: '%s' is missing or no text", place.c_str(), member);
}

Result<const JsonTree::List*> list_in(const JsonTree& object, const char* member,
                                      const std::string& place) {
    const JsonTree::List* const list = object[member].list();
    if (list != nullptr) return list;
    return damaged("%s: '%s' is missing or no array", place.c_str(), member);
}

/// Values of a list of objects by their "id". `read` makes one of an object and its place.
template <class Value, class Read>
Result<std::map<std::uint64_t, Value>> by_id(const JsonTree& root, const char* member,
                                             const Read& read) {
    SPLAT_ASSIGN(const JsonTree::List* const list, list_in(root, member, "the file"));
    std::map<std::uint64_t, Value> found;
    for (std::size_t i = 0; i < list->size(); ++i) {
        const std::string place = format("%s[%zu]", member, i);
        SPLAT_ASSIGN(const std::uint64_t id,
                     count_in((*list)[i], "id", std::uint64_t{1} << 53U, place));
        SPLAT_ASSIGN(Value value, read((*list)[i], place));
        if (!found.emplace(id, std::move(value)).second)
            return damaged("%s: the id %llu occurs twice", place.c_str(), llu(id));
    }
    return found;
}

struct Size {
    std::uint32_t width = 0, height = 0;
};

Result<Size> size_of(const JsonTree& image, const std::string& place) {
    SPLAT_ASSIGN(const std::uint64_t width, count_in(image, "width", UINT32_MAX, place));
    SPLAT_ASSIGN(const std::uint64_t height, count_in(image, "height", UINT32_MAX, place));
    return Size{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height)};
}

Result<std::map<MaskId, std::string>> names_of(
    const JsonTree& annotation, const std::map<std::uint64_t, std::string>& categories,
    const std::string& place) {
    SPLAT_ASSIGN(const JsonTree::List* const list, list_in(annotation, "segments_info", place));
    std::map<MaskId, std::string> names;
    for (std::size_t i = 0; i < list->size(); ++i) {
        const std::string at = format("%s.segments_info[%zu]", place.c_str(), i);
        SPLAT_ASSIGN(const std::uint64_t id, count_in((*list)[i], "id", kMostId, at));
        SPLAT_ASSIGN(const std::uint64_t category,
                     count_in((*list)[i], "category_id", std::uint64_t{1} << 53U, at));
        const auto found = categories.find(category);
        if (found == categories.end())
            return damaged("%s: 'categories' have no name for the category_id %llu", at.c_str(),
                           llu(category));
        if (id == 0) return damaged("%s: the id is 0, which means unlabelled", at.c_str());
        if (!names.emplace(static_cast<MaskId>(id), found->second).second)
            return damaged("%s: the id %llu occurs twice", at.c_str(), llu(id));
    }
    return names;
}

/// The words of a line, and where the fourth begins.
struct PaletteLine {
    std::optional<std::uint32_t> levels[3];
    std::string name;
};

PaletteLine palette_line(std::string_view line) {
    std::istringstream words{std::string(line)};
    PaletteLine read;
    for (auto& level : read.levels) {
        std::string word;
        words >> word;
        level = number_in<std::uint32_t>(word);
        if (level && *level > 255) level.reset();
    }
    std::getline(words >> std::ws, read.name);
    while (!read.name.empty() && (read.name.back() == '\r' || read.name.back() == ' '))
        read.name.pop_back();
    return read;
}

/// Lines of GIMP's format without a colour.
bool is_passed_over(std::string_view line, std::size_t number) {
    const std::size_t first = line.find_first_not_of(" \t\r");
    return first == std::string_view::npos || line[first] == '#' ||
           line.substr(first).starts_with("Name:") || line.substr(first).starts_with("Columns:") ||
           (number == 1 && line.starts_with("GIMP Palette"));
}

MaskId id_at(const io::Image& mask, std::size_t pixel) {
    const std::uint16_t* const at = mask.samples.data() + pixel * mask.channels;
    const MaskId red = at[0];
    return mask.channels == 1 ? red * 0x010101U : red + 256U * at[1] + 65536U * at[2];
}

void grow(Segment& segment, std::uint32_t x, std::uint32_t y) {
    const std::uint32_t right = std::max(segment.left + segment.width, x + 1);
    segment.left = std::min(segment.left, x);
    segment.width = right - segment.left;
    segment.height = y + 1 - segment.top;  // rows come from the top
    ++segment.area;
}

}  // namespace

Result<MaskNames> MaskNames::load(const std::string& path) {
    const bool coco = io::extension_of(path) == ".json";
    SPLAT_ASSIGN(const io::Buffer file,
                 io::read_file(path, coco ? kMaxJsonBytes : kMaxPaletteBytes));
    return io::in_file(coco ? of_coco(io::as_text(file)) : of_palette(io::as_text(file)), path);
}

Result<MaskNames> MaskNames::of_coco(std::string_view text) {
    SPLAT_ASSIGN(const JsonTree root, io::from_file(parse_json_tree(text, "annotations")));
    SPLAT_ASSIGN(
        const auto categories,
        by_id<std::string>(root, "categories", [](const JsonTree& tree, const std::string& place) {
            return text_in(tree, "name", place);
        }));
    SPLAT_ASSIGN(const auto sizes, by_id<Size>(root, "images", size_of));
    SPLAT_ASSIGN(const JsonTree::List* const list, list_in(root, "annotations", "the file"));
    MaskNames made;
    made.coco_ = true;
    for (std::size_t i = 0; i < list->size(); ++i) {
        const std::string place = format("annotations[%zu]", i);
        SPLAT_ASSIGN(const std::uint64_t image,
                     count_in((*list)[i], "image_id", std::uint64_t{1} << 53U, place));
        const auto size = sizes.find(image);
        if (size == sizes.end())
            return damaged("%s: 'images' have no id %llu", place.c_str(), llu(image));
        SPLAT_ASSIGN(std::string file, text_in((*list)[i], "file_name", place));
        Picture picture{size->second.width, size->second.height, {}};
        SPLAT_SET(picture.names, names_of((*list)[i], categories, place));
        if (made.pictures_.contains(file))
            return damaged("%s: the file_name '%s' occurs twice", place.c_str(),
                           shown(file).c_str());
        made.pictures_.emplace(std::move(file), std::move(picture));
    }
    return made;
}

Result<MaskNames> MaskNames::of_palette(std::string_view text) {
    MaskNames made;
    std::size_t number = 1;
    for (std::size_t at = 0; at < text.size(); ++number) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        const std::string_view line = text.substr(at, end - at);
        at = end + 1;
        if (is_passed_over(line, number)) continue;
        const PaletteLine read = palette_line(line);
        if (!read.levels[0] || !read.levels[1] || !read.levels[2])
            return damaged("line %zu is '%s', expected 'R G B name' with numbers of 0 to 255",
                           number, shown(line).c_str());
        const MaskId id = *read.levels[0] + 256U * *read.levels[1] + 65536U * *read.levels[2];
        if (read.name.empty())
            return damaged("line %zu: the colour %s has no name", number, colour_text(id).c_str());
        if (!made.palette_.emplace(id, read.name).second)
            return damaged("line %zu: the colour %s occurs twice", number, colour_text(id).c_str());
    }
    if (made.palette_.empty()) return damaged("there is no line 'R G B name'");
    return made;
}

Result<const MaskNames::Picture*> MaskNames::picture(const std::string& file) const {
    if (!coco_) return static_cast<const Picture*>(nullptr);
    auto found = pictures_.find(file);
    if (found == pictures_.end()) found = pictures_.find(file.substr(file.rfind('/') + 1));
    if (found != pictures_.end()) return &found->second;
    return damaged("no annotation has the file_name '%s', or the last part of it",
                   shown(file).c_str());
}

Result<std::string> MaskNames::name_of(const Picture* picture, MaskId id, std::uint32_t x,
                                       std::uint32_t y) const {
    const std::map<MaskId, std::string>& names = picture != nullptr ? picture->names : palette_;
    const auto found = names.find(id);
    if (found != names.end()) return found->second;
    if (picture != nullptr)
        return damaged("pixel (%u, %u) has the id %u, which is not among the %zu of segments_info",
                       x, y, id, names.size());
    return damaged(
        "pixel (%u, %u) has the colour %s, which is not among the %zu of the palette; "
        "another palette, or a mask that was scaled with smooth edges",
        x, y, colour_text(id).c_str(), names.size());
}

Result<std::vector<Segment>> MaskNames::segments(const io::Image& mask,
                                                 const std::string& file) const {
    SPLAT_ASSIGN(const Picture* const given, picture(file));
    if (mask.bits != 8 || (mask.channels != 3 && (coco_ || mask.channels != 1)))
        return damaged("%u channels of %u bits, expected %s of 8 bits", mask.channels, mask.bits,
                       coco_ ? "RGB" : "RGB, a palette or gray");
    if (given != nullptr && (given->width != mask.width || given->height != mask.height))
        return damaged("%u x %u pixels, but the annotation's image has %u x %u", mask.width,
                       mask.height, given->width, given->height);
    std::map<MaskId, Segment> found;
    Segment* last = nullptr;
    for (std::uint32_t y = 0; y < mask.height; ++y)
        for (std::uint32_t x = 0; x < mask.width; ++x) {
            const MaskId id = id_at(mask, std::size_t{y} * mask.width + x);
            if (coco_ && id == 0) continue;
            if (last == nullptr || last->id != id) {
                const auto [place, fresh] = found.try_emplace(id, Segment{id, {}, 0, x, y, 1, 1});
                if (fresh) SPLAT_SET(place->second.name, name_of(given, id, x, y));
                last = &place->second;
            }
            grow(*last, x, y);
        }
    for (const auto& [id, name] : given != nullptr ? given->names : std::map<MaskId, std::string>())
        if (!found.contains(id))
            return damaged("segment %u of segments_info ('%s') has no pixel", id,
                           shown(name).c_str());
    std::vector<Segment> segments;
    for (auto& [id, segment] : found)
        if (coco_ || segment.name != kVoid) segments.push_back(std::move(segment));
    std::ranges::stable_sort(segments, std::greater(), &Segment::area);
    return segments;
}

}  // namespace splat::data
