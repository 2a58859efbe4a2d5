#include "io/weights_formats.h"

#include <algorithm>
#include <array>
#include <optional>
#include <set>

#include "core/checked_math.h"
#include "core/json.h"
#include "core/json_writer.h"
#include "core/parallel.h"
#include "core/shown.h"
#include "io/reader.h"

namespace splat::io {
namespace {

constexpr const char* kMetadata = "__metadata__";
constexpr std::size_t kSizeBytes = 8;

/// Smaller files are read into memory by one thread: starting threads would take longer than they save,
/// and a mapped file stays open.
constexpr std::uint64_t kManyBytes = std::uint64_t{1} << 20;

Status bad_safetensors(const std::string& problem) {
    return damaged("safetensors: %s", problem.c_str());
}

/// A tensor as the header describes it.
struct Row {
    std::string name;
    std::optional<NumberType> type;
    bool has_shape = false;
    bool has_offsets = false;
    std::vector<std::int64_t> shape;
    std::vector<std::int64_t> offsets;  ///< first byte and end, from the end of the header
    std::uint64_t count = 0;
};

/// Takes the header's values one by one.
class HeaderReader {
  public:
    explicit HeaderReader(std::uint64_t max_tensors) : max_tensors_(max_tensors) {}

    Status operator()(const JsonEvent& event) {
        using Event = JsonEvent::Kind;
        const auto path = event.path;
        if (path.empty())
            return event.kind == Event::kObject
                       ? Status()
                       : bad_safetensors("the header is not a JSON object");
        if (path.size() == 1) return start(path[0].key, event.kind == Event::kObject);
        const std::string& key = path[1].key;
        if (path[0].key == kMetadata) {
            if (path.size() != 2 || event.kind != Event::kText)
                return bad_safetensors("'__metadata__' holds something other than text");
            if (!metadata_keys_.insert(key).second) return twice(key, kMetadata);
            metadata.emplace_back(key, event.text);
            return {};
        }
        Row& row = rows.back();
        if (path.size() == 2 && key == "dtype" && event.kind == Event::kText)
            return set_type(row, event.text);
        if (path.size() == 2 && event.kind == Event::kArray &&
            (key == "shape" || key == "data_offsets")) {
            bool& has = key == "shape" ? row.has_shape : row.has_offsets;
            if (has) return twice(key, row.name);
            has = true;
            return {};
        }
        if (path.size() == 3 && event.kind == Event::kInteger && event.integer >= 0) {
            (key == "shape" ? row.shape : row.offsets).push_back(event.integer);
            return {};
        }
        return bad_safetensors(
            "'" + shown(row.name) + "': '" + shown(key) +
            "' is not as expected: a text 'dtype', and whole numbers 'shape' and "
            "'data_offsets'");
    }

    std::vector<Row> rows;
    Metadata metadata;

  private:
    static Status twice(const std::string& key, const std::string& name) {
        return bad_safetensors("'" + shown(key) + "' appears twice in '" + shown(name) + "'");
    }

    Status start(const std::string& name, bool object) {
        if (!object) return bad_safetensors("'" + shown(name) + "' is not a JSON object");
        if (!names_.insert(name).second) return twice(name, "the header");
        if (name == kMetadata) return {};
        if (rows.size() == max_tensors_)
            return bad_safetensors("more than " + std::to_string(max_tensors_) + " tensors");
        rows.emplace_back();
        rows.back().name = name;
        return {};
    }

    static Status set_type(Row& row, std::string_view text) {
        if (row.type) return twice("dtype", row.name);
        row.type = find_number_type(&NumberTypeRow::safetensors, text);
        if (row.type) return {};
        return unsupported("safetensors: '%s' has the dtype '%s', which is not read",
                           shown(row.name).c_str(), shown(text).c_str());
    }

    std::uint64_t max_tensors_;
    std::set<std::string, std::less<>> names_;
    std::set<std::string, std::less<>> metadata_keys_;
};

/// Checks that every row is complete, and that together they fill the data exactly.
Status check_rows(std::vector<Row>& rows, std::uint64_t data_bytes) {
    for (Row& row : rows) {
        if (!row.type || !row.has_shape || row.offsets.size() != 2)
            return bad_safetensors("'" + shown(row.name) +
                                   "' lacks its dtype, its shape or its two data_offsets");
        SPLAT_ASSIGN(row.count,
                     from_file(count_elements(row.shape, "safetensors: " + shown(row.name))));
        const std::int64_t bytes = row.offsets[1] - row.offsets[0];
        if (bytes < 0 || static_cast<std::uint64_t>(bytes) != row.count * type_bytes(*row.type))
            return bad_safetensors(format("'%s' of shape %s and type %s has %lld bytes",
                                          shown(row.name).c_str(), dims_text(row.shape).c_str(),
                                          type_name(*row.type), lld(bytes)));
    }
    std::ranges::stable_sort(rows,
                             [](const Row& a, const Row& b) { return a.offsets < b.offsets; });
    std::uint64_t end = 0;
    for (const Row& row : rows) {
        if (static_cast<std::uint64_t>(row.offsets[0]) != end)
            return bad_safetensors(
                format("the data of '%s' starts at byte %lld, expected %llu: tensors overlap "
                       "or leave a gap",
                       shown(row.name).c_str(), lld(row.offsets[0]), llu(end)));
        end = static_cast<std::uint64_t>(row.offsets[1]);
    }
    if (end == data_bytes) return {};
    return bad_safetensors(
        format("the tensors have %llu bytes, the file %llu; it is truncated or damaged", llu(end),
               llu(data_bytes)));
}

Result<std::uint64_t> header_size(const Source& source) {
    std::byte bytes[kSizeBytes];
    if (source.size() < kSizeBytes) return bad_safetensors("the file has less than 8 bytes");
    SPLAT_TRY(source.read(0, bytes));
    const auto size = number<std::uint64_t>(bytes);
    if (size > kMaxJsonBytes || size > source.size() - kSizeBytes)
        return bad_safetensors(
            format("a header of %llu bytes, expected at most %zu and no more than the file "
                   "has; it is truncated or not a safetensors file",
                   llu(size), kMaxJsonBytes));
    return size;
}

bool is_f32(const Row& row) {
    return *row.type == NumberType::kF32;
}

/// The numbers in the mapped file; empty if they must be converted or moved.
std::span<const float> in_place(const MappedFile& file, std::uint64_t at, const Row& row) {
    if (!is_f32(row) || at % alignof(float) != 0) return {};
    return {reinterpret_cast<const float*>(file.bytes().data() + at), row.count};
}

Status read_row(const Source& source, std::uint64_t at, const Row& row, NamedTensor& tensor) {
    const std::span<float> values = tensor.values.own();
    if (tensor.type == NumberType::kF32) return source.read(at, std::as_writable_bytes(values));
    LargeVector<std::byte> bytes(row.count * type_bytes(tensor.type));
    SPLAT_TRY(source.read(at, bytes));
    to_floats(tensor.type, bytes, values.data());
    return {};
}

}  // namespace

Result<WeightsFile> read_safetensors(const Source& source, const DecodeLimits& limits) {
    SPLAT_ASSIGN(const std::uint64_t size, header_size(source));
    Buffer text(size);
    SPLAT_TRY(source.read(kSizeBytes, text));
    HeaderReader header(limits.max_items);
    SPLAT_TRY(from_file(visit_json(as_text(text), "safetensors: the header", std::ref(header))));
    const std::uint64_t start = kSizeBytes + size;
    SPLAT_TRY(check_rows(header.rows, source.size() - start));
    DecodeBudget budget(source.size(), limits);
    WeightsFile file;
    file.metadata = std::move(header.metadata);
    for (const Row& row : header.rows)
        SPLAT_TRY(budget.take(row.count, sizeof(float), "safetensors: " + shown(row.name)));
    const bool small = source.size() < kManyBytes;
    const bool in_file = !small && std::ranges::any_of(header.rows, is_f32);
    const std::shared_ptr<const MappedFile> mapped = in_file ? source.map() : nullptr;
    const auto at = [&](const Row& row) {
        return start + static_cast<std::uint64_t>(row.offsets[0]);
    };
    std::vector<NamedTensor> tensors(header.rows.size());
    std::vector<std::size_t> to_read;
    for (std::size_t i = 0; i < tensors.size(); ++i) {
        Row& row = header.rows[i];
        tensors[i] = {std::move(row.name), std::move(row.shape), *row.type, {}};
        if (mapped) tensors[i].values = {mapped, in_place(*mapped, at(row), row)};
        if (tensors[i].values.size() == row.count) continue;
        // Allocated by one thread: memory that several allocate at once was sometimes read at half the speed.
        tensors[i].values.own().resize(row.count);
        to_read.push_back(i);
    }
    SPLAT_TRY(parallel_for(to_read.size(), small ? 1 : kMostHostThreads, [&](std::size_t i) {
        const Row& row = header.rows[to_read[i]];
        return read_row(source, at(row), row, tensors[to_read[i]]);
    }));
    for (NamedTensor& tensor : tensors) SPLAT_TRY(from_file(file.tensors.add(std::move(tensor))));
    return file;
}

Result<FilePieces> write_safetensors(const NamedTensors& tensors, const Metadata& metadata,
                                     bool half) {
    JsonWriter json(JsonWriter::Style::kCompact);
    json.begin_object();
    if (!metadata.empty()) {
        json.key(kMetadata).begin_object();
        for (const auto& [key, value] : metadata) json.member(key, value);
        json.end();
    }
    std::uint64_t end = 0;
    for (const NamedTensor& tensor : tensors) {
        if (tensor.name == kMetadata)
            return invalid("safetensors: no tensor may be named '__metadata__'");
        SPLAT_TRY(check_json_name(tensor.name, "safetensors: the tensor"));
        const std::uint64_t begin = end;
        end += tensor.values.size() * (half ? 2 : 4);
        json.key(tensor.name).begin_object().member("dtype", half ? "F16" : "F32");
        json.key("shape").raw(dims_text(tensor.dims));
        json.key("data_offsets").list(std::array{begin, end}).end();
    }
    std::string header = json.end().text();
    header.append(round_up(header.size(), kSizeBytes) - header.size(), ' ');
    if (header.size() > kMaxJsonBytes)
        return invalid("safetensors: a header of %zu bytes, the limit is %zu", header.size(),
                       kMaxJsonBytes);
    FilePieces file;
    Buffer start;
    put(start, std::uint64_t{header.size()});
    put_text(start, header);
    file.add(std::move(start));
    for (const NamedTensor& tensor : tensors) {
        if (!half) {
            file.add_view(std::as_bytes(std::span(tensor.values)));
            continue;
        }
        Buffer halves;
        SPLAT_TRY(put_halves(halves, tensor));
        file.add(std::move(halves));
    }
    return file;
}

bool is_safetensors(Bytes head) {
    return head.size() > kSizeBytes && number<std::uint64_t>(head.data()) <= kMaxJsonBytes &&
           head[kSizeBytes] == std::byte{'{'};
}

}  // namespace splat::io
