// vkrun data show: a sheet of some objects and views.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>

#include "vkrun/cli/command.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/picture.h"

namespace vkrun {
namespace {

constexpr const char* kDataShowFooter =
    R"(One row for each object: views at equal steps, then the maps of the last one.

Exit status: 0 done, 1 FILE cannot be written, 2 wrong usage, 4 the data cannot be read.

Examples:
  vkrun data show data --out sheet.png
  vkrun data show data --split val --objects 12 --views 10 --size 64 --out sheet.png --json
)";

struct ShowOptions {
    std::string path;
    std::string format;
    std::string split = "train";
    std::string out;
    std::uint32_t objects = 8;
    std::uint32_t views = 6;
    std::uint32_t size = 0;
    bool overwrite = false;
    bool json = false;
};

/// Whatever the library refuses here is bad data.
void check_read(splat_result result) {
    if (result < 0) throw Failure(kBadData, library_message());
}

Dataset open_shown(const ShowOptions& options) {
    auto desc = sized<splat_dataset_desc>();
    desc.path = options.path.c_str();
    desc.format = options.format.empty() ? nullptr : options.format.c_str();
    desc.split = options.split.c_str();
    desc.resolution = options.size;
    desc.limit = options.objects;
    for (float& value : desc.background) value = 1;
    Dataset dataset;
    check_read(splat_dataset_open(&desc, dataset.out()));
    return dataset;
}

std::vector<std::uint32_t> views_shown(std::uint32_t wanted, std::uint32_t there) {
    std::vector<std::uint32_t> views;
    const std::uint32_t count = std::min(wanted, there);
    for (std::uint32_t i = 0; i < count; ++i) views.push_back(i * there / count);
    return views;
}

/// Adds the row of one object.
void add_object(splat_dataset dataset, const Json& report, std::uint32_t object,
                std::uint32_t columns, Picture& sheet) {
    const auto size = report.at("resolution").get<std::uint32_t>();
    const std::vector<std::uint32_t> views =
        views_shown(columns, report.at("views_of")[object].get<std::uint32_t>());
    const std::size_t area = std::size_t{size} * size;
    std::vector<float> images(views.size() * area * 3);
    std::vector<float> depths(views.size() * area);
    std::vector<float> normals(views.size() * area * 3);
    std::vector<float> masks(views.size() * area);
    std::vector<float> planes(views.size() * area * 5);
    auto out = sized<splat_dataset_views>();
    out.images = images.data();
    for (const Json& map : report.at("maps")) {
        if (map == "depth") out.depths = depths.data();
        if (map == "normal") out.normals = normals.data();
        if (map == "mask") out.masks = masks.data();
        if (map == "plane") out.planes = planes.data();
    }
    check_read(splat_dataset_read(dataset, object, views.data(),
                                  static_cast<std::uint32_t>(views.size()), &out));
    const auto place = [&](std::uint32_t column, const float* picture, std::uint32_t channels) {
        sheet.place(picture, channels, size, size, column * size, object * size);
    };
    for (std::uint32_t i = 0; i < views.size(); ++i) place(i, &images[i * area * 3], 3);
    const std::size_t last = views.size() - 1;
    std::uint32_t column = columns;
    if (out.depths != nullptr) place(column++, &depths[last * area], 1);
    if (out.normals != nullptr) place(column++, &normals[last * area * 3], 3);
    if (out.masks != nullptr) place(column++, &masks[last * area], 1);
    if (out.planes != nullptr) place(column++, &planes[last * area * 5], 3);  // normals
}

int show(const ShowOptions& options) {
    const std::string out = one_file(options.out, options.split + ".png");
    check_target(out, options.overwrite);
    const Dataset dataset = open_shown(options);
    const Json report = library_json(splat_dataset_report, dataset.get());
    const auto objects = report.at("objects").get<std::uint32_t>();
    const std::uint32_t columns =
        options.views + static_cast<std::uint32_t>(report.at("maps").size());
    const auto size = report.at("resolution").get<std::uint32_t>();
    Picture sheet(columns * size, objects * size);
    for (std::uint32_t object = 0; object < objects; ++object)
        add_object(dataset.get(), report, object, options.views, sheet);
    make_folder_of(out);
    sheet.save(out);
    if (options.json)
        print_json({{"out", out},
                    {"objects", objects},
                    {"width", sheet.width()},
                    {"height", sheet.height()},
                    {"maps", report.at("maps")}});
    else
        std::printf("%s: %u objects, %u x %u pixels\n", out.c_str(), objects, sheet.width(),
                    sheet.height());
    return kSuccess;
}

}  // namespace

void add_data_show(CLI::App& data, int& exit_code) {
    CLI::App* command =
        add_command(data, "show", "Draw a sheet of objects, views and maps.", kDataShowFooter);
    const auto options = std::make_shared<ShowOptions>();
    command->add_option("DIR", options->path, "Folder of the data set")->required()->type_name("");
    command->add_option("--out", options->out, "Image to write, .png, or a folder for SPLIT.png")
        ->required()
        ->type_name("FILE");
    command->add_option("--split", options->split, "train, val or test")
        ->type_name("NAME")
        ->capture_default_str()
        ->check(one_of({"train", "val", "test"}));
    command->add_option("--format", options->format, "Format of the data set; default: detected")
        ->type_name("NAME");
    add_count_option(*command, "--objects", options->objects, "Objects, one per row", 1, 100);
    add_count_option(*command, "--views", options->views, "Views of each object", 1, 100);
    add_count_option(*command, "--size", options->size,
                     "Side of each picture, pixels; 0: as stored", 0, 1024);
    add_overwrite_flag(*command, options->overwrite, "FILE");
    add_json_flag(*command, options->json);
    command->callback([options, &exit_code] { exit_code = show(*options); });
}

}  // namespace vkrun
