#include "prior_models/onnx/onnx_graph.h"

#include <cstring>
#include <fstream>

namespace splat::test {
namespace {

std::string varint(std::uint64_t value) {
    std::string bytes;
    for (; value >= 128; value >>= 7U) bytes += static_cast<char>((value & 127U) | 128U);
    return bytes + static_cast<char>(value);
}

/// A field of a whole number.
std::string number(std::uint64_t field, std::int64_t value) {
    return varint(field << 3U) + varint(static_cast<std::uint64_t>(value));
}

/// A field of bytes, a text or a message.
std::string block(std::uint64_t field, const std::string& bytes) {
    return varint(field << 3U | 2U) + varint(bytes.size()) + bytes;
}

template <class T>
std::string raw(const std::vector<T>& values) {
    std::string bytes(values.size() * sizeof(T), '\0');
    if (!values.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
    return bytes;
}

/// ValueInfoProto: name = 1, type = 2; TypeProto: tensor_type = 1; its elem_type = 1, shape = 2;
/// TensorShapeProto: dim = 1; its dim_value = 1, dim_param = 2.
std::string value_info(const std::string& name, int type, const std::vector<std::int64_t>& dims) {
    std::string shape;
    for (std::size_t i = 0; i < dims.size(); ++i)
        shape += block(1, dims[i] < 0 ? block(2, "free" + std::to_string(i)) : number(1, dims[i]));
    return block(1, name) + block(2, block(1, number(1, type) + block(2, shape)));
}

/// AttributeProto: name = 1, i = 3, ints = 8, type = 20 (2 INT, 7 INTS).
std::string attribute_text(const OnnxAttribute& attribute) {
    std::string text = block(1, attribute.name);
    for (const std::int64_t value : attribute.ints) text += number(attribute.list ? 8 : 3, value);
    return text + number(20, attribute.list ? 7 : 2);
}

}  // namespace

OnnxGraph& OnnxGraph::input(const std::string& name, int type,
                            const std::vector<std::int64_t>& dims) {
    inputs_ += block(11, value_info(name, type, dims));
    return *this;
}

OnnxGraph& OnnxGraph::output(const std::string& name, int type,
                             const std::vector<std::int64_t>& dims) {
    outputs_ += block(12, value_info(name, type, dims));
    return *this;
}

/// TensorProto: dims = 1, data_type = 2, name = 8, raw_data = 9.
OnnxGraph& OnnxGraph::tensor(const std::string& name, int type,
                             const std::vector<std::int64_t>& dims, const std::string& bytes) {
    std::string text;
    for (const std::int64_t dim : dims) text += number(1, dim);
    tensors_ += block(5, text + number(2, type) + block(8, name) + block(9, bytes));
    return *this;
}

OnnxGraph& OnnxGraph::floats(const std::string& name, const std::vector<std::int64_t>& dims,
                             const std::vector<float>& values) {
    return tensor(name, kOnnxFloat, dims, raw(values));
}

OnnxGraph& OnnxGraph::whole(const std::string& name, const std::vector<std::int64_t>& values) {
    return tensor(name, kOnnxInt64, {static_cast<std::int64_t>(values.size())}, raw(values));
}

/// NodeProto: input = 1, output = 2, op_type = 4, attribute = 5.
OnnxGraph& OnnxGraph::node(const std::string& op, const std::vector<std::string>& inputs,
                           const std::string& output,
                           const std::vector<OnnxAttribute>& attributes) {
    std::string text;
    for (const std::string& name : inputs) text += block(1, name);
    text += block(2, output) + block(4, op);
    for (const OnnxAttribute& attribute : attributes) text += block(5, attribute_text(attribute));
    nodes_ += block(1, text);
    return *this;
}

/// ModelProto: ir_version = 1, graph = 7, opset_import = 8 (its version = 2); GraphProto: node = 1, name = 2,
/// initializer = 5, input = 11, output = 12.
std::string OnnxGraph::file() const {
    const std::string graph = nodes_ + block(2, "graph") + tensors_ + inputs_ + outputs_;
    return number(1, 7) + block(7, graph) + block(8, number(2, 13));
}

void OnnxGraph::save(const std::string& path) const {
    std::ofstream stream(path, std::ios::binary);
    stream << file();
}

}  // namespace splat::test
