#include <algorithm>
#include <map>
#include <set>

#include "io/file.h"
#include "io/mesh/mesh.h"
#include "io/mesh/textures.h"
#include "io/reader.h"
#include "scene/srgb.h"

namespace splat::io {
namespace {

/// What a surface of triangles leaves out. Names of objects and groups, which come first, change nothing.
constexpr std::string_view kLeftOut[] = {
    "o",   "g",     "vp",       "s",        "l",      "p",          "usemap",   "mg",
    "lod", "bevel", "c_interp", "d_interp", "maplib", "shadow_obj", "trace_obj"};
constexpr std::size_t kFirstReported = 2;

constexpr std::string_view kFreeForm[] = {"curv", "curv2", "surf",  "cstype", "deg",  "bmat",
                                          "step", "parm",  "trim",  "hole",   "scrv", "sp",
                                          "end",  "con",   "ctech", "stech",  "call", "csh"};

constexpr std::uint64_t kMaxMtlBytes = std::uint64_t{64} << 20U;
constexpr std::uint64_t kMaxTextureBytes = std::uint64_t{1} << 30U;

template <class Words>
std::size_t place_in(const Words& words, std::string_view word) {
    return static_cast<std::size_t>(std::ranges::find(words, word) - std::begin(words));
}

/// What the lines of a file hold, counted before memory is taken for it.
struct ObjCounts {
    std::uint64_t vertices = 0, normals = 0, texcoords = 0, triangles = 0;
};

ObjCounts count_lines(Bytes file) {
    ObjCounts counts;
    Lines lines(file, "OBJ");
    std::string_view line;
    while (lines.next_record(line)) {
        line.remove_prefix(line.find_first_not_of(" \t\r"));
        const std::size_t end = std::min(line.find_first_of(" \t\r"), line.size());
        const std::string_view keyword = line.substr(0, end);
        counts.vertices += keyword == "v" ? 1 : 0;
        counts.normals += keyword == "vn" ? 1 : 0;
        counts.texcoords += keyword == "vt" ? 1 : 0;
        if (keyword != "f" && keyword != "fo") continue;
        std::uint64_t corners = 0;
        for (std::size_t i = end; i < line.size(); ++i)
            corners += line[i - 1] <= ' ' && line[i] > ' ' ? 1 : 0;
        counts.triangles += corners < 3 ? 0 : corners - 2;
    }
    return counts;
}

class ObjReader {
  public:
    ObjReader(Bytes file, const MeshOptions& options)
        : file_(file), options_(options), lines_(file, "OBJ"), mesh_(to_.mesh) {}

    Result<LoadedMesh> read() {
        SPLAT_TRY(reserve());
        std::string_view line;
        while (lines_.next_record(line)) SPLAT_TRY(read_line(line));
        for (std::size_t i = kFirstReported; i < std::size(kLeftOut); ++i)
            if (left_out_[i]) to_.ignored.insert("lines " + std::string(kLeftOut[i]));
        for (const auto& [count, what] :
             {std::pair(bad_normals_, "normals that are not finite"),
              std::pair(bad_texcoords_, "texture coordinates that are not finite"),
              std::pair(weights_, "weights of vertices")})
            if (count > 0) to_.ignored.insert(format("%zu %s", count, what));
        if (!options_.surface_only) SPLAT_TRY(finish_looks());
        return std::move(to_);
    }

  private:
    Status reserve() {
        counts_ = count_lines(file_);
        if (options_.surface_only) counts_.normals = counts_.texcoords = 0;
        if (counts_.triangles > options_.max_triangles)
            return unsupported("OBJ: %llu triangles, expected at most %llu", llu(counts_.triangles),
                               llu(options_.max_triangles));
        for (const std::uint64_t count : {counts_.vertices, counts_.normals, counts_.texcoords})
            if (count >= scene::kNone)
                return unsupported(
                    "OBJ: more than 2^32 - 2 vertices, normals or texture coordinates");
        DecodeBudget budget(file_.size(), options_.limits);
        SPLAT_TRY(budget.take(counts_.vertices, sizeof(scene::Vec3), "OBJ: vertices"));
        SPLAT_TRY(budget.take(counts_.normals, 3 * sizeof(float), "OBJ: normals"));
        SPLAT_TRY(budget.take(counts_.texcoords, 2 * sizeof(float), "OBJ: texture coordinates"));
        const std::uint64_t lists =
            1U + (counts_.normals > 0 ? 1U : 0U) + (counts_.texcoords > 0 ? 1U : 0U);
        SPLAT_TRY(budget.take(counts_.triangles,
                              lists * sizeof(scene::Triangle) + sizeof(std::uint32_t),
                              "OBJ: triangles"));
        const auto triangles = static_cast<std::size_t>(counts_.triangles);
        mesh_.vertices.reserve(static_cast<std::size_t>(counts_.vertices));
        mesh_.normals.reserve(static_cast<std::size_t>(counts_.normals));
        mesh_.texcoords.reserve(static_cast<std::size_t>(counts_.texcoords));
        mesh_.triangles.reserve(triangles);
        if (counts_.normals > 0) mesh_.normal_indices.reserve(triangles);
        if (counts_.texcoords > 0) mesh_.texcoord_indices.reserve(triangles);
        return {};
    }

    Status read_line(std::string_view line) {
        const std::size_t last = line.find_last_not_of(" \t\r");
        if (line[last] == '\\')
            return unsupported("OBJ line %zu: the line goes on in the next one; join such lines",
                               lines_.number());
        Words words(line, lines_);
        SPLAT_ASSIGN(const std::string_view keyword, words.word("keyword"));
        if (keyword == "v") return read_vertex(words);
        if (keyword == "f" || keyword == "fo") return read_face(words);
        if (keyword == "vn" || keyword == "vt" || keyword == "usemtl" || keyword == "mtllib") {
            if (options_.surface_only) return {};
            if (keyword == "vn") return read_normal(words);
            if (keyword == "vt") return read_texcoord(words);
            return keyword == "usemtl" ? use_material(words) : name_library(words);
        }
        if (const std::size_t i = place_in(kLeftOut, keyword); i < std::size(kLeftOut)) {
            left_out_[i] = true;
            return {};
        }
        const std::string name(keyword.substr(0, 40));
        if (place_in(kFreeForm, keyword) < std::size(kFreeForm))
            return unsupported(
                "OBJ line %zu: '%s' belongs to a free-form surface, expected polygons",
                lines_.number(), name.c_str());
        return lines_.bad("the keyword is '" + name +
                          "', expected one of the format, such as v or f");
    }

    Status read_vertex(Words& words) {
        scene::Vec3 vertex;
        for (std::size_t k = 0; k < 3; ++k) SPLAT_TRY(words.read(vertex[k], "coordinate"));
        if (!scene::is_finite(vertex)) return lines_.bad("a coordinate is not finite");
        mesh_.vertices.push_back(vertex);
        std::array<float, 4> color = {1, 1, 1, 1};
        if (!options_.surface_only && !words.done()) SPLAT_TRY(read_color(words, color));
        if (colored_) mesh_.colors.push_back(color);
        return {};
    }

    /// r, g, b behind the coordinates, after which some programs have an opacity. One number is a weight of curves.
    Status read_color(Words& words, std::array<float, 4>& color) {
        std::size_t count = 0;
        for (; !words.done() && count < 4; ++count)
            SPLAT_TRY(read_float(words, color[count], "colour"));
        if (count < 3) {
            ++weights_;
            color = {1, 1, 1, 1};
            return {};
        }
        for (std::size_t k = 0; k < 4; ++k) {
            if (!(color[k] >= 0 && color[k] <= 1))
                return lines_.bad(format("a colour behind the coordinates is %g, expected 0 to 1",
                                         static_cast<double>(color[k])));
            if (k < 3) color[k] = scene::linear_of_srgb(color[k]);
        }
        if (colored_) return {};
        colored_ = true;
        mesh_.colors.reserve(static_cast<std::size_t>(counts_.vertices));
        mesh_.colors.assign(mesh_.vertices.size() - 1, {1, 1, 1, 1});
        return {};
    }

    Status read_normal(Words& words) {
        std::array<float, 3> normal{};
        for (float& value : normal) SPLAT_TRY(read_float(words, value, "number of a normal"));
        if (!std::ranges::all_of(normal, [](float v) { return std::isfinite(v); })) {
            normal = {};
            ++bad_normals_;
        }
        mesh_.normals.push_back(normal);
        return {};
    }

    /// u and v, which may be missing; in the file v grows from the bottom up.
    Status read_texcoord(Words& words) {
        std::array<float, 2> at{};
        SPLAT_TRY(read_float(words, at[0], "texture coordinate"));
        if (!words.done()) SPLAT_TRY(read_float(words, at[1], "texture coordinate"));
        at[1] = 1 - at[1];
        if (!std::isfinite(at[0]) || !std::isfinite(at[1])) {
            at = {};
            ++bad_texcoords_;
        }
        mesh_.texcoords.push_back(at);
        return {};
    }

    /// Infinite where float32 does not hold the number.
    static Status read_float(Words& words, float& to, const char* field) {
        double value = 0;
        SPLAT_TRY(words.read(value, field));
        to = static_cast<float>(value);
        return {};
    }

    Status read_face(Words& words) {
        Corner first, previous;
        std::size_t corners = 0;
        for (; !words.done(); ++corners) {
            SPLAT_ASSIGN(const std::string_view text, words.word("corner"));
            Corner corner;
            SPLAT_TRY(read_corner(text, corner));
            if (corners == 0) first = corner;
            if (corners >= 2) add_triangle(first, previous, corner);
            previous = corner;
        }
        if (corners >= 3) return {};
        return lines_.bad("a face of " + std::to_string(corners) + " corners, expected 3 or more");
    }

    struct Corner {
        std::uint32_t vertex = 0, texcoord = scene::kNone, normal = scene::kNone;
    };

    void add_triangle(const Corner& a, const Corner& b, const Corner& c) {
        mesh_.triangles.push_back({a.vertex, b.vertex, c.vertex});
        if (counts_.normals > 0) mesh_.normal_indices.push_back({a.normal, b.normal, c.normal});
        if (counts_.texcoords > 0)
            mesh_.texcoord_indices.push_back({a.texcoord, b.texcoord, c.texcoord});
        if (material_ != 0 && mesh_.material_of.empty()) {
            mesh_.material_of.reserve(static_cast<std::size_t>(counts_.triangles));
            mesh_.material_of.assign(mesh_.triangles.size() - 1, 0);
        }
        if (material_ != 0 || !mesh_.material_of.empty()) mesh_.material_of.push_back(material_);
    }

    /// v, v/t, v//n or v/t/n
    Status read_corner(std::string_view text, Corner& to) {
        const std::string_view whole = text;
        const auto part = [&text] {
            const std::size_t end = std::min(text.find('/'), text.size());
            const std::string_view found = text.substr(0, end);
            text.remove_prefix(std::min(end + 1, text.size()));
            return found;
        };
        const Indexed vertices{"vertex", "vertices", mesh_.vertices.size(), counts_.vertices};
        SPLAT_TRY(index_of(part(), whole, vertices, to.vertex));
        if (options_.surface_only || text.empty()) return {};
        const Indexed texcoords{"texture coordinate", "texture coordinates", mesh_.texcoords.size(),
                                counts_.texcoords};
        if (const std::string_view t = part(); !t.empty())
            SPLAT_TRY(index_of(t, whole, texcoords, to.texcoord));
        const Indexed normals{"normal", "normals", mesh_.normals.size(), counts_.normals};
        if (const std::string_view n = part(); !n.empty())
            SPLAT_TRY(index_of(n, whole, normals, to.normal));
        if (text.empty()) return {};
        return lines_.bad("a corner is '" + shown(whole, 40) + "', expected at most v/t/n");
    }

    /// What an index names: its name, and how many stand before the line and in the whole file.
    struct Indexed {
        const char* one;
        const char* many;
        std::uint64_t before, all;
    };

    /// An index of the file, counted from 0: positive ones may name what follows, negative ones what stands before.
    Status index_of(std::string_view text, std::string_view corner, const Indexed& of,
                    std::uint32_t& to) {
        const std::int64_t given = number_in<std::int64_t>(text).value_or(0);
        if (given == 0)
            return lines_.bad("a corner is '" + shown(corner, 40) + "', expected the number of a " +
                              of.one + ", not 0");
        const auto count = static_cast<std::int64_t>(of.before);
        if (given < 0 && given < -count)
            return lines_.bad(format("a corner is %lld, but %llu %s stand before it", lld(given),
                                     llu(of.before), of.many));
        if (given > 0 && static_cast<std::uint64_t>(given) > of.all)
            return lines_.bad(format("the face names %s %lld, but the file has %llu", of.one,
                                     lld(given), llu(of.all)));
        to = static_cast<std::uint32_t>(given > 0 ? given - 1 : count + given);
        return {};
    }

    Status use_material(Words& words) {
        const auto [place, is_new] = numbers_.try_emplace(words.rest(), names_.size());
        if (is_new) names_.push_back(place->first);
        material_ = static_cast<std::uint32_t>(place->second);
        return {};
    }

    Status name_library(Words& words) {
        const std::string name = words.rest();
        if (name.empty()) return lines_.bad("there is no name of a file");
        if (known_libraries_.insert(name).second) libraries_.push_back(name);
        return {};
    }

    Status finish_looks() {
        std::map<std::string, MtlMaterial> found;
        for (const std::string& library : libraries_) {
            const Status read = read_libraries(library, found);
            if (read.ok()) continue;
            if (!options_.lenient) return read;
            add_ignored(to_.ignored, read.message());
        }
        mesh_.materials.resize(names_.size());
        MeshTextures textures(options_);
        for (std::size_t i = 1; i < names_.size(); ++i) {
            const auto material = found.find(names_[i]);
            if (material != found.end()) {
                SPLAT_TRY(take_material(material->second, textures, mesh_.materials[i]));
                continue;
            }
            const Status missing =
                damaged("OBJ: the material '%s' is in none of the %zu files that the mesh names",
                        shown(names_[i], 80).c_str(), libraries_.size());
            // Many meshes are passed on without their files of materials, and name none.
            if (!options_.lenient && !libraries_.empty()) return missing;
            add_ignored(to_.ignored, missing.message());
        }
        if (mesh_.normal_indices == mesh_.triangles &&
            mesh_.normals.size() == mesh_.vertices.size())
            mesh_.normal_indices = {};
        if (mesh_.textures.empty()) {
            mesh_.texcoords = {};
            mesh_.texcoord_indices = {};
        }
        return {};
    }

    /// The file of a name that may hold blanks, or the files of several names.
    Status read_libraries(std::string_view names, std::map<std::string, MtlMaterial>& found) {
        const auto whole = read_library(std::string(names), found);
        if (whole.code() != Code::kNotFound || names.find_first_of(" \t") == names.npos)
            return whole;
        Words words(names, lines_);
        while (!words.done()) {
            SPLAT_ASSIGN(const std::string_view name, words.word("file"));
            SPLAT_TRY(read_library(std::string(name), found));
        }
        return {};
    }

    Status read_library(const std::string& name, std::map<std::string, MtlMaterial>& found) {
        const auto file = read_beside(options_.folder, name, mtl_bytes_left_);
        if (!file.ok())
            return Status(file.status().code(),
                          "OBJ: mtllib '" + shown(name, 80) + "': " + file.status().message());
        mtl_bytes_left_ -= file.value().size();
        SPLAT_ASSIGN(auto materials, in_file(read_mtl(file.value(), to_.ignored), shown(name, 80)));
        std::string path = name;
        std::ranges::replace(path, '\\', '/');
        const std::string folder = path.substr(0, path.rfind('/') + 1);
        for (MtlMaterial& material : materials) {
            if (!material.image.empty()) material.image = folder + material.image;
            found.insert_or_assign(material.name, std::move(material));
        }
        return {};
    }

    Status take_material(const MtlMaterial& from, MeshTextures& textures, scene::MeshMaterial& to) {
        to = from.material;
        if (from.image.empty()) return {};
        Buffer file;
        const auto open = [&]() -> Result<Bytes> {
            SPLAT_SET(file, read_beside(options_.folder, from.image, kMaxTextureBytes));
            return Bytes(file);
        };
        SPLAT_SET(to.texture, textures.add(from.image, open,
                                           "OBJ: material '" + shown(from.name, 80) +
                                               "', map_Kd '" + shown(from.image, 80) + "'",
                                           to_));
        return {};
    }

    Bytes file_;
    MeshOptions options_;
    Lines lines_;
    LoadedMesh to_;
    scene::TriangleMesh& mesh_;
    ObjCounts counts_;
    bool left_out_[std::size(kLeftOut)] = {};
    std::size_t bad_normals_ = 0, bad_texcoords_ = 0, weights_ = 0;
    bool colored_ = false;
    /// Names of materials; the first one is that of faces before any usemtl.
    std::vector<std::string> names_ = {""};
    std::map<std::string, std::size_t> numbers_;
    std::uint32_t material_ = 0;
    std::vector<std::string> libraries_;
    std::set<std::string> known_libraries_;
    std::uint64_t mtl_bytes_left_ = kMaxMtlBytes;
};

}  // namespace

Result<LoadedMesh> read_obj(Bytes file, const MeshOptions& options) {
    return ObjReader(file, options).read();
}

}  // namespace splat::io
