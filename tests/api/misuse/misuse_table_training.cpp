// The rows of batches and of training sessions.
#include "api/misuse/misuse_table.h"

namespace splat::test {

void MisuseTable::batches_rows() {
    const auto create = [this](splat_dataset dataset, const char* config) {
        return splat_batches_create(dataset, config, 1, outputs.batches.out());
    };
    handles<splat_dataset>(
        "splat_batches_create", "dataset", [create](splat_dataset d) { return create(d, nullptr); },
        kHandle);
    add("splat_batches_create", "dataset", "of another resolution", kArgument,
        [this, create] { return create(dataset_, trainer_desc().config); });
    add("splat_batches_create", "config", "an unknown key", kArgument,
        [this, create] { return create(dataset_, "opt: {batchsize: 1}"); });
    add("splat_batches_create", "seed", "any number, with a wrong data set", kArgument,
        [this] { return splat_batches_create(dataset_, nullptr, 7, outputs.batches.out()); });
    add("splat_batches_create", "batches", "NULL", kArgument,
        [this] { return splat_batches_create(dataset_, nullptr, 1, nullptr); });
    handles<splat_batches>(
        "splat_batches_next", "batches",
        [](splat_batches b) {
            auto batch = sized<splat_trainer_batch>();
            return splat_batches_next(b, 0, &batch);
        },
        kHandle);
    add("splat_batches_next", "step", "the greatest number", SPLAT_OK, [this] {
        auto batch = sized<splat_trainer_batch>();
        return splat_batches_next(batches_, UINT64_MAX / 4, &batch);
    });
    infos<splat_trainer_batch>("splat_batches_next", "batch", [this](splat_trainer_batch* batch) {
        return splat_batches_next(batches_, 0, batch);
    });
    handles<splat_batches>("splat_batches_destroy", "batches", splat_batches_destroy, SPLAT_OK);
}

void MisuseTable::training_desc_rows() {
    static const std::string folder = run_folder();
    const splat_training_desc good = training_desc(dataset_, folder);
    const auto open = [this](const splat_training_desc* desc) {
        return splat_training_open(device_, desc, outputs.training.out());
    };
    handles<splat_device>(
        "splat_training_open", "device",
        [this, good](splat_device d) {
            return splat_training_open(d, &good, outputs.training.out());
        },
        kHandle);
    add("splat_training_open", "desc", "NULL", kArgument, [open] { return open(nullptr); });
    descs<splat_training_desc>("splat_training_open", good, open);
    add("splat_training_open", "training", "NULL", kArgument,
        [this, good] { return splat_training_open(device_, &good, nullptr); });
    const auto wrong = [&](const char* what, splat_result expected,
                           void (*change)(splat_training_desc&)) {
        splat_training_desc desc = good;
        change(desc);
        add("splat_training_open", "desc", what, expected, [open, desc] { return open(&desc); });
    };
    wrong("no folder", kArgument, [](splat_training_desc& d) { d.folder = nullptr; });
    wrong("an unknown key", kArgument, [](splat_training_desc& d) { d.config = "opt: {x: 1}"; });
    wrong("no values", kArgument, [](splat_training_desc& d) { d.values = nullptr; });
    wrong("resume and overwrite", kArgument, [](splat_training_desc& d) {
        d.flags = SPLAT_TRAINING_RESUME | SPLAT_TRAINING_OVERWRITE;
    });
    wrong("nothing to resume", kState,
          [](splat_training_desc& d) { d.flags = SPLAT_TRAINING_RESUME; });
    wrong("unknown init_flags", kArgument, [](splat_training_desc& d) { d.init_flags = 1U << 31; });
    wrong("init_flags without init", kArgument,
          [](splat_training_desc& d) { d.init_flags = SPLAT_LOAD_GRAFT; });
    wrong("a data set of another resolution", kArgument, [](splat_training_desc&) {});
    wrong("no data", kArgument, [](splat_training_desc& d) { d.dataset = nullptr; });
    for (auto splat_training_desc::*field :
         {&splat_training_desc::dataset, &splat_training_desc::validation}) {
        splat_training_desc desc = good;
        desc.*field = reinterpret_cast<splat_dataset>(std::uintptr_t{1});
        add("splat_training_open", "desc", "not a data set", kHandle,
            [open, desc] { return open(&desc); });
    }
}

void MisuseTable::training_rows() {
    handles<splat_training>(
        "splat_training_next", "training",
        [](splat_training t) {
            auto event = sized<splat_training_event>();
            return splat_training_next(t, &event);
        },
        kHandle);
    infos<splat_training_event>(
        "splat_training_next", "event",
        [this](splat_training_event* event) { return splat_training_next(training_, event); });
    handles<splat_training>("splat_training_interrupt", "training", splat_training_interrupt,
                            kHandle);
    handles<splat_training>(
        "splat_training_report", "training",
        [this](splat_training t) {
            return splat_training_report(t, *outputs.text.out(), 16, outputs.size.out());
        },
        kHandle);
    for (const char* parameter : {"buffer", "capacity", "needed"})
        add("splat_training_report", parameter, "NULL or 0", SPLAT_INCOMPLETE,
            [this] { return splat_training_report(training_, nullptr, 0, nullptr); });
    handles<splat_training>(
        "splat_training_model", "training",
        [this](splat_training t) { return splat_training_model(t, outputs.model.out()); }, kHandle);
    add("splat_training_model", "model", "NULL", kArgument,
        [this] { return splat_training_model(training_, nullptr); });
    handles<splat_training>("splat_training_destroy", "training", splat_training_destroy, SPLAT_OK);
}

}  // namespace splat::test
