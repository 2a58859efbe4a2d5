/* libsplat: how good a network is, and which of two is better.
 *
 * The scores of a predictor on the objects of a data set, and the files of `vkrun eval`:
 *
 *   splat_evaluator evaluator;
 *   splat_evaluator_desc desc = {sizeof desc, .predictor = predictor, .data_path = "cars"};
 *   splat_object_scores scores = {.struct_size = sizeof scores};
 *   splat_evaluator_info info = {.struct_size = sizeof info};
 *   splat_evaluator_create(&desc, &evaluator);
 *   splat_evaluator_get_info(evaluator, &info);
 *   for (uint32_t i = 0; i < info.objects; ++i) splat_evaluator_score(evaluator, i, &scores);
 *   splat_evaluator_save(evaluator, "eval"); */
#ifndef SPLAT_EVALUATE_H
#define SPLAT_EVALUATE_H

#include "predict.h"
#include "render.h"
#include "train.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Evaluator ------------------------------------------------------------------------------- */

/* The published protocol of Splatter Image: each object is predicted from its conditioning views
 * and drawn in all its views. Conditioning views are number 64 (for two inputs also 128) of SRN's
 * 251 test views, 0 and 30 for two inputs of CO3D, that of the views_file of NMR, else the first
 * ones; the others are novel. PSNR, SSIM and LPIPS are means over an object's views, then over
 * objects, apart for conditioning and novel views. A view that equals its target has no PSNR; such
 * views are counted. A view whose target is all black is skipped.
 *
 * The scores of an object with numbers that are not finite are NaN, and so are the means: no number
 * looks like a score. The caller synchronises calls on the evaluators of one predictor; the device
 * is free for others between its operations and while files are read. */

typedef struct splat_evaluator_desc {
    uint32_t struct_size;
    uint32_t flags;            /* 0 */
    const void* next;          /* NULL */
    splat_predictor predictor; /* what is scored; its `aggregate` is 0 unless there is a method. NULL:
                                * images of the caller */
    /* opened with the predictor's resolution, background and maps; NULL: `data_path` */
    splat_dataset dataset;
    /* a folder, opened as the predictor's configuration says; both NULL: its data.root */
    const char* data_path;
    const char* split; /* split of `data_path`; NULL: test; NULL with `dataset` */
    /* a name for what draws the images of splat_evaluator_score_images; NULL: the predictor. A
     * predictor then only says how the data are read. Must be given without a predictor */
    const char* method;
    splat_lpips lpips;            /* made for the images' resolution; NULL: LPIPS is NaN */
    const uint32_t* conditioning; /* numbers of the conditioning views of each object */
    uint64_t conditioning_count;  /* 0: by the protocol; else as many as the network has inputs */
    /* conditioning views without a predictor and without their numbers; else 0. 0: 1 */
    uint32_t inputs;
    uint32_t novel_views; /* novel views per object, evenly spread; 0: all */
    uint32_t objects;     /* only this many, the first in order; 0: all */
    uint32_t reserved;
} splat_evaluator_desc;

/* Create an evaluator.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, no data, a data set and a path, no method without a
 *                                     predictor, another number of conditioning views, a data set
 *                                     that was opened otherwise than the configuration says
 *   SPLAT_ERROR_SHAPE_MISMATCH        LPIPS for images of another size
 *   and as splat_dataset_open */
SPLAT_API splat_result splat_evaluator_create(const splat_evaluator_desc* desc,
                                              splat_evaluator* evaluator);

/* What an evaluator scores. */
typedef struct splat_evaluator_info {
    uint32_t struct_size;
    uint32_t objects;    /* objects to score */
    uint32_t scored;     /* objects scored so far */
    uint32_t resolution; /* R: images have R x R pixels */
} splat_evaluator_info;

/* Describe an evaluator.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (info). */
SPLAT_API splat_result splat_evaluator_get_info(splat_evaluator evaluator,
                                                splat_evaluator_info* info);

/* Means over views. Frozen. */
typedef struct splat_scores {
    double psnr;            /* dB; NaN without a view that differs from its target */
    double ssim;            /* structural similarity; NaN without views */
    double lpips;           /* learned perceptual distance; NaN without its network */
    uint32_t views;         /* scored views */
    uint32_t perfect_views; /* views that equal their targets */
} splat_scores;

/* What of predictions and images is finite and visible. Frozen. */
typedef struct splat_ledger {
    uint64_t outputs_not_finite;   /* numbers of the output that are NaN or infinite */
    uint64_t gaussians;            /* predicted Gaussians */
    uint64_t gaussians_not_finite; /* Gaussians with a NaN or an infinity; no image shows them */
    uint64_t gaussians_invisible;  /* Gaussians of opacity below 1/255 */
    uint64_t gaussians_visible;    /* all other Gaussians */
    uint32_t images_not_finite;    /* images with a NaN or an infinity */
    uint32_t images_blank;         /* drawn images that show the background only */
} splat_ledger;

/* The scores of one object. */
typedef struct splat_object_scores {
    uint32_t struct_size;
    uint32_t object;           /* number of the object */
    const char* name;          /* name of the object; lives as long as the evaluator */
    splat_scores novel;        /* scores of the novel views */
    splat_scores conditioning; /* scores of the conditioning views */
    splat_ledger ledger;       /* what is finite and visible */
    uint32_t empty_views;      /* views that are skipped: the target is all black */
    uint32_t not_finite; /* 1: the ledger has numbers that are not finite, and no score is one */
    double predict_ms;   /* time to run the network and read its Gaussians */
    double draw_ms;      /* time to draw all views */
} splat_object_scores;

/* Predict an object, draw its views and score them. Objects may be scored in any order; scoring one
 * again replaces its scores.
 * object    below splat_evaluator_info.objects
 * scores    in/out, struct_size set; may be NULL
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      struct_size, no such object
 *   SPLAT_ERROR_INVALID_STATE         the evaluator scores images of the caller
 *   SPLAT_ERROR_FORMAT                the object has no novel views
 *   and as splat_dataset_read and splat_model_forward; the object then stays as it was */
SPLAT_API splat_result splat_evaluator_score(splat_evaluator evaluator, uint32_t object,
                                             splat_object_scores* scores);

/* Score images that the caller made, by the same protocol.
 * images    [n,3,R,R] of the views that splat_evaluator_read gives, in their order
 * count     numbers of `images`
 * Returns as splat_evaluator_score, SPLAT_ERROR_INVALID_ARGUMENT (NULL), SPLAT_ERROR_SHAPE_MISMATCH
 *   (count) */
SPLAT_API splat_result splat_evaluator_score_images(splat_evaluator evaluator, uint32_t object,
                                                    const float* images, uint64_t count,
                                                    splat_object_scores* scores);

/* The views of an object that are scored, conditioning ones first. Arrays that are NULL are not
 * filled; the others have room for at least the numbers in brackets, n being inputs + novel. */
typedef struct splat_evaluated_views {
    uint32_t struct_size;
    uint32_t inputs;   /* out: conditioning views */
    uint32_t novel;    /* out */
    uint32_t reserved; /* 0 */
    uint32_t* numbers; /* [n] in the data set */
    uint64_t number_count;
    splat_camera* cameras; /* [n] in the frame of the first view */
    uint64_t camera_count;
    float* images; /* [n,3,R,R] targets */
    uint64_t image_count;
    float* drawn; /* [n,3,R,R] by the latest splat_evaluator_score, of this object */
    uint64_t drawn_count;
} splat_evaluated_views;

/* Read the views of an object. With all arrays NULL only their numbers are found, and no file is
 * read.
 * views     in/out, struct_size set
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, struct_size, no such object, an array that is too short
 *   SPLAT_ERROR_INVALID_STATE         `drawn` is wanted, and the latest object scored is another
 *   and as splat_dataset_read; on an error nothing is written */
SPLAT_API splat_result splat_evaluator_read(splat_evaluator evaluator, uint32_t object,
                                            splat_evaluated_views* views);

/* Means and sums over the objects scored so far. */
typedef struct splat_evaluation_summary {
    uint32_t struct_size;
    uint32_t objects;   /* scored objects */
    splat_scores novel; /* novel views: means over objects, each counting the same; sums of views */
    splat_scores conditioning;     /* the same of conditioning views */
    splat_ledger ledger;           /* sums of what is finite and visible */
    uint32_t empty_views;          /* views that are skipped: the target is all black */
    uint32_t objects_not_finite;   /* objects with numbers not finite; if any, the means are NaN */
    double predictions_per_second; /* predictions; NaN for images of the caller */
    double images_per_second;      /* drawn images; NaN for images of the caller */
} splat_evaluation_summary;

/* Sum up.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (NULL,
 * struct_size). */
SPLAT_API splat_result splat_evaluator_summary(splat_evaluator evaluator,
                                               splat_evaluation_summary* summary);

/* The summary as JSON, the content of results.json: {"schema": 1, "weights" (path), "baseline" (the
 * method), "split", "data": {"format", "objects"}, "device", "objects", "novel": {"psnr", "ssim",
 * "lpips", "views", "perfect_views"}, "conditioning", "empty_views", "predictions_per_second",
 * "images_per_second", "ledger": {the members of splat_ledger, "objects": [{"object" (name), ...}
 * for each with numbers that are not finite or blank images]}}. NaN is null.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_evaluator_report(splat_evaluator evaluator, char* buffer,
                                              size_t capacity, size_t* needed);

/* Write what `vkrun eval` writes: results.json, per_object.csv (a line per object), per_image.csv (a
 * line per novel view), scores.txt ("index_name psnr ssim lpips" of novel views, as Splatter Image
 * writes it) and objects.json (all of each object's scores, for splat_evaluator_load), each whole or
 * not at all.
 * folder    made where it is missing
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (NULL), SPLAT_ERROR_IO
 *   (the folder or a file cannot be written). */
SPLAT_API splat_result splat_evaluator_save(splat_evaluator evaluator, const char* folder);

/* Take over scores that splat_evaluator_save wrote, by the names of objects, as if they had been
 * scored here: to merge what several processes scored, or to go on. They replace those of the same
 * objects.
 * folder    of objects.json and per_image.csv
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL; scores of other weights, configuration, method, data
 *                                     set, split, views; no such object; nothing is taken
 *   SPLAT_ERROR_NOT_FOUND, SPLAT_ERROR_IO, SPLAT_ERROR_FORMAT  the file is not there, cannot be
 *                                     read, is damaged */
SPLAT_API splat_result splat_evaluator_load(splat_evaluator evaluator, const char* folder);

/* Destroy an evaluator. Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_evaluator_destroy(splat_evaluator evaluator);

/* ---- Comparison ------------------------------------------------------------------------------ */

/* Is B better than A, or is the difference chance? Needs no device. Thread-safe: a comparison never
 * changes. */

/* A score of images. */
typedef int32_t splat_metric;
enum {
    SPLAT_METRIC_PSNR = 1, /* peak signal-to-noise ratio, dB; more is better */
    SPLAT_METRIC_SSIM = 2, /* structural similarity, 1 for equal images; more is better */
    SPLAT_METRIC_LPIPS = 3 /* learned perceptual distance, 0 for equal images; less is better */
};

/* Scores of one object; NaN: none in that metric. Frozen. */
typedef struct splat_score {
    const char* object; /* name of the object */
    double psnr;
    double ssim;
    double lpips; /* less is better */
} splat_score;

/* Scores of a method: a file or an array. Frozen. */
typedef struct splat_score_set {
    /* per_object.csv or scores.txt; a folder, or results.json, stands for the per_object.csv in the
     * same folder; NULL: `scores` */
    const char* path;
    const splat_score* scores;
    uint64_t score_count;
} splat_score_set;

/* How scores are compared. */
enum {
    /* ignore which object a score belongs to, as Splatter Image with priors was judged */
    SPLAT_COMPARE_UNPAIRED = 1u << 0
};

typedef struct splat_compare_desc {
    uint32_t struct_size;
    uint32_t flags;   /* SPLAT_COMPARE_ bits */
    const void* next; /* NULL */
    splat_score_set a;
    splat_score_set b;
    uint64_t seed;       /* seed of all random choices */
    uint32_t resamples;  /* random permutations; 0: 300000 */
    uint32_t bootstraps; /* samples of the interval; 0: 10000 */
} splat_compare_desc;

/* Compare B with A in every metric that both have. The same numbers for the same seed.
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a path and an array, no scores, an object without a
 *                                     name or twice; files whose scores are of other views
 *   SPLAT_ERROR_NOT_FOUND             no such file; compared in pairs, they share no object
 *   SPLAT_ERROR_FORMAT, SPLAT_ERROR_IO   a file that is damaged or cannot be read */
SPLAT_API splat_result splat_compare_scores(const splat_compare_desc* desc,
                                            splat_comparison* comparison);

/* What was compared. */
typedef struct splat_comparison_info {
    uint32_t struct_size;
    uint32_t metrics;        /* metrics that were compared */
    uint64_t objects_a;      /* objects of A */
    uint64_t objects_b;      /* objects of B */
    uint64_t shared_objects; /* objects that A and B share */
    uint32_t unpaired;       /* 1: objects were ignored */
    /* 1: A and B cover the same objects; else the difference may come from the objects alone */
    uint32_t comparable;
} splat_comparison_info;

/* Describe a comparison.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (info). */
SPLAT_API splat_result splat_comparison_get_info(splat_comparison comparison,
                                                 splat_comparison_info* info);

/* What a comparison of two methods found. */
typedef int32_t splat_verdict;
enum {
    SPLAT_VERDICT_NO_DIFFERENCE = 0, /* none was shown: p_holm is 0.05 or more */
    SPLAT_VERDICT_BETTER = 1,        /* B is better than A */
    SPLAT_VERDICT_WORSE = 2,         /* B is worse than A */
    SPLAT_VERDICT_NOT_COMPARABLE =
        3,                    /* other objects in A than in B, or scores that are not finite */
    SPLAT_VERDICT_TOO_FEW = 4 /* too few objects: no difference could bring p_holm below 0.05 */
};

/* The comparison of A and B in one metric. */
typedef struct splat_metric_comparison {
    uint32_t struct_size;
    splat_metric metric;   /* what is compared */
    splat_verdict verdict; /* what the numbers show */
    uint32_t exact;        /* 1: all permutations were counted, not random ones */
    double mean_a;         /* mean of the scores of A */
    double mean_b;         /* mean of the scores of B */
    double difference;     /* mean_b - mean_a */
    /* two-sided; paired: signs of differences flipped, unpaired: all scores shuffled */
    double p_permutation;
    /* paired: Student's t test (NaN of one pair), unpaired: means from a normal distribution */
    double p_parametric;
    double p_holm; /* p_permutation corrected for the number of metrics */
    /* lower end of the percentile bootstrap interval of 95 % of `difference`; NaN of one pair */
    double low;
    double high; /* upper end of that interval */
    double effect; /* Cohen's d; infinite if all differences are equal, NaN of one pair */
    uint64_t n_a;  /* scores of A; paired: as many as of B, those of the shared objects */
    uint64_t n_b;  /* scores of B */
    /* objects of both with a finite score in B only: they are left out, and the verdict is
     * NOT_COMPARABLE */
    uint64_t lacking_a;
    uint64_t lacking_b; /* the same, with a finite score in A only */
    /* lower end of the bias-corrected and accelerated interval (BCa, Efron 1987) of 95 % of
     * `difference`, of the same samples; NaN also where all of these lie on one side of it */
    double bca_low;
    double bca_high; /* upper end of that interval */
    /* two-sided, by Wilcoxon's signed rank test without the differences that are 0 (Wilcoxon's
     * rule); NaN unpaired */
    double p_wilcoxon;
    double p_wilcoxon_holm; /* p_wilcoxon corrected for the number of metrics */
    double wilcoxon_w;      /* sum of the ranks of differences above 0 */
    uint64_t wilcoxon_n; /* differences that are not 0; with fewer than 6 it shows no difference */
    /* 1: p_wilcoxon is exact (50 differences or fewer); 0: by a normal distribution, its variance
     * corrected for ties */
    uint32_t wilcoxon_exact;
    uint32_t wilcoxon_tied; /* 1: differences of one size share the mean of their ranks */
    uint64_t wins_a;        /* objects in which A is better; 0 unpaired */
    uint64_t wins_b;        /* objects in which B is better */
    uint64_t ties;          /* objects with equal scores */
    /* views of the objects of both in which A is better, where per_image.csv beside both
     * per_object.csv tells their scores; else 0, as unpaired */
    uint64_t image_wins_a;
    uint64_t image_wins_b; /* views in which B is better */
    uint64_t image_ties;   /* views with equal scores */
} splat_metric_comparison;

/* Get the comparison in one metric.
 * index     below splat_comparison_info.metrics
 * metric    in/out, struct_size set
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (index, NULL,
 *   struct_size). */
SPLAT_API splat_result splat_comparison_metric(splat_comparison comparison, uint32_t index,
                                               splat_metric_comparison* metric);

/* Copy the scores that were compared in one metric; paired, those of one object have the same place
 * in both.
 * a, b      out, n_a and n_b numbers; NULL: not wanted
 * a_count, b_count   numbers that they have room for
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (index, an array that
 *   is too short). */
SPLAT_API splat_result splat_comparison_samples(splat_comparison comparison, uint32_t index,
                                                double* a, uint64_t a_count, double* b,
                                                uint64_t b_count);

/* JSON: {"a", "b" (paths), "paired", "objects_a", "objects_b", "shared_objects", "seed",
 * "least_objects" (with fewer the verdict is TOO_FEW), "permutations", "bootstraps", "note" (on
 * objects that only one has, and on fewer than Wilcoxon's test takes; may be empty), "metrics":
 * [{"metric", "mean_a", "mean_b", "observed_difference", "p_permutation", "p_parametric", "p_holm",
 * "ci": [low, high], "ci_bca": [low, high], "effect_size", "n_pairs", "n_a", "n_b", "exact",
 * "p_wilcoxon", "p_wilcoxon_holm", "wilcoxon_w", "wilcoxon_n", "wilcoxon_exact", "wilcoxon_tied",
 * "wins_a", "wins_b", "ties", "image_wins_a", "image_wins_b", "image_ties", "verdict"}]}.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_comparison_report(splat_comparison comparison, char* buffer,
                                               size_t capacity, size_t* needed);

/* Destroy a comparison. Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_comparison_destroy(splat_comparison comparison);

#ifdef __cplusplus
}
#endif

#endif /* SPLAT_EVALUATE_H */
