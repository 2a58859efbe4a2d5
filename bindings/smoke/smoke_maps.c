/* The cases of maps and data sets, and what the others share with them. */
#include "smoke.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

_Noreturn void fail(const char* what) {
    fprintf(stderr, "smoke: %s\n", what);
    exit(1);
}

void check(splat_result result) {
    if (result < 0) fail(splat_last_error_message());
}

uint64_t hash(const void* data, size_t bytes) {
    const unsigned char* at = data;
    uint64_t value = 14695981039346656037U;
    for (size_t i = 0; i < bytes; ++i) value = (value ^ at[i]) * 1099511628211U;
    return value;
}

void make_disc(unsigned char pixels[64][80][4]) {
    for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 80; ++x) {
            const int dx = 2 * x - 79, dy = 2 * y - 63;
            pixels[y][x][0] = (unsigned char)(5 * x);
            pixels[y][x][1] = (unsigned char)(7 * y);
            pixels[y][x][2] = (unsigned char)(x * y);
            pixels[y][x][3] = dx * dx + dy * dy < 2304 ? 255 : 0;
        }
}

/* ---- Judging --------------------------------------------------------------------------------- */

enum { MAP = 48 };

typedef struct judged_maps {
    float p[MAP][MAP], g[MAP][MAP], predicted[MAP][MAP][3], truth[MAP][MAP][3], points[MAP][MAP][3];
} judged_maps;

static void make_maps(judged_maps* maps) {
    for (int y = 0; y < MAP; ++y)
        for (int x = 0; x < MAP; ++x) {
            const float p = (float)((3 * x * y + x + 2 * y) % 64 + 1) / 64;
            const float g = (float)((x * y + 3 * x + 5 * y) % 64 + 1) / 64;
            const float rows[3][3] = {{p, g, 1}, {g, p, 1}, {p, g, p - g}};
            maps->p[y][x] = p;
            maps->g[y][x] = g;
            memcpy(maps->predicted[y][x], rows[0], sizeof rows[0]);
            memcpy(maps->truth[y][x], rows[1], sizeof rows[1]);
            memcpy(maps->points[y][x], rows[2], sizeof rows[2]);
        }
}

static splat_image map_image(float* pixels, uint32_t channels) {
    return (splat_image){.pixels = pixels,
                         .type = SPLAT_PIXEL_F32,
                         .width = MAP,
                         .height = MAP,
                         .channels = channels};
}

void case_judge(splat_scene scene) {
    static judged_maps maps;
    static float filtered[MAP][MAP];
    splat_depth_scores d = {.struct_size = sizeof d};
    splat_normal_scores n = {.struct_size = sizeof n};
    splat_mask_scores m = {.struct_size = sizeof m};
    splat_fidelity_scores f = {.struct_size = sizeof f};
    splat_point_scores s = {.struct_size = sizeof s};
    make_maps(&maps);
    const splat_image p = map_image(maps.p[0], 1), g = map_image(maps.g[0], 1);
    const splat_image predicted = map_image(maps.predicted[0][0], 3);
    const splat_image truth = map_image(maps.truth[0][0], 3);
    splat_image edges = map_image(filtered[0], 1);
    check(splat_prior_compare_depth(&p, &g, NULL, 0, &d));
    check(splat_prior_compare_normals(&predicted, &truth, NULL, 0, &n));
    check(splat_prior_compare_masks(&p, &g, 0, &m));
    check(splat_prior_compare_images(&p, &g, 0, &f));
    check(splat_prior_filter(&g, SPLAT_MAP_FILTER_CANNY, &edges));
    check(splat_scene_compare_points(scene, 0, maps.points[0][0], 3 * MAP * MAP, 0.25, &s));
    const double depth[] = {d.abs_rel,   d.rmse,      d.si_rmse, d.within[0],
                            d.within[1], d.within[2], d.scale,   d.shift};
    const double normal[] = {n.mean, n.median, n.rmse, n.within[0], n.within[1], n.within[2]};
    const double mask[] = {m.mae, m.iou, m.precision, m.recall, m.f_beta};
    const double points[] = {s.accuracy,  s.completeness, s.chamfer, s.chamfer_squared,
                             s.precision, s.recall,       s.f_score};
    printf(
        "{\"case\":\"judge\",\"depth\":\"%016llx\",\"normal\":\"%016llx\","
        "\"mask\":\"%016llx\",\"fidelity\":\"%016llx\",\"edges\":\"%016llx\","
        "\"points\":\"%016llx\"}\n",
        (unsigned long long)hash(depth, sizeof depth),
        (unsigned long long)hash(normal, sizeof normal),
        (unsigned long long)hash(mask, sizeof mask), (unsigned long long)hash(&f.vif, sizeof f.vif),
        (unsigned long long)hash(filtered, sizeof filtered),
        (unsigned long long)hash(points, sizeof points));
}

void case_maps(void) {
    static judged_maps maps;
    static float normals[MAP][MAP][3];
    static unsigned char disc[64][80][4], mask[64][80];
    splat_normals_desc desc = {sizeof desc, .focal_x = MAP, .focal_y = MAP, .nearest = 1,
                               .farthest = 2};
    splat_found found;
    make_maps(&maps);
    make_disc(disc);
    const splat_image picture = {
        .pixels = disc, .type = SPLAT_PIXEL_U8, .width = 80, .height = 64, .channels = 4};
    const splat_image to = {
        .pixels = mask, .type = SPLAT_PIXEL_U8, .width = 80, .height = 64, .channels = 1};
    const splat_image depth = map_image(maps.p[0], 1), normal = map_image(normals[0][0], 3);
    check(splat_picture_mask(&picture, &to, &found));
    check(splat_normals_from_depth(&depth, &desc, &normal));
    printf("{\"case\":\"maps\",\"found\":%d,\"mask\":\"%016llx\",\"normal\":\"%016llx\"}\n",
           (int)found, (unsigned long long)hash(mask, sizeof mask),
           (unsigned long long)hash(normals, sizeof normals));
}

void case_data(const char* folder) {
    static float images[4][3][16][16];
    char store[4096];
    const uint32_t views[] = {0, 1, 2, 3};
    splat_dataset_desc from = {sizeof from, .path = folder}, to = {sizeof to, .path = store};
    splat_dataset_export_desc part = {sizeof part, .path = store, .layout = "store", .shards = 2};
    splat_dataset_views out = {sizeof out, .images = images[0][0][0]};
    splat_dataset dataset;
    snprintf(store, sizeof store, "%s/store_c", folder);
    check(splat_dataset_open(&from, &dataset));
    for (part.shard = 2; part.shard-- > 0;) check(splat_dataset_export(dataset, &part, NULL, NULL));
    check(splat_dataset_destroy(dataset));
    check(splat_dataset_open(&to, &dataset));
    check(splat_dataset_read(dataset, 1, views, 4, &out));
    check(splat_dataset_destroy(dataset));
    printf("{\"case\":\"data\",\"objects\":2,\"rgb\":\"%016llx\"}\n",
           (unsigned long long)hash(images, sizeof images));
}
