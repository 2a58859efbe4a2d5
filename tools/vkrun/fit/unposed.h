#pragma once

#include <cstdint>
#include <string>

namespace vkrun {

/// Options of a fit that say where its photographs, cameras and masks are.
struct FitInput {
    std::string
        data;  ///< photographs with or without cameras, or a video; may be empty on resuming
    std::string out, masks, cameras;
    std::uint32_t frames = 120;  ///< how many are taken from a video
    bool frames_given = false;
    bool object = false, resume = false, overwrite = false;
};

/// The folder of the photographs of DATA: images/ if it has some, else DATA.
std::string photos_of(const std::string& data);

/// Make what a fit of photographs without cameras, or of a video, needs, and the masks of --object. In OUT, the first
/// of it last:
///
///   data/          sparse/0 and images, a link: what is fitted
///   masks/mask/    masks of the photographs
///   colmap/, colmap.log, photos/ (frames of a video)
///   prepared.json  of what and how, and which stages are done, which a repeated command leaves out
///
/// Changes the input to that of the fit: data, masks, object (of a resumed one). Input with cameras and without
/// --object stays as it is. Refuses to resume what was interrupted before its run began, which the same command goes on
/// with. Removes config.json and run.json of a run that is replaced, so that nothing resumes it. Throws a Failure with
/// what to do.
void prepare_input(FitInput& input);

/// Note in OUT's prepared.json, if there is one, whether the run that has begun keeps the object alone.
void note_begun(const FitInput& input);

}  // namespace vkrun
