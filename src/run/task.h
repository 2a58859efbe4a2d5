#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "core/json_tree.h"
#include "core/json_writer.h"
#include "io/weights_file.h"

namespace splat::run {

/// A number by the name that it has in metrics.jsonl.
struct Number {
    const char* name = "";  ///< lives as long as the process
    double value = 0;
    bool is_flag = false;  ///< true or false in JSON
};
using Numbers = std::vector<Number>;

void add_members(JsonWriter& json, const Numbers& numbers);

/// The member "ledger" of a report: what was drawn and finite in a step, or null.
void add_ledger(JsonWriter& json, const std::optional<Numbers>& ledger);

/// A line of log.txt.
struct Message {
    std::string text;
    bool warning = false;
};
using Messages = std::deque<Message>;

/// What a run must know of its task.
struct Plan {
    std::string config;            ///< text of config.json
    std::uint64_t iterations = 0;  ///< steps of the whole run
    /// Steps between lines of metrics.jsonl, validations and states; 0: none of these.
    std::uint64_t log_every = 0, validate_every = 0, save_every = 0;
    std::uint32_t pieces = 0;  ///< pieces of a validation; 0: there is none
    /// Members of a validation's line: scores of validations with other ones are not compared.
    Numbers protocol;
    std::string protocol_text;         ///< what it counts, after "other"
    std::string score;                 ///< what Validation::psnr is called in messages
    std::vector<std::string> results;  ///< names of results()
    /// What to do about many steps in a row that are not finite, or that drew nothing.
    std::string if_not_finite, if_not_drawn;
    std::string if_interrupted;  ///< how a run goes on
};

struct Progress {
    std::uint64_t steps = 0;     ///< updates done
    std::uint64_t attempts = 0;  ///< steps that ran to their end, with the skipped ones
};

enum class Outcome {
    kUpdated,
    kSkipped,      ///< the loss or gradients are not finite: nothing was updated
    kDrewNothing,  ///< updated, though nothing was drawn
};

/// What one step did. The line of metrics.jsonl has the loss, the numbers, those of the run, the terms and the ledger.
struct Step {
    Outcome outcome = Outcome::kUpdated;
    const char* why = "";  ///< nothing was drawn
    std::string notice;    ///< a warning; empty: none
    double loss = 0;
    Numbers numbers;
    Numbers terms;                 ///< terms of the loss
    Numbers ledger;                ///< what was drawn and finite; also in run.json
    Progress progress;             ///< with this step
    std::uint64_t peak_bytes = 0;  ///< most device memory until then
};

/// One piece of a validation, such as an object.
struct Piece {
    std::string name;
    Numbers scores;
    std::vector<float> images, truths;  ///< drawn and true, [views,3,height,width]
    std::uint32_t views = 0;
    std::uint32_t inputs = 0;  ///< how many of the views, the first ones, the task has seen
    std::uint32_t width = 0, height = 0;
};

/// What a validation found.
struct Validation {
    double psnr = 0;  ///< decides which results are the best; NaN without a score
    Numbers scores;   ///< for the line of metrics.jsonl
    Numbers more;     ///< only for the event
    std::string text;
};

/// A small file of a run's folder.
struct NamedText {
    const char* name = "";
    std::string text;
};

struct NamedWeights {
    std::string name;
    io::WeightsFile file;
};

/// A file of a run's folder, where it lies or where rank 0 has it.
struct ReadText {
    std::string path, text;
};

/// What ranks compare before the first step.
struct RankFacts {
    std::vector<std::pair<std::string, std::string>>
        equal;           ///< name and value, the same on all ranks
    std::string device;  ///< another one on a rank is a warning
};

/// What a run does, step by step. A Run calls prepare(), then start() or compare() and load(), then begin(), and then
/// the others. What fails is tried again by the same call.
class Task : NoCopy {
  public:
    virtual ~Task() = default;

    /// Check everything that needs no state. `config`: the run's configuration, for one that is resumed.
    virtual Result<Plan> prepare(const ReadText* config, Messages& messages) = 0;
    /// What the ranks of a run must have alike, after prepare(): configuration and data.
    virtual Result<RankFacts> facts() { return RankFacts(); }
    /// Begin before the first step.
    virtual Status start(Messages& messages) = 0;
    /// Take over from a run.json, which `path` names, what start() depends on. Errors: kFormat if it does not say.
    virtual Status recall(const JsonTree& run_json, const std::string& path) = 0;
    /// Refuse what the steps depend on if it differs from the run's, as far as its run.json tells. Errors:
    /// kInvalidArgument.
    virtual Status compare(const JsonTree& run_json, Messages& messages) = 0;
    /// Go on from a state, bit by bit. All or nothing.
    virtual Status load(const io::WeightsFile& state) = 0;
    /// Check and prepare the first steps.
    virtual Status begin() = 0;

    /// Do one step or more, at most `most`, and add them to `done` in order; after an error those before it.
    virtual Status step(std::uint64_t most, std::deque<Step>& done) = 0;
    /// Begin a validation of results(), which live until its end.
    virtual Status begin_validation(const std::vector<NamedWeights>& results) = 0;
    /// The pieces come in order. The latest one comes again if the run could not take what was done.
    virtual Status validate(std::uint32_t piece, Piece& done) = 0;
    [[nodiscard]] virtual Validation validation() const = 0;  ///< after its last piece

    /// Everything that the next step depends on.
    virtual Result<io::WeightsFile> state() = 0;
    virtual Result<std::vector<NamedWeights>> results() = 0;
    /// What the folder also gets with each state.
    virtual Result<std::vector<NamedText>> texts() { return std::vector<NamedText>(); }

    [[nodiscard]] virtual Progress progress() const = 0;
    [[nodiscard]] virtual std::uint64_t peak_bytes() const = 0;  ///< most device memory so far
    /// The sentence of log.txt about a session that begins.
    [[nodiscard]] virtual std::string headline(const std::string& folder) const = 0;
    /// The task's members of run.json.
    virtual void describe(JsonWriter& json) const = 0;
};

}  // namespace splat::run
