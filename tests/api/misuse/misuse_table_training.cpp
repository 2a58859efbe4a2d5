// The rows of batches and of training sessions.
#include "api/misuse/misuse_table.h"

namespace splat::test {

void MisuseTable::batches_rows() {
    const auto create = [this](splat_dataset dataset, const char* config) {
        return splat_batches_create(dataset, config, 1, out<splat_batches>());
    };
    add("splat_batches_create", "dataset", "of another resolution", kArgument,
        [this, create] { return create(dataset_, trainer_desc().config); });
    add("splat_batches_create", "config", "an unknown key", kArgument,
        [this, create] { return create(dataset_, "opt: {batchsize: 1}"); });
    add("splat_batches_create", "seed", "any number, with a wrong data set", kArgument,
        [this] { return splat_batches_create(dataset_, nullptr, 7, out<splat_batches>()); });
    add("splat_batches_next", "step", "the greatest number", SPLAT_OK, [this] {
        auto batch = sized<splat_trainer_batch>();
        return splat_batches_next(batches_, UINT64_MAX / 4, &batch);
    });
}

void MisuseTable::training_desc_rows() {
    static const std::string folder = run_folder();
    const splat_training_desc good = training_desc(dataset_, folder);
    const auto open = [this](const splat_training_desc* desc) {
        return splat_training_open(device_, desc, out<splat_run>());
    };
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

}  // namespace splat::test
