#pragma once

#include <optional>
#include <string>
#include <vector>

#include "vkrun/cli/html_page.h"
#include "vkrun/cli/json.h"
#include "vkrun/predict/network.h"

namespace vkrun {

struct PredictionOptions {
    std::vector<std::string> images;  ///< one, or the views of an object
    std::string mask, depth, normal;
    std::string embedding, tokens;        ///< files of one array
    std::string mask_model, mask_preset;  ///< network that makes the mask; may be empty
    std::string geometry;                 ///< preset or file of a network of geometry; may be empty
    std::string data, split = "test";
    std::uint32_t object = 0;
    std::string weights, config, adapters;
    std::string larger;           ///< "nearer", "farther"; empty: as the configuration says
    std::uint32_t aggregate = 0;  ///< further views that predictions are made from
    std::string convention = "3dgs";
    bool whole = false;
    std::optional<float> foreground;
    std::optional<double> focal;  ///< pixels; default: by the picture's Exif data
    std::optional<double> origin_distance;
    std::uint32_t views = 24;
    double elevation = 20;
    std::string true_depth;
    std::string out = "out";
    std::string device = "best";
};

/// The file of `weights`, which may name built-in ones ("cars64"); without it the built-in ones, those with depth and
/// normals where both are given. Throws a Failure.
std::string weights_of(const PredictionOptions& options);

/// Throws a usage Failure if the network of a configuration takes another number of pictures.
void check_pictures(const PredictionOptions& options, const Json& config);

/// Predict by a network on its device, draw, and write everything into options.out; the scene and the sheet also into a
/// page. Returns the facts: trained_for, gaussians, faint, not_finite, predict_ms, draw_ms, images, report, note
/// of the built-in weights on a picture, and with a truth psnr, ssim, novel_views, psnr_input, depth. Throws a Failure.
Json run_prediction(const PredictionOptions& options, splat_device device, const Network& network,
                    HtmlPage* also = nullptr);

}  // namespace vkrun
