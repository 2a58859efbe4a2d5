#include "data/co3d.h"

#include <filesystem>

#include "data/folder.h"
#include "data/relative_pose.h"
#include "io/file.h"
#include "io/npy.h"
#include "io/npz.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kHeaderBytes = 4096;

struct Sequence {
    std::string name;
    std::string images;  ///< path
    fs::path focals;
    std::size_t frames = 0;
    std::size_t size = 0;   ///< pixels on a side
    std::size_t start = 0;  ///< of the first frame in the file
};

/// Folders of splits below the folder of a category, or below a folder that holds some.
Result<fs::path> category_folder(const fs::path& path, const std::string& split) {
    if (is_file(path / split / "camera_Rs.npz")) return path;
    std::vector<std::string> found;
    for (const std::string& name : folders_in(path))
        if (is_file(path / name / split / "camera_Rs.npz")) found.push_back(name);
    if (found.size() == 1) return path / found.front();
    return error(
        found.empty() ? Code::kNotFound : Code::kInvalidArgument,
        "'%s' and its folders hold %zu files %s/camera_Rs.npz, expected one: give the path of one "
        "category",
        path.c_str(), found.size(), split.c_str());
}

Result<io::NpzFile> load_npz(const fs::path& path) {
    SPLAT_ASSIGN(const auto source, io::open_source(path.string()));
    auto file = io::read_npz(*source);
    if (!file.ok()) return in_file(file.status(), path.string());
    return file;
}

class Co3dReader : public DatasetReader {
  public:
    Status open(const ReaderDesc& desc) {
        index_.format = "co3d";
        index_.split = desc.split;
        index_.filter = Filter::kLanczos;
        SPLAT_ASSIGN(const fs::path category, category_folder(desc.path, desc.split));
        const fs::path root = category / desc.split;
        SPLAT_ASSIGN(rotations_, load_npz(root / "camera_Rs.npz"));
        SPLAT_ASSIGN(translations_, load_npz(root / "camera_Ts.npz"));
        for (const std::string& name : folders_in(root)) {
            if (desc.limit != 0 && sequences_.size() == desc.limit) break;
            if (is_file(root / name / "focal_lengths.npy"))
                SPLAT_TRY(add(root / name, name, desc.lenient));
        }
        if (sequences_.empty())
            return error(Code::kNotFound, "'%s' holds no folder with focal_lengths.npy",
                         root.c_str());
        return index_.find_resolution(*this, desc.lenient);
    }

    [[nodiscard]] const DatasetIndex& index() const override { return index_; }

    [[nodiscard]] Result<std::vector<StoredView>> cameras(std::uint32_t object) const override {
        const Sequence& sequence = sequences_[object];
        SPLAT_ASSIGN(const io::Buffer file, io::read_file(sequence.focals.string(), 1U << 24));
        const auto focals = io::read_npy(file);
        if (!focals.ok()) return in_file(focals.status(), sequence.focals.string());
        const io::NamedTensor* r = rotations_.tensors.find(sequence.name);
        const io::NamedTensor* t = translations_.tensors.find(sequence.name);
        if (r == nullptr || t == nullptr || r->values.size() != sequence.frames * 9 ||
            t->values.size() != sequence.frames * 3 ||
            focals.value().values.size() != sequence.frames * 2)
            return error(
                Code::kFormat,
                "sequence '%s': %zu frames, but %zu rotations, %zu translations and %zu focal "
                "lengths",
                sequence.name.c_str(), sequence.frames, r == nullptr ? 0 : r->values.size() / 9,
                t == nullptr ? 0 : t->values.size() / 3, focals.value().values.size() / 2);
        std::vector<StoredView> views;
        for (std::size_t i = 0; i < sequence.frames; ++i) {
            const auto pose = pose_of_co3d(std::span(r->values).subspan(i * 9, 9),
                                           std::span(t->values).subspan(i * 3, 3));
            if (!pose.ok()) return in_file(pose.status(), sequence.name + format(", frame %zu", i));
            const float* focal = &focals.value().values[i * 2];
            views.push_back({pose.value(), static_cast<double>(focal[0]) / 2,
                             static_cast<double>(focal[1]) / 2, origin_distance(pose.value())});
        }
        return views;
    }

    [[nodiscard]] Result<io::Image> image(std::uint32_t object, std::uint32_t view,
                                          MapKind) const override {
        const Sequence& sequence = sequences_[object];
        SPLAT_ASSIGN(const auto source, io::open_source(sequence.images));
        const std::size_t area = sequence.size * sequence.size;
        std::vector<float> planes(area * 3);
        SPLAT_TRY(source->read(sequence.start + std::uint64_t{view} * planes.size() * sizeof(float),
                               std::as_writable_bytes(std::span(planes))));
        const auto side = static_cast<std::uint32_t>(sequence.size);
        io::Image out{side, side, 3, 8, {}};
        for (std::size_t i = 0; i < area; ++i)
            for (std::size_t c = 0; c < 3; ++c)
                out.samples.push_back(io::to_byte(255 * static_cast<double>(planes[c * area + i])));
        return out;
    }

  private:
    Status add(const fs::path& folder, const std::string& name, bool lenient) {
        const fs::path foreground = folder / "images_fg.npy";
        Sequence sequence{name,
                          (is_file(foreground) ? foreground : folder / "images_full.npy").string(),
                          folder / "focal_lengths.npy",
                          0,
                          0,
                          0};
        std::vector<std::string> frames;
        std::vector<std::string> problems;
        const Status status = examine(sequence);
        if (!status.ok() && !lenient) return status;
        for (std::size_t i = 0; i < sequence.frames; ++i) frames.push_back(std::to_string(i));
        SPLAT_TRY(
            index_.add(name, folder.string(), {frames, frames}, lenient,
                       [&](const std::vector<std::string>&) { sequences_.push_back(sequence); }));
        if (!status.ok()) index_.problems.back().push_back(status.message());
        return {};
    }

    /// Sets frames, size and start.
    static Status examine(Sequence& sequence) {
        SPLAT_ASSIGN(const auto source, io::open_source(sequence.images));
        io::Buffer head(std::min<std::uint64_t>(kHeaderBytes, source->size()));
        SPLAT_TRY(source->read(0, head));
        const auto found = io::read_npy_header(head);
        if (!found.ok()) return in_file(found.status(), sequence.images);
        const io::NpyHeader& header = found.value();
        const std::vector<std::uint64_t>& shape = header.shape;
        if (header.dtype != "f4" || header.order != std::endian::little || shape.size() != 4 ||
            shape[1] != 3 || shape[2] != shape[3] || shape[2] == 0 || shape[2] > 16384 ||
            source->size() - header.start != header.elements * sizeof(float))
            return error(Code::kFormat,
                         "'%s': expected float32 [frames,3,side,side] and as many bytes",
                         sequence.images.c_str());
        sequence.frames = shape[0];
        sequence.size = shape[2];
        sequence.start = header.start;
        return {};
    }

    DatasetIndex index_;
    io::NpzFile rotations_;
    io::NpzFile translations_;
    std::vector<Sequence> sequences_;
};

}  // namespace

bool is_co3d(const std::string& path) {
    for (const char* split : {"train", "val", "test"}) {
        if (is_file(fs::path(path) / split / "camera_Rs.npz")) return true;
        for (const std::string& name : folders_in(path))
            if (is_file(fs::path(path) / name / split / "camera_Rs.npz")) return true;
    }
    return false;
}

Result<std::unique_ptr<DatasetReader>> open_co3d(const ReaderDesc& desc) {
    auto reader = std::make_unique<Co3dReader>();
    SPLAT_TRY(reader->open(desc));
    return std::unique_ptr<DatasetReader>(std::move(reader));
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
