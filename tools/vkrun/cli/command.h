#pragma once

namespace CLI {
class App;
}

namespace vkrun {

/// Each adds one command to the command line; the command leaves its status in `exit_code`. The order is that
/// of the help, in which a user meets the commands.
void add_doctor(CLI::App& app, int& exit_code);
void add_devices(CLI::App& app, int& exit_code);
void add_predict(CLI::App& app, int& exit_code);
void add_demo(CLI::App& app, int& exit_code);
void add_render(CLI::App& app, int& exit_code);
void add_view(CLI::App& app, int& exit_code);
void add_inspect(CLI::App& app, int& exit_code);
void add_convert(CLI::App& app, int& exit_code);
void add_data(CLI::App& app, int& exit_code);
void add_fit(CLI::App& app, int& exit_code);
void add_train(CLI::App& app, int& exit_code);
void add_config(CLI::App& app, int& exit_code);
void add_eval(CLI::App& app, int& exit_code);
void add_compare(CLI::App& app, int& exit_code);
void add_report(CLI::App& app, int& exit_code);
void add_priors(CLI::App& app, int& exit_code);
void add_weights(CLI::App& app, int& exit_code);
void add_completion(CLI::App& app, int& exit_code);

/// Commands of vkrun-bench, with the sentences under which vkrun lists them.
constexpr const char* kBenchSentence = "Measure speed and error on this machine.";
constexpr const char* kStressSentence =
    "Compare results with float64 on inputs that are hard for float32.";
void add_bench(CLI::App& app, int& exit_code);
void add_stress(CLI::App& app, int& exit_code);

/// Below `data`.
void add_data_synth(CLI::App& data, int& exit_code);
void add_data_render(CLI::App& data, int& exit_code);
void add_data_check(CLI::App& data, int& exit_code);
void add_data_co3d(CLI::App& data, int& exit_code);
void add_data_tokens(CLI::App& data, int& exit_code);
void add_data_show(CLI::App& data, int& exit_code);
void add_data_import(CLI::App& data, int& exit_code);
void add_data_export(CLI::App& data, int& exit_code);
void add_data_split(CLI::App& data, int& exit_code);

/// Below `priors`.
void add_priors_eval(CLI::App& priors, int& exit_code);
void add_priors_make(CLI::App& priors, int& exit_code);
void add_priors_points(CLI::App& priors, int& exit_code);
void add_priors_where(CLI::App& priors, int& exit_code);
void add_priors_get(CLI::App& priors, int& exit_code);

/// Below `weights`: where published ones are had, and the commands that need a network.
void add_weights_published(CLI::App& weights, int& exit_code);
void add_weights_model(CLI::App& weights, int& exit_code);

/// Below `bench`.
void add_bench_ops(CLI::App& bench, int& exit_code);
void add_bench_raster(CLI::App& bench, int& exit_code);
void add_bench_model(CLI::App& bench, int& exit_code);
void add_bench_start(CLI::App& bench, int& exit_code);
void add_bench_dispatch(CLI::App& bench, int& exit_code);

}  // namespace vkrun
