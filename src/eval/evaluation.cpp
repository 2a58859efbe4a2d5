#include "eval/evaluation.h"

#include <cerrno>
#include <cmath>

#include "core/os/file.h"
#include "eval/csv_table.h"
#include "eval/json_number.h"
#include "eval/saved_objects.h"
#include "eval/score_table.h"
#include "io/file.h"

namespace splat::eval {
namespace {

double rate_of(double count, double seconds) {
    return seconds > 0 ? count / seconds : std::numeric_limits<double>::quiet_NaN();
}

void write_scores(const Scores& scores, JsonWriter& json) {
    json.begin_object();
    for (const auto& [name, mean] : kScoreMeans)
        write_number(json.newline(4).key(name), scores.*mean);
    json.newline(4).member("views", scores.views);
    json.newline(4).member("perfect_views", scores.perfect).newline(2).end();
}

void write_ledger(const Ledger& ledger, int indent, JsonWriter& json) {
    for (const auto& [name, count] : kLedgerCounts)
        json.newline(indent).member(name, ledger.*count);
}

/// The ledger of all objects, then those of each object that is not as it should be.
void write_ledgers(const Evaluation& evaluation, const Summary& summary, JsonWriter& json) {
    json.newline(2).key("ledger").begin_object();
    write_ledger(summary.ledger, 4, json);
    json.newline(4).key("objects").begin_array();
    bool any = false;
    for (const auto& [index, object] : evaluation.objects) {
        const Ledger& ledger = object.ledger;
        if (ledger.finite() && ledger.images_blank == 0) continue;
        any = true;
        json.newline(6).begin_object().newline(8).member("object", object.name);
        write_ledger(ledger, 8, json);
        json.newline(6).end();
    }
    if (any) json.newline(4);
    json.end().newline(2).end();
}

JsonWriter& text_or_null(JsonWriter& json, const char* key, const std::string& text) {
    json.newline(2).key(key);
    return text.empty() ? json.raw("null") : json.value(text);
}

}  // namespace

Summary summary_of(const Evaluation& evaluation) {
    Summary summary;
    std::vector<ObjectScores> objects;
    double predicting = 0, drawing = 0;
    std::uint64_t drawn = 0;
    for (const auto& [index, object] : evaluation.objects) {
        predicting += object.predict_seconds;
        drawing += object.draw_seconds;
        drawn += object.drawn;
        summary.empty += object.empty;
        summary.ledger.add(object.ledger);
        if (!object.ledger.finite()) ++summary.objects_not_finite;
        objects.push_back(object);
    }
    summary.objects = static_cast<std::uint32_t>(objects.size());
    summary.novel = mean_of(objects, &ObjectScores::novel);
    summary.conditioning = mean_of(objects, &ObjectScores::conditioning);
    summary.predictions_per_second = rate_of(summary.objects, predicting);
    summary.images_per_second = rate_of(static_cast<double>(drawn), drawing);
    return summary;
}

std::string results_text(const Evaluation& evaluation) {
    const Summary summary = summary_of(evaluation);
    JsonWriter json;
    json.begin_object().newline(2).member("schema", 1);
    text_or_null(json, "weights", evaluation.method.empty() ? evaluation.weights : std::string());
    text_or_null(json, "baseline", evaluation.method);
    json.newline(2).member("split", evaluation.split).newline(2).key("data").begin_object();
    json.newline(4).member("format", evaluation.format);
    json.newline(4).member("objects", evaluation.data_objects).newline(2).end();
    text_or_null(json, "device", evaluation.device);
    json.newline(2).member("objects", summary.objects);
    write_scores(summary.novel, json.newline(2).key("novel"));
    write_scores(summary.conditioning, json.newline(2).key("conditioning"));
    json.newline(2).member("empty_views", summary.empty);
    write_number(json.newline(2).key("predictions_per_second"), summary.predictions_per_second);
    write_number(json.newline(2).key("images_per_second"), summary.images_per_second);
    write_ledgers(evaluation, summary, json);
    json.newline(0).end();
    return json.text();
}

std::string table_text(const Evaluation& evaluation) {
    std::string csv =
        "object,psnr_novel,ssim_novel,lpips_novel,psnr_cond,ssim_cond,lpips_cond,views,"
        "perfect_views,predict_ms,draw_ms\n";
    for (const auto& [index, o] : evaluation.objects) {
        csv += csv_field(o.name);
        for (const auto& scores : {o.novel, o.conditioning})
            for (const double score : {scores.psnr, scores.ssim, scores.lpips})
                csv += "," + decimal("%.9g", score);
        csv += format(",%u,%u,%.3f,%.3f\n", o.novel.views + o.conditioning.views,
                      o.novel.perfect + o.conditioning.perfect, 1e3 * o.predict_seconds,
                      1e3 * o.draw_seconds);
    }
    return csv;
}

std::string scores_text(const Evaluation& evaluation) {
    std::string text;
    for (const auto& [index, o] : evaluation.objects) {
        text += format("%u_%s", index, scores_name(o.name).c_str());
        for (const double score : {o.novel.psnr, o.novel.ssim, o.novel.lpips})
            text += " " + decimal("%.17g", score);
        text += "\n";
    }
    return text;
}

Status save(const Evaluation& evaluation, const std::string& folder) {
    if (os::make_folders(folder) != 0)
        return error(Code::kIo, "cannot make the folder '%s': %s", folder.c_str(),
                     os::reason(errno).c_str());
    const auto write = [&folder](const char* name, const std::string& text) {
        return io::write_file(folder + "/" + name, io::as_bytes(text));
    };
    SPLAT_TRY(write("per_object.csv", table_text(evaluation)));
    ImageTable images;
    for (const auto& [index, object] : evaluation.objects) images[object.name] = object.novel_views;
    SPLAT_TRY(write(kImagesFile, image_table_text(images)));
    SPLAT_TRY(write("scores.txt", scores_text(evaluation)));
    SPLAT_TRY(write(kObjectsFile, objects_text(evaluation) + "\n"));
    return write("results.json", results_text(evaluation) + "\n");
}

}  // namespace splat::eval
