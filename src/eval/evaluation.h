#pragma once

#include <map>

#include "eval/scores.h"

namespace splat::eval {

/// The scores of a method on a data set, and what was scored.
struct Evaluation {
    std::string weights;                            ///< path; empty: weights in memory
    std::string network;                            ///< checksum of the weights; empty: a method
    std::string views;                              ///< views that are scored, and how
    std::string method;                             ///< empty: the network of the weights
    std::string format, split;                      ///< data set
    std::uint32_t data_objects = 0;                 ///< objects of the data set
    std::string device;                             ///< empty: none
    std::map<std::uint32_t, ObjectScores> objects;  ///< scored so far, by their number
};

/// Means and sums over the objects of an evaluation.
struct Summary {
    std::uint32_t objects = 0;
    Scores novel, conditioning;  ///< NaN if an object has numbers that are not finite
    std::uint32_t empty = 0;
    Ledger ledger;
    std::uint32_t objects_not_finite = 0;
    double predictions_per_second = 0;  ///< NaN for pictures of the caller, which are not timed
    double images_per_second = 0;
};

Summary summary_of(const Evaluation& evaluation);

/// The text of results.json, without a line end: summary, ledger, and the ledger of each object with
/// numbers that are not finite or blank images.
std::string results_text(const Evaluation& evaluation);

/// The text of per_object.csv: a heading and a line per object.
std::string table_text(const Evaluation& evaluation);

/// "index_name psnr ssim lpips" of novel views, as Splatter Image writes its scores.txt.
std::string scores_text(const Evaluation& evaluation);

/// Make a folder where it is missing, and write results.json, per_object.csv, per_image.csv, scores.txt and
/// objects.json, each whole or not at all. Errors: kIo; those of io::write_file.
Status save(const Evaluation& evaluation, const std::string& folder);

}  // namespace splat::eval
