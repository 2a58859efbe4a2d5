// The times of a network's passes as JSON and as tables.

#include "bench/model/model_report.h"

#include <cstdio>
#include <memory>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/table.h"
#include "vkrun/cli/text.h"

namespace vkrun::bench {
namespace {

const char* precision_name(splat_precision precision) {
    return precision == SPLAT_PRECISION_STRICT ? "strict"
           : precision == SPLAT_PRECISION_FAST ? "fast"
                                               : "balanced";
}

Json times_json(const PassTimes& times, double gflop) {
    if (times.times_ms.empty()) return nullptr;
    Json json;
    json["first_ms"] = times.first_ms;
    json["second_ms"] = times.second_ms;
    json["min_ms"] = times.min_ms();
    json["median_ms"] = times.median_ms();
    json["gflop_per_s"] = gflop > 0 ? Json(gflop / times.min_ms() * 1e3) : Json(nullptr);
    json["times_ms"] = times.times_ms;
    return json;
}

Json memory_json(splat_device device) {
    auto memory = sized<splat_memory_info>();
    check(splat_device_get_memory(device, &memory));
    Json json;
    json["used"] = memory.used_bytes;
    json["live"] = memory.live_bytes;
    json["peak"] = memory.peak_bytes;
    json["budget"] = memory.budget_bytes;
    return json;
}

/// Add the figures of one kind of pass under its key, those of the peer under "peer".
void add_pass(Json& json, const char* key, ModelRun& run, ModelPeer* peer,
              const ModelBenchOptions& options) {
    const bool step = std::string(key) == "forward_backward";
    const PassMeasurement measured = measure_pass(run, peer, step, options.rounds);
    const bool in_part = run.report().at("config").contains("opt");
    const double forward = json.at("gflop").get<double>();
    const double gflop = !step ? forward : in_part ? 0 : 3 * forward;
    json[key] = times_json(measured.ours, gflop);
    json[key]["bytes"] = run.report().at("bytes");
    json[key]["create_ms"] = run.create_ms();
    json[key]["init_ms"] = run.init_ms();
    if (peer == nullptr) return;
    json["peer"][key] = times_json(measured.peer, gflop);
    json[std::string("ratio_") + key] = measured.peer.min_ms() / measured.ours.min_ms();
}

void describe(Json& json, const ModelRun& run, const ModelBenchOptions& options) {
    json["config"] = run.report().at("config");
    json["precision"] = precision_name(options.precision);
    json["objects"] = options.objects;
    json["parameters"] = run.report().at("parameters");
    json["trainable"] = run.report().at("trainable");
    json["gflop"] = run.gflop();
    for (const char* key : {"forward", "forward_backward", "peer", "ratio_forward",
                            "ratio_forward_backward", "profile", "lists"})
        json[key] = nullptr;
}

void add_row(Table& table, const char* pass, const char* who, const Json& times,
             const Json& ratio) {
    if (times.is_null()) return;
    const auto text = [&](const char* key) {
        return times.at(key).is_null() ? "" : format("%.2f", times.at(key).get<double>());
    };
    table.add({std::string("  ") + pass, who, text("first_ms"), text("second_ms"), text("min_ms"),
               text("median_ms"), text("gflop_per_s"),
               ratio.is_null() ? "" : format("%.3f", ratio.get<double>())});
}

}  // namespace

void measure_passes(Json& json, splat_device device, const ModelBenchOptions& options) {
    std::unique_ptr<ModelPeer> peer;
    for (const bool step : {false, true}) {
        if (step && !options.backward) return;
        ModelBenchOptions made = options;
        made.backward = step;
        ModelRun run(device, made);
        if (!step) {
            describe(json, run, options);
            if (options.with_peer) {
                const Json config = run.report().at("config");
                peer =
                    start_torch(options.peer, peer_command(options.peer, config, options.objects));
                json["peer"] = peer->about();
                json["peer"]["forward"] = json["peer"]["forward_backward"] = nullptr;
            }
        }
        add_pass(json, step ? "forward_backward" : "forward", run, peer.get(), options);
        json["memory"] = memory_json(device);
        if (!options.profile) continue;
        check(splat_device_profile_reset(device));
        step ? run.step() : run.forward();
        const Json profile = library_json(splat_device_profile_json, device);
        json["profile"] = profile.at("ops");
        json["lists"][step ? "forward_backward" : "forward"] = profile.at("lists");
    }
}

void print_peer(const Json& peer) {
    const auto text = [&](const char* key) { return peer.at(key).get<std::string>(); };
    const auto flag = [&](const char* key) { return peer.at(key).get<bool>() ? "on" : "off"; };
    std::printf("peer: PyTorch %s, ", text("torch").c_str());
    if (text("device") == "cuda")
        std::printf("%s, CUDA %s, TF32 %s, graphs %s", text("name").c_str(), text("cuda").c_str(),
                    flag("tf32"), flag("graphs"));
    else
        std::printf("%d threads, %s, instructions %s", peer.at("threads").get<int>(),
                    text("blas").c_str(), text("isa").c_str());
    std::printf(", %s\n", text("layout").c_str());
}

void print_passes(const Json& json) {
    const Json& memory = json.at("memory");
    const auto bytes = [&](const char* key) {
        return bytes_text(memory.at(key).get<unsigned long long>());
    };
    const auto count = [&](const char* key) { return json.at(key).get<unsigned long long>(); };
    std::printf(
        "%llu parameters, %llu of them trained; %.3f GFLOP forward; precision %s; %llu objects\n",
        count("parameters"), count("trainable"), json.at("gflop").get<double>(),
        json.at("precision").get<std::string>().c_str(), count("objects"));
    for (const char* key : {"forward", "forward_backward"}) {
        const Json& pass = json.at(key);
        if (pass.is_null()) continue;
        const auto size = [&](const char* of) {
            return bytes_text(pass.at("bytes").at(of).get<unsigned long long>());
        };
        std::printf(
            "%s: created in %.1f ms, started at random in %.1f ms; activations %s, "
            "prepared weights %s\n",
            key, pass.at("create_ms").get<double>(), pass.at("init_ms").get<double>(),
            size("activations").c_str(), size("prepared").c_str());
    }
    std::printf("device memory: %s, at most %s of %s\n", bytes("used").c_str(),
                bytes("peak").c_str(), bytes("budget").c_str());
    const Json& peer = json.at("peer");
    if (!peer.is_null()) print_peer(peer);
    Table table({"  pass", "who", ">first ms", ">second ms", ">min ms", ">median ms", ">GFLOP/s",
                 ">ratio"});
    for (const auto& [key, pass] :
         {std::pair{"forward", "forward"}, std::pair{"forward_backward", "forward + backward"}}) {
        add_row(table, pass, "libsplat", json.at(key), json.at(std::string("ratio_") + key));
        if (!peer.is_null()) add_row(table, pass, "peer", peer.at(key), nullptr);
    }
    std::printf("%s", table.text().c_str());
}

}  // namespace vkrun::bench
