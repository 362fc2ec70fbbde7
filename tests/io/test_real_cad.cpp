// The CAD models that the real geometries were cut into triangles from, by another program.
#include "domain/orient_surface.hpp"
#include "domain/weld_surface.hpp"
#include "io/read_surface.hpp"
#include "support/skip.hpp"

#include <catch2/catch.hpp>
#include <chrono>
#include <fmt/format.h>
#include <fstream>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <iostream>
#include <sstream>

using namespace hexopt;
namespace fs = std::filesystem;

namespace {

struct Model {
    std::string cad_file, stl_file;
    bool closed = false;
};

/// Rows of the manifest with a CAD file; only its last column holds commas.
std::vector<Model> read_models(const fs::path& path) {
    std::ifstream file(path);
    std::vector<Model> models;
    for (std::string line; std::getline(file, line);) {
        std::istringstream stream(line);
        std::vector<std::string> values;
        for (std::string value; std::getline(stream, value, ',');) values.push_back(value);
        if (values.size() > 11 && values[2].starts_with("step/"))
            models.push_back({values[2], values[1], values[11] == "True"});
    }
    return models;
}

double volume_of(const TriangleSoup& soup) {
    double six = 0;
    for (const auto& t : soup.triangles)
        six += glm::dot(soup.vertices[t[0]], glm::cross(soup.vertices[t[1]], soup.vertices[t[2]]));
    return six / 6;
}

double diagonal_of(const TriangleSoup& soup) {
    Point low = soup.vertices.at(0), high = low;
    for (const Point& p : soup.vertices) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    return glm::length(high - low);
}

/// Welded within 1e-5 of the diagonal and turned outwards.
TriangleSoup prepare(const TriangleSoup& soup, std::size_t& open_edges) {
    Context context(2);
    const auto welded = weld_surface(soup, 1e-5 * diagonal_of(soup), context);
    if (!welded) FAIL(welded.error().one_line());
    open_edges = welded->report.open_edges_after;
    const auto oriented = orient_surface(welded->soup, context);
    if (!oriented) FAIL(oriented.error().one_line());
    return oriented->soup;
}

} // namespace

TEST_CASE("the real CAD models are closed and have their STL's volume", "[slow]") {
    const fs::path folder = fs::path(HEXOPT_SHARED_DATA) / "geometry";
    if (!fs::exists(folder / "manifest.csv")) HEXOPT_SKIP("the real geometries are absent");
    const std::vector<Model> models = read_models(folder / "manifest.csv");
    CHECK(models.size() == 27);
    for (const Model& model : models) {
        Context context(1);
        INFO(model.cad_file);
        const auto start = std::chrono::steady_clock::now();
        const auto cad = read_cad(folder / model.cad_file, {}, context);
        const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
        const auto stl = read_surface(folder / model.stl_file, context);
        if (!cad) FAIL_CHECK(cad.error().one_line());
        if (!cad) continue;
        if (!stl) FAIL(stl.error().one_line());
        std::size_t cad_open = 0, stl_open = 0;
        const TriangleSoup ours = prepare(cad->soup, cad_open), theirs = prepare(*stl, stl_open);
        std::cout << fmt::format("{}: {} faces, {} failed, {} patches, {} triangles, {:.2f} s, {} open ({} "
                                 "in the STL, closed {}), volume {:.6g} of {:.6g}\n",
                                 model.cad_file, cad->face_count, cad->failed_faces,
                                 cad->soup.patch_names.size(), cad->soup.triangles.size(), taken.count(),
                                 cad_open, stl_open, model.closed, volume_of(ours), volume_of(theirs));
        CHECK(cad->failed_faces == 0);
        if (!model.closed) continue;
        CHECK(cad_open == 0);
        CHECK(volume_of(ours) == Catch::Detail::Approx(volume_of(theirs)).epsilon(0.01));
    }
}
