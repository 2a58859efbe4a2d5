#include "data/formats.h"

#include <algorithm>
#include <array>
#include <filesystem>

#include "core/os/path.h"
#include "core/shown.h"
#include "data/folder.h"
#include "data/object_lists.h"
#include "data/planes/plane_channels.h"
#include "data/relative_pose.h"
#include "io/file.h"
#include "io/folder.h"
#include "io/npy.h"
#include "io/weights_formats.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPngHeaderBytes = 4096;

/// Limits of focal lengths, in half widths of the image.
constexpr double kLeastFocal = 1e-6, kMostFocal = 1e6;

/// A file of float32 [frames,channels,side,side].
struct FrameArray {
    std::string path;
    std::size_t channels = 0;
    std::size_t frames = 0;
    std::size_t side = 0;
    std::size_t start = 0;  ///< byte of the file where the first frame starts
};

struct Sequence {
    std::string name;
    fs::path focals;
    FrameArray arrays[kImageKinds];  ///< by MapKind; without a path: not there
    [[nodiscard]] const FrameArray& of(MapKind kind) const {
        return arrays[static_cast<std::size_t>(kind)];
    }
    [[nodiscard]] std::size_t frames() const { return of(MapKind::kRgb).frames; }
};

/// Errors: kFormat for another shape.
Status examine(FrameArray& array) {
    SPLAT_ASSIGN(const auto source, io::open_source(array.path));
    io::Buffer head(std::min<std::uint64_t>(kPngHeaderBytes, source->size()));
    SPLAT_TRY(source->read(0, head));
    SPLAT_ASSIGN(const auto found, in_file(io::read_npy_header(head), array.path));
    const io::NpyHeader& header = found;
    const std::vector<std::uint64_t>& shape = header.shape;
    if (header.column_major || header.dtype != "f4" || header.order != std::endian::little ||
        shape.size() != 4 || shape[1] != array.channels || shape[2] != shape[3] || shape[2] == 0 ||
        shape[2] > 16384 || source->size() - header.start != header.elements * sizeof(float))
        return damaged("'%s': expected float32 [frames,%zu,side,side] in C order and as many bytes",
                       array.path.c_str(), array.channels);
    array.frames = shape[0];
    array.side = shape[2];
    array.start = header.start;
    return {};
}

/// Folders of splits below the folder of a category, or below a folder that holds some.
Result<fs::path> category_folder(const ReaderDesc& desc) {
    const fs::path path = os::path_of(desc.path);
    const std::string &split = desc.split, &category = desc.category;
    const auto look = [&](const fs::path& folder, bool& there) -> Result<bool> {
        SPLAT_ASSIGN(const io::PathKind kind, io::kind_of(os::text_of(folder / split)));
        SPLAT_TRY(check_link(kind, folder / split));
        there = there || kind == io::PathKind::kFolder;
        return io::has_file(os::text_of(folder / split / "camera_Rs.npz"));
    };
    bool there = false;
    SPLAT_ASSIGN(const bool is_here, look(path, there));
    if (is_here) return path;
    std::vector<std::string> found;
    SPLAT_ASSIGN(const std::vector<std::string> names, io::folders_in(os::text_of(path)));
    for (const std::string& name : names) {
        SPLAT_ASSIGN(const bool is_below, look(path / name, there));
        if (is_below) found.push_back(name);
    }
    if (found.size() == 1) return path / found.front();
    // The published categories are plurals: "hydrants".
    const std::string wanted =
        "co3d_" + category.substr(0, category.empty() ? 0 : category.size() - 1) + "_for_gs";
    if (std::ranges::find(found, wanted) != found.end()) return path / wanted;
    const Status status = error(
        !found.empty() ? Code::kInvalidArgument
        : there        ? Code::kFormat
                       : Code::kNotFound,
        "'%s' and its folders hold %zu files %s/camera_Rs.npz, expected one: give the path of one "
        "category",
        os::text_of(path).c_str(), found.size(), split.c_str());
    return there ? status : no_split(desc, status);
}

Result<io::WeightsFile> load_npz(const fs::path& path) {
    const auto source = io::open_source(os::text_of(path));
    SPLAT_TRY(as_damage(source.status()));
    return in_file(io::read_npz(*source.value()), os::text_of(path));
}

class Co3dReader : public ObjectsReader<Sequence> {
  public:
    explicit Co3dReader(const ReaderDesc& desc) : ObjectsReader("co3d", desc, Filter::kLanczos) {}

    Status open() {
        std::set<std::string> excluded;
        if (!desc_.excluded_file.empty())
            SPLAT_SET(excluded, load_excluded_sequences(desc_.excluded_file));
        SPLAT_ASSIGN(const fs::path category, category_folder(desc_));
        const fs::path root = category / desc_.split;
        index_.files = {os::text_of(root / "camera_Rs.npz"), os::text_of(root / "camera_Ts.npz")};
        SPLAT_ASSIGN(rotations_, load_npz(root / "camera_Rs.npz"));
        SPLAT_ASSIGN(translations_, load_npz(root / "camera_Ts.npz"));
        SPLAT_ASSIGN(const std::vector<std::string> names, objects_of(root));
        for (const std::string& name : names) {
            if (is_full()) break;
            if (excluded.contains(name)) {
                ++index_.excluded;
                continue;
            }
            SPLAT_TRY(take(name, root / name, [&] { return add(root / name, name); }));
        }
        SPLAT_TRY(index_.check_any());
        if (objects_.empty()) {
            const Status status =
                not_found("'%s' holds no folder with focal_lengths.npy besides %u excluded ones",
                          os::text_of(root).c_str(), index_.excluded);
            return index_.excluded > 0 ? status : no_split(desc_, status);
        }
        return index_.find_resolution(*this, desc_.lenient);
    }

    [[nodiscard]] Result<std::vector<StoredView>> cameras(std::uint32_t object) const override {
        const Sequence& sequence = objects_[object];
        SPLAT_ASSIGN(const io::Buffer file, io::read_file(os::text_of(sequence.focals), 1U << 24));
        SPLAT_ASSIGN(const auto focals, in_file(io::read_npy(file), os::text_of(sequence.focals)));
        const io::NamedTensor* r = rotations_.tensors.find(sequence.name);
        const io::NamedTensor* t = translations_.tensors.find(sequence.name);
        if (r == nullptr || t == nullptr || r->values.size() != sequence.frames() * 9 ||
            t->values.size() != sequence.frames() * 3 ||
            focals.values.size() != sequence.frames() * 2)
            return damaged(
                "sequence '%s': %zu frames, but %zu rotations, %zu translations and %zu focal "
                "lengths",
                sequence.name.c_str(), sequence.frames(), r == nullptr ? 0 : r->values.size() / 9,
                t == nullptr ? 0 : t->values.size() / 3, focals.values.size() / 2);
        std::vector<StoredView> views;
        for (std::size_t i = 0; i < sequence.frames(); ++i) {
            SPLAT_ASSIGN(const auto pose,
                         in_file(pose_of_co3d(std::span(r->values).subspan(i * 9, 9),
                                              std::span(t->values).subspan(i * 3, 3)),
                                 sequence.name + format(", frame %zu", i)));
            const std::array<double, 2> focal = {static_cast<double>(focals.values[i * 2]),
                                                 static_cast<double>(focals.values[i * 2 + 1])};
            for (const double value : focal)
                if (!(value >= kLeastFocal && value <= kMostFocal))
                    return damaged(
                        "'%s': frame %zu has the focal length %g, expected %g to %g half "
                        "widths of the image",
                        os::text_of(sequence.focals).c_str(), i, value, kLeastFocal, kMostFocal);
            views.push_back({pose, focal[0] / 2, focal[1] / 2, origin_distance(pose)});
        }
        return views;
    }

    [[nodiscard]] Result<io::Image> image(std::uint32_t object, std::uint32_t view, MapKind kind,
                                          bool header_only) const override {
        const FrameArray& array = objects_[object].of(kind);
        const auto side = static_cast<std::uint32_t>(array.side);
        io::Image out{side, side, static_cast<std::uint32_t>(array.channels), 8, {}};
        if (header_only) return out;
        SPLAT_ASSIGN(const auto source, io::open_source(array.path));
        const std::size_t area = array.side * array.side;
        std::vector<float> planes(area * array.channels);
        SPLAT_TRY(source->read(array.start + std::uint64_t{view} * planes.size() * sizeof(float),
                               std::as_writable_bytes(std::span(planes))));
        for (std::size_t i = 0; i < area; ++i)
            for (std::size_t c = 0; c < array.channels; ++c)
                out.samples.push_back(io::to_byte(255 * static_cast<double>(planes[c * area + i])));
        if (kind == MapKind::kPlane)
            SPLAT_TRY(
                in_file(check_planes(out.samples, side), array.path + format(", frame %u", view)));
        return out;
    }

  private:
    /// The folders of a split, and the sequences that have cameras.
    [[nodiscard]] Result<std::vector<std::string>> objects_of(const fs::path& root) const {
        SPLAT_ASSIGN(const std::vector<std::string> folders, candidates_in(root));
        std::set<std::string> names(folders.begin(), folders.end());
        for (const io::NamedTensor& tensor : rotations_.tensors) {
            if (!is_folder_name(tensor.name))
                return damaged("'%s': '%s' is not the name of a folder",
                               os::text_of(root / "camera_Rs.npz").c_str(),
                               shown(tensor.name).c_str());
            names.insert(tensor.name);
        }
        return std::vector<std::string>(names.begin(), names.end());
    }

    Result<bool> add(const fs::path& folder, const std::string& name) {
        SPLAT_ASSIGN(const std::vector<std::string> parts, stems_in(folder, ".npy"));
        const auto has = [&parts](const char* part) {
            return std::ranges::find(parts, part) != parts.end();
        };
        if (parts.empty() && rotations_.tensors.find(name) == nullptr) return false;
        Sequence sequence{name, folder / "focal_lengths.npy", {}};
        if (!has("focal_lengths"))
            return damaged("there is no '%s'", os::text_of(sequence.focals).c_str());
        const bool masked = has("images_fg");
        const char* const files[] = {masked ? "images_fg.npy" : "images_full.npy", "depths.npy",
                                     "normals.npy", "masks.npy", "planes.npy"};
        std::vector<std::string> problems;
        std::vector<MapKind> lacking;
        for (const MapKind kind :
             {MapKind::kRgb, MapKind::kDepth, MapKind::kNormal, MapKind::kMask, MapKind::kPlane}) {
            FrameArray& array = sequence.arrays[static_cast<std::size_t>(kind)];
            array.path = os::text_of(folder / files[static_cast<std::size_t>(kind)]);
            array.channels = channels_of(kind);
            if (kind != MapKind::kRgb &&
                !has(os::text_of(os::path_of(array.path).stem()).c_str())) {
                lacking.push_back(kind);
                continue;
            }
            Status status = examine(array);
            if (status.ok() && array.frames != sequence.frames())
                status = damaged("'%s': %zu frames, expected %zu as the images", array.path.c_str(),
                                 array.frames, sequence.frames());
            if (!status.ok() && !desc_.lenient) return status;
            if (!status.ok()) problems.push_back(status.message());
        }
        std::vector<std::string> frames;
        for (std::size_t i = 0; i < sequence.frames(); ++i) frames.push_back(std::to_string(i));
        std::ranges::sort(frames);
        SPLAT_TRY(index_.add(name, os::text_of(folder), {frames, frames}, desc_.lenient).status());
        objects_.push_back(sequence);
        index_.problems.back().insert(index_.problems.back().end(), problems.begin(),
                                      problems.end());
        for (const MapKind kind : lacking) index_.add_lacking(kind, sequence.of(kind).path);
        return true;
    }

    io::WeightsFile rotations_;
    io::WeightsFile translations_;
};

}  // namespace

Result<bool> is_co3d(const std::string& path) {
    SPLAT_ASSIGN(std::vector<std::string> names, io::folders_in(path));
    names.emplace_back();
    return io::holds_for_any(names, [&path](const std::string& name) {
        return io::holds_for_any({"train", "val", "test"}, [&](const std::string& split) {
            return io::has_file(os::text_of(os::path_of(path) / name / split / "camera_Rs.npz"));
        });
    });
}

Result<std::unique_ptr<DatasetReader>> open_co3d(const ReaderDesc& desc) {
    return opened<Co3dReader>(desc);
}

Result<scene::Mat4> pose_of_co3d(std::span<const float> rotation,
                                 std::span<const float> translation) {
    scene::Mat4 world_to_camera{};  // p_camera = p_world R + T with x left and y up
    for (std::size_t i = 0; i < 3; ++i) {
        const double sign = i == 2 ? 1 : -1;
        for (std::size_t j = 0; j < 3; ++j)
            world_to_camera[i * 4 + j] = sign * static_cast<double>(rotation[j * 3 + i]);
        world_to_camera[i * 4 + 3] = sign * static_cast<double>(translation[i]);
    }
    world_to_camera[15] = 1;
    return inverse_pose(world_to_camera);
}

}  // namespace splat::data
