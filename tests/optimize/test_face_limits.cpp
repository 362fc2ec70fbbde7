#include "samples/samples.hpp"
#include "stages/optimize/deviation_guard.hpp"
#include "stages/optimize/face_limits.hpp"
#include "stages/optimize/newton.hpp"

#include <catch2/catch.hpp>
#include <glm/geometric.hpp>
#include <random>

using namespace hexopt;

namespace {

constexpr double kAllowed = 0.02;

/// A cube of 4x4x4 cells whose boundary may leave its surface by kAllowed.
struct Cube {
    Context context{2, 3};
    HexMesh mesh;
    Topology topology;
    BoundaryModel surface;
    SurfaceLimits limits;

    Cube() {
        SampleOptions options;
        options.size = 4;
        mesh = make_sample("grid", options, context).value();
        topology = compute_topology(mesh);
        surface = build_boundary_model(mesh, topology, {}, context).value();
        limits = unlimited_on_surface(mesh.positions);
        limits.band.assign(mesh.vertex_count(), 0.9f * kAllowed);
    }

    DeviationGuard guard() const { return {mesh, topology, surface, limits, kAllowed, context.parallel()}; }

    std::vector<Point> shaken(double by) const {
        std::mt19937_64 generator(5);
        std::uniform_real_distribution<double> uniform(-by, by);
        std::vector<Point> at = mesh.positions;
        for (Point& p : at) p += Point(uniform(generator), uniform(generator), uniform(generator));
        return at;
    }
};

} // namespace

TEST_CASE("limits of faces are 0 where quads are well within, and their terms are the slope of the energy") {
    const Cube cube;
    const std::vector<std::uint8_t> all(cube.mesh.vertex_count(), 1);
    const Problem problem(cube.mesh, cube.topology, all);
    const DeviationGuard guard = cube.guard();
    const FaceLimits faces(problem, guard.faces(), cube.limits);
    CHECK(faces.energy(cube.mesh.positions) == 0);
    CHECK(faces.energy(cube.shaken(0.5 * kAllowed)) == 0); // sqrt(3) / 2 of what is allowed

    std::vector<Point> at = cube.shaken(2 * kAllowed);
    REQUIRE(faces.energy(at) > 1);
    std::vector<FaceTerm> terms;
    faces.append_terms(at, terms);
    std::vector<Point> slope(at.size(), Point(0));
    double energy = 0;
    for (const FaceTerm& term : terms) {
        energy += term.limit.energy;
        for (std::size_t k = 0; k < 4; ++k)
            slope[problem.cell(term.cell)[term.corner[k]]] += term.weight[k] * term.limit.gradient;
    }
    CHECK(energy == Approx(faces.energy(at)).epsilon(1e-12));
    const double h = 1e-7;
    double largest = 0;
    for (std::size_t v = 0; v < at.size(); ++v)
        for (int axis = 0; axis < 3; ++axis) {
            const double x = at[v][axis];
            at[v][axis] = x + h;
            const double up = faces.energy(at);
            at[v][axis] = x - h;
            const double down = faces.energy(at);
            at[v][axis] = x;
            CHECK((up - down) / (2 * h) == Approx(slope[v][axis]).epsilon(1e-3).margin(0.05));
            largest = std::max(largest, std::abs(slope[v][axis]));
        }
    CHECK(largest > 100);
}

TEST_CASE("limits of faces follow the band shares of their corners") {
    Cube cube;
    const std::vector<std::uint8_t> all(cube.mesh.vertex_count(), 1);
    const Problem problem(cube.mesh, cube.topology, all);
    const DeviationGuard guard = cube.guard();
    const std::vector<Point> at = cube.shaken(0.5 * kAllowed);
    CHECK(FaceLimits(problem, guard.faces(), cube.limits).energy(at) == 0);
    cube.limits.band_share.assign(cube.mesh.vertex_count(), 0.5f);
    CHECK(FaceLimits(problem, guard.faces(), cube.limits).energy(at) > 0);
}

TEST_CASE("Newton's method with limits of faces keeps quads where single vertices may go anywhere") {
    Cube cube;
    for (Point& p : cube.mesh.positions) p.x *= 1.5; // cells would rather be cubes
    cube.surface = build_boundary_model(cube.mesh, cube.topology, {}, cube.context).value();
    cube.limits.start = cube.mesh.positions;
    const DeviationGuard guard = cube.guard();
    const LimitedFaces limited = guard.faces();
    Budget budget({}, cube.context);
    const auto minimise = [&](const LimitedFaces* faces, std::vector<Point>& at) {
        Problem problem(cube.mesh, cube.topology, std::vector<std::uint8_t>(at.size(), 1));
        problem.update_lengths(at, cube.context.parallel());
        SurfaceLimits limits = cube.limits;
        if (!faces) limits.band.assign(at.size(), 100.0f);
        const SurfaceMotion motion(problem, cube.surface, limits, Tangents::smooth, faces);
        CHECK(motion.limited().empty() == (faces != nullptr));
        Newton newton(problem, at, &motion, budget);
        NewtonOptions options;
        options.max_steps = 30;
        return newton.minimise({1e-12, 1e-3, 0, 0}, options);
    };
    std::vector<Point> held = cube.mesh.positions, free = held;
    const NewtonResult result = minimise(&limited, held);
    minimise(nullptr, free);
    CHECK(result.end.energy < result.start.energy);
    CHECK(guard.is_within(held, 1, cube.context.parallel()));
    CHECK_FALSE(guard.is_within(free, 1, cube.context.parallel()));
}
