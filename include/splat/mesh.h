/* libsplat: meshes of triangles, read from files and drawn with exact maps.
 *
 * A mesh from one camera as a picture and its mask:
 *
 *   splat_mesh mesh;
 *   splat_mesh_maps maps = {.color = picture, .mask = mask};
 *   splat_mesh_load("chair.glb", NULL, &mesh);
 *   splat_mesh_normalise(mesh, SPLAT_MESH_UNIT_CUBE);
 *   splat_mesh_render(mesh, device, &camera, 1, NULL, &maps); */
#ifndef SPLAT_MESH_H
#define SPLAT_MESH_H

#include "scene.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Meshes ---------------------------------------------------------------------------------- */

/* A surface of triangles in host memory, in the units and axes of its file. Thread-safe. */

/* How a mesh's file is read, what its one material is, how it is drawn. */
enum {
    /* leave out textures and materials that cannot be read, with a warning, instead of refusing the file */
    SPLAT_MESH_LENIENT = 1u << 0,
    /* splat_mesh_create: only the side is drawn on which the corners turn counterclockwise */
    SPLAT_MESH_SINGLE_SIDED = 1u << 1,
    /* splat_mesh_render: color is the base colour, as albedo */
    SPLAT_MESH_UNLIT = 1u << 2
};

/* Options of reading; 0 is the default. */
typedef struct splat_mesh_file_desc {
    uint32_t struct_size;
    uint32_t flags;         /* SPLAT_MESH_LENIENT */
    const void* next;       /* NULL */
    uint64_t max_triangles; /* refuse files with more; 0 = 10^8 */
    uint64_t max_texels;    /* refuse files with more in all textures; 0 = 2^27 */
} splat_mesh_file_desc;

/* Read a mesh from a .obj file with the materials and textures that it names, or from a .glb or .gltf file:
 * its default scene, with base colours, their textures and colours of vertices. The decode limits of core.h
 * hold.
 * desc      may be NULL for defaults
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a field of desc
 *   SPLAT_ERROR_NOT_FOUND, SPLAT_ERROR_IO  the file, or one that it names, is not there, cannot be read
 *   SPLAT_ERROR_FORMAT                a damaged file, a mesh without faces; the message names the place
 *   SPLAT_ERROR_UNSUPPORTED           another extension, compressed meshes, more than the limits */
SPLAT_API splat_result splat_mesh_load(const char* path, const splat_mesh_file_desc* desc,
                                       splat_mesh* mesh);

/* A mesh of arrays, which are copied. Counts are of elements: 3 for each vertex and each triangle. */
typedef struct splat_mesh_desc {
    uint32_t struct_size;
    uint32_t flags;            /* SPLAT_MESH_SINGLE_SIDED */
    const void* next;          /* NULL */
    const double* vertices;    /* x, y, z of each */
    uint64_t vertex_count;
    const uint32_t* triangles; /* three numbers of vertices of each */
    uint64_t triangle_count;
    const float* normals;      /* x, y, z at each vertex, any lengths; NULL: those of the faces */
    uint64_t normal_count;
    const float* texcoords;    /* u, v of each vertex, v from the top down; NULL: no texture */
    uint64_t texcoord_count;
    const float* colors;       /* RGBA of each vertex, linear, 0 to 1; NULL: white */
    uint64_t color_count;
    const uint8_t* texture;    /* sRGB and opacity, 4 bytes a texel, rows from the top, repeated; NULL: none */
    uint64_t texture_count;    /* 4 texture_width texture_height */
    uint32_t texture_width;    /* texels, at most 16384 */
    uint32_t texture_height;   /* texels, at most 16384 */
    float base_color[4];       /* linear RGB and opacity, which multiply all others; all 0 = 1, 1, 1, 1 */
} splat_mesh_desc;

/* Create a mesh. Points of an opacity below 1/2 are not there.
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, counts that do not fit together, no triangles, a vertex that is not
 *                                     finite, a triangle of no vertex; the message names the first */
SPLAT_API splat_result splat_mesh_create(const splat_mesh_desc* desc, splat_mesh* mesh);

/* Tell what was left out of a mesh's file. JSON: {"warnings": [sentences]}.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_mesh_load_report(splat_mesh mesh, char* buffer, size_t capacity,
                                              size_t* needed);

/* What a mesh is. */
typedef struct splat_mesh_info {
    uint32_t struct_size;
    uint32_t materials;  /* materials, of .obj one more for faces without; 0: all is white */
    uint32_t textures;   /* textures of the materials */
    uint32_t reserved;   /* 0 */
    uint64_t vertices;   /* vertices */
    uint64_t triangles;  /* triangles; polygons of a file count as fans */
    uint64_t texels;     /* texels of all textures */
    double low[3];       /* lower corner of the box of the triangles, the mesh's units */
    double high[3];      /* upper corner of that box */
    double area;         /* sum over the triangles, square units */
    uint64_t zero_area;  /* triangles without area, which are never drawn */
    uint64_t unused;     /* vertices that no triangle names */
    uint64_t device_bytes; /* bytes of device memory that drawing 128 x 128 pixels takes, about */
} splat_mesh_info;

/* Measure a mesh.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (info),
 *   SPLAT_ERROR_OUT_OF_HOST_MEMORY. */
SPLAT_API splat_result splat_mesh_get_info(splat_mesh mesh, splat_mesh_info* info);

/* How large a mesh is made. All but the first put the centre of its box into the origin. */
typedef int32_t splat_mesh_size;
enum {
    SPLAT_MESH_AS_GIVEN = 0,      /* nothing changes */
    SPLAT_MESH_UNIT_CUBE = 1,     /* the longest side of the box is 1 */
    SPLAT_MESH_UNIT_DIAGONAL = 2, /* the diagonal of the box is 1, as in ShapeNet */
    SPLAT_MESH_UNIT_SPHERE = 3    /* the farthest vertex is at distance 1 */
};

/* Move and scale a mesh.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_OUT_OF_HOST_MEMORY, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      size, or a mesh whose extent is 0 or not finite; it stays as it was */
SPLAT_API splat_result splat_mesh_normalise(splat_mesh mesh, splat_mesh_size size);

/* Points on a mesh's surface, uniform by area, as splat_points_from_mesh makes them of a file.
 * seed      decides the points, each by its place: more points start with the same ones
 * points    out, x, y, z of each, the mesh's units and axes
 * count     numbers of `points`: 3 for each point
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_OUT_OF_HOST_MEMORY,
 *   SPLAT_ERROR_INVALID_ARGUMENT (NULL, a count that 3 does not divide, a mesh without area). */
SPLAT_API splat_result splat_mesh_sample(splat_mesh mesh, uint64_t seed, float* points,
                                         uint64_t count);

/* How a mesh is drawn; 0 is the default. */
typedef struct splat_mesh_render_desc {
    uint32_t struct_size;
    uint32_t flags;      /* SPLAT_MESH_UNLIT */
    const void* next;    /* NULL */
    uint32_t samples;    /* samples of a pixel's side: 1, 2, 4 or 8; 0 = 4 */
    float background[3]; /* RGB, sRGB, 0 to 1 */
    double up[3];        /* where the sky is, in the mesh's axes; all 0 = 0, 0, 1. The main light comes from 45
                          * degrees above the horizon */
    double near_plane;   /* nearer points are not there, the mesh's units; 0 = 10^-3 of the box's diagonal */
} splat_mesh_render_desc;

/* Where the maps of a view go; all of the camera's size. Frozen. Those without pixels are not wanted.
 * Colours are sRGB, the mean over a pixel's samples in linear light; depth and normals are those of the pixel's
 * centre. */
typedef struct splat_mesh_maps {
    splat_image color;  /* RGB over the background, or with alpha as the fourth channel */
    splat_image albedo; /* the base colour without light, in the same way */
    splat_image mask;   /* 1 channel; share of the pixel's samples that see the mesh */
    splat_image depth;  /* 1 channel, F16 or F32; along the camera's axis, the mesh's units; 0: nothing */
    splat_image normal; /* 3 channels, F16 or F32; of length 1 in the camera's axes, on the side that is seen;
                         * 0: nothing */
} splat_mesh_maps;

/* Draw views of a mesh. Light: linear base colours times 0.35 + 0.25 (1 + n.up) / 2 + 0.4 max(0, n.l), with l 45
 * degrees above the horizon and n on the side that is seen. Neighbours leave no hole and share no sample. Of a
 * material that blends, as many of a pixel's samples are there as its opacity says. A call takes the mesh to the
 * device: many cameras in one call are faster.
 * cameras   `count`, each of its own size; may be NULL for 0
 * desc      NULL: defaults
 * maps      out, `count`; untouched after an error of an argument, after others some may be filled
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_OUT_OF_HOST_MEMORY,
 *   SPLAT_ERROR_OUT_OF_DEVICE_MEMORY, SPLAT_CANCELLED, SPLAT_ERROR_TIMEOUT, SPLAT_ERROR_DEVICE_LOST, or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a field of desc, a camera, an image, no map
 *   SPLAT_ERROR_SHAPE_MISMATCH        a map of another size or other channels
 *   SPLAT_ERROR_UNSUPPORTED           a mesh that is too large for the device's bindings */
SPLAT_API splat_result splat_mesh_render(splat_mesh mesh, splat_device device,
                                         const splat_camera* cameras, uint32_t count,
                                         const splat_mesh_render_desc* desc,
                                         const splat_mesh_maps* maps);

/* Destroy a mesh.
 * Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_mesh_destroy(splat_mesh mesh);

/* ---- Data sets of meshes --------------------------------------------------------------------- */

/* What is written of each view besides its picture, and where is up. */
enum {
    SPLAT_MESH_VIEWS_DEPTH = 1u << 0,  /* depth/: 1 / z from the image's least to its most, 8 bits */
    SPLAT_MESH_VIEWS_NORMAL = 1u << 1, /* normal/: (n + 1) / 2 in the camera's axes */
    SPLAT_MESH_VIEWS_MASK = 1u << 2,   /* mask/: the share of a pixel's samples that see the mesh */
    SPLAT_MESH_VIEWS_ALBEDO = 1u << 3, /* albedo/: pictures without light, over the same background */
    /* y is up in the mesh, as in glTF. It is turned, for z is up in the data set: z becomes x, x becomes
     * y, and y becomes z */
    SPLAT_MESH_VIEWS_Y_UP = 1u << 4
};

/* Where the cameras of a data set stand; all look at the origin. */
typedef int32_t splat_mesh_protocol;
enum {
    /* at random around the object; of val and test on a spiral from the horizon to the top, as SRN's */
    SPLAT_MESH_PROTOCOL_SPHERE = 0,
    SPLAT_MESH_PROTOCOL_HEMISPHERE = 1, /* the same with all cameras above the horizon */
    SPLAT_MESH_PROTOCOL_ORBIT = 2       /* at equal angles on a circle, in every split */
};

/* What is behind an object. */
typedef int32_t splat_mesh_background;
enum {
    SPLAT_MESH_BACKGROUND_WHITE = 0,   /* 1 in all channels */
    SPLAT_MESH_BACKGROUND_BLACK = 1,   /* 0 in all channels */
    SPLAT_MESH_BACKGROUND_GRAY = 2,    /* 0.5 in sRGB */
    SPLAT_MESH_BACKGROUND_PLAIN = 3,   /* a random colour for each view */
    SPLAT_MESH_BACKGROUND_GRADIENT = 4 /* between two random colours, in a random direction */
};

/* An object of a data set and what all its objects have in common; 0 is the default. */
typedef struct splat_mesh_views_desc {
    uint32_t struct_size;
    uint32_t flags;       /* SPLAT_MESH_VIEWS_ bits */
    const void* next;     /* NULL */
    const char* path;     /* folder of the data set */
    /* "srn": srn_<category>/<category>_<split>/<name>/ with intrinsics.txt, pose/ and rgb/; "images":
     * <split>/<name>/ with transforms.json and rgb/; NULL: srn */
    const char* layout;
    const char* category; /* in names of folders; NULL: objects */
    const char* split;    /* "train", "val", "test"; NULL: train */
    const char* name;     /* name of the object, as splat_path_name gives it */
    /* how meshes were made ready, such as "unit_diagonal", in words that all objects of a folder must have
     * in common; NULL: none */
    const char* prepared;
    uint64_t seed;        /* with the name it decides all that is random */
    uint32_t size;        /* side of the images, pixels, 8 to 2048; 0: 128 */
    uint32_t train_views; /* views of an object in train; 0: 50 */
    uint32_t test_views;  /* views of one in val and test; 0: 251 */
    uint32_t samples;     /* samples of a pixel's side: 1, 2, 4 or 8; 0: 4 */
    uint32_t points;      /* points on the surface, in points.ply, in the axes of the data set; 0: none */
    splat_mesh_protocol protocol;
    splat_mesh_background background;
    uint32_t reserved;    /* 0 */
    double distance;      /* distance of the cameras from the origin; 0: 1.3 */
    double fov_x;         /* field of view, radians; 0: a focal length of 131.25 pixels of 128, as SRN's */
    double elevation;     /* height of an orbit above the horizon, radians */
    double jitter;        /* radians: each camera rolls, and aims beside the origin in both directions of
                           * its image, by up to this angle; it stands by up to as many percent nearer or
                           * farther as this is degrees */
    double exposure;      /* stops: the object's light is multiplied by 2^e, with a random e of up to this
                           * size for each view; the background stays */
} splat_mesh_views_desc;

/* Tell whether an object is there already, so that its mesh need not be read.
 * found     out; 1: it is there, 0: it is not
 * Returns SPLAT_OK, SPLAT_ERROR_OUT_OF_HOST_MEMORY, SPLAT_ERROR_UNSUPPORTED (a size above 2048), or
 *   SPLAT_ERROR_INVALID_ARGUMENT      NULL, a field of desc, a folder of data made with other values, an
 *                                     object that another split has
 *   SPLAT_ERROR_IO                    the folder cannot be looked at */
SPLAT_API splat_result splat_mesh_find_views(const splat_mesh_views_desc* desc, int32_t* found);

/* Draw a mesh as an object of a data set, with its cameras, maps and points. The folder of the object
 * appears whole or not at all, and an existing one is kept, so that a set can be made by any number of
 * calls, processes and machines, and gone on with after they were killed. rendered.json in the folder of
 * the set has the values that all objects share. The bytes depend on the mesh, the desc, and the device
 * as those of splat_mesh_render do.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, as splat_mesh_find_views and splat_mesh_render, or
 *   SPLAT_ERROR_FORMAT                a mesh without area, or one that no view shows
 *   SPLAT_ERROR_NOT_FOUND, SPLAT_ERROR_IO  the folder or a file cannot be written */
SPLAT_API splat_result splat_mesh_write_views(splat_mesh mesh, splat_device device,
                                              const splat_mesh_views_desc* desc);

#ifdef __cplusplus
}
#endif

#endif /* SPLAT_MESH_H */
