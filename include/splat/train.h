/* libsplat: configurations, data sets, pictures and training.
 *
 * A trainer of the published cars model:
 *
 *   splat_trainer trainer;
 *   splat_trainer_desc desc = {sizeof desc};
 *   splat_trainer_create(device, &desc, &trainer); */
#ifndef SPLAT_TRAIN_H
#define SPLAT_TRAIN_H

#include "model.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Configuration --------------------------------------------------------------------------- */

/* JSON array of all keys of a configuration, in the order of their sections: {"key", "type"
 * ("integer", "number", "boolean", "text", "choice", "list of integers", "list of numbers", "list
 * of texts", or "any" if the value is not read), "range" (as text; the words of a choice; empty:
 * any value of the type), "default" (null: none), "origin" ("published": of Splatter Image or its
 * fork with priors; "ours"), "effect" (false: accepted, but without effect), "about" (one
 * sentence)}.
 * Returns SPLAT_OK or SPLAT_INCOMPLETE. */
SPLAT_API splat_result splat_config_keys(char* buffer, size_t capacity, size_t* needed);

/* Make a configuration of network and training with every value, as JSON for splat_model_create and
 * splat_trainer_create, from the text of a YAML or JSON file and changes to it.
 * text    NULL: the defaults, those of the published cars model
 * values  `count` texts "key=value", such as "opt.base_lr=1e-4"; later ones win
 * Keys and their meanings: splat_config_keys.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_ARGUMENT (an unknown key, with the
 *   nearest known one; a value outside its range) */
SPLAT_API splat_result splat_config_merge(const char* text, const char* const* values, size_t count,
                                          char* buffer, size_t capacity, size_t* needed);

/* ---- Data sets ------------------------------------------------------------------------------- */

/* Objects seen by several cameras, stored in a folder and read into host memory; needs no
 * device. Thread-safe. */

enum {
    SPLAT_DATA_DEPTH = 1u << 0, /* maps that are required */
    SPLAT_DATA_NORMAL = 1u << 1,
    SPLAT_DATA_MASK = 1u << 2,
    SPLAT_DATA_LENIENT = 1u << 3 /* keep objects with missing files, for splat_dataset_check */
};

typedef struct splat_dataset_desc {
    uint32_t struct_size;
    uint32_t flags; /* SPLAT_DATA_* */
    const void* next;
    const char* path;
    const char*
        format;        /* "srn", "co3d", "nmr", "objaverse", "gso", "images"; NULL: by the folder */
    const char* split; /* "train", "val", "test"; NULL: train */
    uint32_t resolution;  /* of the returned images, which are square; 0: as stored */
    uint32_t limit;       /* use only this many objects, the first in order; 0: all */
    uint64_t cache_bytes; /* for decoded images (8 bits); 0: 1 GiB */
    float background[3];  /* behind transparent pixels, 0 to 1 */
    uint32_t reserved;
} splat_dataset_desc;

/* Open the data set in a folder. Views of an object and images in it are ordered by name.
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a folder of no known format, a missing split or missing
 *                                     maps, images without poses, an object with one view */
SPLAT_API splat_result splat_dataset_open(const splat_dataset_desc* desc, splat_dataset* dataset);

/* JSON: {"format", "split", "objects", "views" (of all objects), "resolution", "stored_resolution",
 * "maps": ["depth", ...], "names": [], "views_of": []}.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE */
SPLAT_API splat_result splat_dataset_report(splat_dataset dataset, char* buffer, size_t capacity,
                                            size_t* needed);

/* Destinations of n views of R x R pixels; NULL: not read. */
typedef struct splat_dataset_views {
    uint32_t struct_size;
    uint32_t reserved;
    float* images;  /* [n,3,R,R] 0 to 1 */
    float* depths;  /* [n,1,R,R] 0 to 1, larger is nearer; scaled for each image */
    float* normals; /* [n,3,R,R] 0 to 1: (normal + 1) / 2, in the camera's axes */
    float* masks;   /* [n,1,R,R] 0 to 1 */
    /* [n,16] row vectors, OpenCV axes; the world is the frame of the first view */
    float* view_to_world;
    float* quaternions;      /* [n,4] w x y z of that rotation, w >= 0 */
    float* focals;           /* [n,2] pixels at R */
    float* origin_distances; /* [n] of the origin along the absolute camera's axis (CO3D); else 0 */
} splat_dataset_views;

/* Read views of one object, in the given order (a view may occur twice). The camera of the first is
 * exactly the identity.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, no such object or view, missing maps, a damaged file
 *                                     (the message has its path and the fault); arrays may be
 *                                     partly written */
SPLAT_API splat_result splat_dataset_read(splat_dataset dataset, uint32_t object,
                                          const uint32_t* views, uint32_t count,
                                          splat_dataset_views* out);

/* Check all files of one object. JSON: {"name", "views", "width", "hash" (of cameras and decoded
 * images), "problems": [sentences on damaged or missing files, poses, sizes], "warnings":
 * [sentences on views that are duplicate or blank]}.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (no
 *   such object) */
SPLAT_API splat_result splat_dataset_check(splat_dataset dataset, uint32_t object, char* buffer,
                                           size_t capacity, size_t* needed);

/* Destroy a data set. Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_dataset_destroy(splat_dataset dataset);

/* Procedural objects with exact maps, in the layout of SRN's data. Cameras at distance 1.3 look at
 * the origin; objects lie within 0.5 of it; the focal length is 131.25 pixels of 128. */
typedef struct splat_synthetic_desc {
    uint32_t struct_size;
    uint32_t flags; /* 0 */
    const void* next;
    const char* path;
    const char* category; /* "cars", "chairs", "mixed"; NULL: cars */
    uint64_t seed;
    uint32_t resolution;  /* 8 to 2048; 0: 128 */
    uint32_t train_views; /* from random places around the object; 0: 50 */
    uint32_t test_views;  /* of val and test, on a spiral; 0: 251 */
    uint32_t train_objects, val_objects, test_objects;
} splat_synthetic_desc;

/* Write one object, counted over all splits, train first. Its folder appears whole or not at all;
 * an existing one is left alone. The bytes depend only on the seed, the split and the number within
 * it.
 * Several threads may write different objects at once.
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_UNSUPPORTED (resolution above
 * 2048), or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, no such object or category, a file that cannot be
 *                                     written, a folder with data made from other values */
SPLAT_API splat_result splat_synthetic_write(const splat_synthetic_desc* desc, uint32_t index);

/* ---- Pictures -------------------------------------------------------------------------------- */

/* A picture of one object as input of a network: the object is cut out and put in the middle of a
 * square with a plain background, as Splatter Image's demonstration does. */
typedef struct splat_photo_desc {
    uint32_t struct_size;
    uint32_t flags; /* SPLAT_PHOTO_* */
    const void* next;
    const char* image; /* PNG, JPEG (turned as its Exif data says) or WebP */
    const char* depth; /* maps of the same size; NULL: none */
    const char* normal;
    /* of the object; NULL: the image's alpha, else pixels that differ from its border */
    const char* mask;
    uint32_t resolution; /* R, 8 to 2048 */
    float foreground;    /* the object's longer side, as a fraction of the square's; 0: 0.65 */
    float background[3]; /* 0 to 1 */
    uint32_t reserved;
} splat_photo_desc;

enum { SPLAT_PHOTO_WHOLE = 1u << 0 }; /* use the largest centred square instead of the object's */

/* Read a picture into images, depths, normals and masks of `out`, n = 1; depths and normals need
 * their maps. The report is JSON: {"width", "height", "mask" ("mask", "alpha", "border" or
 * "nothing"), "square": [left, top, side]}.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE (the report), SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a file that cannot be read, maps of another size, an
 *                                     empty mask; `out` is unchanged */
SPLAT_API splat_result splat_photo_read(const splat_photo_desc* desc, splat_dataset_views* out,
                                        char* buffer, size_t capacity, size_t* needed);

/* ---- Trainer --------------------------------------------------------------------------------- */

/* A network in training: parameters, Adam's moments, averaged weights, and the rasterizer that
 * draws its Gaussians. The caller synchronises calls on one trainer. */

typedef struct splat_trainer_desc {
    uint32_t struct_size;
    uint32_t flags; /* 0 */
    const void* next;
    const char* config; /* from splat_config_merge; NULL: the defaults */
} splat_trainer_desc;

/* Create a trainer; the parameters of its network are zero.
 * Returns as splat_model_create. */
SPLAT_API splat_result splat_trainer_create(splat_device device, const splat_trainer_desc* desc,
                                            splat_trainer* trainer);

/* Return the network in training, to initialise, load, store and read it: a separate handle, which
 * the caller destroys and which keeps the trainer's memory alive. Its passes apply dropout as in
 * training.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (NULL). */
SPLAT_API splat_result splat_trainer_model(splat_trainer trainer, splat_model* model);

/* B = opt.batch_size objects with V = data.input_images input and T = opt.imgs_per_obj target
 * images; poses are relative to the object's first input image. */
typedef struct splat_trainer_batch {
    uint32_t struct_size;
    uint32_t reserved;           /* 0 */
    const float* images;         /* [B*V,channels,R,R] */
    const float* view_to_world;  /* [B*V,4,4] row vectors */
    const float* quaternions;    /* [B*V,4] w x y z */
    const float* focals;         /* [B*V,2] pixels; NULL unless data.fov is 0 */
    const float* embedding;      /* [B*V,length] of a custom embedding, else NULL */
    const float* tokens;         /* [B*V,token_dim,tokens], else NULL */
    const float* targets;        /* [B*T,3,R,R] */
    const splat_camera* cameras; /* B*T, of R x R pixels */
    uint32_t channels; /* of each input image, checked against the configuration; 0: not checked */
    uint32_t objects;  /* B, checked against the configuration; 0: not checked */
} splat_trainer_batch;

typedef struct splat_trainer_info {
    uint32_t struct_size;
    uint32_t skipped; /* 1: loss or gradients were not finite, and nothing was updated */
    uint64_t step;    /* updates done */
    uint64_t pairs;   /* (tile, Gaussian) drawn */
    double loss;      /* mean over the batch, like the following */
    double squared_error;
    double pixel_loss;
    double ssim; /* 0 unless opt.lambda_ssim > 0 */
    double network_ms;
    double render_ms;
    double update_ms;
    double lpips; /* 0 unless opt.lambda_lpips > 0, and before opt.start_lpips_after */
} splat_trainer_info;

/* Do one update. Arrays are read before the call returns.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_SHAPE_MISMATCH and
 *   SPLAT_ERROR_INVALID_ARGUMENT as splat_model_forward, SPLAT_ERROR_OUT_OF_HOST_MEMORY,
 *   SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_ERROR_TIMEOUT, SPLAT_ERROR_DEVICE_LOST; on error there
 *   is no update */
SPLAT_API splat_result splat_trainer_step(splat_trainer trainer, const splat_trainer_batch* batch,
                                          splat_trainer_info* info);

/* JSON: {"step", "attempts" (calls that ran, including skipped ones), "parameters", "trainable",
 * "config"}.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE */
SPLAT_API splat_result splat_trainer_report(splat_trainer trainer, char* buffer, size_t capacity,
                                            size_t* needed);

/* Store the averaged weights (opt.ema) as a state dict, or the current ones if there are none.
 * Returns as splat_model_store. */
SPLAT_API splat_result splat_trainer_store(splat_trainer trainer, splat_weights* weights);

/* Save everything that the next step depends on in a .safetensors file, whole or not at all.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (NULL, the file cannot
 *   be written), and errors of the device. */
SPLAT_API splat_result splat_trainer_save(splat_trainer trainer, const char* path);

/* Resume from such a file, bit-exactly. On an error the trainer is unchanged.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      no such file, damaged (it has a checksum), of another network
 *                                     or optimiser */
SPLAT_API splat_result splat_trainer_resume(splat_trainer trainer, const char* path);

/* Destroy a trainer. Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_trainer_destroy(splat_trainer trainer);

#ifdef __cplusplus
}
#endif

#endif /* SPLAT_TRAIN_H */
