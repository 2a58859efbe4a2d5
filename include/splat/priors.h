/* libsplat: geometry priors, which are depth maps, normals and masks of pictures.
 *
 * How good a depth map is:
 *
 *   splat_depth_scores scores = {sizeof scores};
 *   splat_prior_compare_depth(&predicted, &truth, NULL, 0, &scores);
 *   printf("AbsRel %.3f\n", scores.abs_rel); */
#ifndef SPLAT_PRIORS_H
#define SPLAT_PRIORS_H

#include "core.h"
#include "scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Judging --------------------------------------------------------------------------------- */

/* Maps are pictures of one size: a map of U8 counts as 0 to 1, as in splat_image. Arithmetic is in
 * double precision. Numbers that are not finite are refused, except where a mask leaves them out.
 * Needs no device. Thread-safe.
 *
 * Where the published scores of Splatter Image with priors differ from the definition, a flag gives
 * theirs. */

enum {
    /* Every pixel counts: both maps are first clamped to 1e-8, after which a choice of pixels with
     * a truth > 0 chooses all. An aligned depth below 0 is within every factor. Takes no mask */
    SPLAT_DEPTH_AS_PUBLISHED = 1u << 0
};

/* Errors of an aligned depth map p against the true one g, in its units. */
typedef struct splat_depth_scores {
    uint32_t struct_size;
    uint32_t reserved;
    uint64_t pixels;  /* counted */
    double abs_rel;   /* mean of |p - g| / g */
    double rmse;      /* root of the mean of (p - g)^2 */
    double si_rmse;   /* standard deviation of ln max(p, 1e-8) - ln g */
    double within[3]; /* shares of pixels with max(p/g, g/p) < 1.25, 1.25^2, 1.25^3; p > 0 */
    double scale;     /* p = scale * prediction + shift with the least squares; 0: it is constant */
    double shift;
} splat_depth_scores;

/* Compare a depth map with the true one, both with larger numbers for nearer pixels, or both with
 * larger ones for farther pixels.
 * prediction, truth   of one channel
 * mask      of one channel, may be NULL; pixels > 0.5 count, else those with a truth > 0
 * flags     SPLAT_DEPTH_AS_PUBLISHED
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      an image, flags, struct_size, no pixel that counts, numbers
 *                                     that are not finite, a truth <= 0 inside of the mask
 *   SPLAT_ERROR_SHAPE_MISMATCH        two sizes, or more than one channel */
SPLAT_API splat_result splat_prior_compare_depth(const splat_image* prediction,
                                                 const splat_image* truth, const splat_image* mask,
                                                 uint32_t flags, splat_depth_scores* scores);

enum {
    /* numbers are x, y, z themselves, from -1 to 1; else (n + 1) / 2, as data sets hold them */
    SPLAT_NORMAL_VECTORS = 1u << 0
};

/* Angles between predicted and true normals, in degrees. */
typedef struct splat_normal_scores {
    uint32_t struct_size;
    uint32_t reserved;
    uint64_t pixels;  /* counted */
    uint64_t missing; /* of these, without a prediction; their angle is 180 degrees */
    double mean;
    double median;
    double rmse;
    double within[3]; /* shares of pixels with an angle below 11.25, 22.5, 30 degrees */
} splat_normal_scores;

/* Compare normal maps. Lengths do not matter, but a vector shorter than 0.5 stands for none.
 * prediction, truth   of three channels
 * mask      of one channel, may be NULL; pixels > 0.5 count, else those with a true normal
 * flags     SPLAT_NORMAL_VECTORS
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      an image, flags, struct_size, no pixel that counts, numbers
 *                                     that are not finite, no true normal inside of the mask
 *   SPLAT_ERROR_SHAPE_MISMATCH        two sizes, or other channels */
SPLAT_API splat_result splat_prior_compare_normals(const splat_image* prediction,
                                                   const splat_image* truth,
                                                   const splat_image* mask, uint32_t flags,
                                                   splat_normal_scores* scores);

enum {
    SPLAT_MASK_ALPHA_HALF = 1u << 0 /* the true mask is where alpha > 0.5; else where alpha > 0 */
};

/* How well a soft mask p, binary where p > 0.5, covers the true one. Shares have 1e-6 in their
 * denominators, as published: an empty truth scores 0. */
typedef struct splat_mask_scores {
    uint32_t struct_size;
    uint32_t reserved;
    uint64_t predicted_pixels;
    uint64_t true_pixels;
    double mae; /* mean of |p - truth| */
    double iou;
    double precision;
    double recall;
    double f_beta; /* with beta^2 = 0.3 */
} splat_mask_scores;

/* Compare a mask with the true one.
 * prediction, alpha   of one channel, 0 to 1
 * flags     SPLAT_MASK_ALPHA_HALF
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      an image, flags, struct_size, a number outside 0 to 1
 *   SPLAT_ERROR_SHAPE_MISMATCH        two sizes, or more than one channel */
SPLAT_API splat_result splat_prior_compare_masks(const splat_image* prediction,
                                                 const splat_image* alpha, uint32_t flags,
                                                 splat_mask_scores* scores);

enum {
    /* compare values of 0 to 1 as they are, as published; else 255 times them, as the noise of the
     * definition expects */
    SPLAT_FIDELITY_RANGE_1 = 1u << 0,
    /* average in alpha, as published; where it is constant and equal it counts as 1 */
    SPLAT_FIDELITY_WITH_ALPHA = 1u << 1
};

/* Visual information fidelity of the channels of an image. */
typedef struct splat_fidelity_scores {
    uint32_t struct_size;
    uint32_t constant_channels; /* left out: the true channel is constant */
    double vif;                 /* mean over the other channels, 1 for equal images; NaN: none */
    double channels[4];         /* NaN: constant, left out, or not there */
} splat_fidelity_scores;

/* Compare images by visual information fidelity in the pixel domain, at four scales (Sheikh and
 * Bovik 2006).
 * prediction, truth   of one size and as many channels, at least 41 x 41 pixels
 * flags     SPLAT_FIDELITY_ bits
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      an image, flags, struct_size, numbers that are not finite
 *   SPLAT_ERROR_SHAPE_MISMATCH        two sizes, or fewer pixels */
SPLAT_API splat_result splat_prior_compare_images(const splat_image* prediction,
                                                  const splat_image* truth, uint32_t flags,
                                                  splat_fidelity_scores* scores);

typedef int32_t splat_map_filter;
enum {
    /* Canny's edges, 0 or 1, of 255 times a map of 0 to 1, truncated: thresholds 50 and 150,
     * aperture 3, L1 lengths, as OpenCV 4.6 */
    SPLAT_MAP_FILTER_CANNY = 1,
    /* length of the gradient divided by its largest in the map + 1e-8: weights 1 2 1 */
    SPLAT_MAP_FILTER_SOBEL = 2,
    SPLAT_MAP_FILTER_SCHARR = 3,  /* the same with weights 3 10 3 */
    SPLAT_MAP_FILTER_PREWITT = 4, /* the same with weights 1 1 1 */
    /* the mask map > 0.5 with its holes filled: closing by a square of 3 x 3 pixels */
    SPLAT_MAP_FILTER_CLOSING = 5,
    SPLAT_MAP_FILTER_OPENING = 6 /* the mask map > 0.5 without specks: opening */
};

/* Filter a map.
 * map, filtered   of one channel and one size; may be the same picture
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      an image, filter, numbers that are not finite, for Canny
 *                                     also those outside 0 to 1
 *   SPLAT_ERROR_SHAPE_MISMATCH        two sizes, or more than one channel */
SPLAT_API splat_result splat_prior_filter(const splat_image* map, splat_map_filter filter,
                                          splat_image* filtered);

/* Sample the surface of a mesh, uniformly by area.
 * path      OBJ; its polygons count as fans around their first corners
 * seed      decides the points, each by its place: more points start with the same ones
 * points    out, x, y, z of each, in the mesh's units and axes
 * count     numbers of `points`: 3 for each point
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a count that 3 does not divide, a mesh without area
 *   SPLAT_ERROR_NOT_FOUND, SPLAT_ERROR_IO  the file is not there, cannot be read
 *   SPLAT_ERROR_FORMAT                a damaged file; the message names the line
 *   SPLAT_ERROR_UNSUPPORTED           free-form surfaces, lines that continue in the next one */
SPLAT_API splat_result splat_points_from_mesh(const char* path, uint64_t seed, float* points,
                                              uint64_t count);

/* The points that a depth map shows, in the world.
 * depth     of one channel and the camera's size: distances along its axis, in units of the scene;
 *           pixels <= 0 show nothing
 * points    out, x, y, z of each, row by row; may be NULL
 * capacity  numbers that `points` has room for; 3 for each pixel always suffice
 * needed    out, numbers of all points; may be NULL
 * Returns SPLAT_OK, SPLAT_INCOMPLETE (too little room; `points` is not written),
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      an image, a camera, numbers that are not finite
 *   SPLAT_ERROR_SHAPE_MISMATCH        another size than the camera's, or more than one channel */
SPLAT_API splat_result splat_points_from_depth(const splat_image* depth, const splat_camera* camera,
                                               float* points, uint64_t capacity, uint64_t* needed);

/* How far the Gaussians P of a scene lie from true points T; d(p, T) is the distance from p to the
 * nearest point of T. */
typedef struct splat_point_scores {
    uint32_t struct_size;
    uint32_t reserved;
    uint64_t gaussians;     /* counted: P */
    double accuracy;        /* mean over P of d(p, T) */
    double completeness;    /* mean over T of d(t, P) */
    double chamfer;         /* mean of the two */
    double chamfer_squared; /* sum of the means of the squared distances */
    double precision;       /* share of P with d(p, T) < threshold */
    double recall;          /* share of T with d(t, P) < threshold */
    double f_score;         /* harmonic mean of the two */
} splat_point_scores;

/* Compare the means of a scene's Gaussians with true points. Nearest points are exact.
 * min_opacity  of the Gaussians that count, 0 to 1; 1/255 leaves out those that no image shows
 * points    x, y, z of each, in the scene's units and axes
 * count     numbers of `points`: 3 for each point
 * threshold distance of precision, recall and F-score, > 0
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_OUT_OF_HOST_MEMORY,
 *   SPLAT_ERROR_INVALID_ARGUMENT (NULL, min_opacity, threshold, struct_size, a count that 3 does
 *   not divide, no points, no Gaussian that counts, numbers that are not finite) */
SPLAT_API splat_result splat_scene_compare_points(splat_scene scene, double min_opacity,
                                                  const float* points, uint64_t count,
                                                  double threshold, splat_point_scores* scores);

#ifdef __cplusplus
}
#endif

#endif /* SPLAT_PRIORS_H */
