// Materials of Wavefront's .mtl files: what the base colour depends on.

#include <algorithm>
#include <cmath>
#include <span>

#include "io/mesh/textures.h"
#include "io/reader.h"
#include "scene/srgb.h"

namespace splat::io {
namespace {

class MtlReader {
  public:
    MtlReader(Bytes file, std::set<std::string>& ignored)
        : lines_(file, "MTL"), ignored_(ignored) {}

    Result<std::vector<MtlMaterial>> read() {
        std::string_view line;
        while (lines_.next_record(line)) SPLAT_TRY(read_line(line));
        return std::move(materials_);
    }

  private:
    Status read_line(std::string_view line) {
        Words words(line, lines_);
        SPLAT_ASSIGN(const std::string_view keyword, words.word("keyword"));
        if (keyword == "newmtl") {
            const std::string name = words.rest();
            if (name.empty()) return lines_.bad("there is no name behind newmtl");
            materials_.push_back({name, {}, ""});
            return {};
        }
        const bool known = keyword == "Kd" || keyword == "d" || keyword == "Tr" ||
                           keyword == "map_Kd" || keyword == "map_d";
        if (!known) {
            ignore(std::string(keyword));
            return {};
        }
        if (materials_.empty())
            return lines_.bad("'" + std::string(keyword) + "' stands before the first newmtl");
        if (keyword == "Kd") return read_color(words);
        if (keyword == "map_Kd") return read_image_of(words);
        if (keyword == "map_d") return read_mask(words);
        return read_opacity(words, keyword == "Tr");
    }

    void ignore(const std::string& what) { add_ignored(ignored_, "material's " + shown(what, 40)); }

    Status read_number(Words& words, float& value, const char* field) {
        double number = 0;
        SPLAT_TRY(words.read(number, field));
        value = static_cast<float>(number);
        if (std::isfinite(value)) return {};
        return lines_.bad(std::string(field) + " is not finite");
    }

    /// r g b, or r alone for all.
    Status read_color(Words& words) {
        scene::MeshMaterial& material = materials_.back().material;
        const std::string rest = words.rest();
        if (rest.starts_with("xyz") || rest.starts_with("spectral")) {
            ignore("Kd " + rest.substr(0, rest.find(' ')));
            return {};
        }
        for (std::size_t k = 0; k < 3; ++k) {
            float value = 0;
            if (k == 1 && words.done()) {
                material.color[1] = material.color[2] = material.color[0];
                return {};
            }
            SPLAT_TRY(read_number(words, value, "colour"));
            if (value < 0 || value > 1)
                return lines_.bad(
                    format("a colour is %g, expected 0 to 1", static_cast<double>(value)));
            material.color[k] = scene::linear_of_srgb(value);
        }
        return {};
    }

    /// d, or 1 - Tr. Of materials with d and Tr that contradict each other the last one counts.
    Status read_opacity(Words& words, bool transparency) {
        scene::MeshMaterial& material = materials_.back().material;
        if (words.rest().starts_with("-halo")) {
            ignore("d -halo");
            SPLAT_TRY(words.word("option").status());
        }
        float value = 0;
        SPLAT_TRY(read_number(words, value, "opacity"));
        if (value < 0 || value > 1)
            return lines_.bad(
                format("an opacity is %g, expected 0 to 1", static_cast<double>(value)));
        material.color[3] = transparency ? 1 - value : value;
        if (material.alpha != scene::AlphaMode::kMask)
            material.alpha =
                material.color[3] < 1 ? scene::AlphaMode::kBlend : scene::AlphaMode::kOpaque;
        return {};
    }

    /// One to three numbers behind an option; the later ones keep their values.
    Status read_vector(Words& words, std::span<double, 3> to) {
        SPLAT_TRY(words.read(to[0], "option"));
        for (std::size_t k = 1; k < 3; ++k) {
            const std::string rest = words.rest();
            if (!number_in<double>(rest.substr(0, rest.find_first_of(" \t")))) break;
            SPLAT_TRY(words.read(to[k], "option"));
        }
        if (std::ranges::all_of(to,
                                [](double v) { return std::isfinite(v) && std::abs(v) < 1e30; }))
            return {};
        return lines_.bad("an option of the image is not finite, or beyond 10^30");
    }

    /// The options before the name of an image. Errors: kFormat for an unknown one.
    Status read_options(Words& words, scene::MeshMaterial& material) {
        double scale[3] = {1, 1, 1}, origin[3] = {0, 0, 0};
        while (words.rest().starts_with('-')) {
            SPLAT_ASSIGN(const std::string_view option, words.word("option"));
            double unread[3] = {};
            std::string_view value;
            if (option == "-s" || option == "-o") {
                SPLAT_TRY(read_vector(words, option == "-s" ? scale : origin));
                continue;
            }
            if (option == "-t") {
                SPLAT_TRY(read_vector(words, unread));
            } else if (option == "-mm") {
                SPLAT_TRY(words.read(unread[0], "option"));
                SPLAT_TRY(words.read(unread[1], "option"));
            } else {
                constexpr std::string_view kOfOneWord[] = {"-blendu",  "-blendv", "-bm",
                                                           "-boost",   "-cc",     "-clamp",
                                                           "-imfchan", "-texres", "-type"};
                if (std::ranges::find(kOfOneWord, option) == std::end(kOfOneWord))
                    return lines_.bad("an option of the image is '" + shown(option, 40) +
                                      "', which the format does not have");
                SPLAT_SET(value, words.word("option"));
            }
            if (option == "-clamp")
                material.wrap_u = material.wrap_v =
                    value == "on" ? scene::Wrap::kClamp : scene::Wrap::kRepeat;
            else
                ignore("image option " + std::string(option));
        }
        // The file has v from the bottom up, texture coordinates in memory from the top down.
        material.at = {static_cast<float>(scale[0]),  0,
                       static_cast<float>(origin[0]), 0,
                       static_cast<float>(scale[1]),  static_cast<float>(1 - scale[1] - origin[1])};
        return {};
    }

    Status read_image_of(Words& words) {
        MtlMaterial& to = materials_.back();
        SPLAT_TRY(read_options(words, to.material));
        to.image = words.rest();
        if (to.image.empty()) return lines_.bad("there is no name of an image");
        return {};
    }

    /// Opacity of an image: used where the colour's image has it.
    Status read_mask(Words& words) {
        MtlMaterial& to = materials_.back();
        scene::MeshMaterial unread;
        SPLAT_TRY(read_options(words, unread));
        if (words.rest() == to.image && !to.image.empty())
            to.material.alpha = scene::AlphaMode::kMask;
        else
            ignore("map_d");
        return {};
    }

    Lines lines_;
    std::set<std::string>& ignored_;
    std::vector<MtlMaterial> materials_;
};

}  // namespace

Result<std::vector<MtlMaterial>> read_mtl(Bytes file, std::set<std::string>& ignored) {
    return MtlReader(file, ignored).read();
}

}  // namespace splat::io
