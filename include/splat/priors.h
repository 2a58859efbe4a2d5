/* libsplat: geometry priors, which are depth maps, normals and masks of pictures.
 *
 * A mask by a network (an ONNX file, run by ONNX Runtime, which is loaded when it is asked for; weights
 * of MoGe-2 run on a device instead):
 *
 *   splat_prior_model model;
 *   splat_prior_model_desc desc = {
 *       .struct_size = sizeof desc, .preset = "u2net", .model_path = "u2net.onnx"};
 *   splat_prior_maps maps = {.mask = mask};
 *   splat_prior_model_create(&desc, &model);
 *   splat_prior_model_run(model, &picture, &maps, 1);
 *
 * How good a depth map is:
 *
 *   splat_depth_scores scores = {.struct_size = sizeof scores};
 *   splat_prior_compare_depth(&predicted, &truth, NULL, 0, &scores);
 *   printf("AbsRel %.3f\n", scores.abs_rel); */
#ifndef SPLAT_PRIORS_H
#define SPLAT_PRIORS_H

#include "data.h"
#include "predict.h"
#include "scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Making ---------------------------------------------------------------------------------- */

/* A network that makes maps of pictures, with the preset that says how pictures become its input
 * and its outputs maps. Thread-safe. */

/* Get a preset. JSON: {"path" (where a model without a path is looked for), "preset": {"name",
 * "title", "input", "outputs", "file" (its name; where they are known url, bytes, sha256),
 * "licence", "note"}}.
 * name      as of splat_prior_model_desc; NULL: all names, as a JSON array
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_NOT_FOUND (the message lists the names) */
SPLAT_API splat_result splat_prior_preset(const char* name, char* buffer, size_t capacity,
                                          size_t* needed);

/* What the numbers of a model's maps are. */
enum {
    /* F16 and F32 maps have the model's own numbers: depth at its scale, which may be distances,
     * normals from -1 to 1 */
    SPLAT_PRIOR_MODEL_NUMBERS = 1u << 0
};

typedef struct splat_prior_model_desc {
    uint32_t struct_size;
    uint32_t flags;   /* SPLAT_PRIOR_MODEL_ bits */
    const void* next; /* NULL */
    /* name, or JSON text of a preset of the caller's own; NULL: the one whose file has the name of
     * model_path */
    const char* preset;
    /* ONNX file, or weights of MoGe-2 (.safetensors, .pt); NULL: the preset's, in $SPLAT_PRIORS_DIR,
     * else libsplat/priors/ of the user's data folder, where it may have either form */
    const char* model_path;
    /* library of ONNX Runtime 1.11 or later; NULL: $SPLAT_ONNXRUNTIME_LIBRARY, else libonnxruntime.so.1
     * beside libsplat or where the system's loader looks. Weights do not need it */
    const char* runtime_path;
    uint32_t threads; /* threads of one run by ONNX Runtime; 0: one per core */
    /* patches that a model whose preset has "tokens" divides a picture into, about; 0: the preset's.
     * MoGe-2 was trained with 1200 to 3600: fewer are faster */
    uint32_t tokens;
    splat_device device; /* device that runs weights; NULL for an ONNX file */
} splat_prior_model_desc;

/* Load a model. All tensors of weights are checked before the device is used; the model keeps its
 * device open.
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_OUT_OF_DEVICE_MEMORY,
 *   SPLAT_ERROR_INVALID_HANDLE (device), or
 *   SPLAT_ERROR_INVALID_ARGUMENT  desc; neither preset nor model_path; a member of a preset's JSON;
 *                                 weights without a device; tokens where the preset has none
 *   SPLAT_ERROR_NOT_FOUND         a preset, the model, ONNX Runtime; the message says how to get it
 *   SPLAT_ERROR_UNSUPPORTED       a library that is no ONNX Runtime of version 1.11 or later; a .pt
 *                                 with code in it, which is never run
 *   SPLAT_ERROR_FORMAT            no ONNX file, a damaged one, or one with other inputs or outputs
 *                                 than the preset's; weights of another network (the message says
 *                                 which they look like), missing or further tensors */
SPLAT_API splat_result splat_prior_model_create(const splat_prior_model_desc* desc,
                                                splat_prior_model* model);

/* What a model makes, and where it comes from. */
typedef struct splat_prior_model_info {
    uint32_t struct_size;
    uint32_t maps;       /* maps that it makes, SPLAT_DATA_ flags */
    uint32_t width;      /* width of the model's input, pixels; 0: by the picture */
    uint32_t height;     /* height of the model's input, pixels; 0: by the picture */
    const char* preset;  /* name of the preset; lives, as the other texts, as long as the model */
    const char* licence; /* licence of the model: show it to the user */
    const char* note;    /* what to know of the model */
    const char* path;    /* file of the model */
    const char* runtime_version; /* version of ONNX Runtime, such as "1.30.0"; "": runs on a device */
} splat_prior_model_info;

/* Describe a model.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (info). */
SPLAT_API splat_result splat_prior_model_get_info(splat_prior_model model,
                                                  splat_prior_model_info* info);

/* Where the maps of a picture go; all of the picture's size. Frozen. Those without pixels are not
 * wanted. U8 maps are those of the reference, truncated to 8 bits; F16 and F32 have the same numbers
 * before that, from 0 to 1. */
typedef struct splat_prior_maps {
    splat_image depth; /* 1 channel; larger is nearer, from the picture's farthest to its nearest */
    splat_image normal; /* 3 channels; (normal + 1) / 2 in the model's axes, if the preset does not
                         * say the camera's */
    splat_image mask;   /* 1 channel; 1 on the object */
} splat_prior_maps;

/* Make maps of pictures. Those whose inputs have the same size run at once if the model takes any
 * number; the memory grows with their number.
 * pictures  `count`, 1 to 4 channels; read as 8 bits, alpha is left out
 * maps      `count`; unchanged if the call fails
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT  NULL, a field of an image, no map, a map that the model lacks
 *   SPLAT_ERROR_SHAPE_MISMATCH    a map of another size or other channels
 *   SPLAT_ERROR_UNSUPPORTED       a picture that is too wide or too high for the preset
 *   SPLAT_ERROR_FORMAT            the model cannot run, or gives an output of another shape
 *   SPLAT_ERROR_OUT_OF_DEVICE_MEMORY  weights on a device: too many tokens
 *   SPLAT_ERROR_INVALID_STATE     its output is not finite; the handle is of a forked process */
SPLAT_API splat_result splat_prior_model_run(splat_prior_model model, const splat_image* pictures,
                                             const splat_prior_maps* maps, uint32_t count);

/* Make maps of pictures, as splat_prior_model_run(), and find the focal lengths of their cameras.
 * maps      as there, but with focals none need be wanted
 * focals    out, `count`, pixels in both directions; of models whose depth are points (MoGe-2), for the
 *           pinhole camera that sees them best, or, with a warning, 60 degrees across the width where
 *           no camera does; 0 of others
 * Returns as splat_prior_model_run() */
SPLAT_API splat_result splat_prior_model_run_focal(splat_prior_model model,
                                                   const splat_image* pictures,
                                                   const splat_prior_maps* maps, double* focals,
                                                   uint32_t count);

/* Destroy a model. Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_prior_model_destroy(splat_prior_model model);

/* Find the object of a picture without a network: by an alpha that is not opaque everywhere, else by
 * the colour of its border, as predictors do.
 * mask      1 channel of the picture's size; 1 (U8: 255) on the object
 * found     out, may be NULL; with SPLAT_FOUND_NOTHING the mask is 1 everywhere
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_ARGUMENT (NULL, a field of an image),
 *   SPLAT_ERROR_SHAPE_MISMATCH (the mask), SPLAT_ERROR_OUT_OF_HOST_MEMORY */
SPLAT_API splat_result splat_picture_mask(const splat_image* picture, const splat_image* mask,
                                          splat_found* found);

typedef struct splat_normals_desc {
    uint32_t struct_size;
    uint32_t flags;   /* 0 */
    const void* next; /* NULL */
    double focal_x;   /* pixels */
    double focal_y;
    double center_x; /* principal point, pixels from the left and top edge; both 0: the middle */
    double center_y;
    /* distances that a map of relative depth goes between: 0 is 1 / farthest, 1 is 1 / nearest. Both
     * 0: the map holds distances, and where they are 0 or less, or not finite, there is no surface */
    double nearest;
    double farthest;
} splat_normals_desc;

/* Make normals of the surface that a depth map shows, by a pinhole camera and differences of
 * neighbours.
 * depth     1 channel; distances along the camera's axis, or relative depth, larger is nearer
 * normal    3 channels of its size: (n + 1) / 2, facing the camera, in its axes (x right, y down, z
 *           forward); 0.5 without a surface. U8 maps are truncated, as models' are
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT  NULL, a field of an image or of desc, relative depth outside 0 to 1
 *   SPLAT_ERROR_SHAPE_MISMATCH    channels of the depth, the size or channels of the normals */
SPLAT_API splat_result splat_normals_from_depth(const splat_image* depth,
                                                const splat_normals_desc* desc,
                                                const splat_image* normal);

typedef struct splat_planes_desc {
    uint32_t struct_size;
    uint32_t flags;   /* SPLAT_NORMAL_VECTORS: normals and planes are numbers themselves */
    const void* next; /* NULL */
    double max_degrees; /* most angle between a pixel's normal and its plane's; 0: 15 */
    double max_offset;  /* most distance of a pixel from its plane, as a share of its depth; 0: 0.02 */
    double least_share; /* share of the map's pixels of the smallest plane, 0.001 to 1; 0: 0.005 */
} splat_planes_desc;

/* Find the planes of the surface that a depth map shows, by growing regions; at most 255, the largest.
 * The same bits for the same maps.
 * depth     1 channel, as of splat_normals_from_depth(); 0 is no surface, also as relative
 *           depth, which has nothing nearer than `farthest` there
 * normal    3 channels of its size, in the camera's axes; NULL: those of splat_normals_from_depth()
 * camera    the camera of the depth map, and what its numbers mean
 * desc      NULL: the defaults
 * plane     4 channels of its size: (n + 1) / 2 of the plane of the pixel, facing the camera, and the plane's
 *           distance from the camera as a share of that of the farthest plane, at least 1/255; all 0 without a
 *           plane. With SPLAT_NORMAL_VECTORS n and the distance themselves, which take F16 or F32
 * count     out, planes; may be NULL
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT  NULL, a field of an image, of camera or desc, numbers of the normals that
 *                                 are not finite, relative depth outside 0 to 1, U8 planes as numbers
 *   SPLAT_ERROR_SHAPE_MISMATCH    channels of the depth, the size or channels of normals or planes */
SPLAT_API splat_result splat_planes_from_depth(const splat_image* depth, const splat_image* normal,
                                               const splat_normals_desc* camera,
                                               const splat_planes_desc* desc,
                                               const splat_image* plane, uint32_t* count);

/* ---- Judging --------------------------------------------------------------------------------- */

/* Maps are pictures of one size: a map of U8 counts as 0 to 1, as in splat_image. Arithmetic is in
 * double precision. Numbers that are not finite are refused, except where a mask leaves them out.
 * Needs no device. Thread-safe.
 *
 * Where the published scores of Splatter Image with priors differ from the definition, a flag gives
 * theirs. */

/* How depth maps are compared. */
enum {
    /* Every pixel counts: both maps are first clamped to 1e-8, after which a choice of pixels with
     * a truth > 0 chooses all. An aligned depth below 0 is within every factor. Takes no mask */
    SPLAT_DEPTH_AS_PUBLISHED = 1u << 0
};

/* Errors of an aligned depth map p against the true one g, in its units. */
typedef struct splat_depth_scores {
    uint32_t struct_size;
    uint32_t reserved;
    uint64_t pixels;  /* pixels that count */
    double abs_rel;   /* mean of |p - g| / g */
    double rmse;      /* root of the mean of (p - g)^2 */
    double si_rmse;   /* standard deviation of ln max(p, 1e-8) - ln g */
    double within[3]; /* shares of pixels with max(p/g, g/p) < 1.25, 1.25^2, 1.25^3; p > 0 */
    double scale;     /* p = scale * prediction + shift with the least squares; 0: a constant */
    double shift;     /* the other number of that fit, in the truth's units */
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

/* What the numbers of normal maps are. */
enum {
    /* numbers are x, y, z themselves, from -1 to 1; else (n + 1) / 2, as data sets hold them */
    SPLAT_NORMAL_VECTORS = 1u << 0
};

/* Angles between predicted and true normals, in degrees. */
typedef struct splat_normal_scores {
    uint32_t struct_size;
    uint32_t reserved;
    uint64_t pixels;  /* pixels that count */
    uint64_t missing; /* counted pixels without a prediction; their angle is 180 degrees */
    double mean;      /* mean of the angles, degrees */
    double median;    /* median of the angles, degrees */
    double rmse;      /* root of the mean of the squared angles, degrees */
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

/* How well predicted planes are the true ones; IoU is intersection over union of their pixels. */
typedef struct splat_plane_scores {
    uint32_t struct_size;
    uint32_t reserved;
    uint64_t pixels;           /* pixels on true planes */
    uint64_t predicted_planes; /* planes of the prediction */
    uint64_t true_planes;      /* planes of the truth */
    double covering;  /* mean over the pixels of true planes of their plane's best IoU, 0 to 1 */
    double recall;    /* share of the true planes that a predicted one finds */
    double precision; /* share of the predicted planes that find a true one; 0 without any */
} splat_plane_scores;

/* Compare maps of planes, as splat_planes_from_depth() fills them: a plane is all pixels with the same four
 * numbers. A predicted plane finds a true one if their IoU is above 0.5, and normals and distances agree.
 * prediction, truth   of four channels; a distance <= 0 is no plane
 * flags     SPLAT_NORMAL_VECTORS; without it normals are decoded, and distances are as they are
 * max_distance  most difference of the distances, >= 0, such as 0.05 of maps in metres
 * max_degrees   most angle between the normals, 0 to 180, such as 10
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      an image, flags, limits, struct_size, no true plane, numbers that
 *                                     are not finite, a plane without a normal
 *   SPLAT_ERROR_SHAPE_MISMATCH        two sizes, or other channels */
SPLAT_API splat_result splat_prior_compare_planes(const splat_image* prediction,
                                                  const splat_image* truth, uint32_t flags,
                                                  double max_distance, double max_degrees,
                                                  splat_plane_scores* scores);

/* Where the true mask is. */
enum {
    SPLAT_MASK_ALPHA_HALF = 1u << 0 /* the true mask is where alpha > 0.5; else where alpha > 0 */
};

/* How well a soft mask p, binary where p > 0.5, covers the true one. Shares have 1e-6 in their
 * denominators, as published: an empty truth scores 0. */
typedef struct splat_mask_scores {
    uint32_t struct_size;
    uint32_t reserved;
    uint64_t predicted_pixels; /* pixels of the predicted mask */
    uint64_t true_pixels;      /* pixels of the true mask */
    double mae;                /* mean of |p - truth| */
    double iou;                /* intersection over union, 0 to 1 */
    double precision;          /* share of the predicted pixels that are true */
    double recall;             /* share of the true pixels that are predicted */
    double f_beta;             /* weighted harmonic mean of the two, with beta^2 = 0.3 */
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

/* How images are compared. */
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
    uint32_t constant_channels; /* channels left out: the true one is constant */
    double vif;                 /* mean over the other channels, 1 for equal images; NaN: none */
    double channels[4];         /* fidelity of each; NaN: constant, left out, or not there */
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

/* What is done with a map. */
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

/* Sample the surface of a mesh, uniformly by area, or the points of a point cloud, evenly.
 * path      OBJ, whose polygons count as fans around their first corners, or .glb and .gltf, as their
 *           nodes place meshes. Or PLY without faces: point i of n is number floor(i v / n) of its v
 *           vertices
 * seed      decides the points, each by its place: more points start with the same ones
 * points    out, x, y, z of each, in the mesh's units and axes
 * count     numbers of `points`: 3 for each point
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a count that 3 does not divide, a mesh without area
 *   SPLAT_ERROR_NOT_FOUND, SPLAT_ERROR_IO  the file is not there, cannot be read
 *   SPLAT_ERROR_FORMAT                a damaged file; the message names the line
 *   SPLAT_ERROR_UNSUPPORTED           free-form surfaces, lines that continue in the next one; a PLY
 *                                     with faces; compressed meshes of glTF */
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
    uint64_t gaussians;     /* Gaussians that count: P */
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
