#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/no_copy.h"
#include "core/os/path.h"
#include "core/status.h"
#include "data/resample.h"
#include "io/image.h"
#include "scene/vector.h"

namespace splat::data {

/// Images of a view.
enum class MapKind : std::uint32_t { kRgb = 0, kDepth = 1, kNormal = 2, kMask = 3, kPlane = 4 };
inline constexpr MapKind kMaps[] = {MapKind::kDepth, MapKind::kNormal, MapKind::kMask,
                                    MapKind::kPlane};
inline constexpr std::size_t kImageKinds = 1 + std::size(kMaps);  ///< kinds, with rgb
const char* map_name(MapKind kind);
constexpr std::uint32_t channels_of(MapKind kind) {
    if (kind == MapKind::kPlane) return 4;
    return kind == MapKind::kRgb || kind == MapKind::kNormal ? 3 : 1;
}
/// SPLAT_DATA_* of a map, 0 for rgb.
constexpr std::uint32_t flag_of(MapKind kind) {
    constexpr std::uint32_t kFlags[] = {0, 1U << 0, 1U << 1, 1U << 2, 1U << 5};
    return kFlags[static_cast<std::uint32_t>(kind)];
}

inline constexpr std::uint32_t kAllMaps = flag_of(MapKind::kDepth) | flag_of(MapKind::kNormal) |
                                          flag_of(MapKind::kMask) | flag_of(MapKind::kPlane);

struct StoredView {
    scene::Mat4 camera_to_world{};  ///< row-major, column vectors, OpenCV axes
    double focal_x = 0;             ///< in widths of the image
    double focal_y = 0;             ///< in heights
    double origin_distance = 0;     ///< set for CO3D alone
};

class DatasetReader;
struct ReaderDesc;

/// Names of the views of an object that have a camera, and of those that have an image; sorted.
struct ViewNames {
    std::vector<std::string> cameras;
    std::vector<std::string> images;
};

/// Images of which the largest square around the principal point is used.
struct Crop {
    std::size_t images = 0, cut = 0;                ///< all, and those that are no such squares
    std::uint32_t width = 0, height = 0, side = 0;  ///< pixels of the first image that is cut
    bool alike = true;                              ///< all that are cut have those

    void add(std::uint32_t image_width, std::uint32_t image_height, std::uint32_t square);
};

/// The contents of a folder.
struct DatasetIndex {
    std::string format;
    std::string split;
    bool has_splits = true;            ///< false: the folder has none and serves any
    std::vector<std::string> names;    ///< names of the objects, in order
    std::vector<std::string> folders;  ///< folders with their files; one if it is that of all
    std::vector<std::string> files;    ///< more of their files, which lie elsewhere
    std::vector<std::uint32_t> views_of;
    std::uint32_t maps = 0;  ///< flags of the maps that every object has
    /// Objects without maps of a kind, and where those would be.
    struct Lack {
        std::size_t object;
        MapKind kind;
        std::string place;
    };
    std::vector<Lack> lacks;
    bool alpha_masks = false;          ///< masks are the alpha of the images
    bool ignores_alpha = false;        ///< colours of transparent pixels are used as stored
    Crop crop;                         ///< how photographs are cut
    std::uint32_t resolution = 0;      ///< side of the first image
    Filter filter = Filter::kBicubic;  ///< for other resolutions
    double source_distance = 0;        ///< the first view read is scaled to it; 0: not scaled
    std::vector<std::vector<std::string>> problems;  ///< problems of each object, if lenient
    /// Objects left out because they are incomplete, and why; with ReaderDesc::allow_missing.
    std::vector<std::pair<std::string, std::string>> missing;
    std::vector<std::string> others;  ///< folders beside the objects, without a part of one
    std::uint32_t excluded = 0;       ///< objects that a list leaves out
    /// The view that evaluations start from, of each object; empty: that of the format.
    std::vector<std::uint32_t> source_views;

    /// Files in folders of maps that are no maps, the first kMostUnread.
    std::vector<std::string> unread;
    std::size_t unread_count = 0;
    static constexpr std::size_t kMostUnread = 10;

    void add_unread(std::string path) {
        ++unread_count;
        if (unread.size() < kMostUnread) unread.push_back(std::move(path));
    }

    /// A sentence on these files, with what to do; empty if there are none.
    [[nodiscard]] std::string unread_note() const;

    /// A sentence on images that are cut, and scaled to `used` pixels a side; empty if none is.
    [[nodiscard]] std::string crop_note(std::uint32_t used) const;

    /// Note that the last object has no maps of a kind in this place.
    void add_lacking(MapKind kind, const std::string& place);

    /// Add an object with the views that have a camera and an image, and give them. Errors: kFormat for views that
    /// lack one of the two, and for fewer than two views; if lenient, these become problems.
    Result<std::vector<std::string>> add(const std::string& name, const std::string& folder,
                                         const ViewNames& views, bool lenient);

    /// Add an object with as many views that have both. Errors: kFormat as above.
    Status add_stored(std::string name, std::uint32_t views, const std::string& folder,
                      bool lenient);

    /// Take in what may be an object, by `add`: it calls add() above, or gives false for what has no part of an object.
    /// An object that `add` cannot read or that is incomplete is an error; with desc.lenient its problem; with
    /// desc.allow_missing an incomplete one is left out. Errors: of `add`, kFormat for what is missing.
    Status take(const ReaderDesc& desc, const std::string& name, const std::string& folder,
                const std::function<Result<bool>()>& add);

    /// The first place without maps of a kind; empty: none.
    [[nodiscard]] std::string lacking(MapKind kind) const;

    /// What makes maps of planes that are lacking; empty if no folder of them is read.
    [[nodiscard]] std::string plane_remedy() const;

    /// Note as problems, if lenient, maps that an object lacks and others have.
    void compare_maps();

    /// Errors: kFormat if all objects are left out, which is not a split that is not there.
    [[nodiscard]] Status check_any() const;

    /// Set the resolution to that of the first image; if lenient, of the first readable one. If it has alpha and
    /// there are no maps of masks, alpha is the mask.
    Status find_resolution(const DatasetReader& reader, bool lenient);
};

/// Checks that both lists are equal; `kind` names the images. Errors: kFormat, naming what only
/// one of them holds.
Status check_same(const std::string& folder, const char* kind,
                  const std::vector<std::string>& cameras, const std::vector<std::string>& images);

/// The cameras of an object as SRN's files have them, without loss.
struct ObjectText {
    struct View {
        std::string name;  ///< stem of its files, "000064"
        std::string pose;  ///< 16 numbers, row-major camera-to-world
    };
    std::string intrinsics;
    std::vector<View> views;
};

struct ReaderDesc {
    std::string path;
    std::string split = "train";  ///< or "val", "test"
    std::string category;        ///< "cars", "hydrants", where the folder has several; may be empty
    std::uint32_t limit = 0;     ///< objects, the first in order; 0: all
    bool lenient = false;        ///< keep objects with missing files, and note their problems
    bool allow_missing = false;  ///< leave incomplete objects out, and name them
    /// Lists that the published code reads, see object_lists.h; a path, or one in the folder of the data.
    std::string objects_file;   ///< the objects of Objaverse in their order
    std::string excluded_file;  ///< sequences of CO3D to leave out
    std::string views_file;     ///< test objects of NMR and their source views
    /// Not null: a folder without splits, which else serves any, lacks this one too; true if the error is that the
    /// split is not there.
    bool* lacks_split = nullptr;
};

/// One format of data sets. Thread-safe once opened.
class DatasetReader : NoCopy {
  public:
    virtual ~DatasetReader() = default;

    [[nodiscard]] const DatasetIndex& index() const { return index_; }

    /// Views of an object. Errors: kNotFound, kIo, kFormat with the file and its problem.
    [[nodiscard]] virtual Result<std::vector<StoredView>> cameras(std::uint32_t object) const = 0;

    /// Stored samples, 8 bits, square: gray, or colours with or without alpha. With `header_only` the samples may be
    /// missing, and are not decoded. Errors: as cameras().
    [[nodiscard]] virtual Result<io::Image> image(std::uint32_t object, std::uint32_t view,
                                                  MapKind kind, bool header_only) const = 0;

    /// The same, with masks that are the alpha of images, and masks of 0 and 1 as 0 and 255. Errors: also kFormat for
    /// an image without alpha.
    [[nodiscard]] Result<io::Image> map(std::uint32_t object, std::uint32_t view,
                                        MapKind kind) const;

    /// Side of a map, pixels. Errors: as image().
    [[nodiscard]] Result<std::uint32_t> width(std::uint32_t object, std::uint32_t view,
                                              MapKind kind) const;

    /// Points of the scene of an object, in the frame of its cameras; none unless the format holds such. Errors: as
    /// cameras().
    [[nodiscard]] virtual Result<std::vector<scene::Vec3>> points(std::uint32_t object) const;

    /// Cameras of an object; made from cameras() unless the format holds such texts. Errors: as cameras(); kUnsupported
    /// for views of different focal lengths, which SRN's files cannot hold.
    [[nodiscard]] virtual Result<ObjectText> text(std::uint32_t object) const;

  protected:
    /// An index that is empty, of objects that have all maps.
    DatasetReader(const char* format, const ReaderDesc& desc, Filter filter);

    [[nodiscard]] bool is_full() const {
        return desc_.limit != 0 && index_.names.size() == desc_.limit;
    }

    ReaderDesc desc_;
    DatasetIndex index_;
};

/// Reader(desc, arguments...), opened. Errors: those of Reader::open().
template <class Reader, class... Arguments>
Result<std::unique_ptr<DatasetReader>> opened(const ReaderDesc& desc, Arguments... arguments) {
    auto reader = std::make_unique<Reader>(desc, arguments...);
    SPLAT_TRY(reader->open());
    return std::unique_ptr<DatasetReader>(std::move(reader));
}

/// A format that knows an Object of each object of the index.
template <class Object>
class ObjectsReader : public DatasetReader {
  protected:
    using DatasetReader::DatasetReader;

    /// DatasetIndex::take(); `add` also adds to objects_.
    Status take(const std::string& name, const std::filesystem::path& folder,
                const std::function<Result<bool>()>& add) {
        SPLAT_TRY(index_.take(desc_, name, os::text_of(folder), add));
        objects_.resize(index_.names.size());
        return {};
    }

    std::vector<Object> objects_;
};

/// This error, which means that the folder lacks the split.
Status no_split(const ReaderDesc& desc, Status status);

}  // namespace splat::data
