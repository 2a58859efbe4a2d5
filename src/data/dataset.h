#pragma once

#include <span>

#include "core/fork.h"
#include "data/dataset_reader.h"
#include "data/image_cache.h"

namespace splat::data {

/// Most objects of a set of which lists are made: all cameras, the order of a pass of a training.
inline constexpr std::uint32_t kMostListed = 65'536;
/// Checks before a run look at each object of a larger set whose number is a multiple of this, at some 4,096 of them.
inline std::uint32_t check_stride(std::uint32_t objects) {
    return objects <= kMostListed ? 1 : objects / 4096;
}

struct DatasetDesc : ReaderDesc {
    std::string format;                 ///< a name of kFormats; empty: detected from the folder
    std::uint32_t maps = 0;             ///< flags of the maps that every object must have
    std::uint32_t resolution = 0;       ///< side of the images returned; 0: the stored one
    std::uint64_t cache_bytes = 0;      ///< decoded images kept; 0: 1 GiB
    std::array<float, 3> background{};  ///< behind transparent pixels, 0 to 1
};

/// Destination of views; null pointers are skipped. n is the number of views, R the resolution.
struct ViewArrays {
    float* images = nullptr;         ///< [n,3,R,R], 0 to 1
    float* depths = nullptr;         ///< [n,1,R,R], 0 to 1, larger is nearer
    float* normals = nullptr;        ///< [n,3,R,R], 0 to 1: (normal + 1) / 2 in the camera's axes
    float* masks = nullptr;          ///< [n,1,R,R], 0 to 1
    float* view_to_world = nullptr;  ///< [n,16], see RelativeView
    float* quaternions = nullptr;    ///< [n,4]
    float* focals = nullptr;         ///< [n,2] pixels at R
    float* origin_distances = nullptr;  ///< [n]; 0 unless the data is CO3D's
    std::uint8_t* levels = nullptr;  ///< [n,3,R,R] images of 0 to 255; `images` holds level / 255
    float* planes = nullptr;         ///< [n,5,R,R], see plane_channels()
};

/// Objects seen by several cameras. Thread-safe.
class Dataset {
  public:
    /// Errors: kNotFound for the folder, the split or maps; kFormat for another format and for damaged files;
    /// kInvalidArgument for the desc; each names what is missing and what was found.
    static Result<std::unique_ptr<Dataset>> open(const DatasetDesc& desc);

    [[nodiscard]] const DatasetIndex& index() const { return reader_->index(); }
    [[nodiscard]] std::uint32_t resolution() const { return resolution_; }
    [[nodiscard]] const DatasetReader& reader() const { return *reader_; }
    [[nodiscard]] const std::array<float, 3>& background() const { return background_; }
    [[nodiscard]] const ImageCache& cache() const { return cache_; }

    /// Copy views of an object in the given order, with cameras relative to the first of them.
    ///
    /// Errors        kInvalidArgument for no such object or view; kNotFound, kIo, kFormat with the file: maps that the
    ///               data lacks, a missing or damaged file; arrays may then be partly written
    /// Determinism   the same bits with any contents of the cache
    Status read(std::uint32_t object, std::span<const std::uint32_t> views, const ViewArrays& out);
    /// ViewArrays::planes alone, of views that there are. Errors: those of read().
    Status read_planes(std::uint32_t object, std::span<const std::uint32_t> views, float* out);

    /// Read the cameras of every object, which stay in memory; of more than kMostListed objects, those that checks look
    /// at, and none stay. Errors: those of DatasetReader::cameras.
    Status read_cameras();
    /// 8-bit samples [R,R,channels] of an image, over the background; planes are those of the nearest pixels. Errors:
    /// those of read().
    Result<ImageCache::Pixels> pixels(std::uint32_t object, std::uint32_t view, MapKind kind);

  private:
    Dataset(const DatasetDesc& desc, std::unique_ptr<DatasetReader> reader);

    using Views = std::shared_ptr<const std::vector<StoredView>>;
    Result<Views> cameras(std::uint32_t object);
    Status read_cameras(std::uint32_t object, std::span<const std::uint32_t> views,
                        const ViewArrays& out);
    Status read_map(std::uint32_t object, std::span<const std::uint32_t> views, MapKind kind,
                    float* out, std::uint8_t* levels = nullptr);

    std::unique_ptr<DatasetReader> reader_;
    std::uint32_t resolution_;
    std::array<float, 3> background_;
    ImageCache cache_;
    ForkMutex mutex_;  ///< guards cameras_
    std::vector<Views>
        cameras_;  ///< views of each object read so far, unless there are more than kMostListed
};

/// JSON, as splat_dataset_report().
std::string report_text(const Dataset& dataset);

}  // namespace splat::data
