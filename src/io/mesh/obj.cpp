#include "io/mesh/mesh.h"

#include <algorithm>
#include <limits>

#include "io/reader.h"

namespace splat::io {
namespace {

/// What a surface of triangles leaves out.
constexpr std::string_view kLeftOut[] = {"vt",       "vn",       "vp",         "o",        "g",
                                         "s",        "l",        "p",          "usemtl",   "mtllib",
                                         "usemap",   "maplib",   "mg",         "lod",      "bevel",
                                         "c_interp", "d_interp", "shadow_obj", "trace_obj"};

constexpr std::string_view kFreeForm[] = {"curv", "curv2", "surf",  "cstype", "deg",  "bmat",
                                          "step", "parm",  "trim",  "hole",   "scrv", "sp",
                                          "end",  "con",   "ctech", "stech",  "call", "csh"};

template <class Words>
bool holds(const Words& words, std::string_view word) {
    return std::ranges::find(words, word) != std::end(words);
}

class ObjReader {
  public:
    explicit ObjReader(Bytes file) : lines_(file, "OBJ") {}

    Result<Mesh> read() {
        std::string_view line;
        while (lines_.next_record(line)) SPLAT_TRY(read_line(line));
        if (farthest_ > mesh_.vertices.size())
            return damaged("OBJ line %zu: the face names vertex %llu, but the file has %zu",
                           farthest_line_, llu(farthest_), mesh_.vertices.size());
        return std::move(mesh_);
    }

  private:
    Status read_line(std::string_view line) {
        const std::size_t last = line.find_last_not_of(" \t\r");
        if (line[last] == '\\')
            return unsupported("OBJ line %zu: the line goes on in the next one; join such lines",
                               lines_.number());
        Words words(line, lines_);
        SPLAT_ASSIGN(const std::string_view keyword, words.word("keyword"));
        if (keyword == "v") return read_vertex(words);
        if (keyword == "f" || keyword == "fo") return read_face(words);
        if (holds(kLeftOut, keyword)) return {};
        const std::string name(keyword.substr(0, 40));
        if (holds(kFreeForm, keyword))
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
        // Indices of triangles have 32 bits.
        if (mesh_.vertices.size() == std::numeric_limits<std::uint32_t>::max())
            return unsupported("OBJ line %zu: more than 2^32 - 1 vertices", lines_.number());
        mesh_.vertices.push_back(vertex);
        return {};
    }

    Status read_face(Words& words) {
        std::uint32_t first = 0;
        std::uint32_t previous = 0;
        std::size_t corners = 0;
        for (; !words.done(); ++corners) {
            SPLAT_ASSIGN(const std::string_view corner, words.word("corner"));
            SPLAT_ASSIGN(const std::uint32_t index, index_of(corner));
            if (corners == 0) first = index;
            if (corners >= 2) mesh_.triangles.push_back({first, previous, index});
            previous = index;
        }
        if (corners >= 3) return {};
        return lines_.bad("a face of " + std::to_string(corners) + " corners, expected 3 or more");
    }

    /// The vertex of a corner v, v/t, v//n or v/t/n, counted from 0.
    Result<std::uint32_t> index_of(std::string_view corner) {
        const std::string_view text = corner.substr(0, corner.find('/'));
        const std::int64_t given = number_in<std::int64_t>(text).value_or(0);
        if (given == 0)
            return lines_.bad("a corner is '" + std::string(corner.substr(0, 40)) +
                              "', expected the number of a vertex, not 0");
        const auto count = static_cast<std::int64_t>(mesh_.vertices.size());
        if (given < 0 && given < -count)
            return lines_.bad("a corner is " + std::to_string(given) + ", but " +
                              std::to_string(count) + " vertices stand before it");
        if (given > std::numeric_limits<std::uint32_t>::max())
            return lines_.bad("a corner is " + std::to_string(given) + ", expected less than 2^32");
        // A positive index may name a vertex that follows; the end of the file tells.
        if (given > static_cast<std::int64_t>(farthest_)) {
            farthest_ = static_cast<std::uint64_t>(given);
            farthest_line_ = lines_.number();
        }
        return static_cast<std::uint32_t>(given > 0 ? given - 1 : count + given);
    }

    Lines lines_;
    Mesh mesh_;
    std::uint64_t farthest_ = 0;  ///< the largest index, counted from 1
    std::size_t farthest_line_ = 0;
};

}  // namespace

Result<Mesh> read_obj(Bytes file) {
    return ObjReader(file).read();
}

}  // namespace splat::io
