#include "domain/boundary_model_builder.hpp"
#include "io/read_surface.hpp"
#include "io/scratch.hpp"
#include "io/write_surface.hpp"
#include "mesh/topology.hpp"
#include "pipeline/mesh_keys.hpp"
#include "pipeline/mesh_pipeline.hpp"
#include "samples/geometry/geometries.hpp"
#include "samples/geometry/solid.hpp"
#include "samples/samples.hpp"
#include "support/skip.hpp"

#include "samples/grid.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

using namespace hexopt;
namespace fs = std::filesystem;

namespace {

TriangleSoup cube(double low, double high) {
    return geometry::make_box(Point(low), Point(high), {"west", "east", "south", "north", "down", "up"});
}

MeshOptions coarse(double cells) {
    MeshOptions options;
    options.refine.target_cells = cells;
    return options;
}

Result<MeshOutcome> mesh(const TriangleSoup& soup, const MeshOptions& options, int threads = 2) {
    StageClock clock;
    Context context(threads);
    return mesh_surface(soup, options, clock, context);
}

/// Every boundary face has a patch.
void check_patches(const HexMesh& mesh) {
    CHECK(compute_topology(mesh).boundary_faces.size() == mesh.boundary.size());
    for (const BoundaryQuad& quad : mesh.boundary) REQUIRE(quad.patch < mesh.patch_names.size());
}

/// [0, n]^3 in unit cells, x fastest.
HexMesh unit_grid(Index n) { return *make_grid({.cells = {n, n, n}, .high = Point(n)}, Parallel(1)); }

} // namespace

TEST_CASE("a cube is meshed exactly, with its names") {
    const auto outcome = mesh(cube(0, 2), coarse(800));
    INFO((outcome ? "" : outcome.error().one_line()));
    REQUIRE(outcome);
    CHECK(outcome->verdict == ErrorCode::ok);
    CHECK(outcome->after.validity.is_valid());
    CHECK(outcome->after.total_volume == Approx(8).epsilon(1e-9));
    CHECK(outcome->fit.captured_corners == 8);
    CHECK(outcome->fit.captured_curves == 12);
    CHECK(outcome->deviation.largest_rel() < 1e-9);
    CHECK(outcome->settle.deviation_rel == 0);
    CHECK(outcome->settle.backed_off_count == 0);
    CHECK(outcome->mesh.patch_names ==
          std::vector<std::string>{"west", "east", "south", "north", "down", "up"});
    check_patches(outcome->mesh);
    for (const BoundaryQuad& quad : outcome->mesh.boundary)
        for (Index v : quad.vertices) {
            const Point& p = outcome->mesh.positions[v];
            const double on[] = {p.x, 2 - p.x, p.y, 2 - p.y, p.z, 2 - p.z};
            CHECK(std::abs(on[quad.patch]) < 1e-9);
        }
}

TEST_CASE("a part of the surface that no quad lies on is told, with its place") {
    const auto told = [](const MeshOutcome& outcome) {
        return std::find_if(outcome.notes.begin(), outcome.notes.end(), [](const std::string& note) {
            return note.find("away from the mesh") != std::string::npos;
        });
    };
    const auto whole = mesh(cube(0, 2), coarse(800));
    REQUIRE(whole);
    CHECK(told(*whole) == whole->notes.end());
    TriangleSoup soup = cube(0, 2);
    const TriangleSoup foil =
        geometry::make_box({2.5, 0.5, 0.5}, {2.5005, 1, 1}, {"west", "east", "south", "north", "down", "up"});
    const auto first = static_cast<Index>(soup.vertices.size());
    soup.vertices.insert(soup.vertices.end(), foil.vertices.begin(), foil.vertices.end());
    for (std::array<Index, 3> triangle : foil.triangles) {
        for (Index& v : triangle) v += first;
        soup.triangles.push_back(triangle);
    }
    soup.patch.insert(soup.patch.end(), foil.patch.begin(), foil.patch.end());
    const auto outcome = mesh(soup, coarse(800));
    INFO((outcome ? "" : outcome.error().one_line()));
    REQUIRE(outcome);
    REQUIRE(outcome->deviation.surface_to_mesh.largest == Approx(0.5).margin(0.01));
    REQUIRE(told(*outcome) != outcome->notes.end());
    CHECK(told(*outcome)->find("near (2.5") != std::string::npos);
}

TEST_CASE("a cylinder is meshed validly, the same for any number of threads") {
    Context context(1);
    const auto soup = make_geometry("cylinder", {24, ""}, context);
    REQUIRE(soup);
    const auto one = mesh(*soup, coarse(1500), 1), two = mesh(*soup, coarse(1500), 2);
    REQUIRE(one);
    REQUIRE(two);
    CHECK(one->verdict == ErrorCode::ok);
    CHECK(one->fit.captured_curves == one->curves);
    CHECK(one->mesh.positions == two->mesh.positions);
    CHECK(one->mesh.cells == two->mesh.cells);
    CHECK(one->after.total_volume == Approx(4 * 12 * std::sin(2 * std::numbers::pi / 24)).epsilon(1e-2));
    check_patches(one->mesh);
}

TEST_CASE("settle: cells that cannot be valid on the surface get vertices off it, within what is allowed") {
    // A cube of 4 x 4 x 4 cells, two neighbours on one edge bound to corners in the wrong order: no place on
    // what they are bound to leaves the cells there valid.
    StageClock clock;
    Context context(2);
    auto domain = build_domain(cube(0, 4), {}, context);
    REQUIRE(domain);
    const HexMesh grid = unit_grid(4);
    const auto at = [](int i, int j, int k) { return static_cast<Index>((k * 5 + j) * 5 + i); };
    auto fitted = fit_boundary(grid, *domain, {}, context);
    REQUIRE(fitted);
    REQUIRE(fitted->report.captured_corners == 8);
    std::vector<Association> bound = fitted->fitted.association;
    std::swap(bound[at(0, 0, 0)], bound[at(1, 0, 0)]);
    for (double allowed : {0.0, 0.1}) {
        HexMesh swapped = fitted->fitted.mesh;
        for (Index v : {at(0, 0, 0), at(1, 0, 0)})
            swapped.positions[v] = domain->model.project(bound[v], swapped.positions[v]).point;
        BoundaryModelBuilder::bind(domain->model, bound, {}, {}, 1e-4);
        OptimizeOptions options;
        options.effort = Effort::quick;
        options.fresh_boundary = true;
        options.max_deviation_rel = allowed;
        const Topology topology = compute_topology(swapped);
        OptimizeOptions on_surface = options;
        on_surface.max_deviation_rel = 0;
        auto stats = optimize(swapped, topology, &domain->model, on_surface, context);
        REQUIRE(stats);
        SettleReport report;
        REQUIRE(settle_mesh(swapped, topology, domain->model, {}, options, *stats, report, context));
        CHECK(stats->bad32_after <= stats->bad32_before);
        CHECK(report.deviation_rel <= allowed);
        double farthest = 0;
        for (Index v = 0; v < swapped.vertex_count(); ++v)
            farthest = std::max(farthest, domain->model.project(bound[v], swapped.positions[v]).distance);
        CHECK(farthest <= allowed * domain->model.diagonal() + 1e-9);
        CHECK((report.backed_off_count > 0) == (farthest > 1e-9 * domain->model.diagonal()));
        if (allowed == 0) CHECK(report.backed_off_count == 0);
    }
}

TEST_CASE("sliding on a fresh boundary does not shrink the cells round what cannot be valid") {
    // A cube of 8 x 8 x 8 cells, two vertices of its top bound to its front: the cells there stay flat.
    Context context(2);
    auto domain = build_domain(cube(0, 8), {}, context);
    REQUIRE(domain);
    HexMesh grid = unit_grid(8);
    auto fitted = fit_boundary(grid, *domain, {}, context);
    REQUIRE(fitted);
    const auto at = [](int i, int j, int k) { return static_cast<Index>((k * 9 + j) * 9 + i); };
    std::vector<Association> bound = fitted->fitted.association;
    HexMesh& mesh = fitted->fitted.mesh;
    for (int i : {3, 4, 5}) {
        bound[at(i, 1, 8)] = bound[at(i, 0, 4)];
        mesh.positions[at(i, 1, 8)] = Point(i, 0, 8);
    }
    BoundaryModelBuilder::bind(domain->model, bound, {}, {}, 1e-4);
    OptimizeOptions options;
    options.effort = Effort::quick;
    options.fresh_boundary = true;
    options.max_min = false;
    const Topology topology = compute_topology(mesh);
    const auto stats = optimize(mesh, topology, &domain->model, options, context);
    REQUIRE(stats);
    CHECK(stats->bad32_after > 0);
    double least = 1;
    for (const Cell& cell : mesh.cells)
        least = std::min(least, glm::distance(mesh.positions[cell[0]], mesh.positions[cell[6]]));
    CHECK(least > 0.16); // 0.13 where cells have no size, 0.20 where they do
}

TEST_CASE("settle: real models that sliding leaves bad end valid and apart from themselves", "[slow]") {
    const fs::path folder = fs::path(HEXOPT_SHARED_DATA) / "geometry";
    for (const char* name : {"airplane1.stl", "elbow_90.stl"}) {
        if (!fs::exists(folder / name)) HEXOPT_SKIP("no shared geometry " + std::string(name));
        CAPTURE(name);
        Context context(2);
        const auto soup = read_surface(folder / name, context);
        REQUIRE(soup);
        MeshOptions options = coarse(8000);
        options.repairs = 0; // the next attempts would leave nothing to settle
        const auto outcome = mesh(*soup, options);
        REQUIRE(outcome);
        CHECK(outcome->settle.retreat.bad_before > 0);
        CHECK(outcome->verdict == ErrorCode::ok);
        CHECK(outcome->after.validity.is_valid());
        CHECK(outcome->contacts.empty());
        CHECK(outcome->settle.deviation_rel < 0.02);
        CHECK((outcome->settle.backed_off_count > 0) == (outcome->settle.deviation_rel > 0));
    }
}

TEST_CASE("external flow: the box becomes the outer boundary") {
    MeshOptions options = coarse(3000);
    options.farfield = Box{Point(-3), Point(4)};
    const auto outcome = mesh(cube(0, 1), options);
    INFO((outcome ? "" : outcome.error().one_line()));
    REQUIRE(outcome);
    CHECK(outcome->verdict == ErrorCode::ok);
    CHECK(outcome->after.total_volume == Approx(342).epsilon(1e-6));
    CHECK(outcome->mesh.patch_names.size() == 12);
    options.farfield = Box{Point(0.5), Point(4)};
    CHECK(mesh(cube(0, 1), options).error().code == ErrorCode::usage);
}

TEST_CASE("without buffers and repairs the flow is shorter") {
    MeshOptions options = coarse(800);
    options.buffers = false;
    options.fit_repairs = options.repairs = 0;
    const auto outcome = mesh(cube(0, 1), options);
    REQUIRE(outcome);
    CHECK_FALSE(outcome->buffer);
    CHECK(outcome->fit_rounds == 1);
    options.fit_repairs = 6;
    CHECK(mesh(cube(0, 1), options).error().code == ErrorCode::usage);
}

TEST_CASE("several files: each is a patch named after it") {
    const test::Scratch scratch;
    Context context(1);
    const TriangleSoup soup = cube(0, 1);
    std::vector<fs::path> files;
    for (Index p = 0; p < 6; ++p) {
        TriangleSoup part{soup.vertices, {}, {}, {}};
        for (std::size_t t = 0; t < soup.triangles.size(); ++t)
            if (soup.patch[t] == p) part.triangles.push_back(soup.triangles[t]);
        files.push_back(scratch / (soup.patch_names[p] + ".stl"));
        REQUIRE(write_surface(files.back(), part, {}, context));
    }
    const auto all = read_surfaces(files, {}, context);
    REQUIRE(all);
    CHECK(all->patch_names == soup.patch_names);
    CHECK(all->patch == soup.patch);
    REQUIRE(write_surface(scratch / "both.stl", soup, {}, context));
    const std::vector<fs::path> two = {files[0], scratch / "both.stl"};
    const auto mixed = read_surfaces(two, {}, context);
    REQUIRE(mixed);
    CHECK(mixed->patch_names.size() == 7);
    CHECK(mixed->patch_names.back() == "both.up");
    for (Index p = 0; p < 7; ++p) CHECK(mixed->group_of(p) == p);
    CHECK(read_surfaces({files[0], scratch / "none.stl"}, {}, context).error().code == ErrorCode::bad_input);

    MeshJob job;
    job.surfaces = files;
    job.output = scratch / "out.vtu";
    job.report = scratch / "out.json";
    job.html = scratch / "out.html";
    job.picture = scratch / "out.png";
    job.options = coarse(800);
    const auto result = run_mesh_job(job, context);
    INFO((result ? "" : result.error().one_line()));
    REQUIRE(result);
    CHECK(result->written.size() == 4);
    const auto report = nlohmann::json::parse(test::slurp(job.report));
    CHECK(report["verdict"] == "ok");
    CHECK(report["fit"]["captured_corners"] == 8);
    CHECK(report["quality_after"]["validity"]["is_valid"] == true);
    std::set<std::string> stages;
    for (const auto& stage : report["stages"]) stages.insert(stage["stage"]);
    for (const char* stage :
         {"read", "orient", "domain", "refine", "trim", "fit", "buffer", "optimize", "write"})
        CHECK(stages.count(stage) == 1);
    CHECK(test::slurp(job.html).find("<html") != std::string::npos);
}

TEST_CASE("regions may be bounded by surfaces of files") {
    const test::Scratch scratch;
    Context context(2);
    REQUIRE(write_surface(scratch / "in.stl", cube(0, 2), {}, context));
    REQUIRE(write_surface(scratch / "box.stl", cube(1.2, 2.5), {}, context));
    MeshJob job;
    job.surfaces = {scratch / "in.stl"};
    job.output = scratch / "out.vtu";
    job.options.refine.surface.size = 0.3;
    const auto region = [&](const std::string& text) {
        job.options.refine.regions.clear();
        return set_mesh_key(job, "refine.regions", std::vector<std::string>{text}, "--region");
    };
    const auto coarse_mesh = run_mesh_job(job, context);
    REQUIRE(coarse_mesh);
    REQUIRE(region("inside " + (scratch / "box.stl").string() + " size=0.1"));
    const auto result = run_mesh_job(job, context);
    INFO((result ? "" : result.error().one_line()));
    REQUIRE(result);
    CHECK(result->outcome.verdict == ErrorCode::ok);
    std::size_t in_box = 0, elsewhere = 0;
    const HexMesh& mesh = result->outcome.mesh;
    for (const Cell& cell : mesh.cells) {
        Point centre(0);
        for (Index v : cell) centre += mesh.positions[v] / 8.0;
        ++(std::min({centre.x, centre.y, centre.z}) > 1.2 ? in_box : elsewhere);
    }
    CHECK(in_box > 512); // 0.8 / 0.1 cells each way
    CHECK(mesh.cell_count() > 2 * coarse_mesh->outcome.mesh.cell_count());
    for (const char* missing : {"none.stl", "in.txt"}) {
        REQUIRE(region("inside " + (scratch / missing).string() + " size=0.1"));
        const auto refused = run_mesh_job(job, context);
        REQUIRE_FALSE(refused);
        CHECK(refused.error().code == ErrorCode::bad_input);
        CHECK(refused.error().one_line().find(missing) != std::string::npos);
    }
}

TEST_CASE("cells may be flat at a wall and inside") {
    RegionTarget wall, inside;
    wall.low = Point(-1), wall.high = Point(3, 3, 0.4);
    wall.sizes = {0.25, 0.25, 0.06};
    inside.low = Point(0.6), inside.high = Point(1.4);
    inside.sizes = {0.06, 0.25, 0.25};
    for (const RegionTarget& region : {wall, inside}) {
        MeshOptions options;
        options.refine.surface.size = 0.25;
        options.refine.regions = {region};
        const auto outcome = mesh(cube(0, 2), options);
        INFO((outcome ? "" : outcome.error().one_line()));
        REQUIRE(outcome);
        CHECK(outcome->verdict == ErrorCode::ok);
        CHECK(outcome->after.validity.is_valid());
        CHECK(outcome->after.total_volume == Approx(8).epsilon(1e-9));
        CHECK(outcome->fit.captured_corners == 8);
        CHECK(outcome->after.aspect_ratio.p95 > 3);
        CHECK(outcome->settle.backed_off_count == 0);
    }
}

TEST_CASE("an octree may be the initial mesh, named hanging vertices or not") {
    const test::Scratch scratch;
    Context context(2);
    REQUIRE(write_surface(scratch / "in.stl", cube(-0.5, 0.5), {}, context));
    SampleOptions size;
    size.size = 4, size.levels = 2;
    auto octree = make_sample("octree-corner", size, context);
    REQUIRE(octree);
    REQUIRE_FALSE(octree->hanging.empty());
    for (Point& p : octree->positions) p = 1.7 * p - Point(0.83);
    MeshJob job;
    job.surfaces = {scratch / "in.stl"};
    job.output = scratch / "out.vtu";
    job.options.refine.surface.size = 0.11;
    std::vector<std::size_t> cells;
    for (const char* name : {"octree.vtu", "octree.mesh"}) { // .mesh has no place for constraints
        INFO(name);
        REQUIRE(write_mesh(scratch / name, *octree, {}, {}, context));
        job.initial_mesh = scratch / name;
        const auto result = run_mesh_job(job, context);
        INFO((result ? "" : result.error().one_line()));
        REQUIRE(result);
        CHECK(result->outcome.verdict == ErrorCode::ok);
        CHECK(result->outcome.fit.captured_corners == 8);
        CHECK(result->outcome.after.total_volume == Approx(1).epsilon(1e-9));
        cells.push_back(result->outcome.mesh.cell_count());
    }
    CHECK(cells[0] == cells[1]);
}

TEST_CASE("a cancelled run leaves the earlier file") {
    const test::Scratch scratch;
    Context context(1);
    REQUIRE(write_surface(scratch / "in.stl", cube(0, 1), {}, context));
    test::spill(scratch / "out.vtu", "earlier");
    MeshJob job;
    job.surfaces = {scratch / "in.stl"};
    job.output = scratch / "out.vtu";
    job.options = coarse(800);
    for (const char* at : {"read", "refine", "trim", "fit", "buffer", "optimize"}) {
        INFO(at);
        Context cancelled(1);
        cancelled.set_progress_sink([&](std::string_view stage, double, std::string_view) {
            if (stage == at) cancelled.cancel();
        });
        const auto result = run_mesh_job(job, cancelled);
        CHECK((result ? result->outcome.verdict : result.error().code) == ErrorCode::cancelled);
        CHECK(test::slurp(job.output) == "earlier");
    }
}

TEST_CASE("larger cells beside smaller ones across a ridge are no contact") {
    TriangleSoup turned = cube(0, 2);
    for (Point& p : turned.vertices)
        p = Point(0.8 * p.x - 0.6 * p.y, 0.48 * p.x + 0.64 * p.y - 0.6 * p.z,
                  0.36 * p.x + 0.48 * p.y + 0.8 * p.z);
    MeshOptions options = coarse(1500);
    RegionTarget corner;
    corner.shape = RegionShape::sphere;
    corner.radius = 0.7;
    corner.target.size = 0.1;
    options.refine.regions.push_back(corner);
    const auto outcome = mesh(turned, options);
    REQUIRE(outcome);
    CHECK(outcome->contacts.empty());
    CHECK(outcome->verdict == ErrorCode::ok);
}

TEST_CASE("where cells fail the octree is refined and meshed anew", "[slow]") {
    const fs::path model = fs::path(HEXOPT_SHARED_DATA) / "geometry/airplane1.stl";
    if (!fs::exists(model)) {
        WARN("skipped: no " << model);
        return;
    }
    Context context(2);
    const auto surface = read_surface(model, context);
    REQUIRE(surface);
    MeshOptions options;
    options.refine.surface.size = 0.15; // no number of cells that repairs would have to keep to
    options.optimize.max_deviation_rel = 0;
    options.noise_angle_deg = 0; // all that fails is to be refined
    const auto outcome = mesh(*surface, options);
    REQUIRE(outcome);
    REQUIRE(outcome->attempts.size() > 1);
    REQUIRE(outcome->attempts.front().refined > 0);
    std::size_t fewest = outcome->attempts.front().failed;
    for (const AttemptCount& attempt : outcome->attempts) fewest = std::min(fewest, attempt.failed);
    CHECK(fewest <= outcome->attempts.front().failed / 10); // 0 when this was written
    if (fewest == 0) CHECK(outcome->verdict == ErrorCode::ok);
}
