#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"

/// Numerical stability by cases: a case is one computation on one kind of input. Each of its results is a row
/// for each set of kernels: how far it lies from float64, and how far it may.
namespace vkrun::stress {

/// One rounding of float32: half a unit in the last place of 1.
constexpr double kRounding = 0x1p-24;

/// A tensor in float64, and how far float32 may lie from it.
struct Expected {
    std::vector<double> value;
    std::vector<double> allowed;  ///< absolute, of each element
    /// The largest number that summing up an element meets; empty: `value`. Where float32 cannot hold it, a
    /// result must be infinite or right.
    std::vector<double> largest;
    /// What a device may give instead, and how far float32 may lie from that; empty: the same. It may flush denormal
    /// inputs to zero, or decide otherwise whether a Gaussian that ends at the rim of the image is in it.
    std::vector<double> other{};
    std::vector<double> other_allowed{};
};

/// What a comparison found.
struct Verdict {
    double error = 0;  ///< error of the element that is nearest to its bound or farthest beyond it
    double allowed = 0;  ///< bound of that element; both relative to the largest expected magnitude
    std::size_t elements = 0;
    std::size_t non_finite = 0;  ///< NaN or infinite where float32 has a value
    std::size_t wrong = 0;       ///< finite, but beyond the bound
    std::size_t unequal = 0;     ///< other bits in a second run
    std::size_t unjudged = 0;    ///< float64 has no value

    [[nodiscard]] bool passed() const { return non_finite + wrong + unequal + unjudged == 0; }
    /// error / allowed; above 1 is beyond the bound.
    [[nodiscard]] double ratio() const;
};

Verdict judge(const std::vector<float>& got, const Expected& expected);

/// A number that fails as first element.
float beyond_bound(const Expected& expected);

/// Row::peer of what float32 gives elsewhere.
double peer_error(const std::vector<float>& got, const Expected& expected);

/// Elements whose bits differ.
std::size_t count_unequal(const std::vector<float>& a, const std::vector<float>& b);

struct Row {
    std::string group;    ///< "ops", "raster", "model" or "train"
    std::string name;     ///< name of the case, such as "silu/magnitude_1e30"
    std::string input;    ///< in words
    std::string result;   ///< "y", "grad_x"
    std::string kernels;  ///< "plain", "cpu" or "gpu"
    std::string reason;   ///< reason for the bound
    Verdict verdict{};
    /// The same figure of float32 elsewhere (PyTorch, the published formulas): infinite where that is not finite,
    /// NaN if there is none.
    double peer = std::numeric_limits<double>::quiet_NaN();

    [[nodiscard]] std::string reproduce() const;
};

/// On purpose, in the first element of each result: to see that a wrong result fails.
enum class Fault { kNone, kWorse, kNan };

struct KernelDevice {
    std::string kernels;
    Device device;
};

struct Options {
    std::string device = "best";
    std::string only;    ///< a case, or the first parts of the names of several; empty: all
    std::string python;  ///< the peer's interpreter; empty: no peer
    bool quick = false;
    Fault fault = Fault::kNone;
    /// Only a few cases, with the device's own kernels, for the hashes of their bits.
    bool hashes = false;
};

/// What cases share: devices, and the rows found so far.
class Run {
  public:
    explicit Run(Options options);

    [[nodiscard]] const Options& options() const { return options_; }
    [[nodiscard]] bool quick() const { return options_.quick; }
    /// One for each set of kernels that this device runs.
    [[nodiscard]] const std::vector<KernelDevice>& devices() const { return devices_; }
    /// True if `--case` names this case or a group of cases that it is in.
    [[nodiscard]] bool wants(const std::string& name) const;

    /// Compares `got` with float64 and `again`, a second run, with `got`.
    void add(Row row, std::vector<float> got, const std::vector<float>& again,
             const Expected& expected);
    void add(Row row) { rows_.push_back(std::move(row)); }
    [[nodiscard]] const std::vector<Row>& rows() const { return rows_; }
    /// `compute` for a case and a set of kernels; a note where the device is too small for it.
    void unless_refused(const std::string& what, const std::function<void()>& compute);
    /// What was not run, and why.
    void note(const std::string& sentence) { notes_.push_back(sentence); }
    [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }
    /// Hash of each result added so far, by case and result.
    [[nodiscard]] const std::map<std::string, std::uint64_t>& hashes() const { return hashes_; }

  private:
    Options options_;
    std::vector<KernelDevice> devices_;
    std::vector<Row> rows_;
    std::vector<std::string> notes_;
    std::map<std::string, std::uint64_t> hashes_;
};

void stress_ops(Run& run);
void stress_raster(Run& run);
/// Meshes; a part of stress_raster().
void stress_triangles(Run& run);
void stress_model(Run& run);
void stress_train(Run& run);
/// The bits of a few cases of each kind, computed by other processes with 0, 1 and 4 threads of the software driver.
void stress_threads(Run& run);

/// A line for each case, that of its worst row, and one for each row that fails.
std::string stress_table(const std::vector<Row>& rows);
Json stress_json(const std::vector<Row>& rows);
/// An SVG file: each row's error over what it may be, both logarithmic.
std::string stress_svg(const std::vector<Row>& rows, const std::string& title);

/// Run time against error: a network by precision, the rasterizer by skip, each with every set of kernels.
std::string tradeoff_svg(Run& run, const std::string& title);

/// kNotFinite, kGateMissed or kSuccess.
ExitCode exit_code_of(const std::vector<Row>& rows);

}  // namespace vkrun::stress
