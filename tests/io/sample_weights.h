#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "io/bytes.h"
#include "io/tensor_file.h"

namespace splat::test {

/// A file of an archive with the fields of its headers, so that tests can make them wrong.
struct ZipPart {
    ZipPart(std::string name, std::string data, bool deflated = false);

    std::string name;
    std::string packed;
    std::uint16_t flags = 0;
    std::uint16_t method = 0;
    std::uint32_t crc = 0;
    std::uint64_t packed_bytes = 0;
    std::uint64_t bytes = 0;
    std::string local_name;         ///< in front of the data
    std::uint32_t local_bytes = 0;  ///< both sizes in the local header
    std::int64_t shift = 0;         ///< added to the place of the local header
    bool zip64 = false;             ///< sizes and place in the zip64 extra field
};

/// The fields of an archive's end record.
struct ZipEnd {
    std::int64_t more_entries = 0;  ///< than there are
    std::int64_t shift = 0;         ///< added to the place of the directory
    std::string comment = {};
    bool zip64 = false;
};

io::Buffer sample_zip(const std::vector<ZipPart>& parts, const ZipEnd& end = {});

/// Opcodes of Python's pickle, appended one by one.
class PickleText {
  public:
    PickleText() : text_("\x80\x02") {}

    PickleText& raw(const std::string& bytes) {
        text_ += bytes;
        return *this;
    }
    PickleText& global(const std::string& module, const std::string& name) {
        return raw("c" + module + "\n" + name + "\n");
    }
    PickleText& text(const std::string& value);
    PickleText& integer(std::int64_t value);
    PickleText& real(double value);
    PickleText& tuple(const std::vector<std::int64_t>& values);
    /// A tensor of a storage, as torch.save() writes it; `legacy`: before version 1.6.
    PickleText& tensor(const std::string& storage_type, const std::string& key, std::int64_t stored,
                       std::int64_t offset, const std::vector<std::int64_t>& dims,
                       const std::vector<std::int64_t>& strides, bool legacy = false);
    [[nodiscard]] std::string done() const { return text_ + "."; }

  private:
    std::string text_;
};

/// The bytes of numbers.
template <class T>
std::string raw_bytes(const std::vector<T>& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

/// An archive with this pickle and storages "0", "1", ...
io::Buffer sample_pth(const std::string& pickle, const std::vector<std::string>& storages,
                      const std::string& byte_order = "little");

/// A state dict of two tensors, one of them transposed.
io::Buffer sample_pth();

/// Parts of a file from before PyTorch 1.6; tests make them wrong.
struct LegacyPth {
    std::string protocol = PickleText().integer(1001).done();
    std::string machine = PickleText().raw("}").text("little_endian").raw("\x88s").done();
    std::string saved;
    std::vector<std::string> keys = {"7", "12"};
    std::vector<std::uint64_t> counts = {6, 2};
    std::vector<std::string> storages = {raw_bytes<float>({1, 2, 3, 4, 5, 6}),
                                         raw_bytes<std::uint16_t>({0, 0x3C00})};
};

/// The tensors of sample_pth() in such a file.
LegacyPth legacy_parts();
io::Buffer sample_legacy_pth(const LegacyPth& parts = legacy_parts());

/// Three tensors: [2, 3], a number, and an empty one.
io::NamedTensors sample_tensors();

/// A header of this text in front of `data_bytes` bytes.
io::Buffer sample_safetensors(const std::string& header, std::size_t data_bytes);

}  // namespace splat::test
