#pragma once

#include <splat.h>

#include <cmath>
#include <string>

#include "vkrun/cli/html_page.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/picture.h"
#include "vkrun/cli/stopwatch.h"
#include "vkrun/train/tensorboard.h"

namespace vkrun {

/// Shows a fit and adds to its folder: lines or a progress bar on standard error, tb/ for TensorBoard, renders/ with
/// photographs that are held out, what was drawn of them and the error, and report.html. Pictures and page are made
/// anew at validations, while they take less than a hundredth of the time, and at the end.
class FitView {
  public:
    /// `folder` holds the run. Throws a Failure.
    explicit FitView(std::string folder);

    void show(const splat_run_event& event);
    /// The page of a fit that has ended, also with an error; it turns scene.ply where that is there.
    void finish();

    /// What a fit that has ended says of itself.
    [[nodiscard]] Json summary(splat_run run, splat_scene scene, const splat_run_event& last) const;

  private:
    void show_step(const splat_run_event& event);
    void show_validation(const splat_run_event& event);
    void show_bar(const splat_run_event& event, double ms, const std::string& left);
    void write_page(bool running);

    std::string folder_;
    TensorBoard board_;
    bool bar_;                          ///< standard error is a terminal
    double psnr_ = std::nan("");        ///< latest one of photographs that are held out
    double seconds_ = 0;                ///< time of this session's steps
    double measured_ = 0;               ///< the same without the first one
    double first_fraction_ = -1;        ///< share of the fit that was done before
    PhotoSheet sheet_;                  ///< pictures of the validation that goes on
    unsigned long long validated_ = 0;  ///< step of the latest validation
    bool sheet_saved_ = true;
    Stopwatch watch_;
    double spent_ = 0;  ///< seconds for pictures and pages
};

/// Throws a Failure where a fit, or the scoring of a scene, was not opened: of bad data for what is read, of usage for
/// the rest.
void check_opened(splat_result opened);

/// Adds the scene that a fit made to a page; nothing if there is none. `config` is that of the run. Throws a Failure.
void add_fitted_scene(HtmlPage& page, const std::string& folder, const Json& config);

/// Adds a scene to a page, seen from where the photographs in `data` were taken. Throws a Failure.
void add_scene_of_photographs(HtmlPage& page, splat_scene scene, const std::string& data,
                              bool transforms, bool white);

}  // namespace vkrun
