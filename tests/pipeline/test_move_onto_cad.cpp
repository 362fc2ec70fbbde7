#include "io/cad_samples.hpp"
#include "io/scratch.hpp"
#include "pipeline/mesh_pipeline.hpp"
#include "quality/mesh_validity.hpp"
#include "stages/optimize/contact_guard.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <set>

using namespace hexopt;

namespace {

MeshJob cylinder_job(const test::Scratch& scratch) {
    test::spill(scratch / "a.step", test::step_of_cylinder());
    MeshJob job;
    job.surfaces = {scratch / "a.step"};
    job.output = scratch / "out.vtu";
    job.tessellation = {5e-3, 40};
    job.options.refine.target_cells = 1500;
    return job;
}

std::set<Index> wall_vertices(const HexMesh& mesh) {
    std::set<Index> vertices, hanging(mesh.hanging.vertex.begin(), mesh.hanging.vertex.end());
    for (const BoundaryQuad& quad : mesh.boundary) {
        Point centre(0);
        for (Index v : quad.vertices) centre += 0.25 * mesh.positions[v];
        if (centre.z < 0.01 || centre.z > 2.99) continue; // the ends
        for (Index v : quad.vertices)
            if (!hanging.contains(v)) vertices.insert(v);
    }
    return vertices;
}

double largest_error(const HexMesh& mesh) {
    double largest = 0;
    for (Index v : wall_vertices(mesh))
        largest = std::max(largest, std::abs(std::hypot(mesh.positions[v].x, mesh.positions[v].y) - 1));
    return largest;
}

} // namespace

TEST_CASE("boundary vertices end on the exact cylinder, and only if told so") {
    const test::Scratch scratch;
    MeshJob job = cylinder_job(scratch);
    Context context(2);
    const auto exact = run_mesh_job(job, context);
    if (!exact) FAIL(exact.error().one_line());
    CHECK(exact->outcome.verdict == ErrorCode::ok);
    REQUIRE(exact->outcome.cad);
    const CadReport& report = *exact->outcome.cad;
    CHECK(report.unmatched == 0);
    CHECK(report.held == 0);
    CHECK(report.largest_before > 1e-3);
    CHECK(report.largest_after < 1e-9);
    CHECK(largest_error(exact->outcome.mesh) < 1e-9);
    CHECK(to_json(job, *exact)["cad"]["vertices"] == report.vertices);

    job.options.cad_projection = false;
    Context other(2);
    const auto rough = run_mesh_job(job, other);
    REQUIRE(rough);
    CHECK(!rough->outcome.cad);
    CHECK(largest_error(rough->outcome.mesh) > 1e-3);
    CHECK(rough->outcome.mesh.cells == exact->outcome.mesh.cells);
}

TEST_CASE("vertices are held where cells would fall below what they may") {
    const test::Scratch scratch;
    MeshJob job = cylinder_job(scratch);
    job.options.cad_projection = false;
    job.options.farfield = Box{Point(-4), Point(4)};
    job.options.refine.target_cells = 4000;
    Context context(2);
    StageClock clock;
    auto prepared = load_domain(job, clock, context);
    REQUIRE(prepared);
    CHECK(prepared->cad.empty());
    job.options.cad_projection = true;
    prepared = load_domain(job, clock, context);
    REQUIRE(prepared);
    REQUIRE(prepared->cad.size() == 1);

    for (double min_sj : {1.0, 0.3}) {
        MeshOptions options = job.options;
        options.optimize.min_sj = min_sj;
        options.optimize.max_iterations = 30;
        auto fresh = load_domain(job, clock, context);
        REQUIRE(fresh);
        std::vector<CadSource> cad = std::move(fresh->cad);
        fresh->cad.clear();
        const auto before = mesh_domain(std::move(*fresh), options, clock, context);
        REQUIRE(before);
        fresh = load_domain(job, clock, context);
        REQUIRE(fresh);
        const auto after = mesh_domain(std::move(*fresh), options, clock, context);
        REQUIRE(after);
        REQUIRE(after->cad);
        REQUIRE(after->mesh.cells == before->mesh.cells);
        CHECK(after->cad->unmatched > 0); // the box
        if (min_sj == 1) CHECK(after->cad->held > 0);
        const auto old_cells = compute_cell_validities(before->mesh, context.parallel());
        const auto new_cells = compute_cell_validities(after->mesh, context.parallel());
        for (std::size_t c = 0; c < old_cells.size(); ++c) {
            CHECK((!old_cells[c].is_usable() || new_cells[c].is_usable()));
            CHECK(new_cells[c].scaled_jacobian >= std::min(old_cells[c].scaled_jacobian, min_sj) - 1e-12);
        }
        CHECK(after->cad->mean_after < after->cad->mean_before);
    }
}

TEST_CASE("vertices are held where quads on both sides of a slit would come to touch") {
    // A block of cells above the box's top and one below, joined along one side: both sides of the slit
    // between them are as near to the exact face as triangles of it may be.
    const test::Scratch scratch;
    test::spill(scratch / "a.step", test::step_of_box());
    MeshJob job;
    job.surfaces = {scratch / "a.step"};
    Context context(1);
    StageClock clock;
    auto prepared = load_domain(job, clock, context);
    REQUIRE(prepared);
    REQUIRE(prepared->cad.size() == 1);
    const double top = 4, half = 2e-4;
    const Index n = 6;
    const auto id = [&](Index i, Index j, Index k) { return i + (n + 1) * (j + (n + 1) * k); };
    HexMesh mesh;
    for (double z : {top - 0.5, top - half, top + half, top + 0.5})
        for (Index j = 0; j <= n; ++j)
            for (Index i = 0; i <= n; ++i) mesh.positions.emplace_back(0.4 + 0.2 * i, 0.5 + 0.3 * j, z);
    for (Index k = 0; k < 3; ++k)
        for (Index j = 0; j < n; ++j)
            for (Index i = 0; i < (k == 1 ? 1 : n); ++i)
                mesh.cells.push_back({id(i, j, k), id(i + 1, j, k), id(i + 1, j + 1, k), id(i, j + 1, k),
                                      id(i, j, k + 1), id(i + 1, j, k + 1), id(i + 1, j + 1, k + 1),
                                      id(i, j + 1, k + 1)});
    const Topology topology = compute_topology(mesh);
    const std::vector<Point> before = mesh.positions;
    REQUIRE(find_boundary_contacts(mesh, topology, Parallel(1)).empty());
    const auto model = build_boundary_model(mesh, topology, {}, context);
    REQUIRE(model);
    const auto report = move_onto_cad(mesh, topology, *model, prepared->cad, 0.2, context);
    REQUIRE(report);
    CHECK(report->vertices > report->unmatched);
    CHECK(report->held > 0);
    CHECK(report->largest_after == Approx(half));
    CHECK(find_boundary_contacts(mesh, topology, Parallel(1)).empty());
    CHECK(mesh.positions[id(4, 3, 1)] == before[id(4, 3, 1)]);
    CHECK(mesh.positions[id(4, 3, 2)] == before[id(4, 3, 2)]);
}

TEST_CASE("a CAD file that changed while it was meshed costs the projection, not the mesh") {
    const test::Scratch scratch;
    const MeshJob job = cylinder_job(scratch);
    Context context(2);
    StageClock clock;
    auto prepared = load_domain(job, clock, context);
    REQUIRE(prepared);
    test::spill(scratch / "a.step", test::step_of_box());
    const auto outcome = mesh_domain(std::move(*prepared), job.options, clock, context);
    REQUIRE(outcome);
    CHECK(outcome->verdict == ErrorCode::ok);
    CHECK(!outcome->cad);
    REQUIRE(!outcome->notes.empty());
    CHECK(std::any_of(outcome->notes.begin(), outcome->notes.end(),
                      [](const std::string& note) { return note.find("has changed") != std::string::npos; }));
}
