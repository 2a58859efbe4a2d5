#include "io/weights_formats.h"

#include <charconv>
#include <optional>

#include "core/checked_math.h"
#include "core/json_writer.h"
#include "io/reader.h"
#include "io/torch/pth_archive.h"

namespace splat::io {
namespace {

using Kind = PickleNode::Kind;

constexpr const char* kModelConfig = "model_config";  ///< key of MoGe's configuration

Status bad_pth(const std::string& problem) {
    return damaged("pth: %s", problem.c_str());
}

/// A tensor's place in its storage.
struct View {
    std::string name;
    NumberType type = NumberType::kF32;
    std::string key;           ///< key of the storage
    std::uint64_t stored = 0;  ///< elements of the storage
    std::uint64_t offset = 0;
    std::vector<std::int64_t> dims;
    std::vector<std::int64_t> strides;
    std::uint64_t count = 0;
};

/// The elements of the view are contiguous in row-major order.
bool is_contiguous(const View& view) {
    std::int64_t expected = 1;
    for (std::size_t i = view.dims.size(); i-- > 0; expected *= view.dims[i])
        if (view.dims[i] != 1 && view.strides[i] != expected) return false;
    return true;
}

/// Copies in row-major order; the view has been checked against `from`.
void gather(const View& view, std::span<const float> from, std::span<float> to) {
    std::vector<std::int64_t> index(view.dims.size(), 0);
    const std::size_t last = view.dims.size() - 1;
    const auto row = static_cast<std::size_t>(view.dims[last]);
    const auto step = static_cast<std::size_t>(view.strides[last]);
    std::size_t at = view.offset;
    for (std::size_t done = 0; done < to.size(); done += row) {
        for (std::size_t i = 0; i < row; ++i) to[done + i] = from[at + i * step];
        for (std::size_t d = last; d-- > 0;) {
            at += static_cast<std::size_t>(view.strides[d]);
            if (++index[d] < view.dims[d]) break;
            at -= static_cast<std::size_t>(view.strides[d] * view.dims[d]);
            index[d] = 0;
        }
    }
}

class PthReader {
  public:
    PthReader(const Source& source, const DecodeLimits& limits)
        : source_(source), budget_(source.size(), limits) {}

    Status open() {
        SPLAT_ASSIGN(archive_, PthArchive::open(source_, budget_));
        return {};
    }

    [[nodiscard]] const Pickle& pickle() const { return archive_->pickle(); }
    [[nodiscard]] const PickleNode& root() const { return archive_->root(); }

    Result<NamedTensor> tensor(const PickleNode& node, const std::string& name) {
        SPLAT_ASSIGN(const View view, view_of(node, name));
        NamedTensor tensor;
        tensor.name = name;
        tensor.dims = view.dims;
        tensor.type = view.type;
        if (view.count == 0) return tensor;
        SPLAT_TRY(budget_.take(view.count, sizeof(float), "pth: '" + name + "'"));
        SPLAT_TRY(load(view));
        LargeVector<float>& values = tensor.values.own();
        values.resize(view.count);
        const std::size_t each = type_bytes(view.type);
        if (is_contiguous(view)) {
            to_floats(view.type, Bytes(stored_).subspan(view.offset * each, view.count * each),
                      values.data());
            return tensor;
        }
        SPLAT_TRY(budget_.take(view.stored, sizeof(float), "pth: '" + name + "'"));
        std::vector<float> floats(view.stored);
        to_floats(view.type, stored_, floats.data());
        gather(view, floats, values);
        return tensor;
    }

  private:
    Result<std::vector<std::int64_t>> numbers(std::uint32_t node, const std::string& what) const {
        const PickleNode& tuple = pickle()[node];
        if (tuple.kind != Kind::kTuple) return bad_pth(what + " is not a tuple");
        std::vector<std::int64_t> values;
        for (const std::uint32_t item : tuple.items) {
            if (pickle()[item].kind != Kind::kInt || pickle()[item].integer < 0)
                return bad_pth(what + " holds something other than whole numbers >= 0");
            values.push_back(pickle()[item].integer);
        }
        return values;
    }

    Result<View> view_of(const PickleNode& node, const std::string& name) const {
        View view;
        view.name = name;
        const PickleNode& storage = pickle()[node.items[0]];
        const PickleNode& elements = pickle()[storage.items[4]];
        const PickleNode& offset = pickle()[node.items[1]];
        SPLAT_ASSIGN(view.type, Pickle::storage_type(pickle()[storage.items[1]]));
        view.key = pickle()[storage.items[2]].text;
        if (elements.integer < 0 || offset.kind != Kind::kInt || offset.integer < 0)
            return bad_pth("the storage of '" + name + "' has a size or offset below 0");
        view.stored = static_cast<std::uint64_t>(elements.integer);
        view.offset = static_cast<std::uint64_t>(offset.integer);
        // The part of another storage that this one is, in files from before PyTorch 1.6; later always None.
        if (storage.items.size() > 5 && pickle()[storage.items[5]].kind != Kind::kNone)
            return unsupported(
                "pth: the storage of '%s' is part of another one; load the file in Python "
                "and save it "
                "again with torch.save()",
                name.c_str());
        SPLAT_ASSIGN(view.dims, numbers(node.items[2], "the shape of '" + name + "'"));
        SPLAT_ASSIGN(view.strides, numbers(node.items[3], "the stride of '" + name + "'"));
        SPLAT_ASSIGN(view.count, from_file(count_elements(view.dims, name)));
        if (view.dims.size() != view.strides.size())
            return bad_pth(format("'%s' has %zu dimensions and %zu strides", name.c_str(),
                                  view.dims.size(), view.strides.size()));
        if (view.count != 0) SPLAT_TRY(check_reach(view));
        return view;
    }

    /// Checks that the last element of the view lies in the storage.
    static Status check_reach(const View& view) {
        std::optional<std::uint64_t> last = view.offset;
        for (std::size_t i = 0; i < view.dims.size(); ++i) {
            const auto reach = checked_mul(static_cast<std::uint64_t>(view.dims[i] - 1),
                                           static_cast<std::uint64_t>(view.strides[i]));
            last = last && reach ? checked_add(*last, *reach) : std::nullopt;
        }
        if (last && *last < view.stored) return {};
        return bad_pth(
            format("'%s' of shape %s and stride %s reaches beyond its storage of %llu "
                   "elements",
                   view.name.c_str(), dims_text(view.dims).c_str(), dims_text(view.strides).c_str(),
                   llu(view.stored)));
    }

    /// Loads the view's storage into stored_.
    Status load(const View& view) {
        if (view.key == loaded_ && view.type == loaded_type_)
            return check_length(view, stored_.size());
        SPLAT_ASSIGN(const std::uint64_t bytes, archive_->size_of(view.key, view.name));
        SPLAT_TRY(check_length(view, bytes));
        SPLAT_TRY(budget_.take(bytes, 1, "pth: storage '" + view.key + "'"));
        loaded_.clear();
        SPLAT_TRY(archive_->read(view.key, stored_));
        loaded_ = view.key;
        loaded_type_ = view.type;
        return {};
    }

    static Status check_length(const View& view, std::uint64_t bytes) {
        const auto expected = checked_mul(view.stored, type_bytes(view.type));
        if (expected && *expected == bytes) return {};
        return bad_pth(format("the storage of '%s' has %llu bytes, expected %llu of %s",
                              view.name.c_str(), llu(bytes), llu(view.stored),
                              type_name(view.type)));
    }

    const Source& source_;
    DecodeBudget budget_;
    std::unique_ptr<PthArchive> archive_;
    Buffer stored_;
    std::string loaded_;  // key of stored_; empty: none
    NumberType loaded_type_ = NumberType::kF32;
};

/// A number, or a tensor of one element.
Result<std::optional<double>> scalar(PthReader& reader, const PickleNode& dict, const char* key) {
    const PickleNode* node = reader.pickle().find(dict, key);
    if (node == nullptr || node->kind == Kind::kNone) return std::optional<double>();
    if (node->kind == Kind::kFloat) return std::optional(node->real);
    if (node->kind == Kind::kInt) return std::optional(static_cast<double>(node->integer));
    if (node->kind == Kind::kTensor) {
        SPLAT_ASSIGN(const NamedTensor tensor, reader.tensor(*node, key));
        if (tensor.values.size() == 1) return std::optional(static_cast<double>(tensor.values[0]));
    }
    return bad_pth(std::string("'") + key + "' is " + kind_name(node->kind) +
                   ", expected a number");
}

/// The shortest text that parses to the same number.
std::string number_text(double number) {
    char text[32];
    return {text, std::to_chars(std::begin(text), std::end(text), number).ptr};
}

Status read_scalars(PthReader& reader, Metadata& metadata) {
    const PickleNode& root = reader.root();
    const PickleNode* iteration = reader.pickle().find(root, "iteration");
    if (iteration != nullptr && iteration->kind == Kind::kInt)
        metadata.emplace_back("iteration", std::to_string(iteration->integer));
    for (const char* name : {"loss",  // numbers, or tensors of one
                             "best_PSNR"}) {
        SPLAT_ASSIGN(const std::optional<double> value, scalar(reader, root, name));
        if (value) metadata.emplace_back(name, number_text(*value));
    }
    return {};
}

/// Plain values of a pickle as JSON: the configuration that a network was saved with. Errors: kFormat for values that
/// JSON lacks, and beyond kMostValues, which also ends cycles.
class ConfigWriter {
  public:
    explicit ConfigWriter(const Pickle& pickle) : pickle_(pickle) {}

    Result<std::string> text(const PickleNode& root) {
        SPLAT_TRY(write(root, 0));
        return json_.text();
    }

  private:
    static constexpr std::size_t kMostValues = 4096;
    static constexpr int kMostDepth = 16;

    Status write(const PickleNode& node, int depth) {
        if (++values_ > kMostValues || depth > kMostDepth)
            return bad_pth(
                format("'model_config' has more than %zu values, or nests deeper than %d",
                       kMostValues, kMostDepth));
        switch (node.kind) {
            case Kind::kNone:
                json_.raw("null");
                return {};
            case Kind::kBool:
                json_.value(node.integer != 0);
                return {};
            case Kind::kInt:
                json_.value(node.integer);
                return {};
            case Kind::kFloat:
                json_.value(node.real);
                return {};
            case Kind::kText:
                json_.value(node.text);
                return {};
            case Kind::kList:
            case Kind::kTuple:
                json_.begin_array();
                for (const std::uint32_t item : node.items)
                    SPLAT_TRY(write(pickle_[item], depth + 1));
                json_.end();
                return {};
            case Kind::kDict:
                return write_dict(node, depth);
            default:
                return bad_pth(std::string("'model_config' holds ") + kind_name(node.kind));
        }
    }

    Status write_dict(const PickleNode& node, int depth) {
        json_.begin_object();
        for (std::size_t i = 0; i < node.items.size(); i += 2) {
            const PickleNode& key = pickle_[node.items[i]];
            if (key.kind != Kind::kText) return bad_pth("a name in 'model_config' is not a text");
            json_.key(key.text);
            SPLAT_TRY(write(pickle_[node.items[i + 1]], depth + 1));
        }
        json_.end();
        return {};
    }

    const Pickle& pickle_;
    JsonWriter json_;
    std::size_t values_ = 0;
};

Result<NamedTensors> read_tensors(PthReader& reader, const PickleNode& dict,
                                  const DecodeLimits& limits) {
    const Pickle& pickle = reader.pickle();
    if (dict.items.size() / 2 > limits.max_items)
        return bad_pth(
            format("%zu tensors, the limit is %llu", dict.items.size() / 2, llu(limits.max_items)));
    NamedTensors tensors;
    for (std::size_t i = 0; i < dict.items.size(); i += 2) {
        const PickleNode& key = pickle[dict.items[i]];
        const PickleNode& value = pickle[dict.items[i + 1]];
        if (key.kind != Kind::kText) return bad_pth("a name in the state dict is not text");
        const std::string name(key.text);
        if (value.kind != Kind::kTensor)
            return bad_pth("'" + name + "' is " + kind_name(value.kind) +
                           ", expected a tensor; there is no 'model_state_dict' or 'state_dict'");
        SPLAT_ASSIGN(NamedTensor tensor, reader.tensor(value, name));
        SPLAT_TRY(from_file(tensors.add(std::move(tensor))));
    }
    return tensors;
}

}  // namespace

Result<WeightsFile> read_pth(const Source& source, const DecodeLimits& limits) {
    PthReader reader(source, limits);
    SPLAT_TRY(reader.open());
    const PickleNode* dict = &reader.root();
    if (dict->kind != Kind::kDict)
        return bad_pth(std::string("it holds ") + kind_name(dict->kind) +
                       ", expected a state dict");
    WeightsFile file;
    file.format = WeightsFormat::kPth;
    for (const char* section : {"model_state_dict", "state_dict", "model"}) {
        const PickleNode* inner = reader.pickle().find(*dict, section);
        if (inner == nullptr || inner->kind != Kind::kDict) continue;
        SPLAT_TRY(read_scalars(reader, file.metadata));
        if (const PickleNode* config = reader.pickle().find(*dict, kModelConfig)) {
            SPLAT_ASSIGN(std::string text, ConfigWriter(reader.pickle()).text(*config));
            file.metadata.emplace_back(kModelConfig, std::move(text));
        }
        dict = inner;
        break;
    }
    SPLAT_ASSIGN(file.tensors, read_tensors(reader, *dict, limits));
    return file;
}

}  // namespace splat::io
