/* libsplat: scenes of 3D Gaussians and cameras, in memory and in files. Needs no device.
 *
 * A scene seen from 24 places around it:
 *
 *   splat_scene scene;
 *   splat_camera cameras[24];
 *   splat_scene_load("scene.ply", NULL, &scene);
 *   splat_camera_orbit(scene, NULL, 24, cameras); */
#ifndef SPLAT_SCENE_H
#define SPLAT_SCENE_H

#include "core.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Scene ----------------------------------------------------------------------------------- */

/* A set of 3D Gaussians in host memory, in the parameters that 3DGS files store. Needs no device.
 * Thread-safe. A rasterizer that draws it leaves a packed copy on its device, which keeps that
 * device open until the scene changes or is destroyed. Axes are those of 3DGS .ply files: x right,
 * y down, z forward (SPLAT_FRAME_RDF).
 *
 * Attributes, float32, row-major, n Gaussians, K = (sh_degree + 1)^2:
 *   "means" [n,3] scene units             "log_scales" [n,3] or activated "scales" [n,3], > 0
 *   "rotations" [n,4] w, x, y, z          "opacity_logits" [n] or activated "opacities" [n], 0 to 1
 *   "sh" [n,K,3] constant term first; colour = max(0, 0.5 + sum sh_k Y_k(direction)) */

/* What the file of a scene says of drawing it, where formats differ. Values are those of SPLAT_RASTERIZER_:
 * a rasterizer draws a scene so if these bits are among its flags. */
enum {
    SPLAT_DRAWN_ANTIALIASED = 1u << 1, /* opacities compensate for the dilation (Mip-Splatting) */
    SPLAT_DRAWN_BY_DISTANCE = 1u << 12,  /* blended by the distance to the camera, not by depth */
    SPLAT_DRAWN_CUT_3_SIGMA = 1u << 13,  /* a Gaussian ends at 3 sigma */
    SPLAT_DRAWN_LINEAR_COLORS = 1u << 14 /* colours are blended linear, then converted to sRGB */
};

typedef struct splat_scene_desc {
    uint32_t struct_size;
    uint32_t flags;     /* 0 */
    const void* next;   /* NULL */
    uint64_t count;     /* Gaussians; 0 makes an empty scene */
    uint32_t sh_degree; /* 0 to 3 */
    uint32_t drawn_as;  /* SPLAT_DRAWN_ bits */
    /* arrays as above, copied; NULL: zeros (rotations: 1, 0, 0, 0) */
    const float* means;
    const float* log_scales;
    const float* rotations;
    const float* opacity_logits;
    const float* sh;
    /* floats of each array, at least those of `count` Gaussians; 0: trusted */
    uint64_t mean_count;
    uint64_t log_scale_count;
    uint64_t rotation_count;
    uint64_t opacity_logit_count;
    uint64_t sh_count;
} splat_scene_desc;

/* Create a scene.
 * Returns SPLAT_OK, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      desc, sh_degree > 3, an array that is too short
 *   SPLAT_ERROR_UNSUPPORTED           more than 2^27 Gaussians
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY */
SPLAT_API splat_result splat_scene_create(const splat_scene_desc* desc, splat_scene* scene);

/* A format of scene files. */
typedef int32_t splat_scene_format;
enum {
    SPLAT_SCENE_PLY = 1,            /* 3DGS, ascii or binary, properties in any order */
    SPLAT_SCENE_COMPRESSED_PLY = 2, /* SuperSplat's quantised chunks of 256; named .compressed.ply */
    SPLAT_SCENE_SPLAT = 3,          /* 8-bit colours, no higher SH bands */
    SPLAT_SCENE_SPZ = 4,            /* quantised; versions 1 to 4 are read, 3 and 4 written */
    SPLAT_SCENE_KSPLAT = 5,         /* files of GaussianSplats3D, SH bands up to 2; read only */
    SPLAT_SCENE_SOG = 6,            /* quantised, in another order; versions 1 and 2 are read, 2 written */
    SPLAT_SCENE_GLTF = 7,           /* glTF with KHR_gaussian_splatting; written as one file */
    SPLAT_SCENE_GLB = 8             /* glTF as one binary file */
};

/* JSON array of all formats of scene files: {"name" (of reports), "id" (SPLAT_SCENE_), "extension",
 * "holds", "frame" (the usual one), "max_sh_degree", "written" (bool: else read only)}.
 * Returns SPLAT_OK or SPLAT_INCOMPLETE. */
SPLAT_API splat_result splat_scene_formats(char* buffer, size_t capacity, size_t* needed);

/* Axes x, y, z of a file: right or left, up or down, front or back. */
typedef int32_t splat_frame;
enum {
    SPLAT_FRAME_RDF = 1, /* right, down, front: .ply, .splat, COLMAP, OpenCV; scenes in memory */
    SPLAT_FRAME_RUB = 2, /* right, up, back: .spz, OpenGL, three.js */
    SPLAT_FRAME_LUF = 3, /* left, up, front: .gltf, .glb */
    SPLAT_FRAME_RUF = 4, /* right, up, front: Unity */
    SPLAT_FRAME_LDB = 5, /* left, down, back */
    SPLAT_FRAME_RDB = 6, /* right, down, back */
    SPLAT_FRAME_LUB = 7, /* left, up, back */
    SPLAT_FRAME_LDF = 8  /* left, down, front */
};

/* For splat_scene_file_desc.sh_degree: only the constant colour. */
#define SPLAT_SH_CONSTANT (-1)

/* What is done with files that are not quite as they should be. */
enum {
    /* read .ply, .spz, .ksplat and .glb files with bytes that their header does not count, with a warning that
     * they are left out, instead of refusing them */
    SPLAT_SCENE_LENIENT = 1u << 0,
    /* write .spz files of scenes of which more than 1 % of the Gaussians have scales that the format does not
     * hold, with the nearest ones, instead of refusing them */
    SPLAT_SCENE_CLAMP = 1u << 1
};

/* How a scene is read or written; 0 is the default. */
typedef struct splat_scene_file_desc {
    uint32_t struct_size;
    uint32_t flags;            /* SPLAT_SCENE_ bits */
    const void* next;          /* NULL */
    splat_scene_format format; /* 0 = by the first bytes, else by the extension of the path */
    splat_frame frame;         /* axes of the file; 0 = the format's usual ones */
    /* drop bands, or pad them with zeros, to degree 1 to 3 or (SPLAT_SH_CONSTANT) 0; 0: keep all */
    int32_t sh_degree;
    uint32_t spz_version; /* to write: 3 or 4; 0 = 3 */
    uint64_t max_count;   /* refuse files with more Gaussians; 0 = 2^27 */
} splat_scene_file_desc;

/* Read a scene from a file.
 * path      of a file; of the folder of a .sog file that is unpacked, or of its meta.json
 * desc      may be NULL for defaults
 * Returns SPLAT_OK, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a field of desc
 *   SPLAT_ERROR_NOT_FOUND, SPLAT_ERROR_IO  the file is not there, cannot be read
 *   SPLAT_ERROR_FORMAT                damaged, truncated, not a scene or not of desc.format
 *   SPLAT_ERROR_UNSUPPORTED           a known format that cannot be read, or more than max_count
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY */
SPLAT_API splat_result splat_scene_load(const char* path, const splat_scene_file_desc* desc,
                                        splat_scene* scene);

/* Tell how large the scene of a file is, from its head, to decide whether to read it.
 * desc       may be NULL for defaults
 * count      out, Gaussians
 * sh_degree  out, of the spherical harmonics that splat_scene_load would read, 0 to 3
 * Returns as splat_scene_load. */
SPLAT_API splat_result splat_scene_peek(const char* path, const splat_scene_file_desc* desc,
                                        uint64_t* count, uint32_t* sh_degree);

/* Read a scene from the bytes of a file.
 * data      in, `bytes` bytes; .splat, .ksplat and .gltf have no magic bytes, so desc.format must name
 *           them; a .gltf that names other files is refused
 * desc      may be NULL for defaults
 * Returns as splat_scene_load. */
SPLAT_API splat_result splat_scene_load_memory(const void* data, size_t bytes,
                                               const splat_scene_file_desc* desc,
                                               splat_scene* scene);

/* Report what was found in the scene's file. JSON: {"format", "version", "count", "sh_degree",
 * "frame", "ignored": [names], "non_finite_values", "bad_rotations", "drawn_as": [those of
 * "antialiased", "by distance", "3 sigma", "linear colours"]}; {} for a scene without file.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_scene_load_report(splat_scene scene, char* buffer, size_t capacity,
                                               size_t* needed);

/* Write a scene to a file, which appears whole or not at all.
 * desc      may be NULL for defaults
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      desc, values that the format cannot hold
 *   SPLAT_ERROR_NOT_FOUND             there is no such folder
 *   SPLAT_ERROR_IO                    the file cannot be written; an old one stays
 *   SPLAT_ERROR_UNSUPPORTED           a format or extension that cannot be written
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY */
SPLAT_API splat_result splat_scene_save(splat_scene scene, const char* path,
                                        const splat_scene_file_desc* desc);

/* Write the bytes of such a file to memory.
 * desc      names the format
 * buffer    out, `capacity` bytes; untouched if they are too few
 * needed    out, bytes of the file; may be NULL
 * Returns as splat_scene_save, or SPLAT_INCOMPLETE (capacity). */
SPLAT_API splat_result splat_scene_save_memory(splat_scene scene, const splat_scene_file_desc* desc,
                                               void* buffer, size_t capacity, size_t* needed);

/* Copy an attribute out of a scene.
 * name      as listed above
 * values    out, `bytes` bytes, at least those of the attribute
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      name; too few bytes. Nothing is changed */
SPLAT_API splat_result splat_scene_read(splat_scene scene, const char* name, float* values,
                                        size_t bytes);

/* Replace the values of an attribute.
 * name      as listed above
 * values    in, `bytes` bytes, at least those of the attribute
 * Returns as splat_scene_read; also SPLAT_ERROR_INVALID_ARGUMENT for a value of "scales" or
 * "opacities" outside its range. */
SPLAT_API splat_result splat_scene_write(splat_scene scene, const char* name, const float* values,
                                         size_t bytes);

/* Copy an attribute to a new tensor of its shape.
 * Returns what splat_scene_read and splat_tensor_from_host return; SPLAT_ERROR_INVALID_STATE for a
 * scene without Gaussians. */
SPLAT_API splat_result splat_scene_to_tensor(splat_scene scene, const char* name,
                                             splat_device device, splat_tensor* tensor);

/* x -> scale * rotation x + translation. Frozen. */
typedef struct splat_similarity {
    double rotation[4];    /* quaternion w, x, y, z, of any length > 0 */
    double translation[3]; /* scene units */
    double scale;          /* factor, > 0 */
} splat_similarity;

/* Move, turn and scale a scene, including its spherical harmonics.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (the similarity, or one
 *   that moves means beyond float32), SPLAT_ERROR_OUT_OF_HOST_MEMORY; on error the scene is unchanged. */
SPLAT_API splat_result splat_scene_transform(splat_scene scene, const splat_similarity* similarity);

/* Keep the Gaussians whose mean lies in a box.
 * low, high  in, exactly 3 doubles each, scene units; the faces belong to the box
 * Returns as splat_scene_transform. */
SPLAT_API splat_result splat_scene_crop(splat_scene scene, const double* low, const double* high);

/* Keep the Gaussians whose mean lies in a sphere.
 * center    in, exactly 3 doubles, scene units
 * radius    scene units, >= 0; the surface belongs to the sphere
 * Returns as splat_scene_transform. */
SPLAT_API splat_result splat_scene_crop_sphere(splat_scene scene, const double* center,
                                               double radius);

/* What a filter does besides. */
enum {
    /* drop NaN, infinities and rotations of length 0; an infinite logit is an opacity of 0 or 1 */
    SPLAT_FILTER_FINITE = 1u << 0,
    SPLAT_FILTER_SORT = 1u << 1 /* order the remaining ones along a Morton curve */
};

/* Keep the Gaussians of opacity >= min_opacity, in their order.
 * flags        SPLAT_FILTER_ bits
 * min_opacity  0 to 1
 * Returns as splat_scene_transform. */
SPLAT_API splat_result splat_scene_filter(splat_scene scene, uint32_t flags, double min_opacity);

/* Change the degree of the spherical harmonics: bands above it are dropped, missing ones are zeros.
 * sh_degree 0 (only the constant colour) to 3
 * Returns as splat_scene_transform. */
SPLAT_API splat_result splat_scene_set_sh_degree(splat_scene scene, uint32_t sh_degree);

/* Concatenate the Gaussians of `count` scenes into a new one, with the highest of their degrees; no
 * scenes make an empty one.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (NULL),
 *   SPLAT_ERROR_UNSUPPORTED (more than 2^27 Gaussians), SPLAT_ERROR_OUT_OF_HOST_MEMORY. */
SPLAT_API splat_result splat_scene_merge(const splat_scene* scenes, uint32_t count,
                                         splat_scene* scene);

/* What the Gaussians of a scene are. */
typedef struct splat_scene_info {
    uint32_t struct_size;
    uint32_t sh_degree;     /* degree of the spherical harmonics, 0 to 3 */
    uint64_t count;         /* Gaussians */
    double low[3];          /* lower bounds of the finite means */
    double high[3];         /* upper bounds of the finite means */
    double center[3];       /* median of the finite means, axis by axis */
    double radius;          /* distance from the centre that holds 95 % of the finite means */
    double scale_min;       /* smallest finite standard deviation, scene units */
    double scale_max;       /* largest finite standard deviation, scene units */
    double scale_mean;      /* mean of the finite standard deviations, scene units */
    double opacity_min;     /* smallest opacity, 0 to 1 */
    double opacity_max;     /* largest opacity, 0 to 1 */
    double opacity_mean;    /* mean of the opacities, 0 to 1 */
    uint64_t non_finite;    /* numbers of all attributes that are NaN or infinite */
    uint64_t bad_rotations; /* rotations of length 0, or not finite */
    uint64_t degenerate;    /* Gaussians with a scale below 1e-12 */
    uint64_t invisible;     /* Gaussians of opacity below 1/255 */
    uint64_t bytes;         /* bytes of all attributes in host memory */
    uint64_t device_bytes;  /* bytes of the packed copy on a device that draws it; a rasterizer needs more besides */
    /* about how many Gaussians lie one behind another: the sum of the areas pi s1 s2 of the 1-sigma ellipses over the
     * two largest scales, over the mean face of the box of the middle 98 % of the finite means of each axis (without
     * an area: over the median ellipse); infinite if a scale is; "fillRatio" of splat-transform 3 */
    double fill_ratio;
    double band_max;     /* largest magnitude of a finite coefficient above the constant one; 0: no colour depends on
                            the direction */
    uint64_t beyond_spz; /* Gaussians with a scale that .spz files do not hold: below exp(-10) or above exp(5.94) */
    uint32_t drawn_as;      /* SPLAT_DRAWN_ bits; of merged scenes those of the first */
    uint32_t reserved;      /* 0 */
} splat_scene_info;

/* Tell the size of a scene, without measuring it.
 * count     out, Gaussians; may be NULL
 * sh_degree  out, 0 to 3; may be NULL
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_scene_get_size(splat_scene scene, uint64_t* count,
                                            uint32_t* sh_degree);

/* Measure a scene.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT,
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY. */
SPLAT_API splat_result splat_scene_get_info(splat_scene scene, splat_scene_info* info);

/* Destroy a scene.
 * Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_scene_destroy(splat_scene scene);

/* ---- Camera ---------------------------------------------------------------------------------- */

/* A pinhole camera. Frozen. The centre of the pixel in column i and row j is (i + 0.5, j + 0.5). */
typedef struct splat_camera {
    uint32_t width;  /* width of the image, pixels */
    uint32_t height; /* height of the image, pixels */
    double fx;       /* horizontal focal length, pixels */
    double fy;       /* vertical focal length, pixels */
    double cx;       /* principal point, pixels from the left edge */
    double cy;       /* principal point, pixels from the upper edge */
    /* row-major 4x4, last row 0 0 0 1; OpenCV axes of the camera: x right, y down, z forward */
    double world_to_camera[16];
} splat_camera;

/* Intrinsics of an image whose horizontal field of view is `fov_x` radians, square pixels,
 * principal point in the middle; the pose is the identity.
 * camera    out
 * Returns SPLAT_OK, or SPLAT_ERROR_INVALID_ARGUMENT: a side outside 1 to 16384, or an angle outside
 * 0 to pi. */
SPLAT_API splat_result splat_camera_from_fov(uint32_t width, uint32_t height, double fov_x,
                                             splat_camera* camera);

/* Set the pose: at `eye`, looking at `target`, with `up` (a direction of the world) upwards in the
 * image.
 * camera    in/out, the intrinsics stay
 * eye, target, up  in, exactly 3 doubles each, scene units
 * Returns SPLAT_OK, or SPLAT_ERROR_INVALID_ARGUMENT: eye and target coincide, `up` is parallel to
 * the view, or a value is not finite. */
SPLAT_API splat_result splat_camera_look_at(splat_camera* camera, const double* eye,
                                            const double* target, const double* up);

/* Set the pose from an OpenGL camera-to-world matrix (x right, y up, z backwards; NeRF's
 * transform_matrix).
 * camera    in/out, the intrinsics stay
 * camera_to_world  in, exactly 16 doubles, row-major
 * Returns SPLAT_OK, or SPLAT_ERROR_INVALID_ARGUMENT: the matrix is not a rotation with a
 * translation. */
SPLAT_API splat_result splat_camera_from_opengl(splat_camera* camera,
                                                const double* camera_to_world);

/* Give the pose as such a matrix.
 * camera_to_world  out, exactly 16 doubles, row-major
 * Returns as splat_camera_from_opengl, for the camera's own matrix. */
SPLAT_API splat_result splat_camera_to_opengl(const splat_camera* camera, double* camera_to_world);

/* Cameras on a circle; 0 is the default. */
typedef struct splat_orbit_desc {
    uint32_t struct_size;
    uint32_t flags;   /* 0 */
    const void* next; /* NULL */
    uint32_t width;   /* pixels; 0 = 512 */
    uint32_t height;  /* pixels; 0 = 512 */
    double fov_x;     /* radians; 0 = 0.7 */
    double elevation; /* radians above the horizon */
    double start;     /* angle of the first camera, radians; 0: in front, looking along +z */
    double distance;  /* scene units from the middle; 0 = the scene fills 95 % of the images */
    double up[3];     /* a direction of the world; 0, 0, 0 = 0, -1, 0 */
} splat_orbit_desc;

/* `count` cameras at equal angles on a circle around the middle of a scene's bounds: those of the
 * means of its visible Gaussians (opacity of at least 1/255), without those that lie farther from
 * their median than 1.5 times the radius that holds 98 % of their opacity. With distance 0 all of
 * these are in every image.
 * desc      may be NULL for defaults
 * cameras   out, `count` of them
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      options that do not give a valid camera, or a scene without
 *                                     visible extent if distance is 0 */
SPLAT_API splat_result splat_camera_orbit(splat_scene scene, const splat_orbit_desc* desc,
                                          uint32_t count, splat_camera* cameras);

/* `count` cameras along a smooth path through others, in their order: cubic curves of positions and rotations through
 * all of them, by about equal steps of distance and angle. They have the size and lens of the first one.
 * keys      poses of the path; those equal to the one before are left out
 * closed    1: the path returns to its first key, which the last camera comes before; 0: it ends at the last key
 * cameras   out, `count` of them
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or SPLAT_ERROR_INVALID_ARGUMENT (NULL, an invalid camera, fewer
 *   than two different poses, closed) */
SPLAT_API splat_result splat_camera_path(const splat_camera* keys, uint32_t key_count,
                                         uint32_t closed, uint32_t count, splat_camera* cameras);

/* Options of reading cameras. */
enum {
    /* read cameras with lens distortion, or with other lenses, as pinholes, instead of refusing them */
    SPLAT_CAMERA_IGNORE_DISTORTION = 1u << 0
};

/* How cameras are read; 0 is the default. */
typedef struct splat_camera_file_desc {
    uint32_t struct_size;
    uint32_t flags;   /* SPLAT_CAMERA_ bits */
    const void* next; /* NULL */
    uint32_t width;   /* width in pixels, for a transforms.json without size; else 0 */
    uint32_t height;  /* height in pixels, for the same file */
} splat_camera_file_desc;

/* Read the cameras of a NeRF transforms.json, or of a COLMAP model's folder (text or binary).
 * desc      may be NULL for defaults
 * cameras   out, `capacity` of them; may be NULL when capacity is 0
 * count     out, number of cameras in the file; may be NULL
 * Returns SPLAT_OK, SPLAT_INCOMPLETE (the first `capacity` are written),
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a field of desc
 *   SPLAT_ERROR_NOT_FOUND             there is no such file, or no model in the folder
 *   SPLAT_ERROR_IO                    a file cannot be read
 *   SPLAT_ERROR_FORMAT                damaged, truncated, an invalid camera
 *   SPLAT_ERROR_UNSUPPORTED           distortion, another lens model */
SPLAT_API splat_result splat_camera_load(const char* path, const splat_camera_file_desc* desc,
                                         splat_camera* cameras, uint32_t capacity, uint32_t* count);

/* Report on the same file. JSON: {"names": [paths of the images, in the order of the cameras],
 * "warnings": [sentences]}.
 * Returns as splat_camera_load. */
SPLAT_API splat_result splat_camera_load_report(const char* path,
                                                const splat_camera_file_desc* desc, char* buffer,
                                                size_t capacity, size_t* needed);

/* Files of cameras in memory. */
typedef struct splat_camera_bytes {
    uint32_t struct_size;
    uint32_t reserved;   /* 0 */
    const void* cameras; /* transforms.json, or COLMAP's cameras.bin or cameras.txt */
    size_t camera_bytes;
    const void* images; /* COLMAP's images.bin or images.txt; NULL for a transforms.json */
    size_t image_bytes;
} splat_camera_bytes;

/* Read cameras from memory.
 * Returns as splat_camera_load. */
SPLAT_API splat_result splat_camera_load_memory(const splat_camera_bytes* files,
                                                const splat_camera_file_desc* desc,
                                                splat_camera* cameras, uint32_t capacity,
                                                uint32_t* count);

/* Report on the same files, as splat_camera_load_report.
 * Returns as splat_camera_load. */
SPLAT_API splat_result splat_camera_load_memory_report(const splat_camera_bytes* files,
                                                       const splat_camera_file_desc* desc,
                                                       char* buffer, size_t capacity,
                                                       size_t* needed);

/* Write cameras as a NeRF transforms.json, whole or not at all. splat_camera_load reads the same
 * intrinsics, and poses within float64 rounding.
 * cameras   `count` of them; none makes a file without frames
 * names     `count` texts, paths of the images (file_path); NULL: empty ones
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, an invalid camera
 *   SPLAT_ERROR_NOT_FOUND             there is no such folder
 *   SPLAT_ERROR_IO                    the file cannot be written */
SPLAT_API splat_result splat_camera_save(const char* path, const splat_camera* cameras,
                                         const char* const* names, uint32_t count);

/* Write the same bytes to memory.
 * needed    out, bytes of the file, may be NULL; with a smaller capacity the result is
 *           SPLAT_INCOMPLETE and nothing is written to `buffer`
 * Returns as splat_camera_save, SPLAT_INCOMPLETE. */
SPLAT_API splat_result splat_camera_save_memory(const splat_camera* cameras,
                                                const char* const* names, uint32_t count,
                                                void* buffer, size_t capacity, size_t* needed);

#ifdef __cplusplus
}
#endif

#endif /* SPLAT_SCENE_H */
