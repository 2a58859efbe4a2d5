#include "vkrun/priors/map_maker.h"

#include <algorithm>
#include <cstdio>
#include <iterator>

#include "core/os/path.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/picture.h"
#include "vkrun/cli/progress.h"
#include "vkrun/cli/stopwatch.h"
#include "vkrun/cli/text.h"
#include "vkrun/priors/preset_list.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;
namespace os = splat::os;

/// A map of splat_prior_maps, or the edges of one operator.
struct MapKind {
    const char* name;  ///< name of the map's folder
    std::uint32_t flag;
    std::uint32_t channels;
    splat_image splat_prior_maps::*image;
};

constexpr MapKind kMapKinds[] = {{"depth", SPLAT_DATA_DEPTH, 1, &splat_prior_maps::depth},
                                 {"normal", SPLAT_DATA_NORMAL, 3, &splat_prior_maps::normal},
                                 {"mask", SPLAT_DATA_MASK, 1, &splat_prior_maps::mask}};

/// The model is a file of weights, by its name or its content, as the library decides.
bool holds_weights(const ModelSource& source) {
    std::string path = source.model;
    if (path.empty() && source.preset.find('{') == std::string::npos)
        path = preset_json(source.preset).at("path").get<std::string>();
    const std::string extension = os::text_of(os::path_of(path).extension());
    if (extension == ".pt" || extension == ".pth" || extension == ".safetensors") return true;
    Weights other;
    return splat_weights_load(path.c_str(), 0, other.out()) == SPLAT_OK;
}

/// One run of vkrun priors.
struct MapRun {
    const MapOptions& options;
    PriorModel model;  ///< empty: masks without a model
    std::vector<MapKind> kinds;
    std::string extension;
    MapReport report;
};

/// A map in memory.
struct MapPixels {
    std::vector<std::uint8_t> bytes;
    std::vector<float> floats;
};

bool missing(const MapRun& run, const MapJob& job) {
    std::error_code none;
    return std::any_of(run.kinds.begin(), run.kinds.end(), [&](const MapKind& kind) {
        return !fs::exists(job.map_path(kind.name, run.extension), none);
    });
}

/// What made the maps of a kind; a run with another may not add to them.
void check_record(const MapRun& run, const MapKind& kind) {
    const fs::path path =
        os::path_of(run.options.out) / os::path_of("priors-" + std::string(kind.name) + ".json");
    Json wanted = {
        {"map", kind.name}, {"preset", run.report.preset}, {"format", run.options.format}};
    std::error_code none;
    if (run.options.edges.use) {
        wanted["operators"] = run.options.edges.operators;
        wanted["of"] = run.options.depth.use ? "depth" : "picture";
    }
    if (const PlaneOptions& planes = run.options.planes; planes.use) {
        wanted["normals"] = planes.normals ? "maps" : "of depth";
        wanted["degrees"] = planes.degrees;
        wanted["offset"] = planes.offset;
        wanted["least"] = planes.least;
    }
    if (const fs::path model = os::path_of(run.report.model); !model.empty())
        wanted["model"] = {{"file", os::text_of(model.filename())},
                           {"bytes", fs::file_size(model, none)}};
    if (run.options.tokens != 0) wanted["tokens"] = run.options.tokens;
    if (!run.options.overwrite && fs::exists(path, none)) {
        const Json found = Json::parse(read_text(os::text_of(path)), nullptr, false);
        if (found != wanted)
            throw Failure(kUsageError, "'" + os::text_of(path) +
                                           "' says that the maps there are others (" +
                                           found.dump() + ", now " + wanted.dump() +
                                           "): use another folder, or --overwrite");
        return;
    }
    replace_file(path, json_text(wanted) + "\n");
}

/// Room for a map, and the image that names it.
splat_image map_target(const MapRun& run, const MapKind& kind, const splat_image& picture,
                       MapPixels& pixels) {
    const std::size_t count = std::size_t{picture.width} * picture.height * kind.channels;
    if (run.options.format == "png") {
        pixels.bytes.resize(count);
        return bytes_image(pixels.bytes.data(), picture.width, picture.height, kind.channels);
    }
    pixels.floats.resize(count);
    return interleaved_image(pixels.floats.data(), picture.width, picture.height, kind.channels);
}

void write_map(const MapRun& run, const MapJob& job, const MapKind& kind,
               const splat_image& image) {
    const fs::path path = job.map_path(kind.name, run.extension);
    check_target(os::text_of(path), true, {os::text_of(job.picture)});
    make_folder(path.parent_path());
    if (run.options.format != "png16")
        return check(splat_image_save(os::text_of(path).c_str(), &image));
    std::size_t needed = 0;
    check(splat_image_save_memory(&image, SPLAT_IMAGE_PNG16, nullptr, 0, &needed));
    std::string file(needed, '\0');
    check(splat_image_save_memory(&image, SPLAT_IMAGE_PNG16, file.data(), file.size(), &needed));
    replace_file(path, file);
}

/// Name a picture that has no maps.
void complain(MapRun& run, const MapJob& job, const std::string& sentence) {
    std::fprintf(stderr, "vkrun: %s\n", about_file(os::text_of(job.picture), sentence).c_str());
    ++run.report.failed;
}

void make_by_model(MapRun& run, const std::vector<MapJob>& jobs,
                   const std::vector<LoadedPicture>& pictures) {
    std::vector<splat_image> images;
    std::vector<MapPixels> pixels(pictures.size() * run.kinds.size());
    std::vector<splat_prior_maps> maps(pictures.size());
    for (std::size_t i = 0; i < pictures.size(); ++i) {
        images.push_back(pictures[i].image);
        for (std::size_t k = 0; k < run.kinds.size(); ++k)
            maps[i].*run.kinds[k].image =
                map_target(run, run.kinds[k], images[i], pixels[i * run.kinds.size() + k]);
    }
    const splat_result result = splat_prior_model_run(run.model.get(), images.data(), maps.data(),
                                                      static_cast<std::uint32_t>(images.size()));
    if (result < 0)
        throw Failure(
            result == SPLAT_ERROR_INVALID_STATE        ? kNotFinite
            : result == SPLAT_ERROR_OUT_OF_HOST_MEMORY ? kOutOfMemory
                                                       : kBadData,
            "'" + os::text_of(jobs.front().picture) + "'" +
                (jobs.size() > 1 ? " to '" + os::text_of(jobs.back().picture) + "'" : "") + ": " +
                library_message());
    for (std::size_t i = 0; i < jobs.size(); ++i)
        for (const MapKind& kind : run.kinds) write_map(run, jobs[i], kind, maps[i].*kind.image);
    run.report.made += jobs.size();
}

void make_mask(MapRun& run, const MapJob& job, const LoadedPicture& picture) {
    MapPixels pixels;
    splat_image mask = map_target(run, run.kinds.front(), picture.image, pixels);
    splat_found found = 0;
    check(splat_picture_mask(&picture.image, &mask, &found), kBadData);
    if (found == SPLAT_FOUND_NOTHING)
        return complain(run, job,
                        "no object: it has no alpha, and its border has no colour of its own; use "
                        "--preset or --model");
    write_map(run, job, run.kinds.front(), mask);
    ++run.report.made;
}

void make_normals(MapRun& run, const MapJob& job) {
    try {
        const LoadedDepth depth = load_depth(job, run.options.depth);
        MapPixels pixels;
        const splat_image normal = map_target(run, run.kinds.front(), depth.image, pixels);
        check(splat_normals_from_depth(&depth.image, &depth.desc, &normal), kBadData);
        write_map(run, job, run.kinds.front(), normal);
        ++run.report.made;
    } catch (const Failure& failure) {
        if (failure.code() != kBadData) throw;
        complain(run, job, failure.what());
    }
}

void make_planes(MapRun& run, const MapJob& job) {
    const PlaneOptions& options = run.options.planes;
    try {
        const LoadedDepth depth = load_depth(job, run.options.depth);
        auto desc = sized<splat_planes_desc>();
        const bool vectors = run.options.format == "npy";
        desc.flags = vectors ? SPLAT_NORMAL_VECTORS : 0;
        desc.max_degrees = options.degrees;
        desc.max_offset = options.offset;
        desc.least_share = options.least;
        LoadedDepth normals;
        if (options.normals) normals = load_normals(job, vectors);
        MapPixels pixels;
        const splat_image plane = map_target(run, run.kinds.front(), depth.image, pixels);
        check(splat_planes_from_depth(&depth.image, options.normals ? &normals.image : nullptr,
                                      &depth.desc, &desc, &plane, nullptr),
              kBadData);
        write_map(run, job, run.kinds.front(), plane);
        ++run.report.made;
    } catch (const Failure& failure) {
        if (failure.code() != kBadData) throw;
        complain(run, job, failure.what());
    }
}

/// Write channels `first` to `first` + those of the kind, of edges [height,width,channels].
void write_edges(const MapRun& run, const MapJob& job, const MapKind& kind, std::size_t first,
                 const std::vector<float>& edges, const splat_image& plane) {
    const std::size_t channels = run.options.edges.operators.size();
    MapPixels pixels;
    const splat_image image = map_target(run, kind, plane, pixels);
    const std::size_t area = std::size_t{plane.width} * plane.height;
    for (std::size_t i = 0; i < area; ++i)
        for (std::size_t c = 0; c < kind.channels; ++c) {
            const float value = edges[i * channels + first + c];
            const std::size_t at = i * kind.channels + c;
            if (pixels.floats.empty())
                pixels.bytes[at] = static_cast<std::uint8_t>(value * 255);
            else
                pixels.floats[at] = value;
        }
    write_map(run, job, kind, image);
}

void make_edges(MapRun& run, const MapJob& job) {
    try {
        const LoadedDepth plane = run.options.depth.use
                                      ? load_depth_plane(job)
                                      : gray_plane_of(load_picture(os::text_of(job.picture)).image);
        const std::vector<float> edges = edges_of(plane.image, run.options.edges.operators);
        std::size_t first = 0;
        for (const MapKind& kind : run.kinds) {
            write_edges(run, job, kind, first, edges, plane.image);
            first += kind.channels;
        }
        ++run.report.made;
    } catch (const Failure& failure) {
        if (failure.code() != kBadData) throw;
        complain(run, job, failure.what());
    }
}

void make_batch(MapRun& run, const std::vector<MapJob>& batch) {
    std::vector<MapJob> jobs;
    std::vector<LoadedPicture> pictures;
    for (const MapJob& job : batch) {
        if (run.options.edges.use || run.options.depth.use) {
            run.options.edges.use    ? make_edges(run, job)
            : run.options.planes.use ? make_planes(run, job)
                                     : make_normals(run, job);
            continue;
        }
        try {
            pictures.push_back(load_picture(os::text_of(job.picture)));
            jobs.push_back(job);
        } catch (const Failure& failure) {
            complain(run, job, failure.what());
        }
    }
    if (run.model.get() == nullptr)
        for (std::size_t i = 0; i < jobs.size(); ++i) make_mask(run, jobs[i], pictures[i]);
    else if (!jobs.empty())
        make_by_model(run, jobs, pictures);
}

/// Throws a usage Failure if one of these options was given.
void refuse_options(const MapOptions& options, const std::vector<std::string>& names,
                    const std::string& why) {
    for (const std::string& name : names)
        if (std::ranges::find(options.of_models, name) != options.of_models.end())
            throw Failure(kUsageError, name + " has no effect " + why);
}

/// The operators as channels of the map that is asked for, or each in a folder of its own.
void choose_edges(MapRun& run) {
    const MapOptions& options = run.options;
    const std::vector<std::string>& operators = options.edges.operators;
    if (!options.model.empty() || options.all)
        throw Failure(kUsageError, "--preset edges goes without --model and --all");
    run.report.preset = "edges";
    if (options.map == "edges") {
        for (const std::string& name : operators)
            run.kinds.push_back({name.c_str(), 0, 1, nullptr});
    } else {
        const auto kind = std::find_if(std::begin(kMapKinds), std::end(kMapKinds),
                                       [&](const MapKind& one) { return options.map == one.name; });
        if (operators.size() != kind->channels)
            throw Failure(kUsageError, "--operator names " + std::to_string(operators.size()) +
                                           " operators, expected " +
                                           std::to_string(kind->channels) + " for a map of " +
                                           options.map);
        run.kinds.push_back(*kind);
    }
    for (const MapKind& kind : run.kinds) run.report.maps.emplace_back(kind.name);
}

/// The model and its maps, or a mask without a model.
void choose_maps(MapRun& run) {
    const MapOptions& options = run.options;
    const bool model = !options.model.empty() || !options.preset.empty();
    if (!model || options.edges.use)
        refuse_options(options, options.of_models,
                       "without a model: name one with --preset or --model");
    if (options.edges.use) return choose_edges(run);
    if (options.planes.use) {
        run.kinds.push_back({"plane", 0, 4, nullptr});
        run.report.preset = "from-depth";
        run.report.maps.emplace_back("plane");
        return;
    }
    if (!options.edges.operators.empty())
        throw Failure(kUsageError, "--operator goes with --preset edges");
    std::uint32_t maps = SPLAT_DATA_MASK;
    if (options.depth.use) {
        if (model || options.all)
            throw Failure(kUsageError, "--from-depth goes without a model and --all");
        maps = SPLAT_DATA_NORMAL;
        run.report.preset = "from-depth";
    } else if (!model) {
        if (options.map != "mask" || options.all)
            throw Failure(kUsageError,
                          "name a model with --preset or --model; 'vkrun priors where' "
                          "lists the presets");
    } else {
        run.model =
            load_prior_model({options.model, options.preset, options.runtime, options.threads,
                              options.tokens, options.format == "npy", options.device});
        auto info = sized<splat_prior_model_info>();
        check(splat_prior_model_get_info(run.model.get(), &info));
        run.report.preset = info.preset;
        run.report.licence = info.licence;
        run.report.model = info.path;
        if (*info.runtime_version == '\0')
            refuse_options(options, {"--runtime"}, "on weights, which run on --device");
        else
            refuse_options(options, {"--device"}, "on an .onnx file, which ONNX Runtime runs");
        maps = info.maps;
    }
    for (const MapKind& kind : kMapKinds) {
        const bool asked = options.map == kind.name;
        if (asked && (maps & kind.flag) == 0)
            throw Failure(kUsageError,
                          "preset '" + run.report.preset + "' makes no " + options.map + " maps");
        if (asked || (options.all && (maps & kind.flag) != 0)) run.kinds.push_back(kind);
    }
    for (const MapKind& kind : run.kinds) run.report.maps.emplace_back(kind.name);
}

}  // namespace

LoadedPicture load_picture(const std::string& path) {
    LoadedPicture loaded;
    loaded.image.type = SPLAT_PIXEL_U8;
    check(splat_image_load(path.c_str(), &loaded.image, nullptr), kBadData);
    loaded.bytes.resize(loaded.image.bytes);
    loaded.image.pixels = loaded.bytes.data();
    check(splat_image_load(path.c_str(), &loaded.image, nullptr), kBadData);
    return loaded;
}

PriorModel load_prior_model(const ModelSource& source) {
    const auto text = [](const std::string& value) {
        return value.empty() ? nullptr : value.c_str();
    };
    auto desc = sized<splat_prior_model_desc>();
    desc.preset = text(source.preset);
    desc.model_path = text(source.model);
    desc.runtime_path = text(source.runtime);
    desc.threads = source.threads;
    desc.tokens = source.tokens;
    desc.device = source.on;
    if (source.numbers) desc.flags |= SPLAT_PRIOR_MODEL_NUMBERS;
    Device own;  // the model keeps it open
    if (source.on == nullptr && holds_weights(source)) {
        own = open_device(device_desc(source.device));
        desc.device = own.get();
    }
    PriorModel loaded;
    const splat_result result = splat_prior_model_create(&desc, loaded.out());
    check(result, result == SPLAT_ERROR_INVALID_ARGUMENT ? kUsageError : kBadData);
    return loaded;
}

MapReport make_maps(const MapOptions& options) {
    const Stopwatch watch;
    MapRun run{options, {}, {}, options.format == "npy" ? ".npy" : ".png", {}};
    const Shard shard = parse_shard(options.shard);
    std::vector<MapJob> jobs = map_jobs(os::path_of(options.in), os::path_of(options.out), shard);
    choose_maps(run);
    make_folder(options.out);
    remove_stale_files(os::path_of(options.out), shard);
    for (const MapKind& kind : run.kinds) {
        check_record(run, kind);
        remove_stale_maps(jobs, kind.name, shard);
    }
    if (!options.overwrite) {
        const std::size_t all = jobs.size();
        std::erase_if(jobs, [&](const MapJob& job) { return !missing(run, job); });
        run.report.kept = all - jobs.size();
    }
    Progress progress("pictures", jobs.size());
    for (std::size_t first = 0; first < jobs.size(); first += options.batch) {
        progress.show(first);
        const auto from = jobs.begin() + static_cast<std::ptrdiff_t>(first);
        const std::size_t count = std::min<std::size_t>(options.batch, jobs.size() - first);
        make_batch(run, {from, from + static_cast<std::ptrdiff_t>(count)});
    }
    run.report.seconds = watch.seconds();
    return run.report;
}

}  // namespace vkrun
