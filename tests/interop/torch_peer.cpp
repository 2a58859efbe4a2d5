// The part of lpips.py and cars.py that runs the library.
//
//   torch_peer lpips INPUT.npz OUTPUT.npz WEIGHTS...    render, target [N,3,R,R] and grad [N,1] to value
//                                                       [N,1] and grad_render [N,3,R,R]
//   torch_peer predict INPUT.npz OUTPUT.npz WEIGHTS     images [N,3,R,R], v2w [N,4,4] and quaternion
//                                                       [N,4] of N objects to the predictions of the cars
//                                                       model; prints the seconds of loading
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "io/weights_file.h"
#include "model/lpips_net.h"
#include "model/weights.h"
#include "vk/context.h"

namespace {

using namespace splat;

void fail(const std::string& problem) {
    std::fprintf(stderr, "torch_peer: %s\n", problem.c_str());
    std::exit(1);
}

void check(const Status& status) {
    if (!status.ok()) fail(status.message());
}

template <class T>
T value_or_exit(Result<T> result) {
    check(result.status());
    return std::move(result.value());
}

struct Files {
    io::WeightsFile input;
    io::WeightsFile output;

    [[nodiscard]] const io::NamedTensor& get(const char* name) const {
        const io::NamedTensor* tensor = input.tensors.find(name);
        if (tensor == nullptr) fail(std::string("the input has no array ") + name);
        return *tensor;
    }
    void put(const char* name, const Shape& shape, std::vector<float> values) {
        std::vector<std::int64_t> dims;
        for (std::uint32_t i = 0; i < shape.rank(); ++i) dims.push_back(shape[i]);
        check(output.tensors.add({name, std::move(dims), io::NumberType::kF32, std::move(values)}));
    }
};

std::vector<float> read(vk::Context& context, const vk::BufferView& view) {
    std::vector<float> values(view.shape.elements());
    check(context.read(view, values.data(), values.size() * sizeof(float)));
    return values;
}

void write(vk::Context& context, const vk::BufferView& view, const io::NamedTensor& tensor) {
    if (view.shape.elements() != tensor.values.size()) fail(tensor.name + " has another size");
    check(context.write(view, tensor.values.data(), tensor.values.size() * sizeof(float)));
}

void lpips(vk::Context& context, Files& files, const std::vector<std::string>& paths) {
    std::vector<io::WeightsFile> loaded;
    for (const std::string& path : paths) loaded.push_back(value_or_exit(io::load_weights(path)));
    std::vector<const io::NamedTensors*> weights;
    for (const io::WeightsFile& file : loaded) weights.push_back(&file.tensors);
    const io::NamedTensor& render = files.get("render");
    model::LpipsDesc desc;
    desc.images = static_cast<std::uint32_t>(render.dims.at(0));
    desc.side = static_cast<std::uint32_t>(render.dims.at(2));
    const auto net = value_or_exit(model::LpipsNet::create(context, desc, weights));
    write(context, net->render(), render);
    write(context, net->target(), files.get("target"));
    check(net->forward());
    files.put("value", net->values().shape, read(context, net->values()));
    write(context, net->value_gradients(), files.get("grad"));
    check(net->backward());
    files.put("grad_render", net->render_gradient().shape, read(context, net->render_gradient()));
}

void predict(vk::Context& context, Files& files, const std::string& path) {
    const io::NamedTensor& images = files.get("images");
    model::ModelOptions options;
    options.objects = static_cast<std::uint32_t>(images.dims.at(0));
    const auto model = value_or_exit(model::Model::create(context, {}, options));
    const auto start = std::chrono::steady_clock::now();
    const io::WeightsFile weights = value_or_exit(io::load_weights(path));
    model::LoadReport report;
    check(model::load_state(*model, weights.tensors, {}, report));
    const std::chrono::duration<double> loading = std::chrono::steady_clock::now() - start;
    std::printf("%.2f\n", loading.count());
    check(model->set_input({.images = images.values,
                            .view_to_world = files.get("v2w").values,
                            .quaternions = files.get("quaternion").values,
                            .focals = {},
                            .embedding = {},
                            .tokens = {}}));
    check(model->forward());
    const auto outputs = model->outputs().value();
    files.put("xyz", outputs.means.shape, read(context, outputs.means));
    files.put("opacity", outputs.opacities.shape, read(context, outputs.opacities));
    files.put("scaling", outputs.scales.shape, read(context, outputs.scales));
    files.put("rotation", outputs.rotations.shape, read(context, outputs.rotations));
    files.put("sh", outputs.sh.shape, read(context, outputs.sh));
}

}  // namespace

int main(int argc, char** argv) {
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    if (arguments.size() < 4) fail("expected lpips or predict, INPUT, OUTPUT and WEIGHTS");
    const std::shared_ptr<vk::Context> context = value_or_exit(vk::Context::create({}));
    Files files;
    files.input = value_or_exit(io::load_weights(arguments[1]));
    if (arguments[0] == "lpips")
        lpips(*context, files, {arguments.begin() + 3, arguments.end()});
    else
        predict(*context, files, arguments[3]);
    check(io::save_weights(files.output, arguments[2], false));
    return 0;
}
