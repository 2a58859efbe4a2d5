#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace splat::test {

/// ONNX element types.
inline constexpr int kOnnxFloat = 1, kOnnxInt64 = 7, kOnnxString = 8, kOnnxHalf = 10;

/// An attribute of a node: one number, or a list of whole ones.
struct OnnxAttribute {
    std::string name;
    std::vector<std::int64_t> ints;
    bool list = true;
};

/// Writes small ONNX files (opset 13): a graph node by node, as protocol buffers. Dimensions below 0 are free.
/// Source: onnx.proto, the numbers of its fields.
class OnnxGraph {
  public:
    OnnxGraph& input(const std::string& name, int type, const std::vector<std::int64_t>& dims);
    OnnxGraph& output(const std::string& name, int type, const std::vector<std::int64_t>& dims);
    OnnxGraph& floats(const std::string& name, const std::vector<std::int64_t>& dims,
                      const std::vector<float>& values);
    OnnxGraph& whole(const std::string& name, const std::vector<std::int64_t>& values);
    OnnxGraph& node(const std::string& op, const std::vector<std::string>& inputs,
                    const std::string& output, const std::vector<OnnxAttribute>& attributes = {});

    /// The bytes of the file.
    [[nodiscard]] std::string file() const;

    /// Write the file to `path`.
    void save(const std::string& path) const;

  private:
    OnnxGraph& tensor(const std::string& name, int type, const std::vector<std::int64_t>& dims,
                      const std::string& bytes);
    std::string nodes_, tensors_, inputs_, outputs_;
};

}  // namespace splat::test
