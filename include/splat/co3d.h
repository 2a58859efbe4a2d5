/* libsplat: CO3D's raw release to the data set that Splatter Image's code reads.
 *
 *   splat_co3d_info info = {.struct_size = sizeof info};
 *   splat_co3d_desc desc = {
 *       .struct_size = sizeof desc, .raw = "co3d", .out = "data", .category = "hydrant"};
 *   splat_co3d_prepare(&desc, &info); */
#ifndef SPLAT_CO3D_H
#define SPLAT_CO3D_H

#include "core.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Options of what is prepared. */
enum {
    /* keep the cameras of the release; else the world's origin, axes and scale come from the point
     * cloud and the cameras, as in the published data */
    SPLAT_CO3D_STORED_POSES = 1u << 0
};

typedef struct splat_co3d_desc {
    uint32_t struct_size;
    uint32_t flags; /* SPLAT_CO3D_* */
    const void* next;
    const char* raw;      /* folder of the release, with a folder for each category */
    const char* out;      /* folder to write to */
    const char* category; /* "hydrant", "teddybear" */
    const char* subset;   /* NULL: "fewview_dev", as published */
    const char* split;    /* "train", "val", "test"; NULL: train */
    uint32_t size;        /* side of the images, pixels; 0: 128 */
    uint32_t limit;       /* only this many sequences, the first by name; 0: all */
} splat_co3d_desc;

/* What was prepared. */
typedef struct splat_co3d_info {
    uint32_t struct_size;
    uint32_t sequences; /* sequences in the split */
    uint32_t kept;      /* sequences that were there before */
    uint32_t left_out;  /* sequences left out: their cameras are not finite */
    uint64_t frames;    /* frames of all sequences in the split */
} splat_co3d_info;

/* Write the images, masks and cameras of a split to OUT/co3d_CATEGORY_for_gs/SPLIT, which
 * splat_dataset_open reads: the largest square around the principal point, LANCZOS to the size, on
 * black. Sequences that are there are kept, so that an interrupted run can be repeated. Runs on
 * several threads; each sequence done is a message of the level info.
 * info    out, may be NULL
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a field of desc, sequences of another size, subset or flags
 *   SPLAT_ERROR_NOT_FOUND             annotations, an image, a mask or points are not there
 *   SPLAT_ERROR_IO                    a file cannot be read or written
 *   SPLAT_ERROR_FORMAT                damaged or incomplete annotations, a damaged file
 * After an error, what was written stays. */
SPLAT_API splat_result splat_co3d_prepare(const splat_co3d_desc* desc, splat_co3d_info* info);

#ifdef __cplusplus
}
#endif

#endif /* SPLAT_CO3D_H */
