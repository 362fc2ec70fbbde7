#include "domain/deviation.hpp"
#include "io/mesh_io.hpp"
#include "support/skip.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <random>

using namespace hexopt;
namespace fs = std::filesystem;

namespace {

std::vector<fs::path> real_meshes() {
    std::vector<fs::path> paths;
    const fs::path folder = fs::path(HEXOPT_SHARED_DATA) / "hexmeshes";
    if (!fs::exists(folder)) return paths;
    for (const auto& entry : fs::directory_iterator(folder))
        if (entry.path().extension() == ".vtk" || entry.path().extension() == ".mesh")
            paths.push_back(entry.path());
    std::sort(paths.begin(), paths.end());
    return paths;
}

HexMesh read(const fs::path& path) {
    Context context(1);
    Result<HexMesh> mesh = read_mesh(path, context);
    if (!mesh) FAIL(mesh.error().one_line());
    return std::move(*mesh);
}

BoundaryModel build(const HexMesh& mesh, const Topology& topology) {
    Context context(1);
    Result<BoundaryModel> model = build_boundary_model(mesh, topology, {}, context);
    if (!model) FAIL(model.error().one_line());
    return std::move(*model);
}

/// What must not depend on where the mesh lies, how large it is and how it is numbered.
std::array<std::size_t, 6> signature(const BoundaryModel& model) {
    std::array<std::size_t, 6> count = {
        model.patch_count(), model.curve_count(), model.corner_count(), 0, 0, 0};
    for (const Association& a : model.associations()) {
        if (a.kind == EntityKind::patch) ++count[3];
        if (a.kind == EntityKind::curve) ++count[4];
        if (a.kind == EntityKind::corner) ++count[5];
    }
    return count;
}

HexMesh renumbered(const HexMesh& mesh, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<Index> old2new(mesh.vertex_count());
    for (Index v = 0; v < old2new.size(); ++v) old2new[v] = v;
    std::shuffle(old2new.begin(), old2new.end(), random);
    HexMesh result = mesh;
    for (Index v = 0; v < old2new.size(); ++v) result.positions[old2new[v]] = mesh.positions[v];
    for (Cell& cell : result.cells)
        for (Index& v : cell) v = old2new[v];
    std::shuffle(result.cells.begin(), result.cells.end(), random);
    return result;
}

HexMesh moved(const HexMesh& mesh, double scale) {
    HexMesh result = mesh;
    const double c = std::cos(0.7), s = std::sin(0.7);
    for (Point& x : result.positions) {
        const Point turned(c * x.x - s * x.y, s * x.x + c * x.y, x.z);
        x = scale *
            (Point(turned.x, c * turned.y - s * turned.z, s * turned.y + c * turned.z) + Point(3, -2, 1));
    }
    return result;
}

} // namespace

TEST_CASE("every boundary vertex of the real meshes lies on what it is bound to, and nothing deviates") {
    if (real_meshes().empty()) HEXOPT_SKIP("the real meshes are absent");
    for (const fs::path& path : real_meshes()) {
        INFO(path.filename());
        const HexMesh mesh = read(path);
        const Topology topology = compute_topology(mesh);
        const BoundaryModel model = build(mesh, topology);
        double farthest = 0;
        for (Index v = 0; v < mesh.vertex_count(); ++v) {
            const Association a = model.associations()[v];
            CHECK((a.kind != EntityKind::interior) == (topology.on_boundary[v] != 0));
            farthest = std::max(farthest, model.project(a, mesh.positions[v]).distance);
        }
        CHECK(farthest <= 1e-12 * model.diagonal());
        Context context(1);
        const Result<Deviation> d = measure_deviation(mesh, topology, model, {}, context);
        REQUIRE(d);
        // Where the boundary is folded onto itself, a triangle's own place is not the only one at distance 0.
        CHECK(d->largest() <= 1e-13 * model.diagonal());
        CHECK(std::max(d->mesh_to_surface.upper, d->surface_to_mesh.upper) <= 1e-6 * model.diagonal());
        CHECK(d->feature_largest() == 0);
    }
}

TEST_CASE("features stay the same under rigid motion, scaling and renumbering") {
    if (real_meshes().empty()) HEXOPT_SKIP("the real meshes are absent");
    for (const fs::path& path : real_meshes()) {
        INFO(path.filename());
        const HexMesh mesh = read(path);
        if (mesh.cell_count() > 12000) continue;
        const auto original = signature(build(mesh, compute_topology(mesh)));
        for (const HexMesh& other : {renumbered(mesh, 1), moved(mesh, 1e6), moved(mesh, 1e-6)})
            CHECK(signature(build(other, compute_topology(other))) == original);
    }
}
