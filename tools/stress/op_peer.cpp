#include "stress/op_peer.h"

#include <algorithm>
#include <fstream>

#include "core/os/path.h"
#include "vkrun/cli/files.h"

namespace vkrun::stress {
namespace {

constexpr const char* kRemedy =
    "PyTorch is needed: `apt-get install python3-torch`; --python PROGRAM names another "
    "interpreter";

Json described(const std::vector<CaseTensor>& tensors, std::vector<float>& numbers) {
    Json json = Json::array();
    for (const CaseTensor& tensor : tensors) {
        json.push_back({{"name", tensor.name},
                        {"dims", tensor.dims},
                        {"constant", tensor.constant},
                        {"at", numbers.size()}});
        numbers.insert(numbers.end(), tensor.values.begin(), tensor.values.end());
    }
    return json;
}

}  // namespace

OpPeer::OpPeer(const std::string& python) {
    if (python.empty()) return;
    peer_ = std::make_unique<bench::ModelPeer>(
        std::vector<std::string>{python, bench::find_script("tools/bench/torch_ops.py"),
                                 folder_.path()},
        kRemedy);
}

PeerResults OpPeer::results_of(const OpCase& op_case) {
    if (!peer_) return {};
    const Json& known = peer_->about().at("ops");
    if (std::find(known.begin(), known.end(), Json(op_case.op)) == known.end()) return {};
    std::vector<float> numbers;
    Json json{{"op", op_case.op}, {"attributes", op_case.attributes}};
    json["inputs"] = described(op_case.inputs, numbers);
    json["outputs"] = described(op_case.outputs, numbers);
    write_text(folder_.file("case.json"), json.dump());
    write_text(folder_.file("case.f32"),
               {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(float)});
    peer_->run("run");
    PeerResults results;
    std::ifstream answer(splat::os::path_of(folder_.file("results.f32")), std::ios::binary);
    const auto take = [&](const std::string& name, std::size_t count) {
        std::vector<float> values(count);
        if (!answer.read(reinterpret_cast<char*>(values.data()),
                         static_cast<std::streamsize>(count * sizeof(float))))
            throw Failure(kFailed, "the peer wrote fewer numbers than '" + op_case.op + "' has");
        results[name] = std::move(values);
    };
    for (const CaseTensor& output : op_case.outputs) take(output.name, output.values.size());
    for (const CaseTensor& input : op_case.inputs)
        if (!input.constant && !input.dims.empty()) take("grad_" + input.name, input.values.size());
    return results;
}

}  // namespace vkrun::stress
