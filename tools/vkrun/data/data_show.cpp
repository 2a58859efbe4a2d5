// vkrun data show: a sheet of some objects and views.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>

#include "vkrun/data/data_commands.h"
#include "vkrun/scene_input.h"

namespace vkrun {
namespace {

constexpr const char* kDataShowFooter =
    R"(One row for each object, views at equal steps over those that it has, and the maps of the last one.

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

/// What the data cannot give is bad data.
void check_read(splat_result result) {
    if (result < 0) throw Failure(kBadData, splat_last_error_message());
}

/// Pictures side by side in rows, RGB.
class Sheet {
  public:
    Sheet(std::uint32_t columns, std::uint32_t rows, std::uint32_t size)
        : width_(columns * size), height_(rows * size), size_(size) {
        values_.resize(std::size_t{width_} * height_ * 3, 1.0F);
    }

    /// A picture [channels,size,size]; one channel is gray.
    void put(std::uint32_t column, std::uint32_t row, const float* picture,
             std::uint32_t channels) {
        for (std::uint32_t y = 0; y < size_; ++y)
            for (std::uint32_t x = 0; x < size_; ++x)
                for (std::uint32_t c = 0; c < 3; ++c) {
                    const std::size_t to =
                        (std::size_t{row * size_ + y} * width_ + column * size_ + x) * 3 + c;
                    const std::size_t plane = std::min(c, channels - 1);
                    values_[to] = picture[(plane * size_ + y) * size_ + x];
                }
    }

    void save(const std::string& path) const {
        check(splat_image_save(path.c_str(), values_.data(), width_, height_, 3));
    }

    [[nodiscard]] std::uint32_t width() const { return width_; }
    [[nodiscard]] std::uint32_t height() const { return height_; }

  private:
    std::uint32_t width_;
    std::uint32_t height_;
    std::uint32_t size_;
    std::vector<float> values_;
};

Dataset open_data(const ShowOptions& options) {
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

/// The row of one object.
void put_object(splat_dataset dataset, const Json& report, std::uint32_t object,
                std::uint32_t columns, Sheet& sheet) {
    const auto size = report.at("resolution").get<std::uint32_t>();
    const std::vector<std::uint32_t> views =
        views_shown(columns, report.at("views_of")[object].get<std::uint32_t>());
    const std::size_t area = std::size_t{size} * size;
    std::vector<float> images(views.size() * area * 3);
    std::vector<float> depths(views.size() * area);
    std::vector<float> normals(views.size() * area * 3);
    std::vector<float> masks(views.size() * area);
    auto out = sized<splat_dataset_views>();
    out.images = images.data();
    for (const Json& map : report.at("maps")) {
        if (map == "depth") out.depths = depths.data();
        if (map == "normal") out.normals = normals.data();
        if (map == "mask") out.masks = masks.data();
    }
    check_read(splat_dataset_read(dataset, object, views.data(),
                                  static_cast<std::uint32_t>(views.size()), &out));
    for (std::uint32_t i = 0; i < views.size(); ++i) sheet.put(i, object, &images[i * area * 3], 3);
    const std::size_t last = views.size() - 1;
    std::uint32_t column = columns;
    if (out.depths != nullptr) sheet.put(column++, object, &depths[last * area], 1);
    if (out.normals != nullptr) sheet.put(column++, object, &normals[last * area * 3], 3);
    if (out.masks != nullptr) sheet.put(column++, object, &masks[last * area], 1);
}

int show(const ShowOptions& options) {
    check_target(options.out, options.overwrite);
    const Dataset dataset = open_data(options);
    const Json report =
        Json::parse(whole_text([&](char* buffer, std::size_t capacity, std::size_t* needed) {
            return splat_dataset_report(dataset.get(), buffer, capacity, needed);
        }));
    const auto objects = report.at("objects").get<std::uint32_t>();
    const std::uint32_t columns =
        options.views + static_cast<std::uint32_t>(report.at("maps").size());
    Sheet sheet(columns, objects, report.at("resolution").get<std::uint32_t>());
    for (std::uint32_t object = 0; object < objects; ++object)
        put_object(dataset.get(), report, object, options.views, sheet);
    sheet.save(options.out);
    if (options.json)
        std::printf("%s\n", json_text({{"out", options.out},
                                       {"objects", objects},
                                       {"width", sheet.width()},
                                       {"height", sheet.height()},
                                       {"maps", report.at("maps")}})
                                .c_str());
    else
        std::printf("%s: %u objects, %u x %u pixels\n", options.out.c_str(), objects, sheet.width(),
                    sheet.height());
    return kSuccess;
}

}  // namespace

void add_data_show(CLI::App& data, int& exit_code) {
    CLI::App* command = data.add_subcommand("show", "Draw a sheet of objects, views and maps.");
    command->group("Commands");
    const auto options = std::make_shared<ShowOptions>();
    const auto counted = [command](const char* name, std::uint32_t& value, const char* text,
                                   int least, int most) {
        command->add_option(name, value, std::string(text) + "; " + std::to_string(value))
            ->type_name("N")
            ->check(CLI::Range(least, most).description(""));
    };
    command->add_option("DIR", options->path, "Folder of the data set")->required()->type_name("");
    command->add_option("--out", options->out, "Image to write, .png")
        ->required()
        ->type_name("FILE");
    command->add_option("--split", options->split, "train, val or test; train")
        ->type_name("NAME")
        ->check(CLI::IsMember({"train", "val", "test"}).description(""));
    command->add_option("--format", options->format, "Of the data; by what the folder holds")
        ->type_name("NAME");
    counted("--objects", options->objects, "Rows", 1, 100);
    counted("--views", options->views, "Views of each object", 1, 100);
    counted("--size", options->size, "Rows and columns of each picture, 0 as stored", 0, 1024);
    command->add_flag("--overwrite", options->overwrite, "Replace FILE if it is there");
    command->add_flag("--json", options->json, "Print one JSON object on standard output");
    command->footer(kDataShowFooter);
    command->callback([options, &exit_code] { exit_code = show(*options); });
}

}  // namespace vkrun
