#pragma once

#include "api/api_guard.h"
#include "run/run.h"

namespace splat::api {

/// Where a run lies and whether it is new, from the folder and the flags of a task's struct, of which `resume` and
/// `overwrite` are the bits. Errors: kInvalidArgument for no folder or both flags.
template <class Desc>
Result<run::RunDesc> run_desc_of(const Desc& given, std::uint32_t resume, std::uint32_t overwrite) {
    using Mode = run::RunFolder::Mode;
    const std::string type = kStructName<Desc>;
    SPLAT_TRY(require(given.folder, (type + ".folder").c_str()));
    const bool resumes = (given.flags & resume) != 0, overwrites = (given.flags & overwrite) != 0;
    if (resumes && overwrites)
        return invalid("%s.flags ask to resume the run and to overwrite it, expected one of them",
                       type.c_str());
    const Mode mode = resumes ? Mode::kResume : overwrites ? Mode::kReplace : Mode::kNew;
    return run::RunDesc{given.folder, mode, splat_version_string()};
}

}  // namespace splat::api
