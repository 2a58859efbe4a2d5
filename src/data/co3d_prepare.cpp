#include "data/co3d_prepare.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <set>

#include "core/json_writer.h"
#include "core/log.h"
#include "core/os/path.h"
#include "core/parallel.h"
#include "core/path_name.h"
#include "data/co3d_cameras.h"
#include "data/co3d_image.h"
#include "data/folder.h"
#include "io/file.h"
#include "io/folder.h"
#include "io/npy.h"
#include "io/weights_formats.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxManifestBytes = 1U << 16;

/// The arrays of a sequence.
struct PreparedSequence {
    io::FloatArray full, foreground, masks, focals;
    Co3dCameras cameras;
    std::string order;
};

bool all_finite(const std::vector<float>& values) {
    return std::ranges::all_of(values, [](float v) { return std::isfinite(v); });
}

Result<PreparedFrame> read_frame(const Co3dPreparation& preparation, const RawFrame& frame,
                                 double& half_side) {
    const fs::path image_path = os::path_of(preparation.raw) / frame.image;
    const fs::path mask_path = os::path_of(preparation.raw) / frame.mask;
    SPLAT_ASSIGN(const io::Image image, load_bytes(image_path, {}));
    SPLAT_ASSIGN(const io::Image mask, load_bytes(mask_path, {}));
    const auto check = [&frame](const io::Image& found, const fs::path& path) {
        if (found.width == frame.width && found.height == frame.height) return Status();
        return damaged("'%s': %u x %u pixels, its annotation has %u x %u",
                       os::text_of(path).c_str(), found.width, found.height, frame.width,
                       frame.height);
    };
    SPLAT_TRY(check(image, image_path));
    SPLAT_TRY(check(mask, mask_path));
    if (image.channels < 3)
        return damaged("'%s': an image without colours", os::text_of(image_path).c_str());
    const Planes probability = planes_of(mask);
    SPLAT_ASSIGN(const auto box,
                 in_file(crop_box(frame.box ? *frame.box : foreground_box(probability), frame.width,
                                  frame.height),
                         os::text_of(mask_path)));
    SPLAT_ASSIGN(const auto square,
                 in_file(principal_square(frame.principal_point, frame.width, frame.height),
                         os::text_of(image_path)));
    half_side = square.half_side;
    return prepare_frame(image, probability, box, square, preparation.size);
}

Result<PreparedSequence> prepare_sequence(const Co3dPreparation& preparation,
                                          const RawSequence& sequence) {
    PreparedSequence made;
    const std::uint64_t frames = sequence.frames.size(), size = preparation.size;
    made.full.shape = made.foreground.shape = {frames, 3, size, size};
    made.masks.shape = {frames, 1, size, size};
    made.focals.shape = {frames, 1, 2};
    for (const RawFrame& frame : sequence.frames) {
        double half_side = 1;
        SPLAT_ASSIGN(const PreparedFrame images, read_frame(preparation, frame, half_side));
        const auto append = [](const std::vector<float>& from, std::vector<float>& to) {
            to.insert(to.end(), from.begin(), from.end());
        };
        append(images.full, made.full.values);
        append(images.foreground, made.foreground.values);
        append(images.mask, made.masks.values);
        for (const double focal : frame.focal)
            made.focals.values.push_back(static_cast<float>(focal / half_side));
        made.order += format("%05zu.png\n", frame.place);
    }
    if (preparation.stored_poses) {
        made.cameras = stored_cameras(sequence.frames);
        return made;
    }
    fs::path file = os::path_of(sequence.points);
    if (file.has_root_directory())  // a path of another machine
        file = os::path_of(preparation.category) / sequence.name / file.filename();
    SPLAT_TRY(check_below(os::text_of(file)));
    SPLAT_ASSIGN(const std::vector<scene::Vec3> points,
                 read_points(os::text_of(os::path_of(preparation.raw) / file)));
    SPLAT_ASSIGN(made.cameras, in_file(normalised_cameras(sequence.frames, points), sequence.name));
    return made;
}

Status write_array(const fs::path& path, const io::FloatArray& array) {
    SPLAT_ASSIGN(const io::Buffer file, io::write_npy(array));
    return io::write_new_file(os::text_of(path), file);
}

/// Writes the folder of a sequence, whole or not at all.
Status write_sequence(const fs::path& root, const PathName& name, const PreparedSequence& made) {
    const fs::path target = root / name;
    return io::write_folder(
        target, io::temporary_of(target), [&](const fs::path& folder) -> Status {
            const std::uint64_t frames = made.full.shape[0];
            SPLAT_TRY(io::make_folders(folder));
            SPLAT_TRY(write_array(folder / "images_full.npy", made.full));
            SPLAT_TRY(write_array(folder / "images_fg.npy", made.foreground));
            SPLAT_TRY(write_array(folder / "masks.npy", made.masks));
            SPLAT_TRY(write_array(folder / "focal_lengths.npy", made.focals));
            SPLAT_TRY(
                write_array(folder / "camera_R.npy", {{frames, 3, 3}, made.cameras.rotations}));
            SPLAT_TRY(
                write_array(folder / "camera_T.npy", {{frames, 3}, made.cameras.translations}));
            return io::write_new_file(os::text_of(folder / "frame_order.txt"),
                                      io::as_bytes(made.order));
        });
}

/// The arrays {sequence}/{name}.npy of all sequences in the folder, also of earlier calls, in one file.
Status collect_cameras(const fs::path& root, const char* name, const char* target) {
    io::NamedTensors tensors;
    SPLAT_ASSIGN(const std::vector<std::string> sequences, io::folders_in(os::text_of(root)));
    for (const std::string& sequence : sequences) {
        const fs::path path = root / sequence / (std::string(name) + ".npy");
        SPLAT_ASSIGN(const bool is_there, io::has_file(os::text_of(path)));
        if (!is_there) continue;
        SPLAT_ASSIGN(const io::Buffer file, io::read_file(os::text_of(path)));
        SPLAT_ASSIGN(const auto array, in_file(io::read_npy(file), os::text_of(path)));
        SPLAT_TRY(tensors.add({sequence,
                               {array.shape.begin(), array.shape.end()},
                               io::NumberType::kF32,
                               array.values}));
    }
    SPLAT_ASSIGN(const io::FilePieces file, io::write_npz(tensors));
    return io::write_file(os::text_of(root / target), file.pieces());
}

Status check_preparation(const Co3dPreparation& preparation) {
    SPLAT_TRY(check_split(preparation.split));
    if (preparation.size == 0 || preparation.size > 4096)
        return invalid("size is %u, expected 1 to 4096", preparation.size);
    if (!is_name_in_folder(preparation.category))
        return invalid("category is '%s', expected a name such as 'hydrant'",
                       preparation.category.c_str());
    return {};
}

/// Checks that the folder holds nothing made with other values.
Status check_manifest(const Co3dPreparation& preparation, const fs::path& root) {
    const fs::path path = root / "prepared.json";
    JsonWriter json;
    json.begin_object().member("made_by", "splat_co3d_prepare").member("version", 1);
    json.member("size", preparation.size).member("subset", preparation.subset);
    json.member("stored_poses", preparation.stored_poses).end();
    const std::string expected = json.text() + "\n";
    SPLAT_ASSIGN(const bool is_begun, io::has_file(os::text_of(path)));
    if (!is_begun) {
        SPLAT_ASSIGN(const std::vector<std::string> sequences, io::folders_in(os::text_of(root)));
        if (sequences.empty()) return io::write_file(os::text_of(path), io::as_bytes(expected));
        return invalid(
            "'%s' holds sequences, but no prepared.json that tells with which values they "
            "were made, as of an earlier version: use another folder, or remove them",
            os::text_of(root).c_str());
    }
    SPLAT_ASSIGN(const io::Buffer file, io::read_file(os::text_of(path), kMaxManifestBytes));
    const std::string found(io::as_text(file));
    if (found == expected) return {};
    return invalid(
        "'%s' holds sequences made with other values: %sexpected: %suse another folder, "
        "or the same values to add sequences",
        os::text_of(root).c_str(), found.c_str(), expected.c_str());
}

}  // namespace

Result<Co3dPrepared> prepare_co3d(const Co3dPreparation& preparation,
                                  const std::function<void(std::size_t, std::size_t)>& progress) {
    SPLAT_TRY(check_preparation(preparation));
    SPLAT_ASSIGN(std::vector<RawSequence> sequences,
                 read_raw_co3d(preparation.raw, preparation.category, preparation.subset,
                               preparation.split));
    if (preparation.limit != 0 && sequences.size() > preparation.limit)
        sequences.resize(preparation.limit);
    std::set<std::string> folders;
    for (const RawSequence& sequence : sequences)
        if (!folders.insert(os::one_name(PathName(sequence.name).text())).second)
            return damaged("two sequences would have the folder '%s'",
                           PathName(sequence.name).text().c_str());
    const fs::path root = os::path_of(preparation.out) /
                          ("co3d_" + preparation.category + "_for_gs") / preparation.split;
    SPLAT_TRY(io::make_folders(root));
    SPLAT_TRY(check_manifest(preparation, root));
    std::atomic<std::uint32_t> kept{0}, left_out{0};
    std::atomic<std::size_t> done{0};
    const auto prepare_one = [&](std::size_t i) -> Status {
        const RawSequence& sequence = sequences[i];
        const PathName name(sequence.name);
        SPLAT_ASSIGN(const bool is_done,
                     io::has_file(os::text_of(root / name / "frame_order.txt")));
        if (is_done) {
            ++kept;
        } else {
            SPLAT_ASSIGN(const PreparedSequence made, prepare_sequence(preparation, sequence));
            if (all_finite(made.focals.values) && all_finite(made.cameras.rotations) &&
                all_finite(made.cameras.translations)) {
                SPLAT_TRY(write_sequence(root, name, made));
            } else {
                ++left_out;
                log(LogLevel::kWarning,
                    "sequence '" + sequence.name + "' is left out: its cameras are not finite");
            }
        }
        progress(++done, sequences.size());
        return {};
    };
    SPLAT_TRY(parallel_for(sequences.size(), kMostHostThreads, prepare_one));
    SPLAT_TRY(collect_cameras(root, "camera_R", "camera_Rs.npz"));
    SPLAT_TRY(collect_cameras(root, "camera_T", "camera_Ts.npz"));
    Co3dPrepared report;
    report.sequences = static_cast<std::uint32_t>(sequences.size());
    report.kept = kept;
    report.left_out = left_out;
    for (const RawSequence& sequence : sequences) report.frames += sequence.frames.size();
    return report;
}

}  // namespace splat::data
