/* The scores of the built-in weights on a data set, and the files of `vkrun eval`. */
#include <splat.h>
#include <stdio.h>
#include <stdlib.h>

static void check(splat_result result) {
    if (result >= 0) return;
    fprintf(stderr, "%s\n", splat_last_error_message());
    exit(1);
}

int main(int argc, char** argv) {
    splat_device device;
    splat_predictor predictor;
    splat_evaluator evaluator;
    splat_evaluator_info info = {.struct_size = sizeof info};
    splat_object_scores scores = {.struct_size = sizeof scores};
    splat_evaluation_summary summary = {.struct_size = sizeof summary};
    splat_evaluator_desc desc = {.struct_size = sizeof desc};
    check(splat_device_create(NULL, &device));
    check(splat_predictor_create(device, NULL, &predictor));
    desc.predictor = predictor;
    desc.data_path = argc > 1 ? argv[1] : "cars";
    check(splat_evaluator_create(&desc, &evaluator));
    check(splat_evaluator_get_info(evaluator, &info));
    for (unsigned i = 0; i < info.objects; ++i) {
        check(splat_evaluator_score(evaluator, i, &scores));
        fprintf(stderr, "%s: %.2f dB\n", scores.name, scores.novel.psnr);
    }
    check(splat_evaluator_save(evaluator, argc > 2 ? argv[2] : "eval"));
    check(splat_evaluator_summary(evaluator, &summary));
    printf("%.3f dB, %.4f\n", summary.novel.psnr, summary.novel.ssim);
    return summary.objects_not_finite != 0;
}
