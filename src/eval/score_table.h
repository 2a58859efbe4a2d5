#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "core/status.h"
#include "eval/image_table.h"

namespace splat::eval {

/// The names of scores, in the order of tables.
inline constexpr const char* kMetrics[] = {"psnr", "ssim", "lpips"};

/// Scores of objects: metric -> name of the object -> value. A value that is not finite is left out.
struct ScoreTable {
    std::string path;                  ///< empty for scores in memory
    std::set<std::string> objects;     ///< all objects, even without a finite score
    std::vector<std::string> metrics;  ///< names of kMetrics that have values
    std::map<std::string, std::map<std::string, double>> values;
    std::map<std::string, double> views;  ///< scored of each object, where the file tells
    std::string protocol;  ///< which views are scored, where objects.json beside the file tells
    ImageTable images;     ///< per_image.csv, if it is beside per_object.csv
};

/// Errors: kInvalidArgument if the scores of an object of both are known to be of different views.
Status check_same_views(const ScoreTable& a, const ScoreTable& b);

/// Read per_object.csv (RFC 4180; an empty score is none) or scores.txt ("index_name psnr ssim lpips") of an
/// evaluation; a folder, or results.json, stands for the per_object.csv in the same folder. Which views are scored
/// tells the column "views", and objects.json beside the file. Errors: those of read_image_scores() and
/// io::read_file; kFormat, naming file and line, if the file is neither, a line has other columns than the first, a
/// number is malformed, or an object occurs twice.
Result<ScoreTable> read_scores(const std::string& path);

/// A name as a column of scores.txt: white space, control characters and % as %XX. read_scores() decodes it.
std::string scores_name(const std::string& name);

/// Set the metrics of a table with values.
void list_metrics(ScoreTable& table);

/// Scores of one metric in A and B; if paired, of the same objects in the same order.
struct MetricSamples {
    std::string metric;
    std::vector<double> a;
    std::vector<double> b;
    /// Objects of both tables that have this score in the other one only; if any, the samples are a choice.
    std::size_t lacking_a = 0, lacking_b = 0;
};

/// Samples of each metric that both tables have, unless they share no object with it.
std::vector<MetricSamples> samples_of(const ScoreTable& a, const ScoreTable& b,
                                      bool unpaired = false);

}  // namespace splat::eval
