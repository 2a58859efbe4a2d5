/* libsplat: from pictures of an object to a scene.
 *
 * A photograph to a file of Gaussians, with the weights that come with the library:
 *
 *   splat_predictor predictor;
 *   splat_scene scene;
 *   splat_picture picture = {.image.path = "photo.png"};
 *   splat_predictor_create(device, NULL, &predictor);
 *   splat_predictor_predict(predictor, &picture, 1, &scene, NULL);
 *   splat_scene_save(scene, "scene.ply", NULL); */
#ifndef SPLAT_PREDICT_H
#define SPLAT_PREDICT_H

#include "render.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Pictures -------------------------------------------------------------------------------- */

/* A picture or a map: a file or pixels. A zeroed one is none. Frozen. Pixels of F16 and F32 are
 * finite and from 0 to 1, within 1e-3. Depths of these types may have any range: the picture's
 * least becomes 0, its greatest 1 (all 0 if they are equal). U8 and files are taken as they are. */
typedef struct splat_picture_source {
    const char* path;   /* PNG, JPEG (turned as its Exif data says) or WebP; NULL: `pixels` */
    splat_image pixels; /* reduced to 8 bits, as files of 16 bits are */
} splat_picture_source;

/* Options of a picture. */
enum { SPLAT_PICTURE_WHOLE = 1u << 0 }; /* use the largest centred square, not the object's */

/* One view of an object. Frozen. */
typedef struct splat_picture {
    splat_picture_source image;
    splat_picture_source mask;   /* the object's mask, 1 (U8: 255) inside; none: an alpha not opaque
                                  * everywhere, else what differs from its border's colour, else all */
    splat_picture_source depth;  /* where the network takes it; larger is nearer, or as
                                  * model.head.depth_maps of the configuration says, at any scale */
    splat_picture_source normal; /* where the network takes it; (normal + 1) / 2, camera's axes */
    uint32_t flags;              /* SPLAT_PICTURE_* */
    float foreground;            /* the object's longer side, as a part of the square's; 0: 0.65;
                                  * 0 with SPLAT_PICTURE_WHOLE */
    double focal;                /* pixels of the image; 0: by its Exif data, else not known */
    double origin_distance;      /* along the camera's axis, where the network takes it; else 0 */
    double world_to_camera[16];  /* like splat_camera's; all 0: none. Networks of several views need
                                  * the poses of all, and whole pictures; others take none. LGM's
                                  * (model.network lgm_unet) takes those around an object, from
                                  * front, right, back and left, where no picture has one */
    const float* embedding;      /* a custom embedding, or NULL */
    uint64_t embedding_count;    /* numbers */
    const float* tokens;         /* [token_dim,tokens] where the network takes them, or NULL */
    uint64_t token_count;        /* numbers */
} splat_picture;

/* How the object was found. */
typedef int32_t splat_found;
enum {
    SPLAT_FOUND_BY_MASK = 1,   /* by the mask that was given */
    SPLAT_FOUND_BY_ALPHA = 2,  /* by an alpha that is not opaque everywhere */
    SPLAT_FOUND_BY_BORDER = 3, /* by what differs from the colour of the picture's border */
    SPLAT_FOUND_NOTHING = 4    /* the whole picture counts as the object */
};

/* Warnings of a picture. */
enum {
    SPLAT_PICTURE_NO_OBJECT = 1u << 0, /* nothing was found in a picture that was to be cut out */
    /* the square's field of view is more than 1.5 times the network's, or less than 1 / 1.5 */
    SPLAT_PICTURE_FIELD_OF_VIEW = 1u << 1,
    SPLAT_PICTURE_AT_BORDER =
        1u << 2 /* the object reaches the picture's border: a part is missing */
};

/* What became of a picture. Frozen. */
typedef struct splat_picture_info {
    uint32_t width;     /* width of the picture, pixels */
    uint32_t height;    /* height of the picture, pixels */
    splat_found found;  /* how the object was found */
    uint32_t warnings;  /* SPLAT_PICTURE_* warnings */
    double square[3];   /* left, top and side of what was cut out, pixels of the picture */
    double focal;       /* focal length, pixels of the picture; 0: not known */
    double fov_degrees; /* field of view of the square; 0: not known */
} splat_picture_info;

/* Where splat_picture_cut writes: squares of `resolution` pixels. Those without pixels are not
 * wanted. */
typedef struct splat_picture_cut_desc {
    uint32_t struct_size;
    uint32_t flags;   /* 0 */
    const void* next; /* NULL */
    uint32_t resolution;
    float background[3]; /* behind the object, 0 to 1 */
    splat_image image;   /* 3 channels */
    splat_image mask;    /* 1 channel, and so depth */
    splat_image depth;   /* needs the picture's map; 0 outside of the object */
    splat_image normal;  /* 3 channels; needs the picture's map; 0.5 outside of the object */
} splat_picture_cut_desc;

/* Cut a picture and its maps out as a predictor does, without a device.
 * info      out, may be NULL; it has no warnings of the field of view
 * Returns as splat_predictor_predict */
SPLAT_API splat_result splat_picture_cut(const splat_picture* picture,
                                         const splat_picture_cut_desc* desc,
                                         splat_picture_info* info);

/* ---- Predictors ------------------------------------------------------------------------------ */

/* A network with weights that turns pictures of an object into a scene, as Splatter Image's
 * demonstration does. Thread-safe: the device runs one network at a time; pictures are read and cut
 * out at once. */

/* Get the path of weights that come with the library: below its prefix, or in its build folder.
 * name      "cars64" or NULL: procedural cars at 64 x 64 pixels; "cars64-depth-normal": the same from
 *           a picture with depth and normals
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_NOT_FOUND (the message lists the names) */
SPLAT_API splat_result splat_builtin_weights(const char* name, char* buffer, size_t capacity,
                                             size_t* needed);

typedef struct splat_predictor_desc {
    uint32_t struct_size;
    uint32_t flags;           /* 0 */
    const void* next;         /* NULL */
    const char* weights_path; /* a file, or a name, as of splat_weights_load */
    /* used instead of reading the file, whose path then only names them; neither: those of
     * splat_builtin_weights(NULL) */
    splat_weights weights;
    /* text, JSON or YAML; NULL: the file of the adapters' name with .json; else that of the weights'
     * name with .json or .yaml, else config.json or config.yaml in the weights' folder; else the one of
     * splat_config_presets that fits: by shapes of tensors, by the field of view of ray_dirs and, of
     * several, by the published name of the file, such as model_cars.pth. "published" of
     * splat_weights_report has {"fit": [names], "head" (of model.head, if one fits), "nearest",
     * "differences" (from that, if none fits), "sentence"} */
    const char* config;
    const char* adapters_path; /* a file of low-rank adapters, which are folded in */
    splat_weights adapters;    /* adapters in memory; neither: only those among the weights */
    double adapters_alpha;     /* 0: lora_alpha of their metadata, else of the configuration */
    /* 0, or 2 to 64: each prediction is drawn from so many further views around the object, each of
     * these is predicted, too, and all Gaussians are joined; F3D-Gaus has 8. For networks of one
     * picture of colours and mask whose head takes depths (model.head f3d) */
    uint32_t aggregate;
    splat_convention convention; /* 0: SPLAT_CONVENTION_3DGS; how these views are drawn */
} splat_predictor_desc;

/* Create a predictor. If the weights were trained with another field of view than data.fov, theirs
 * is used, with a warning in the report.
 * desc      NULL: the built-in weights
 * Returns SPLAT_OK, SPLAT_ERROR_NOT_FOUND (a file, or the configuration beside it),
 *   SPLAT_ERROR_SHAPE_MISMATCH or SPLAT_ERROR_FORMAT (weights or adapters that do not fit),
 *   or as splat_weights_load, splat_weights_fold and splat_model_create */
SPLAT_API splat_result splat_predictor_create(splat_device device, const splat_predictor_desc* desc,
                                              splat_predictor* predictor);

/* What a predictor takes and gives, for what its weights were trained. */
typedef struct splat_predictor_info {
    uint32_t struct_size;
    uint32_t views;           /* pictures of one prediction */
    uint32_t resolution;      /* R: the network sees squares of R x R pixels */
    uint32_t channels;        /* channels of the network's input */
    uint32_t depth;           /* 1: it takes a depth map, for the network or for its head */
    uint32_t normal;          /* 1: it takes a normal map */
    uint32_t mask;            /* 1: it takes the object's mask, which is always found */
    uint32_t origin_distance; /* 1: it takes the distance of the object's origin */
    uint64_t gaussians;       /* views * S * S * model.head.per_pixel Gaussians of one prediction, of
                               * all that are joined; S is R, or fewer pixels of lgm_unet, whose
                               * model.up is shorter than model.down. A scene gets the visible ones */
    uint32_t sh_degree;       /* degree of the spherical harmonics, 0 to 3 */
    float background[3];      /* colour behind the object, 0 to 1 */
    double fov_degrees;       /* across the square; 0: each view has a focal length of its own */
    const char* category;     /* data.category, may be empty; lives as long as the predictor */
    uint32_t whole;           /* 1: it takes pictures whole, as if SPLAT_PICTURE_WHOLE were set, over
                               * the background only where a mask or an alpha is given: its head
                               * takes the depth of each pixel, of a map in the proportion of the
                               * image */
    uint32_t plane;           /* 1: it takes planes, which only objects of data sets have:
                               * splat_predictor_predict_object */
} splat_predictor_info;

/* Describe a predictor.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (info). */
SPLAT_API splat_result splat_predictor_get_info(splat_predictor predictor,
                                                splat_predictor_info* info);

/* Report on a predictor. JSON: {"weights" (the path, or empty), "warnings": [sentences], "ignored":
 * [sentences on parts of the file that are not read], "category", "metadata" (of the file), "load"
 * (as splat_model_report), "config"}.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_predictor_report(splat_predictor predictor, char* buffer,
                                              size_t capacity, size_t* needed);

/* Facts of a prediction. The caller sets arrays and capacities; an array may be NULL. */
typedef struct splat_prediction {
    uint32_t struct_size;
    uint32_t camera_capacity;
    splat_camera* cameras;        /* receives those of the views, relative to the first */
    splat_picture_info* pictures; /* receives what became of each picture */
    uint32_t picture_capacity;
    uint32_t camera_count;  /* out: all there are */
    uint32_t picture_count; /* out; 0 for an object of a data set */
    uint32_t reserved;
    float* inputs;           /* receives what the network sees, [views,channels,R,R] */
    uint64_t input_capacity; /* numbers */
    uint64_t gaussians;      /* out, as what follows: of the scene */
    uint64_t not_finite;     /* left out: numbers of theirs are not finite */
    uint64_t faint;          /* left out: opacity below 1 / 255, which no image of 8 bits shows, or
                              * below the configuration's model.head.opacity_threshold */
    double read_ms;          /* to read and cut out the pictures */
    double network_ms;       /* to run the network and read its Gaussians */
} splat_prediction;

/* Predict a scene in the frame of the first picture's camera, which looks along z from the origin.
 * LGM's network has the origin in the middle of data.znear and data.zfar before that camera.
 * pictures    `count`, as many as the network has views; those of LGM's must be of one size
 * prediction  NULL: no facts
 * Returns SPLAT_OK, SPLAT_INCOMPLETE (an array of `prediction` holds a part; the rest is done),
 *   SPLAT_ERROR_INVALID_HANDLE, errors of files, or
 *   SPLAT_ERROR_INVALID_ARGUMENT   another count; a map, focal length, pose or array that the
 *                                  network needs and a picture lacks, or the other way round; a
 *                                  network that takes planes; maps of another size; an empty mask;
 *                                  pixels that do not fit, are not finite or not from 0 to 1
 *                                  (splat_picture_source)
 *   SPLAT_ERROR_INVALID_STATE      the network's output is not finite: the weights overflow
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_TIMEOUT, SPLAT_ERROR_DEVICE_LOST */
SPLAT_API splat_result splat_predictor_predict(splat_predictor predictor,
                                               const splat_picture* pictures, uint32_t count,
                                               splat_scene* scene, splat_prediction* prediction);

/* The same for an object of a data set that was opened with the predictor's resolution and
 * background.
 * views     `count` numbers of views; the network sees the first of them, as many as it takes. The
 *           cameras of `prediction` are those of all
 * Returns as splat_predictor_predict and splat_dataset_read */
SPLAT_API splat_result splat_predictor_predict_object(splat_predictor predictor,
                                                      splat_dataset dataset, uint32_t object,
                                                      const uint32_t* views, uint32_t count,
                                                      splat_scene* scene,
                                                      splat_prediction* prediction);

/* Write the facts of a prediction as JSON: {"gaussians", "not_finite", "faint", "read_ms",
 * "network_ms", "pictures": [{"width", "height", "mask" ("mask", "alpha", "border", "nothing"),
 * "square", "focal", "fov", "warnings": [sentences]}]}.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_ARGUMENT (NULL, struct_size). */
SPLAT_API splat_result splat_prediction_report(const splat_prediction* prediction, char* buffer,
                                               size_t capacity, size_t* needed);

/* Destroy a predictor. Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_predictor_destroy(splat_predictor predictor);

#ifdef __cplusplus
}
#endif

#endif /* SPLAT_PREDICT_H */
