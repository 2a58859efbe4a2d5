#pragma once

#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "core/json_tree.h"
#include "io/scene_load.h"
#include "scene/vector.h"

// What the files of glTF share: a document, its numbers, and where its nodes place meshes. Sources: glTF 2.0 and its
// extension KHR_gaussian_splatting, both of the Khronos Group.
namespace splat::io::gltf {

inline constexpr const char* kExtension = "KHR_gaussian_splatting";

/// Axes of a file, unless options name others: the specification has +Y up, +Z forward and -X right.
inline constexpr scene::Frame kFrame = scene::Frame::kLuf;
/// By the extension every scene is sorted by distance and ends at 3 sigma; files can say the rest.
inline constexpr scene::DrawnAs kAlways = {.by_distance = true, .three_sigma = true};
inline constexpr scene::DrawnAs kSays = {
    .by_distance = true, .three_sigma = true, .linear_colors = true};

/// Bytes from the start of a buffer view on, and the distance of its elements; 0: they lie tightly.
struct View {
    Bytes bytes;
    std::uint64_t stride = 0;
};

/// The JSON of a file, and the bytes of its buffers. Buffers are read when they are asked for, each once.
class Document {
  public:
    /// `binary`: the chunk of a .glb, which outlives the document, as `json` does. Errors: kFormat; kUnsupported for
    /// another version.
    static Result<Document> open(std::string_view json, std::optional<Bytes> binary,
                                 const LoadOptions& options);

    [[nodiscard]] const JsonTree& json() const { return json_; }

    /// Element `index` of a top-level array. Errors: kFormat if there is none.
    [[nodiscard]] Result<const JsonTree*> element(const char* array, std::uint64_t index) const;

    /// The bytes of image `index`, as they are stored. Errors: as view().
    Result<Bytes> image(std::uint64_t index);

    /// Buffer view `index`. Errors: kFormat; kUnsupported for a file beside one in memory; as read_file().
    Result<View> view(std::uint64_t index);

    /// Bytes of the document and of the files beside it that were read, which bound what a scene may take.
    [[nodiscard]] std::uint64_t file_bytes() const { return file_bytes_; }

  private:
    Result<Bytes> buffer(std::uint64_t index);
    Result<Bytes> resource(const std::string& uri, const std::string& where);

    JsonTree json_;
    /// Top-level members by name: finding them among many each time would take the square of the time.
    mutable std::map<std::string_view, const JsonTree*> arrays_;
    std::vector<std::string_view> data_uris_;  ///< long ones; the JSON has "#0", "#1"... for them
    std::optional<Bytes> binary_;
    std::optional<std::string> folder_;
    std::map<std::string, Buffer> resources_;  ///< by URI, or by the path of a file
    std::uint64_t file_bytes_ = 0;
};

/// The bytes of base64, with or without '=' at its end; `where` is for messages. Errors: kFormat.
Result<Buffer> from_base64(std::string_view text, const std::string& where);
void put_base64(Buffer& to, Bytes bytes);

/// A whole number that is a member of an object; `usual` where there is no such member. Errors: kFormat.
Result<std::uint64_t> whole_number(const JsonTree& object, const char* member,
                                   const std::string& where,
                                   std::optional<std::uint64_t> usual = {});

/// An accessor: `count` elements of one to four numbers.
struct Accessor {
    struct Sparse {
        std::uint64_t count = 0;
        std::uint32_t index_type = 0;
        Bytes indices;
        Bytes values;
    };

    std::uint64_t count = 0;
    std::size_t components = 0;
    std::uint32_t type = 0;  ///< componentType of the specification
    bool normalized = false;
    Bytes bytes;  ///< from the first element on; none: zeros
    std::uint64_t stride = 0;
    std::optional<Sparse> sparse;
    std::string where;  ///< for messages

    /// "float", "normalized byte", "unsigned short" and so on.
    [[nodiscard]] std::string encoding() const;
};

/// Accessor `index`, with all of its elements inside their buffers. Errors: kFormat; as Document::view().
Result<Accessor> accessor_at(Document& document, std::uint64_t index);

/// How the numbers of an attribute may be stored, as Accessor::encoding() has it.
using Encodings = std::span<const std::string_view>;
inline constexpr std::string_view kFloat[] = {"float"};
/// Encodings of positions and texture coordinates with KHR_mesh_quantization (`quantized`), else `otherwise`.
Encodings quantized_or(bool quantized, Encodings otherwise);

/// What the attribute `name` of a primitive at `where` holds, of `count` elements (0: of any number). Errors: kFormat
/// for others than `components` numbers each of these encodings; as accessor_at().
Result<Accessor> attribute_at(Document& document, const JsonTree& attributes,
                              const std::string& name, std::size_t components, Encodings encodings,
                              std::uint64_t count, const std::string& where);

/// Writes whole numbers, of the types that indices have. Errors: kFormat for another type, kUnsupported for sparse ones
Status copy_indices(const Accessor& accessor, std::uint32_t* to);

/// Writes element i to to[i * step] and on: normalised integers as 0 to 1 or -1 to 1, others as they are. Errors:
/// kFormat for indices of a sparse accessor that do not grow, or are beyond the count.
Status copy_numbers(const Accessor& accessor, float* to, std::size_t step);

/// Exactly `count` finite numbers of a list, which is a member of `where`. Errors: kFormat.
Status read_numbers(const JsonTree& list, double* to, std::size_t count, const char* member,
                    const std::string& where);

/// What a reader does with extensions: reads them, or takes files that require them although it leaves them out.
struct ExtensionRules {
    bool (*is_read)(std::string_view name);
    bool (*may_be_required)(std::string_view name);
};

/// True if positions may be integers. Adds what is used, but not read, to `ignored`. Errors: kUnsupported for what
/// changes how numbers lie in the file, and for what is required.
Result<bool> check_extensions(const JsonTree& json, const ExtensionRules& rules,
                              std::set<std::string>& ignored);

struct Chunks {
    std::optional<Bytes> json;
    std::optional<Bytes> binary;
};

/// The chunks of a .glb: JSON, then at most one of bytes; later ones are ignored, as the specification asks. Errors:
/// kFormat, unless options.lenient also for bytes that follow; kUnsupported for another version.
Result<Chunks> chunks_of(Bytes file, const LoadOptions& options, LoadReport& report);

/// A mesh where a node places it: x -> linear x + move.
struct Placement {
    std::uint64_t node = 0;
    std::uint64_t mesh = 0;
    scene::Mat3 linear{1};
    scene::Vec3 move{};
};

/// All meshes of the scene that a program shows first. Errors: kFormat, also for a node that is reached twice.
Result<std::vector<Placement>> placed_meshes(const Document& document,
                                             std::set<std::string>& ignored);

/// Moves, turns and stretches Gaussians to where the node has them, with their harmonics. A stretch that differs by
/// axis makes other rotations and scales, so that the covariance is right.
///
/// Errors       kUnsupported for a node that mirrors or shears, for which the extension defines no drawing; kFormat for
///              means that would not stay finite
/// Precision    computed in float64, rounded once; identity keeps all bits
Status place(scene::Gaussians& gaussians, const Placement& placement);

/// Errors: kUnsupported if the chunks do not fit the 32-bit lengths of a .glb.
Status check_glb_size(std::uint64_t json_bytes, std::uint64_t binary_bytes);

}  // namespace splat::io::gltf
