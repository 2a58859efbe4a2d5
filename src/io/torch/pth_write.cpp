// Files that torch.load() reads, of the format since PyTorch 1.6.

#include "io/reader.h"
#include "io/weights_formats.h"
#include "io/zip.h"

namespace splat::io {
namespace {

/// Opcodes of protocol 2, appended one by one.
class PickleWriter {
  public:
    PickleWriter() { raw("\x80\x02"); }

    PickleWriter& raw(std::string_view opcodes) {
        put_text(bytes_, opcodes);
        return *this;
    }

    PickleWriter& global(std::string_view module, std::string_view name) {
        return raw("c").raw(module).raw("\n").raw(name).raw("\n");
    }

    PickleWriter& text(std::string_view value) {
        raw("X");
        put(bytes_, static_cast<std::uint32_t>(value.size()));
        return raw(value);
    }

    PickleWriter& integer(std::int64_t value) {
        raw(std::string_view("\x8a\x08", 2));
        put(bytes_, value);
        return *this;
    }

    PickleWriter& real(double value) {
        raw("G");
        put(bytes_, value, std::endian::big);
        return *this;
    }

    PickleWriter& tuple(const std::vector<std::int64_t>& values) {
        raw("(");
        for (const std::int64_t value : values) integer(value);
        return raw("t");
    }

    /// All of storage `key`, row-major.
    PickleWriter& tensor(const NamedTensor& tensor, const std::string& key, bool half) {
        std::vector<std::int64_t> strides(tensor.dims.size(), 1);
        for (std::size_t i = strides.size(); i-- > 1;)
            strides[i - 1] = strides[i] * std::max<std::int64_t>(tensor.dims[i], 1);
        global("torch._utils", "_rebuild_tensor_v2").raw("((").text("storage");
        global("torch", half ? "HalfStorage" : "FloatStorage").text(key).text("cpu");
        integer(static_cast<std::int64_t>(tensor.values.size())).raw("tQ").integer(0);
        tuple(tensor.dims).tuple(strides).raw("\x89");
        return global("collections", "OrderedDict").raw(")RtR");
    }

    Buffer done() {
        raw(".");
        return std::move(bytes_);
    }

  private:
    Buffer bytes_;
};

/// A number of the metadata; 0 where it is not given.
template <class T>
Result<T> scalar_of(const Metadata& metadata, std::string_view name) {
    T value{};
    for (const auto& [key, text] : metadata) {
        if (key != name) continue;
        const auto number = number_in<T>(text);
        if (!number)
            return invalid("metadata '%s' is '%s', expected a number", key.c_str(), text.c_str());
        value = *number;
    }
    return value;
}

}  // namespace

Result<FilePieces> write_pth(const NamedTensors& tensors, const Metadata& metadata, bool half) {
    SPLAT_ASSIGN(const auto iteration, scalar_of<std::int64_t>(metadata, "iteration"));
    SPLAT_ASSIGN(const auto loss, scalar_of<double>(metadata, "loss"));
    SPLAT_ASSIGN(const auto best_psnr, scalar_of<double>(metadata, "best_PSNR"));
    const std::string folder = "model/";
    PickleWriter pickle;
    pickle.raw("}(").text("iteration").integer(iteration);
    pickle.text("loss").real(loss);
    pickle.text("best_PSNR").real(best_psnr);
    pickle.text("model_state_dict").global("collections", "OrderedDict").raw(")R(");
    std::vector<ZipMember> members;
    members.push_back({folder + "data.pkl", {}, {}});
    members.push_back({folder + "byteorder", {}, as_bytes("little")});
    for (std::size_t i = 0; i < tensors.size(); ++i) {
        const std::string key = std::to_string(i);
        pickle.text(tensors[i].name).tensor(tensors[i], key, half);
        ZipMember member{folder + "data/" + key, {}, {}};
        if (half)
            SPLAT_TRY(put_halves(member.head, tensors[i]));
        else
            member.body = std::as_bytes(std::span(tensors[i].values));
        members.push_back(std::move(member));
    }
    members.front().head = pickle.raw("uu").done();
    members.push_back({folder + "version", {}, as_bytes("3\n")});
    return write_zip(std::move(members));
}

}  // namespace splat::io
