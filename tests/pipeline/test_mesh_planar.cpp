#include "io/read_surface.hpp"
#include "io/scratch.hpp"
#include "io/write_surface.hpp"
#include "mesh/hanging.hpp"
#include "mesh/topology.hpp"
#include "pipeline/mesh_keys.hpp"
#include "pipeline/planar_job.hpp"
#include "samples/geometry/airfoil.hpp"
#include "samples/geometry/geometries.hpp"
#include "stages/refine/region_surface.hpp"
#include "support/skip.hpp"
#include "support/turned.hpp"

#include <catch2/catch.hpp>
#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vector_relational.hpp>
#include <set>

using namespace hexopt;
namespace fs = std::filesystem;

namespace {

void write_outline(const fs::path& path, const std::vector<Point2>& points) {
    std::string text = "section\n";
    for (const Point2& p : points) text += fmt::format("{} {}\n", p.x, p.y);
    test::spill(path, text);
}

MeshJob job_of(std::vector<fs::path> surfaces, const fs::path& output, const std::string& farfield) {
    MeshJob job;
    job.surfaces = std::move(surfaces);
    job.output = output;
    job.options.refine.target_cells = 4000;
    for (const MeshKey& key : mesh_keys())
        if (key.name == "farfield.box" && !farfield.empty())
            REQUIRE(set_mesh_key(job, key.name, *parse_value(key, farfield), key.flag));
    return job;
}

void check_valid(const Result<MeshJobResult>& result, double least_sj) {
    INFO((result ? "" : result.error().one_line()));
    REQUIRE(result);
    const MeshOutcome& outcome = result->outcome;
    CHECK(outcome.verdict == ErrorCode::ok);
    REQUIRE(outcome.planar);
    CHECK(outcome.after.validity.is_valid());
    CHECK(outcome.after.validity.min_scaled_jacobian > least_sj);
    CHECK(outcome.contacts.empty());
    CHECK(compute_topology(outcome.mesh).boundary_faces.size() == outcome.mesh.boundary.size());
}

void check_result(const Result<MeshJobResult>& result, double least_sj) {
    check_valid(result, least_sj);
    const MeshOutcome& outcome = result->outcome;
    CHECK(outcome.deviation.mesh_to_surface.upper < 3e-4 * outcome.planar->diagonal);
    CHECK(outcome.deviation.surface_to_mesh.upper < 3e-4 * outcome.planar->diagonal);
}

std::set<std::string> names(const HexMesh& mesh) {
    return {mesh.patch_names.begin(), mesh.patch_names.end()};
}

std::set<std::string> names_of(const TriangleSoup& soup) {
    return {soup.patch_names.begin(), soup.patch_names.end()};
}

} // namespace

TEST_CASE("airfoils of several files are meshed in a farfield") {
    const test::Scratch scratch;
    auto main = geometry::make_naca("23012", 50);
    REQUIRE(main);
    std::vector<Point2> flap;
    for (const Point2& p : *main) flap.emplace_back(0.98 + 0.3 * p.x, 0.3 * p.y - 0.04 - 0.12 * p.x);
    write_outline(scratch / "main.dat", *main);
    write_outline(scratch / "flap.dat", flap);
    Context context(2);
    const MeshJob job =
        job_of({scratch / "main.dat", scratch / "flap.dat"}, scratch / "out.foam", "-3,-3,4,3");
    const auto result = run_mesh_job(job, context);
    check_result(result, 0.5);
    const HexMesh& mesh = result->outcome.mesh;
    CHECK(names(mesh) == std::set<std::string>{"main", "flap", "farfield_x_min", "farfield_x_max",
                                               "farfield_y_min", "farfield_y_max", "back", "front"});
    CHECK(result->outcome.planar->row.corners == std::array<std::size_t, 5>{0, 4, 0, 0, 2});
    const std::string boundary = test::slurp(scratch / "constant" / "polyMesh" / "boundary");
    for (const char* side : {"back", "front"}) {
        const std::size_t at = boundary.find(std::string("    ") + side + "\n");
        REQUIRE(at != std::string::npos);
        CHECK(boundary.substr(at, 60).find("empty;") != std::string::npos);
    }
    CHECK(boundary.find("empty;", boundary.find("empty;", boundary.find("empty;") + 1) + 1) ==
          std::string::npos);
}

TEST_CASE("samples of airfoils are recognised as slabs and keep their names") {
    const test::Scratch scratch;
    Context context(2);
    for (const char* name : {"airfoil", "multi-element"}) {
        INFO(name);
        const auto soup = make_geometry(name, {}, context);
        REQUIRE(soup);
        REQUIRE(write_surface(scratch / "slab.stl", *soup, {}, context));
        const auto result = run_mesh_job(job_of({scratch / "slab.stl"}, scratch / "slab.vtu", ""), context);
        check_result(result, 0.5);
        CHECK(names(result->outcome.mesh) == names_of(*soup));
        MeshJob turned_off = job_of({scratch / "slab.stl"}, scratch / "slab.vtu", "");
        StageClock clock;
        turned_off.options.planar = PlanarChoice::no;
        CHECK_FALSE(find_slab(*soup, turned_off.options, clock, context)->has_value());
    }
}

TEST_CASE("planar meshing refuses what it cannot use, by its flag") {
    const test::Scratch scratch;
    write_outline(scratch / "square.dat", {{0, 0}, {1, 0}, {1, 1}, {0, 1}});
    Context context(1);
    const auto refused = [&](auto change) {
        MeshJob job = job_of({scratch / "square.dat"}, scratch / "out.vtu", "");
        change(job);
        const auto result = run_mesh_job(job, context);
        REQUIRE_FALSE(result);
        CHECK_FALSE(fs::exists(scratch / "out.vtu"));
        CHECK(result.error().code == ErrorCode::usage);
        return result.error().one_line();
    };
    CHECK(refused([](MeshJob& j) { j.options.buffers = false; }).find("--buffers") != std::string::npos);
    CHECK(refused([](MeshJob& j) { j.options.trim.rule = TrimRule::strict; }).find("--trim-rule") !=
          std::string::npos);
    CHECK(refused([](MeshJob& j) { j.options.planar = PlanarChoice::no; }).find("--planar") !=
          std::string::npos);
    CHECK(refused([](MeshJob& j) {
              j.options.farfield = Box{Point(-1), Point(2)};
          }).find("four numbers") != std::string::npos);
    CHECK(refused([](MeshJob& j) {
              j.options.farfield = Box{Point(0.5, 0.5, -INFINITY), Point(2, 2, INFINITY)};
          }).find("not inside the box") != std::string::npos);
    CHECK(refused([](MeshJob& j) { j.options.trim.seeds = {Point(3, 3, 0)}; }).find("(3, 3)") !=
          std::string::npos);
    CHECK(refused([&](MeshJob& j) { j.surfaces.emplace_back("other.stl"); }).find("other.stl") !=
          std::string::npos);
    CHECK(refused([](MeshJob& j) {
              j.options.refine.initial.cells = {9, 9, 2};
          }).find("must be 1") != std::string::npos);
    CHECK(refused([](MeshJob& j) {
              j.options.refine.initial.box = Box{Point(-1, -1, 0), Point(0.5, 2, 1)};
          }).find("not inside the box") != std::string::npos);
    MeshJob same = job_of({scratch / "square.dat", scratch / "square.dat"}, scratch / "out.vtu", "");
    const auto twice = run_mesh_job(same, context);
    REQUIRE_FALSE(twice);
    CHECK(twice.error().where.ends_with("square.dat:2"));
}

TEST_CASE("real outlines and slabs are meshed validly", "[slow]") {
    const fs::path folder = HEXOPT_SHARED_DATA "/geometry";
    if (!fs::exists(folder / "dat2d")) HEXOPT_SKIP("no " + (folder / "dat2d").string());
    const test::Scratch scratch;
    Context context(2);
    for (const char* name : {"naca64a010", "rae2822", "rae2822_su2"}) {
        INFO(name);
        const fs::path file = folder / "dat2d" / (std::string(name) + ".dat");
        MeshJob job = job_of({file}, scratch / "out.vtu", "-8,-8,9,8");
        job.options.refine.target_cells = 0;
        check_result(run_mesh_job(job, context), 0.7);
    }
    for (const char* name : {"rae2822_slab", "naca64a010_slab", "multi_element_slab", "cooled_blade_2d"}) {
        INFO(name);
        MeshJob job = job_of({folder / (std::string(name) + ".stl")}, scratch / "out.vtu", "");
        job.options.refine.target_cells = 0;
        const auto result = run_mesh_job(job, context);
        check_result(result, 0.7);
        CHECK(result->outcome.notes.front().find("thin slab and") != std::string::npos);
        const auto surface = read_surfaces(job.surfaces, {}, context);
        REQUIRE(surface);
        job.surfaces = {scratch / "turned.stl"};
        const TriangleSoup turned = test::turned(*surface, {31, 47, 19}, Point(1, 2, 3));
        REQUIRE(write_surface(job.surfaces[0], test::rounded(turned), {}, context));
        const auto in_place = run_mesh_job(job, context);
        check_result(in_place, 0.7);
        CHECK(in_place->outcome.planar->is_turned);
    }
}

namespace {

/// A section in a box of 4 x 3, thin across z.
TriangleSoup section_in_box() {
    auto section = geometry::make_naca("2412", 30);
    REQUIRE(section);
    Slab slab;
    slab.high = 0.125;
    slab.outline.patch_names = {"box", "foil"};
    std::reverse(section->begin(), section->end());
    for (const auto& points : {std::vector<Point2>{{-2, -1}, {2, -1}, {2, 2}, {-2, 2}}, *section}) {
        const auto patch = static_cast<Index>(slab.outline.loops.size());
        slab.outline.loops.push_back({points, std::vector<Index>(points.size(), patch), {}, {}});
    }
    const auto solid = make_solid(slab);
    REQUIRE(solid);
    return *solid;
}

/// The section alone.
TriangleSoup section_alone() {
    auto section = geometry::make_naca("2412", 30);
    REQUIRE(section);
    Slab slab;
    slab.high = 0.03125;
    slab.outline.patch_names = {"foil"};
    slab.outline.loops.push_back({*section, std::vector<Index>(section->size(), 0), {}, {}});
    const auto solid = make_solid(slab);
    REQUIRE(solid);
    return *solid;
}

RegionTarget sized(RegionTarget region, double size) {
    region.target.size = size;
    return region;
}

MeshJob slab_job(const test::Scratch& scratch, const TriangleSoup& soup, const std::string& output) {
    Context context(1);
    REQUIRE(write_surface(scratch / "slab.stl", soup, {}, context));
    MeshJob job = job_of({scratch / "slab.stl"}, scratch / output, "");
    job.report = scratch / "report.json";
    return job;
}

double longest_edge(const HexMesh& mesh, const Cell& cell) {
    double longest = 0;
    for (int k = 0; k < 4; ++k)
        longest =
            std::max(longest, glm::distance(mesh.positions[cell[k]], mesh.positions[cell[(k + 1) % 4]]));
    return longest;
}

Point centre_of(const HexMesh& mesh, const Cell& cell) {
    Point sum(0);
    for (Index v : cell) sum += mesh.positions[v];
    return sum / 8.0;
}

std::string error_of(const MeshJob& job) {
    Context context(1);
    const auto result = run_mesh_job(job, context);
    REQUIRE_FALSE(result);
    CHECK(result.error().code == ErrorCode::usage);
    CHECK_FALSE(fs::exists(job.output));
    return result.error().one_line();
}

} // namespace

TEST_CASE("slabs across x and y are meshed as those across z, to the same bits") {
    const test::Scratch scratch;
    Context context(2);
    const TriangleSoup solid = section_alone();
    const auto run = [&](int axis) {
        MeshJob job = slab_job(scratch, test::permuted(solid, axis), "out.foam");
        // In x, y of the slab -1,-2,3,2; in the order of the model's axes.
        job.options.farfield = axis == 1 ? Box{Point(-2, -1, -INFINITY), Point(2, 3, INFINITY)}
                                         : Box{Point(-1, -2, -INFINITY), Point(3, 2, INFINITY)};
        job.options.trim.seeds = {test::permuted(Point(2, 1, 0.01), axis)};
        const Point low = test::permuted(Point(1.5, -0.5, 0), axis),
                    high = test::permuted(Point(2, 0.5, 1), axis);
        RegionTarget box, ball, near;
        box.low = low;
        box.high = high;
        ball.shape = RegionShape::sphere;
        ball.low = test::permuted(Point(-0.5, 1, 0), axis);
        ball.radius = 0.25;
        near.shape = RegionShape::near;
        near.surface = *RegionSurface::create(
            test::permuted(
                geometry::make_box(Point(2.5, 1.5, -1), Point(2.75, 1.75, 1), {"a", "b", "c", "d", "e", "f"}),
                axis),
            context);
        job.options.refine.regions = {sized(box, 0.05), sized(ball, 0.06), sized(near, 0.04)};
        InitialMeshOptions& initial = job.options.refine.initial;
        initial.box =
            Box{test::permuted(Point(-1.1, -2.2, 0), axis), test::permuted(Point(3.3, 2.1, 0.03125), axis)};
        const std::array<Index, 3> counts = {11, 10, 1};
        for (int k = 0; k < 3; ++k) initial.cells[(axis + 1 + k) % 3] = counts[k];
        auto result = run_mesh_job(job, context);
        check_valid(result, 0.4);
        const std::string boundary = test::slurp(scratch / "constant" / "polyMesh" / "boundary");
        CHECK(boundary.find("empty;", boundary.find("empty;") + 1) != std::string::npos);
        return std::move(result->outcome);
    };
    const MeshOutcome flat = run(2);
    CHECK(flat.refine.split[static_cast<std::size_t>(RefineCriterion::region)] > 50);
    for (int axis : {0, 1}) {
        const MeshOutcome other = run(axis);
        std::vector<Point> wanted = flat.mesh.positions;
        for (Point& p : wanted) p = test::permuted(p, axis);
        CHECK(other.mesh.positions == wanted);
        CHECK(other.mesh.cells == flat.mesh.cells);
        CHECK(other.planar->normal[axis] == 1);
        std::set<std::string> sides;
        for (const char* end : {"min", "max"})
            for (int k : {1, 2}) sides.insert(fmt::format("farfield_{}_{}", "xyz"[(axis + k) % 3], end));
        sides.insert({"foil", "back", "front"});
        CHECK(names(other.mesh) == sides);
        CHECK(other.notes.front().find(fmt::format("thin slab across {} ", "xyz"[axis])) !=
              std::string::npos);
    }
}

TEST_CASE("a turned slab is meshed in its own plane, and regions keep their place in the model") {
    const test::Scratch scratch;
    Context context(2);
    const Point degrees(25, -50, 70);
    const glm::dmat3 by = test::turn(degrees);
    const TriangleSoup solid = test::rounded(test::turned(section_in_box(), degrees, Point(0)));
    MeshJob job = slab_job(scratch, solid, "out.foam");
    RegionTarget box, rod;
    const Point middle = by * Point(-1.25, 1, 0.06);
    box.low = middle - Point(0.3);
    box.high = middle + Point(0.3);
    rod.shape = RegionShape::cylinder;
    rod.low = by * Point(1.5, 1, -1);
    rod.high = by * Point(1.5, 1, 1);
    rod.radius = 0.3;
    job.options.refine.regions = {sized(box, 0.03), sized(rod, 0.02)};
    job.options.trim.seeds = {by * Point(1.9, 1.9, 0.01)};
    const auto result = run_mesh_job(job, context);
    check_valid(result, 0.5);
    const HexMesh& mesh = result->outcome.mesh;
    const PlanarReport& planar = *result->outcome.planar;
    CHECK(names(mesh) == std::set<std::string>{"box", "foil", "back", "front"});
    CHECK(planar.is_turned);
    CHECK(glm::distance(planar.normal, by[2] * (glm::dot(by[2], planar.normal) > 0 ? 1.0 : -1.0)) < 1e-6);
    std::size_t in_box = 0, in_rod = 0, coarse = 0, given = 0;
    for (const Cell& cell : mesh.cells) {
        const Point at = centre_of(mesh, cell), from = glm::transpose(by) * at;
        const double size = longest_edge(mesh, cell);
        const bool boxed = glm::all(glm::lessThan(glm::abs(at - middle), Point(0.3)));
        const bool rodded = glm::distance(Point2(from), Point2(1.5, 1)) < 0.3;
        if (boxed && size > 0.03 * 1.3) FAIL("a cell in the box has the size " << size);
        if (rodded && size > 0.02 * 1.3) FAIL("a cell in the cylinder has the size " << size);
        in_box += boxed;
        in_rod += rodded;
        coarse += size > 0.06;
    }
    CHECK(in_box > 100);
    CHECK(in_rod > 100);
    CHECK(coarse > 50);
    CHECK(max_hanging_deviation(mesh.hanging, mesh.positions) == 0);
    const std::vector<Index> hanging_row = compute_hanging_row(mesh.hanging, mesh.positions.size());
    const std::set<std::array<double, 3>> vertices = [&] {
        std::set<std::array<double, 3>> all;
        for (const Point& p : solid.vertices) all.insert({p.x, p.y, p.z});
        return all;
    }();
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
        const Point& p = mesh.positions[v];
        const double off =
            std::abs(glm::dot(planar.normal, p) - (v < mesh.positions.size() / 2 ? planar.low : planar.high));
        if (vertices.count({p.x, p.y, p.z}) == 0)
            REQUIRE(off < (hanging_row[v] == kNoIndex ? 1e-14 : 1e-7));
        else
            ++given;
    }
    CHECK(given >= 2 * result->outcome.corners);
    // OpenFOAM would leave out every direction that a turned plane's normal has a part in.
    const std::string boundary = test::slurp(scratch / "constant" / "polyMesh" / "boundary");
    CHECK(boundary.find("empty;") == std::string::npos);
    CHECK(result->outcome.notes[1].find("have the type `patch`") != std::string::npos);
    CHECK(test::slurp(job.report).find("\"planes\"") != std::string::npos);
}

TEST_CASE("what cannot be meant in a slab's plane is refused, and places are named in the model") {
    const test::Scratch scratch;
    const TriangleSoup solid = section_in_box();
    const TriangleSoup turned = test::rounded(test::turned(solid, {25, -50, 70}, Point(0)));
    const auto refused = [&](const TriangleSoup& soup, auto change) {
        MeshJob job = slab_job(scratch, soup, "out.vtu");
        change(job);
        return error_of(job);
    };
    const auto farfield = [](MeshJob& job) {
        job.options.farfield = Box{Point(-9, -9, -INFINITY), Point(9, 9, INFINITY)};
    };
    CHECK(refused(turned, farfield).find("--farfield: the slab's plane is turned") != std::string::npos);
    CHECK(refused(turned, [](MeshJob& job) {
              job.options.refine.initial.box = Box{Point(-9), Point(9)};
          }).find("box: the slab's plane is turned") != std::string::npos);
    CHECK(refused(turned, [](MeshJob& job) {
              job.options.refine.initial.cells = {9, 9, 1};
          }).find("cells: the slab's plane is turned") != std::string::npos);
    CHECK(refused(turned, [](MeshJob& job) {
              job.options.trim.seeds = {Point(100, 0, 0)};
          }).find("is not inside the outline") != std::string::npos);
    const TriangleSoup across = test::permuted(solid, 1); // x: the slab's y, y: across, z: its x
    CHECK(refused(across, [](MeshJob& job) {
              job.options.farfield = Box{Point(-9), Point(9)};
          }).find("xmin,zmin,xmax,zmax") != std::string::npos);
    CHECK(refused(across, [](MeshJob& job) {
              job.options.farfield = Box{Point(-1.5, -9, -INFINITY), Point(1.5, 9, INFINITY)};
          }).find("the point (2, 0, 2) of") != std::string::npos);
    CHECK(refused(across, [](MeshJob& job) {
              job.options.refine.initial.cells = {9, 2, 9};
          }).find("must be 1") != std::string::npos);
    CHECK(refused(across, [](MeshJob& job) {
              job.options.trim.seeds = {Point(7, 0, 8)};
          }).find("(7, 0, 8) is not inside") != std::string::npos);
}

TEST_CASE("a real slab too thin for its cells in space is refused before many times the cells are made",
          "[slow]") {
    const fs::path folder = HEXOPT_SHARED_DATA "/geometry";
    if (!fs::exists(folder)) HEXOPT_SKIP("no " + folder.string());
    for (const char* name : {"rae2822_slab", "naca64a010_slab"}) {
        INFO(name);
        Context context(2);
        const auto surface = read_surfaces({folder / (std::string(name) + ".stl")}, {}, context);
        REQUIRE(surface);
        std::size_t largest = 0; // octree that was trimmed
        context.set_progress_sink([&largest](std::string_view stage, double, std::string_view what) {
            const std::size_t of = what.find(" of ");
            if (stage == "trim" && of != std::string_view::npos)
                largest = std::max<std::size_t>(largest, std::stoul(std::string(what.substr(of + 4))));
        });
        StageClock clock;
        const auto refused =
            mesh_surface(test::turned(*surface, {31, 47, 19}, Point(0)), MeshOptions(), clock, context);
        REQUIRE_FALSE(refused);
        CHECK(refused.error().code == ErrorCode::no_valid_mesh);
        CHECK(refused.error().one_line().find("0.05 thick") != std::string::npos);
        CHECK(largest > 10'000);
        CHECK(largest < 1'000'000);
    }
}
