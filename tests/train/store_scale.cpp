// Usage: store_scale write FOLDER OBJECTS [VIEWS [SIDE]], store_scale read FOLDER [MOST_MIB]
//
// Writes a store of objects with VIEWS (2) views of SIDE (8) pixels a side; or opens one as a training does, and prints
// seconds of the processor and peak memory of each step until the first batches, and those of the next pass. Exit
// status: 0; 1 a step failed or took more than MOST_MIB MiB.
#include <cstdio>
#include <cstdlib>

#include "support/system.h"
#include "tables/store.h"
#include "train/batches.h"

namespace {

using namespace splat;
using tables::Table;

constexpr std::uint32_t kBatch = 8;
constexpr std::uint64_t kSeed = 1;

double peak_mib() {
    return static_cast<double>(test::peak_bytes()) / (1 << 20);
}

tables::StoreIndex index_of(std::uint32_t objects, std::uint32_t views, std::uint32_t side) {
    tables::StoreIndex index;
    index.split = "train";
    index.source = "store_scale";
    index.resolution = side;
    index.maps = {Table::kRgb};
    const std::string intrinsics =
        format("%u %u %u 0\n0 0 0\n1\n%u %u\n", side, side / 2, side / 2, side, side);
    for (std::uint32_t i = 0; i < objects; ++i)
        index.objects.push_back({format("%032x", i), intrinsics, views});
    index.frames.resize(std::uint64_t{objects} * views);
    for (std::uint64_t row = 0; row < index.frames.size(); ++row)
        index.frames[row] = static_cast<std::int64_t>(row % views);
    return index;
}

Status write(const std::string& folder, std::uint32_t objects, std::uint32_t views,
             std::uint32_t side) {
    SPLAT_ASSIGN(const auto writer, tables::StoreWriter::open(
                                        folder + "/train", index_of(objects, views, side), false));
    std::vector<std::byte> pixels(std::size_t{3} * side * side);
    for (std::uint64_t row = 0; row < std::uint64_t{objects} * views; ++row) {
        const std::string pose = row % views == 0 ? "1 0 0 0 0 1 0 0 0 0 1 -1.3 0 0 0 1"
                                                  : "-1 0 0 0 0 1 0 0 0 0 -1 1.3 0 0 0 1";
        for (std::size_t i = 0; i < pixels.size(); ++i)
            pixels[i] = static_cast<std::byte>(row * 2654435761U >> (i % 24U));
        SPLAT_TRY(writer->put(Table::kPoses, row, io::as_bytes(pose)));
        SPLAT_TRY(writer->put(Table::kRgb, row, pixels));
    }
    return writer->finish();
}

class Steps {
  public:
    explicit Steps(double most) : most_(most) {}

    /// Gives the status, or an error for too much memory.
    Status told(const char* step, const Status& status) {
        SPLAT_TRY(status);
        const double now = test::processor_seconds();
        std::printf("%-30s %8.3f s, peak so far %5.0f MiB\n", step, now - start_, peak_mib());
        start_ = now;
        if (peak_mib() <= most_) return {};
        return bad_state("%.0f MiB, expected at most %.0f", peak_mib(), most_);
    }

  private:
    double most_, start_ = test::processor_seconds();
};

Status read(const std::string& folder, double most) {
    config::Settings settings;
    settings.training.root = folder;
    settings.training.batch_size = kBatch;
    settings.training.targets = 2;
    Steps steps(most);
    SPLAT_TRY(steps.told("start", {}));
    data::DatasetDesc desc;
    desc.path = folder;
    desc.background = predict::background_of(settings);
    SPLAT_ASSIGN(auto made, data::Dataset::open(desc));
    const std::shared_ptr<data::Dataset> dataset(std::move(made));
    settings.network.resolution = dataset->resolution();
    SPLAT_ASSIGN(auto opened, predict::ViewSource::open(settings, dataset));
    const std::shared_ptr<const predict::ViewSource> data(std::move(opened));
    SPLAT_TRY(steps.told("open", {}));
    SPLAT_TRY(steps.told("read cameras", dataset->read_cameras()));
    const train::BatchSource source(data, settings, kSeed);
    SPLAT_TRY(steps.told("check views", source.check()));
    SPLAT_TRY(
        steps.told("check fields of view", data->field_of_view_warning(data->objects()).status()));
    SPLAT_TRY(steps.told("first batch, 8 objects", source.make(0).status()));
    for (std::uint64_t n = 1; n <= 100; ++n) SPLAT_TRY(source.make(n).status());
    SPLAT_TRY(steps.told("100 batches", {}));
    const std::uint64_t pass = data->objects() / kBatch;
    for (std::uint64_t n = pass; n < pass + 100; ++n) SPLAT_TRY(source.make(n).status());
    return steps.told("100 batches of the next pass", {});
}

}  // namespace

int main(int count, char** words) {
    const std::string what = count > 2 ? words[1] : "";
    const auto number = [&](int word, std::uint32_t otherwise) {
        return count > word ? static_cast<std::uint32_t>(std::strtoul(words[word], nullptr, 10))
                            : otherwise;
    };
    Status status;
    if (what == "write" && count > 3)
        status = write(words[2], number(3, 0), number(4, 2), number(5, 8));
    else if (what == "read")
        status = read(words[2], number(3, 1U << 30U));
    else
        return 2;
    if (!status.ok()) std::printf("%s\n", status.message().c_str());
    return status.ok() ? 0 : 1;
}
