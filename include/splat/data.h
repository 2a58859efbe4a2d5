/* libsplat: data sets of posed images, and their files.
 *
 * Tables to files for training, once, and then views from them:
 *
 *   splat_dataset_import_desc tables = {sizeof tables, .path = "srn_cars_priors", .out = "cars"};
 *   splat_dataset_desc desc = {sizeof desc, .path = "cars", .flags = SPLAT_DATA_DEPTH};
 *   splat_dataset_import(&tables, NULL, NULL);
 *   splat_dataset_open(&desc, &dataset); */
#ifndef SPLAT_DATA_H
#define SPLAT_DATA_H

#include "core.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Data sets ------------------------------------------------------------------------------- */

/* Objects seen by several cameras, stored in a folder; needs no device. Thread-safe. */

/* Maps that a data set must have, and what becomes of incomplete objects. */
enum {
    SPLAT_DATA_DEPTH = 1u << 0,   /* depth maps are required */
    SPLAT_DATA_NORMAL = 1u << 1,  /* normal maps are required */
    SPLAT_DATA_MASK = 1u << 2,    /* masks are required */
    SPLAT_DATA_LENIENT = 1u << 3, /* keep objects with missing files, for splat_dataset_check */
    SPLAT_DATA_ALLOW_MISSING =
        1u << 4, /* leave incomplete objects out; the log and the report name them */
    SPLAT_DATA_PLANE = 1u << 5 /* plane maps are required */
};

typedef struct splat_dataset_desc {
    uint32_t struct_size;
    uint32_t flags; /* SPLAT_DATA_* */
    const void* next;
    const char* path;
    /* "store", "tables", "srn", "co3d", "nmr", "disn" (and its parts, "disn_easy", "disn_hard",
     * "disn_albedo"), "objaverse", "gso", "images"; NULL: by the folder */
    const char* format;
    const char* split;    /* "train", "val", "test"; NULL: train */
    uint32_t resolution;  /* side of the returned images, which are square; 0: as stored */
    uint32_t limit;       /* use only this many objects, the first in order; 0: all */
    uint64_t cache_bytes; /* for decoded images (8 bits); 0: 1 GiB */
    float background[3];  /* behind transparent pixels, 0 to 1 */
    uint32_t reserved;
    const char* category; /* "cars", "hydrants", where there are several; NULL: the only one */
    /* NULL, or a list for one format: a path, or one in the folder of the data */
    const char* objects_file;  /* "objaverse": JSON array of all objects in order */
    const char* excluded_file; /* "co3d": names of sequences to leave out, in any text */
    const char* views_file;    /* "nmr": tests, lines "category object source_view" */
} splat_dataset_desc;

/* Open the data set in a folder. Views of an object and images in it are ordered by name. Maps lie
 * in folders depth, normal, mask and plane of an object (also depths, normals, masks, planes; CO3D's:
 * depths.npy and so on), as images, .npy or .pfm files: vectors of normals, masks of 0 to 1; whole
 * numbers of .npy files are as those of images. Depth of such files and of 16 bits is scaled from least
 * to most. Planes have four channels as splat_planes_from_depth gives them (CO3D's planes.npy
 * [F,4,S,S] 0 to 1), at most 255 planes a map, and normals of a length of about 1. At another
 * resolution they are those of the nearest pixels. Tables, stores and DISN's layout hold no planes.
 * A transforms.json may name mask_path, depth_file_path (distances: their inverses are scaled) and
 * train_, val_ and test_filenames. Masks of 0 and 1 are 0 and 255. Without masks, alpha is the mask.
 * Objaverse has no split "test", GSO none "train"; a folder without splits serves any. The first
 * opening of a split of tables imports it, as with out NULL.
 * A folder of a split is an object if it has any part of its format (SRN's: rgb, pose, intrinsics.txt);
 * one that cannot be read is an error, and so is one that lacks a part, unless flags have LENIENT or
 * ALLOW_MISSING. Other folders are not read; the log and the report name them.
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a field of desc, a folder of several categories
 *   SPLAT_ERROR_NOT_FOUND             there is no such folder, split or list, or no such maps
 *   SPLAT_ERROR_IO                    a file cannot be read
 *   SPLAT_ERROR_FORMAT                a folder of no known format, a damaged file, an object without
 *                                     a part of it, images without poses, an object with one view
 *   of tables as splat_dataset_import */
SPLAT_API splat_result splat_dataset_open(const splat_dataset_desc* desc, splat_dataset* dataset);

/* JSON: {"format", "split", "has_splits", "objects", "views" (of all objects), "excluded" (by a
 * list), "missing": [{"name", "problem"}] (left out with ALLOW_MISSING), "not_objects": [names of
 * other folders], "not_read": [the first files in folders of maps that are not read],
 * "not_read_count", "notes": [sentences on such files and on images that are cut to squares],
 * "resolution", "stored_resolution", "maps": ["depth", ...], "names": [],
 * "views_of": []}.
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
    /* floats of each array, at least those of n views; 0: trusted */
    uint64_t image_count;
    uint64_t depth_count;
    uint64_t normal_count;
    uint64_t mask_count;
    uint64_t view_to_world_count;
    uint64_t quaternion_count;
    uint64_t focal_count;
    uint64_t origin_distance_count;
    /* [n,5,R,R] 0 to 1: (normal + 1) / 2 of the pixel's plane, in the camera's axes; its distance from
     * the camera, as a share of the farthest plane's; id, (place + 1) / number of the view's planes,
     * where place 0 has the most pixels. All 0 where there is no plane */
    float* planes;
    uint64_t plane_count;
} splat_dataset_views;

/* Read views of one object, in the given order (a view may occur twice). The camera of the first is
 * exactly the identity.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, no such object or view, an array that is too short
 *   SPLAT_ERROR_NOT_FOUND             missing maps or a missing file
 *   SPLAT_ERROR_IO, SPLAT_ERROR_FORMAT  a file that cannot be read, a damaged one, or planes other
 *                                     than above; the message has its path. After these three,
 *                                     arrays may be partly written */
SPLAT_API splat_result splat_dataset_read(splat_dataset dataset, uint32_t object,
                                          const uint32_t* views, uint32_t count,
                                          splat_dataset_views* out);

/* Check all files of one object. JSON: {"name", "views", "width", "hash" (of cameras and decoded
 * images), "problems": [sentences on damaged or missing files, poses, sizes], "warnings":
 * [sentences on views that are duplicate or blank], "depths": {"from" ("points" of a COLMAP model, or
 * "cameras"), "near", "far" (where the scene lies), "znear", "zfar" (of a network that holds it)}};
 * without "depths" where the cameras do not tell.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (no
 *   such object) */
SPLAT_API splat_result splat_dataset_check(splat_dataset dataset, uint32_t object, char* buffer,
                                           size_t capacity, size_t* needed);

/* Destroy a data set. Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_dataset_destroy(splat_dataset dataset);

/* The name of an object or a view as one part of a path, for files that are named after it: %XX for
 * separators and whatever else leads elsewhere or is forbidden on some system, at most 200 bytes.
 * Names come from files, tables and annotations, and may be "../../x". eval and the exports use it.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_ARGUMENT (NULL) */
SPLAT_API splat_result splat_path_name(const char* name, char* buffer, size_t capacity,
                                       size_t* needed);

/* ---- Tables ---------------------------------------------------------------------------------- */

/* Data sets as tables in Parquet files, in the layout of the published SRN cars with priors:
 *   <table>/<split>/<any name>.parquet   any number of files; tables are intrins, poses, rgbs, depths,
 *                                        normals and segmentation, splits train, val and test
 *   <table>/<split>-00000-of-00001.parquet   the same, as Hugging Face names them
 *   <name>_<table>.parquet               one file for all splits, with a column "split"
 * Rows belong together by the columns uuid and frame_id. Parquet is read and written by DuckDB's
 * library, which is loaded when it is needed: the one that the desc names, else the one that
 * SPLAT_DUCKDB_LIBRARY names, else libduckdb.so beside libsplat, else the loader's. */

/* Called on the calling thread now and then. `total` counts the rows of all tables. Return 0 to go
 * on; another number ends the call with SPLAT_CANCELLED. It must not throw. */
typedef int32_t (*splat_progress_callback)(void* user, uint64_t done, uint64_t total);

/* Options of an import. */
enum { SPLAT_IMPORT_REPLACE = 1u << 0 }; /* an import of other tables in the folder is removed */

typedef struct splat_dataset_import_desc {
    uint32_t struct_size;
    uint32_t flags; /* SPLAT_IMPORT_* */
    const void* next;
    const char* path;  /* folder of the tables */
    const char* out;   /* folder of the store; NULL: where splat_dataset_open looks, with REPLACE */
    const char* split; /* "train", "val", "test"; NULL: train */
    const char* duckdb; /* path of DuckDB's library; NULL: see above */
    /* parts of the work, done by calls in any processes that share the folder, and which of them this
     * call does, below `shards`; the last call to end completes the store. 0: 1 */
    uint32_t shards;
    uint32_t shard;
} splat_dataset_import_desc;

/* Copy a split of tables to a store, <out>/<split>/: .npy files with a checksum for each row, in any
 * order of which images are read fast. Tables are read once, front to back, in less than 512 MiB of
 * memory. An import that a killed process began is continued, a complete one is left alone.
 * splat_dataset_open reads `out`.
 * callback  may be NULL
 * user      passed to it
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_CANCELLED, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a field of desc, a folder with anything else in it, or
 *                                     with the same import begun in another number of shards
 *   SPLAT_ERROR_INVALID_STATE         another process imports into the folder, or the same shard
 *   SPLAT_ERROR_NOT_FOUND             no such folder, table or split; no DuckDB, with how to get it
 *   SPLAT_ERROR_UNSUPPORTED           a DuckDB that lacks a function; more than 8,388,608 rows;
 *                                     many objects (some 120,000), one with a name of more than 512
 *                                     bytes; row groups that do not fit in that memory
 *   SPLAT_ERROR_FORMAT                with table, column, row and file: missing columns, rows that
 *                                     one table lacks, ids that occur twice, values of wrong length,
 *                                     damaged files
 *   SPLAT_ERROR_IO                    the disk is full, a file cannot be read or written */
SPLAT_API splat_result splat_dataset_import(const splat_dataset_import_desc* desc,
                                            splat_progress_callback callback, void* user);

typedef struct splat_dataset_export_desc {
    uint32_t struct_size;
    uint32_t flags; /* 0 */
    const void* next;
    const char* path;
    /* "tables": as above, with a README.md that Hugging Face reads; "srn": the layout of SRN's data,
     * srn_<category>/<category>_<split>/; "images": <split>/<object>/ with transforms.json and
     * the images in rgb/; "store": <split>/, as an import gives; NULL: tables */
    const char* layout;
    const char* split;       /* to write; NULL: that of the data set */
    const char* category;    /* in names of folders and configurations; NULL: cars */
    const char* duckdb;      /* see splat_dataset_import_desc */
    const uint32_t* objects; /* objects to write; NULL: all */
    uint64_t object_count;
    uint32_t shards; /* parts of a store, see splat_dataset_import_desc */
    uint32_t shard;
} splat_dataset_export_desc;

/* Write objects of a data set with their cameras, images and all maps that it has, as 8 bits at its
 * resolution and over its background. Planes are left out, and a warning says so. Text of poses and
 * intrinsics in SRN's files and tables is kept as it is. An export that a killed process began is
 * continued: by file of 16 row groups or by object.
 * export_<split>.json in the folder says what it holds, and for tables the CRC-32 of each file,
 * which an import compares.
 * callback, user   as splat_dataset_import
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_OUT_OF_HOST_MEMORY,
 *   SPLAT_CANCELLED, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a field of desc, a folder with another export of the split,
 *                                     or one of files that have changed since
 *   SPLAT_ERROR_INVALID_STATE         another process writes the store
 *   SPLAT_ERROR_NOT_FOUND             no DuckDB, with how to get it; a missing file of the data set
 *   SPLAT_ERROR_UNSUPPORTED           an object of several focal lengths; a DuckDB, a store as above
 *   SPLAT_ERROR_FORMAT, SPLAT_ERROR_IO  a damaged file; the disk is full, a file cannot be written */
SPLAT_API splat_result splat_dataset_export(splat_dataset dataset,
                                            const splat_dataset_export_desc* desc,
                                            splat_progress_callback callback, void* user);

/* ---- Tokens from masks ----------------------------------------------------------------------- */

/* Options of tokens. */
enum {
    /* one vector for each view, which data.embedding_file reads: the sum of the tokens of all
     * segments, each times its share of the picture */
    SPLAT_TOKENS_POOLED = 1u << 0
};

typedef struct splat_tokens_desc {
    uint32_t struct_size;
    uint32_t flags; /* SPLAT_TOKENS_* */
    const void* next;
    const char* data;     /* folder of the data set */
    const char* format;   /* NULL: detected */
    const char* category; /* which of several in the folder; NULL: the only one */
    /* folder of the masks: SPLIT/OBJECT/ with a .png for each view, in the order of their names; of
     * a data set without splits OBJECT/ */
    const char* masks;
    /* .json: COCO's panoptic annotations, whose file_name is the path in that folder, or its last
     * part; else a palette, as GIMP's: lines "R G B name" */
    const char* names;
    const char* out;    /* file to write: .npz or .safetensors; an existing one is replaced */
    uint32_t dimension; /* numbers of a token, even, 12 to 4096; 0: 32, with POOLED 60 */
    uint32_t tokens;    /* tokens of a view, at most 65536; 0: 16; no effect with POOLED */
} splat_tokens_desc;

/* What was written. */
typedef struct splat_tokens_info {
    uint32_t struct_size;
    uint32_t classes;  /* names that occur */
    uint32_t objects;  /* objects of all splits */
    uint32_t reserved; /* 0 */
    uint64_t views;    /* views of all objects */
    uint64_t segments; /* segments of all masks */
    uint64_t dropped;  /* the smallest segments of views that have more than there are tokens */
} splat_tokens_info;

/* Turn masks of classes and instances into tokens that a network attends to (data.tokens_file), or
 * into vectors that modulate it (data.embedding_file): arrays of all splits, SPLIT/OBJECT, of
 * [views, dimension, tokens], with POOLED [views, dimension], where dimension is 6
 * cam_embd.dimension. A segment is what has one colour in a mask, in COCO's masks one id, R + 256 G +
 * 65536 B. Segments follow each other by area, the largest first, then by id; tokens that a view
 * lacks are 0. The id 0 of COCO and colours named "void" have none. A token has, in this order:
 *   dimension - 8 numbers of the class, sines and cosines that depend on its name alone
 *   sine and cosine of the instance's number: 0 for the first of its class in the picture
 *   x and y of the centre, width and height of its box, and its area, as shares of the picture
 *   1
 * info    out, may be NULL
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a field of desc
 *   SPLAT_ERROR_NOT_FOUND             the data set, a folder of masks, the names are not there
 *   SPLAT_ERROR_UNSUPPORTED           more than 2 GiB of tokens; annotations of more than 16 MiB, a
 *                                     palette of more than 1 MiB; another extension of out
 *   SPLAT_ERROR_FORMAT                with the file: damaged names, ids and colours without a name,
 *                                     a segment without a pixel, a mask of another size than its
 *                                     picture, more or fewer masks than views
 *   SPLAT_ERROR_IO                    a file cannot be read or written
 * After an error, `out` is as it was. */
SPLAT_API splat_result splat_tokens_write(const splat_tokens_desc* desc, splat_tokens_info* info);

/* ---- Procedural objects ---------------------------------------------------------------------- */

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
    uint32_t test_views;  /* views of val and test objects, on a spiral; 0: 251 */
    uint32_t train_objects, val_objects, test_objects;
} splat_synthetic_desc;

/* Write one object, counted over all splits, train first. Its folder appears whole or not at all;
 * an existing one is left alone. The bytes depend only on the seed, the split and the number within
 * it. Several threads may write different objects at once.
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_UNSUPPORTED (resolution above
 * 2048), or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, no such object or category, a folder with data made
 *                                     from other values
 *   SPLAT_ERROR_NOT_FOUND, SPLAT_ERROR_IO  the folder or a file cannot be written */
SPLAT_API splat_result splat_synthetic_write(const splat_synthetic_desc* desc, uint32_t index);

#ifdef __cplusplus
}
#endif

#endif /* SPLAT_DATA_H */
