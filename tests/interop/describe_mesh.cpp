// describe_mesh FILE...: what load_mesh() reads of each, in a line of JSON, for comparison with other programs.

#include <cstdio>

#include "core/json_writer.h"
#include "io/mesh/mesh.h"

using namespace splat;

namespace {

std::string described(const io::LoadedMesh& loaded) {
    const scene::TriangleMesh& mesh = loaded.mesh;
    const scene::MeshMeasures measures = scene::measure(mesh);
    JsonWriter json(JsonWriter::Style::kCompact);
    json.begin_object().member("triangles", mesh.triangles.size());
    json.member("vertices", mesh.vertices.size()).member("unused", measures.unused);
    json.member("area", measures.area).member("zero_area", measures.zero_area);
    for (const auto& [name, corner] : {std::pair("low", &measures.low), {"high", &measures.high}})
        json.key(name).list(std::vector<double>{corner->x, corner->y, corner->z});
    json.member("normals", mesh.normals.size()).member("texcoords", mesh.texcoords.size());
    json.member("colors", mesh.colors.size()).key("materials").begin_array();
    for (const scene::MeshMaterial& material : mesh.materials) {
        json.begin_object().key("color");
        json.list(std::vector<float>(material.color.begin(), material.color.end()));
        json.member("texture", material.texture == scene::kNone ? -1 : int(material.texture));
        json.member("double_sided", material.double_sided).end();
    }
    json.end().key("textures").begin_array();
    for (const scene::Texture& texture : mesh.textures) {
        double sums[4] = {};
        for (const auto& texel : texture.texels)
            for (std::size_t k = 0; k < 4; ++k) sums[k] += texel[k];
        json.begin_object().member("width", texture.width).member("height", texture.height);
        json.key("sums").list(std::vector<double>(sums, sums + 4)).end();
    }
    json.end().key("ignored").begin_array();
    for (const std::string& line : loaded.ignored) json.value(line);
    return json.end().end().text();
}

}  // namespace

int main(int argc, char** argv) {
    for (int i = 1; i < argc; ++i) {
        const auto loaded = io::load_mesh(argv[i]);
        if (!loaded.ok()) {
            JsonWriter json(JsonWriter::Style::kCompact);
            json.begin_object().member("error", loaded.status().message());
            std::printf("%s\n", json.end().text().c_str());
            continue;
        }
        const Status good = scene::check_mesh(loaded.value().mesh);
        if (!good.ok()) {
            std::fprintf(stderr, "%s: %s\n", argv[i], good.message().c_str());
            return 1;
        }
        std::printf("%s\n", described(loaded.value()).c_str());
    }
    return 0;
}
