#include "tables/import.h"

#include <cmath>
#include <filesystem>
#include <optional>

#include "core/os/path.h"
#include "io/photo/image_file.h"
#include "io/reader.h"
#include "scene/camera_pose.h"
#include "tables/journal.h"
#include "tables/srn_text.h"
#include "tables/table_files.h"
#include "tables/table_keys.h"
#include "tables/table_reader.h"

namespace splat::tables {
namespace {

constexpr std::uint64_t kMaxImageBytes = std::uint64_t{1} << 30;
/// Bytes of an image file besides twice those of its samples: 16 bits without compression, and a header.
constexpr std::uint64_t kFileBytesBesides = std::uint64_t{16} << 10;

/// S of an image of `bytes` bytes, 0 if there is none.
std::uint32_t side_of(std::uint64_t bytes, std::uint32_t channels) {
    const auto side =
        static_cast<std::uint64_t>(std::llround(std::sqrt(static_cast<double>(bytes) / channels)));
    return side * side * channels == bytes && side <= 16384 ? static_cast<std::uint32_t>(side) : 0;
}

/// Errors: kFormat for an image of another size, whose pixels are then not decoded.
Status check_side(std::string_view file, std::uint32_t side) {
    SPLAT_ASSIGN(const io::Image image, io::read_image(io::as_bytes(file), {.header_only = true}));
    if (image.width == side && image.height == side) return {};
    return damaged("%u x %u pixels, expected %u x %u", image.width, image.height, side, side);
}

/// uint8 [channels,S,S] of an image file: of gray, the only channel; of colours, without alpha, as the published
/// tables were made.
Result<io::Buffer> decoded(std::string_view file, std::uint32_t channels, std::uint32_t side) {
    SPLAT_TRY(check_side(file, side));
    SPLAT_ASSIGN(const io::Image image, io::read_image(io::as_bytes(file)));
    const std::uint32_t colors = image.channels >= 3 ? 3 : 1;
    const std::size_t area = std::size_t{image.width} * image.height;
    io::Buffer planes(area * channels);
    for (std::uint32_t c = 0; c < channels; ++c)
        for (std::size_t i = 0; i < area; ++i) {
            const unsigned sample = image.samples[i * image.channels + std::min(c, colors - 1)];
            planes[c * area + i] = static_cast<std::byte>(
                image.bits == 16 ? (sample * 255U + 32767U) / 65535U : sample);
        }
    return planes;
}

Status check_text(const TableRow& row) {
    SPLAT_ASSIGN(const scene::Mat4 pose, pose_of(row.value));
    return io::from_file(scene::check_camera(scene::Camera{"pose", 1, 1, 1, 1, 0.5, 0.5, pose}));
}

class Import {
  public:
    Import(const ImportDesc& desc, const Progress& progress) : desc_(desc), progress_(progress) {}

    Status run() {
        const auto files = find_tables(desc_.path, desc_.split);
        SPLAT_TRY(of_split(files.status()));
        const std::vector<TableFiles>& found = files.value();
        const std::string source = fingerprint_of(found);
        const auto there = read_store_text(desc_.store);
        if (there.ok() && there.value().source == source) return {};
        std::error_code none;
        const std::string root =
            os::text_of(std::filesystem::canonical(os::path_of(desc_.path), none));
        SPLAT_TRY(Journal::verify(desc_.path, desc_.split));
        SPLAT_ASSIGN(session_, Session::open(desc_.library, {desc_.path, root}));
        for (const TableFiles& table : found) {
            SPLAT_ASSIGN(TableReader reader, TableReader::open(*session_, table, desc_.split));
            tables_.push_back(std::move(reader));
        }
        const std::uint64_t bytes = bytes_of(found);
        DecodeBudget budget(bytes);
        SPLAT_TRY(of_split(keys_.read(tables_, budget)));
        StoreIndex index;
        index.split = desc_.split;
        index.source = source;
        index.objects = keys_.objects();
        index.frames = keys_.frames();
        for (const TableReader& table : tables_)
            if (kind_of(table.table()).map != nullptr) index.maps.push_back(table.table());
        SPLAT_ASSIGN(index.resolution, resolution());
        SPLAT_TRY(check_store_bytes(index, bytes));
        SPLAT_ASSIGN(store_,
                     StoreWriter::open(desc_.store, std::move(index), desc_.replace, desc_.part));
        if (store_->complete()) return {};
        total_ = keys_.rows() * (tables_.size() - 1) / desc_.part.count;
        for (const TableReader& table : tables_)
            if (table.table() != Table::kIntrinsics) SPLAT_TRY(copy(table));
        return store_->finish();
    }

  private:
    /// The status of a search for the split.
    Status of_split(const Status& status) const {
        if (status.code() == Code::kNotFound && desc_.lacks_split != nullptr)
            *desc_.lacks_split = true;
        return status;
    }

    /// The store takes its space on the disk before the first row is copied.
    static Status check_store_bytes(const StoreIndex& index, std::uint64_t table_bytes) {
        std::uint64_t row = 0;
        for (const Table map : index.maps) row += index.image_bytes(map);
        DecodeBudget budget(table_bytes);
        return budget.take(index.frames.size(), row,
                           format("a store of images of %u pixels a side", index.resolution));
    }

    /// S of the first image.
    Result<std::uint32_t> resolution() const {
        for (const TableReader& table : tables_) {
            if (table.table() != Table::kRgb) continue;
            for (std::size_t file = 0; file < table.files().size(); ++file) {
                const Status ends_the_scan(Code::kIncomplete, "");
                std::optional<std::uint64_t> first;
                std::optional<Result<std::uint32_t>> side;
                Status ended = table.keys(file, [&](const TableRow& row) -> Status {
                    first = row.number;
                    return ends_the_scan;
                });
                if (first)
                    ended = table.values(file, *first, *first + 1, kMaxImageBytes,
                                         [&](const TableRow& row) {
                                             side = side_of_row(table, file, row);
                                             return ends_the_scan;
                                         });
                if (side) return *side;
                SPLAT_TRY(ended);
            }
        }
        return damaged("table %s has no rows of the split %s", kind_of(Table::kRgb).name,
                       desc_.split.c_str());
    }

    static Result<std::uint32_t> side_of_row(const TableReader& table, std::size_t file,
                                             const TableRow& row) {
        if (table.encoded(file)) {
            const auto image = io::read_image(io::as_bytes(row.value), {.header_only = true});
            if (!image.ok()) return table.in_row(file, row.number, image.status());
            return image.value().width;
        }
        const std::uint32_t side = side_of(row.value.size(), 3);
        if (side != 0) return side;
        return table.in_row(
            file, row.number,
            damaged("%zu bytes, expected 3 S S of a square image", row.value.size()));
    }

    Status copy(const TableReader& table) {
        for (std::size_t file = 0; file < table.files().size(); ++file)
            SPLAT_TRY(copy_file(table, file));
        return {};
    }

    /// Rows from the first of this part that is not in the store.
    Status copy_file(const TableReader& table, std::size_t file) {
        const std::uint64_t begin = desc_.part.begin(table.rows(file));
        const std::uint64_t end = desc_.part.end(table.rows(file));
        SPLAT_ASSIGN(const std::uint64_t first, first_missing(table, file, begin, end));
        const std::uint64_t bytes = table.table() == Table::kPoses
                                        ? kMaxPoseBytes
                                        : store_->index().image_bytes(table.table());
        const auto take = [&](const TableRow& row) -> Status {
            const Status status = put(table, file, row);
            if (!status.ok()) return table.in_row(file, row.number, status);
            ++done_;
            return done_ % 64 == 0 && progress_ ? progress_(done_, total_) : Status();
        };
        const std::uint64_t most = table.encoded(file) ? kFileBytesBesides + 2 * bytes : bytes;
        SPLAT_TRY(table.values(file, first, end, most, take));
        return progress_ ? progress_(done_, total_) : Status();
    }

    /// The first of the rows from `begin` to before `end` that the store does not hold, else `end`.
    Result<std::uint64_t> first_missing(const TableReader& table, std::size_t file,
                                        std::uint64_t begin, std::uint64_t end) {
        if (!store_->is_begun()) return begin;
        std::uint64_t missing = end;
        SPLAT_TRY(table.keys(file, [&](const TableRow& row) -> Status {
            if (row.number < begin || row.number >= missing) return {};
            SPLAT_ASSIGN(const std::uint64_t place, keys_.place_of(row));
            if (store_->holds(table.table(), place))
                ++done_;
            else
                missing = row.number;
            return {};
        }));
        return missing;
    }

    Status put(const TableReader& table, std::size_t file, const TableRow& row) {
        SPLAT_ASSIGN(const std::uint64_t place, keys_.place_of(row));
        const TableKind kind = kind_of(table.table());
        io::Bytes bytes = io::as_bytes(row.value);
        io::Buffer planes;
        if (kind.map == nullptr) {
            SPLAT_TRY(check_text(row));
        } else if (table.encoded(file)) {
            SPLAT_ASSIGN(planes, decoded(row.value, kind.channels, store_->index().resolution));
            bytes = planes;
        }
        const std::uint64_t expected = store_->index().image_bytes(table.table());
        if (kind.map != nullptr && bytes.size() != expected)
            return damaged("%zu bytes, expected %llu: uint8 [%u,%u,%u]", bytes.size(),
                           llu(expected), kind.channels, store_->index().resolution,
                           store_->index().resolution);
        return store_->put(table.table(), place, bytes);
    }

    const ImportDesc& desc_;
    const Progress& progress_;
    std::unique_ptr<Session> session_;
    std::vector<TableReader> tables_;
    TableKeys keys_;
    std::unique_ptr<StoreWriter> store_;
    std::uint64_t done_ = 0, total_ = 0;
};

}  // namespace

Status import_tables(const ImportDesc& desc, const Progress& progress) {
    return Import(desc, progress).run();
}

}  // namespace splat::tables
