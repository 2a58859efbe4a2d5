/* libsplat: runs. A run is a task with its folder, done one piece of work per call: steps, validations,
 * saved states. A run that ends anywhere and is resumed, here or by vkrun's --resume, has the same bits as one
 * without an interruption. splat_training_open of train.h and splat_fit_open of fit.h make one.
 *
 *   splat_run_event event = {.struct_size = sizeof event};
 *   while (event.kind < SPLAT_EVENT_DONE && splat_run_next(run, &event) == SPLAT_OK)
 *       if (event.text) puts(event.text);
 *
 * The folder of a run holds
 *   config.json            every value of the configuration; what makes the folder a run
 *   run.json               state, error, library, and facts of the task, such as device and data
 *   log.txt                the texts of events
 *   metrics.jsonl          one JSON object per line, of steps and of validations
 *   checkpoints/           the last two states; one of step 0 is saved before step 1. States that a
 *                          resumed run could not read are renamed to *.unreadable
 *   weights_last.safetensors, weights_best.safetensors   the task's result; of a fit gaussians_...
 *   lock                   the process that has the folder; the lock ends with it */
#ifndef SPLAT_RUN_H
#define SPLAT_RUN_H

#include "core.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Runs ------------------------------------------------------------------------------------ */

/* A task with its folder, one piece of work per call. The caller synchronises calls on one run, except
 * splat_run_interrupt, splat_run_report and splat_training_last_step. */

/* What a piece of a run did. */
typedef int32_t splat_run_event_kind;
enum {
    SPLAT_EVENT_MESSAGE = 0, /* only a text */
    SPLAT_EVENT_STEP = 1,    /* one attempt of a step, with its numbers */
    /* one piece of a validation, such as an object of a data set: its numbers and images */
    SPLAT_EVENT_VALIDATED_PIECE = 2,
    SPLAT_EVENT_VALIDATION = 3,  /* the mean numbers of a validation */
    SPLAT_EVENT_CHECKPOINT = 4,  /* a state was saved */
    SPLAT_EVENT_DONE = 5,        /* all steps are done; this and what follows end the run */
    SPLAT_EVENT_INTERRUPTED = 6, /* the caller ended it; it can be resumed */
    /* ten steps in a row had a loss or gradients that are not finite */
    SPLAT_EVENT_NOT_FINITE = 7,
    /* 200 steps in a row drew nothing; 20 of them give a warning */
    SPLAT_EVENT_NOTHING_DRAWN = 8
};

/* A number by its name. Frozen. */
typedef struct splat_number {
    const char* name; /* what the number is */
    double value;     /* 1 or 0 where metrics.jsonl has true or false */
} splat_number;

/* What a call of splat_run_next did. Pointers are valid until the next splat_run_next or
 * splat_run_destroy of the run. */
typedef struct splat_run_event {
    uint32_t struct_size;
    splat_run_event_kind kind; /* what was done */
    const char* text;          /* the line of log.txt; NULL: none */
    uint32_t warning;          /* 1: the text warns */
    uint32_t updated;    /* 1: a step updated what is learned; 0: it was skipped, or is no step */
    uint32_t logged;     /* 1: metrics.jsonl got a line of the step */
    uint32_t reserved;   /* 0 */
    uint64_t step;       /* updates done */
    uint64_t attempts;   /* steps that ran, with the skipped ones */
    uint64_t iterations; /* updates of the whole run */
    uint64_t skipped;    /* attempts that updated nothing */
    uint64_t peak_bytes; /* most device memory so far */
    double seconds;      /* seconds since the first step of this session */
    double steps_per_second; /* rate since the first step of this session */
    /* With the names of metrics.jsonl. Of a step: "loss", "averaged_loss" (over the latest steps of this
     * session), then the task's. Of a validation: "val_psnr" (dB; NaN without a score),
     * "best_val_psnr" (of those with as many pieces and views), then the task's. NULL: none. */
    const splat_number* numbers;
    uint64_t number_count; /* length of `numbers` */
    const char* name;      /* name of the validated piece, else NULL */
    uint32_t piece;        /* number of the validated piece */
    uint32_t pieces;       /* pieces of the validation */
    uint32_t views;        /* views of the piece, the input views first */
    uint32_t inputs;       /* input views among them */
    uint32_t width;        /* width of an image, pixels */
    uint32_t height;       /* height of an image, pixels */
    uint64_t image_count;  /* numbers of `images`, and of `truths` */
    const float* images;   /* drawn, [views,3,height,width] */
    const float* truths;   /* the images to be drawn, of the same shape */
} splat_run_event;

/* Do the next piece of work: a step, one piece of a validation, a saved state. After the end it gives
 * the last event again, without text. After an error the next call tries the same piece.
 * event     in/out, struct_size set
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE, SPLAT_ERROR_INVALID_ARGUMENT (NULL), SPLAT_ERROR_IO
 *   (the folder cannot be written), and errors of the task: of a training, those of
 *   splat_batches_next and splat_trainer_step */
SPLAT_API splat_result splat_run_next(splat_run run, splat_run_event* event);

/* End the run: the next call of splat_run_next saves the state and ends with
 * SPLAT_EVENT_INTERRUPTED. Any thread may call it, and a signal handler.
 * Returns SPLAT_OK, SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_run_interrupt(splat_run run);

/* JSON: {"schema": 1, "folder", "step", "iterations", "skipped", "loss" (of the latest step; null
 * before the first of this session), "val_psnr" and "val_ssim" (null before a validation), "best_val_psnr",
 * "peak_bytes", "ledger" (what was drawn and finite in this session's last attempt; of a training as in
 * splat_trainer_report)}.
 * Returns SPLAT_OK, SPLAT_INCOMPLETE, SPLAT_ERROR_INVALID_HANDLE */
SPLAT_API splat_result splat_run_report(splat_run run, char* buffer, size_t capacity,
                                        size_t* needed);

/* Close a run. Steps since the latest state are lost; resuming repeats them with the same bits.
 * Returns SPLAT_OK, or SPLAT_ERROR_INVALID_HANDLE. */
SPLAT_API splat_result splat_run_destroy(splat_run run);

#ifdef __cplusplus
}
#endif

#endif /* SPLAT_RUN_H */
