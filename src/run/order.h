#pragma once

#include <functional>
#include <string>
#include <vector>

#include "io/weights_file.h"
#include "run/group.h"
#include "run/task.h"

namespace splat::run {

/// What rank 0 has the other ranks do. After all but the last two, all ranks agree on a status.
struct Order {
    enum class What : std::uint32_t {
        kPrepare,  ///< texts: path and text of the configuration of a run that is resumed, or none
        kCompare,  ///< texts: RankFacts::equal of rank 0, names and values in turn
        kStart,    ///< texts: path and text of the run.json to recall(), or none
        kLoad,     ///< a state follows
        kBegin,    ///< texts: checksum of what start() began with, or none after a state
        kOpen,     ///< nothing: rank 0 makes the folder
        kStep,     ///< number: most steps
        kWait,     ///< nothing: rank 0 has done a piece of work of its own
        kEnd,      ///< code: an EventKind; texts: its text
        kFail,     ///< code: a Code; texts: its sentence
    };
    What what = What::kWait;
    std::int32_t code = 0;
    std::uint64_t number = 0;
    std::vector<std::string> texts = {};
};

/// Tell it on rank 0, hear it on others.
Status broadcast(Group& group, Order& order);
/// Give the state of rank 0 to all. `given`: null on others.
Result<io::WeightsFile> broadcast(Group& group, const io::WeightsFile* given);

/// Refuse other versions of the library than rank 0's. Errors: kInvalidArgument, the same on all ranks.
Status compare_versions(Group& group, const std::string& mine);
/// Refuse facts that differ from rank 0's, in the texts of its order. Errors: kInvalidArgument, naming the first.
Status compare_facts(const RankFacts& mine, const std::vector<std::string>& first);
/// Returns a warning if a rank has another device than rank 0; else nothing.
Result<std::string> compare_devices(Group& group, const std::string& mine);

/// Do `work`; memory that runs out is an error, of which other ranks hear.
Status told(const std::function<Status()>& work);

/// Returns a checksum of what a task has before its first step.
Result<std::string> checksum_of(Task& task);

}  // namespace splat::run
