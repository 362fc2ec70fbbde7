#include "io/read_surface.hpp"
#include "io/scratch.hpp"
#include "io/write_surface.hpp"
#include "mesh/topology.hpp"
#include "pipeline/mesh_keys.hpp"
#include "pipeline/planar_job.hpp"
#include "samples/geometry/airfoil.hpp"
#include "samples/geometry/geometries.hpp"
#include "support/skip.hpp"

#include <catch2/catch.hpp>
#include <fmt/format.h>
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

void check_result(const Result<MeshJobResult>& result, double least_sj) {
    INFO((result ? "" : result.error().one_line()));
    REQUIRE(result);
    const MeshOutcome& outcome = result->outcome;
    CHECK(outcome.verdict == ErrorCode::ok);
    REQUIRE(outcome.planar);
    CHECK(outcome.after.validity.is_valid());
    CHECK(outcome.after.validity.min_scaled_jacobian > least_sj);
    CHECK(outcome.deviation.mesh_to_surface.upper < 3e-4 * outcome.planar->diagonal);
    CHECK(outcome.deviation.surface_to_mesh.upper < 3e-4 * outcome.planar->diagonal);
    CHECK(outcome.contacts.empty());
    CHECK(compute_topology(outcome.mesh).boundary_faces.size() == outcome.mesh.boundary.size());
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
        CHECK(result->outcome.notes.front().find("thin slab") != std::string::npos);
    }
}
