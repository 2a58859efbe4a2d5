#pragma once

#include <map>
#include <string>
#include <vector>

namespace vkrun {

/// Scores of objects: metric -> name of the object -> value. A value that is not finite is left out.
struct ScoreFile {
    std::string path;
    std::size_t objects = 0;
    std::vector<std::string> metrics;  ///< "psnr", "ssim", "lpips", those that the file has
    std::map<std::string, std::map<std::string, double>> values;
};

/// Read per_object.csv or scores.txt ("index_name psnr ssim lpips") of an evaluation; a folder, or
/// results.json, stands for the per_object.csv in the same folder. Throws a Failure that names file
/// and line if the file is neither, a number is malformed, or an object occurs twice.
ScoreFile read_scores(const std::string& path);

/// Scores of one metric in A and B; if paired, of the same objects in the same order.
struct MetricSamples {
    std::string metric;
    std::vector<double> a;
    std::vector<double> b;
};

/// Samples of each metric that both files have, unless they share no object with it.
std::vector<MetricSamples> samples_of(const ScoreFile& a, const ScoreFile& b,
                                      bool unpaired = false);

}  // namespace vkrun
