// Edges of the real geometries against the counts that come with them, made by another program.
#include "domain/feature_graph.hpp"
#include "domain/surface_polygons.hpp"
#include "io/read_surface.hpp"
#include "support/skip.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <fstream>
#include <map>
#include <sstream>

using namespace hexopt;
namespace fs = std::filesystem;

namespace {

/// Rows of the manifest as column -> value; only its last column holds commas.
std::vector<std::map<std::string, std::string>> read_manifest(const fs::path& path) {
    std::ifstream file(path);
    std::vector<std::map<std::string, std::string>> rows;
    std::vector<std::string> columns;
    for (std::string line; std::getline(file, line);) {
        std::istringstream stream(line);
        std::vector<std::string> values;
        for (std::string value; std::getline(stream, value, ',');) values.push_back(value);
        if (columns.empty()) {
            columns = values;
            continue;
        }
        std::map<std::string, std::string> row;
        for (std::size_t i = 0; i < columns.size() && i < values.size(); ++i) row[columns[i]] = values[i];
        rows.push_back(row);
    }
    return rows;
}

} // namespace

TEST_CASE("open, non-manifold and sharp edges of the real geometries are as many as stated") {
    const fs::path folder = fs::path(HEXOPT_SHARED_DATA) / "geometry";
    if (!fs::exists(folder / "manifest.csv")) HEXOPT_SKIP("the real geometries are absent");
    std::size_t compared = 0;
    for (auto& row : read_manifest(folder / "manifest.csv")) {
        if (!row["file"].ends_with(".stl")) continue;
        INFO(row["file"]);
        Context context(1);
        const Result<TriangleSoup> soup = read_surface(folder / row["file"], context);
        if (!soup) FAIL(soup.error().one_line());
        const Result<CleanSurface> clean = clean_surface(*soup);
        if (!clean) FAIL(clean.error().one_line());
        const FeatureGraph graph = compute_feature_graph(clean->vertices, clean->polygons, {30, 60, false});
        CHECK(*std::max_element(graph.face_patch.begin(), graph.face_patch.end()) + 1 == graph.patch_count);
        std::size_t feature_edges = 0;
        for (std::size_t c = 0; c < graph.curve_vertex.rows(); ++c)
            feature_edges += graph.curve_vertex[c].size() - 1;
        if (row["degenerate_tris"] != "0" || row["duplicate_tris"] != "0")
            continue; // counted otherwise there
        CHECK(clean->open_edges == std::stoul(row["boundary_edges"]));
        CHECK(clean->nonmanifold_edges == std::stoul(row["nonmanifold_edges"]));
        CHECK(feature_edges ==
              std::stoul(row["sharp_edges_30"]) + clean->open_edges + clean->nonmanifold_edges);
        ++compared;
    }
    CHECK(compared > 50);
}
