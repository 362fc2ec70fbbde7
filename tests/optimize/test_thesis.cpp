#include "stages/optimize/thesis_sweeps.hpp"

#include "io/mesh_io.hpp"
#include "mesh/hanging.hpp"
#include "quality/mesh_validity.hpp"
#include "samples/samples.hpp"
#include "stages/optimize/problem.hpp"
#include "support/skip.hpp"

#include <catch2/catch.hpp>
#include <cstring>
#include <filesystem>
#include <glm/geometric.hpp>

using namespace hexopt;

namespace {

HexMesh sample(const char* name, Index size, int levels, double tangled, std::uint64_t seed = 1) {
    Context context(1, seed);
    if (std::string_view(name).starts_with("grid")) levels = 0;
    auto mesh = make_sample(name, {size, levels, tangled, false, PerturbPattern::everywhere}, context);
    REQUIRE(mesh);
    return *mesh;
}

OptimizeOptions thesis(UntangleTarget untangle = UntangleTarget::deepest_point) {
    OptimizeOptions options;
    options.method = OptimizeMethod::thesis;
    options.boundary = BoundaryMode::fixed;
    options.untangle = untangle;
    return options;
}

OptimizeStats run(HexMesh& mesh, const OptimizeOptions& options, int threads = 2) {
    Context context(threads);
    const auto stats = optimize(mesh, compute_topology(mesh), nullptr, options, context);
    REQUIRE(stats);
    return *stats;
}

struct Sweeps {
    HexMesh mesh;
    Topology topology = compute_topology(mesh);
    Context context{2};
    Budget budget{OptimizeOptions{}, context};
    std::vector<std::uint8_t> movable;
    LocalSweeps sweeps;

    explicit Sweeps(HexMesh m)
        : mesh(std::move(m)), movable(inner(topology)),
          sweeps(mesh, topology, movable, mesh.positions, budget) {}

    static std::vector<std::uint8_t> inner(const Topology& topology) {
        std::vector<std::uint8_t> movable;
        for (std::uint8_t b : topology.on_boundary) movable.push_back(!b);
        return movable;
    }
    std::size_t concave() const { return compute_validity(mesh, Parallel(1)).concave_cells; }
};

} // namespace

TEST_CASE("Algorithm 1 brings a lone vertex back into its ball, by every target and in both modes") {
    const auto target =
        GENERATE(UntangleTarget::axis, UntangleTarget::extended, UntangleTarget::deepest_point);
    const std::uint32_t tets = GENERATE(kCornerTets, kPathTets, kAllTets);
    const Point where = GENERATE(Point(1.2, 0.5, 0.5), Point(0.4, -0.3, 1.1), Point(-1, -1, 3));
    Sweeps s(sample("grid", 2, 0, 0));
    s.mesh.positions[13] = where;
    REQUIRE(s.concave() > 0);
    CHECK(s.sweeps.untangle(tets, target) == 1);
    CHECK(s.concave() == 0);
    CHECK(s.sweeps.untangle(tets, target) == 0);
}

TEST_CASE("a vertex without a kernel is skipped") {
    Sweeps s(sample("grid", 2, 0, 0));
    std::swap(s.mesh.positions[4], s.mesh.positions[22]); // the middles of two opposite faces change places
    const auto target =
        GENERATE(UntangleTarget::axis, UntangleTarget::extended, UntangleTarget::deepest_point);
    CHECK(s.sweeps.untangle(kAllTets, target) == 0);
    CHECK(s.mesh.positions[13] == Point(0.5));
}

TEST_CASE("sweeps count concave cells as the quality folder does") {
    Sweeps s(sample("octree-corner", 4, 2, 0.3));
    const auto counts = compute_validity(s.mesh, Parallel(1));
    CHECK(s.sweeps.count_concave(kCornerTets) == counts.concave8_cells);
    CHECK(s.sweeps.count_concave(kPathTets) == counts.concave24_cells);
    CHECK(s.sweeps.count_concave(kAllTets) == counts.concave_cells);
    CHECK(s.sweeps.find_min_sj() == Approx(counts.min_scaled_jacobian).margin(1e-6));
}

TEST_CASE("optimization sweeps keep a valid mesh valid in the mode they work in") {
    for (const char* name : {"grid-warped", "octree-warped"}) {
        Sweeps s(sample(name, 4, 1, 0));
        for (Energy kind : {Energy::structural, Energy::shape})
            for (auto gradient : {GradientKind::analytic, GradientKind::finite_difference})
                for (int sweep = 0; sweep < 3; ++sweep) {
                    s.sweeps.optimise(kAllTets, {kind, 0}, gradient);
                    CHECK(s.concave() == 0);
                    CHECK(max_hanging_deviation(s.mesh.hanging, s.mesh.positions) < 1e-14);
                }
    }
}

TEST_CASE("shape optimization takes a warped grid back to the lattice") {
    Sweeps s(sample("grid", 4, 0, 0));
    const HexMesh lattice = s.mesh;
    for (Index v = 0; v < s.mesh.vertex_count(); ++v)
        if (s.movable[v])
            s.mesh.positions[v] += 0.04 * Point(std::sin(7.0 * v), std::cos(5.0 * v), std::sin(3.0 * v));
    for (int sweep = 0; sweep < 60; ++sweep)
        s.sweeps.optimise(kAllTets, {Energy::shape, 0}, GradientKind::analytic);
    for (Index v = 0; v < s.mesh.vertex_count(); ++v)
        CHECK(glm::distance(s.mesh.positions[v], lattice.positions[v]) < 1e-4);
}

TEST_CASE("Jacobi steps of the hyper-elastic energy lower it on tangled meshes and untangle cubes") {
    Sweeps s(sample("grid", 5, 0, 0.3));
    REQUIRE(s.concave() > 10);
    double last = std::numeric_limits<double>::infinity();
    for (int step = 0; step < 80; ++step) {
        const double energy = s.sweeps.step_jacobi(kAllTets, {Energy::hyperelastic, 0}, 0.5);
        CHECK(energy <= last * (1 + 1e-12));
        last = energy;
    }
    CHECK(s.concave() == 0);
}

TEST_CASE("smart Laplacian smoothing never lowers the least scaled Jacobian, plain smoothing may") {
    Sweeps s(sample("octree-warped", 4, 1, 0.1));
    const std::vector<std::uint8_t> all(s.mesh.cell_count(), 1);
    double least = s.sweeps.find_min_sj();
    for (int sweep = 0; sweep < 5; ++sweep) {
        s.sweeps.smooth(all, true);
        const double now = s.sweeps.find_min_sj();
        CHECK(now >= least - 1e-6);
        least = now;
    }
}

TEST_CASE("the thesis method untangles random tangled meshes, hanging ones too") {
    const char* name =
        GENERATE("grid", "grid-warped", "octree-corner", "octree-sphere", "octree-warped", "octree-halved");
    const auto target = GENERATE(UntangleTarget::extended, UntangleTarget::deepest_point);
    for (std::uint64_t seed : {1, 2}) {
        HexMesh mesh = sample(name, 4, 1, 0.15, seed);
        const HexMesh before = mesh;
        const OptimizeStats stats = run(mesh, thesis(target));
        INFO(name << " seed " << seed);
        CHECK(stats.bad32_before > 3);
        const ValidityCounts counts = compute_validity(mesh, Parallel(1));
        CHECK(counts.concave_cells == stats.bad32_after);
        if (target == UntangleTarget::deepest_point) CHECK(counts.concave_cells == 0);
        CHECK(counts.concave_cells <= stats.bad32_before / 5);
        CHECK(max_hanging_deviation(mesh.hanging, mesh.positions) < 1e-13);
        const Topology topology = compute_topology(mesh);
        for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
            if (topology.on_boundary[v] &&
                (topology.hanging_row.empty() || topology.hanging_row[v] == kNoIndex))
                CHECK(mesh.positions[v] == before.positions[v]);
    }
}

TEST_CASE("every energy and decomposition of the thesis method works on a tangled mesh") {
    const auto energy =
        GENERATE(Energy::structural, Energy::shape, Energy::hyperelastic, Energy::regularised);
    const auto decomposition = GENERATE(Decomposition::corner8, Decomposition::path24, Decomposition::all32);
    HexMesh mesh = sample("grid", 5, 0, 0.2);
    OptimizeOptions options = thesis();
    options.energy = energy;
    options.decomposition = decomposition;
    const OptimizeStats stats = run(mesh, options);
    const ValidityCounts counts = compute_validity(mesh, Parallel(1));
    if (decomposition != Decomposition::path24) CHECK(counts.concave8_cells == 0);
    if (decomposition != Decomposition::corner8) CHECK(counts.concave24_cells == 0);
    CHECK(counts.min_scaled_jacobian > 0.2);
    CHECK(stats.sweeps > 0);
}

TEST_CASE("energies, gradients and targets change what the thesis method does") {
    const auto positions = [](auto change) {
        HexMesh mesh = sample("grid", 4, 0, 0.2);
        OptimizeOptions options = thesis();
        change(options);
        run(mesh, options);
        return mesh.positions;
    };
    const auto usual = positions([](OptimizeOptions&) {});
    CHECK(usual == positions([](OptimizeOptions& o) { o.energy = Energy::structural; }));
    CHECK(usual != positions([](OptimizeOptions& o) { o.energy = Energy::shape; }));
    CHECK(usual != positions([](OptimizeOptions& o) { o.energy = Energy::hyperelastic; }));
    CHECK(usual != positions([](OptimizeOptions& o) { o.gradient = GradientKind::finite_difference; }));
    CHECK(usual != positions([](OptimizeOptions& o) { o.untangle = UntangleTarget::axis; }));
    CHECK(usual != positions([](OptimizeOptions& o) { o.decomposition = Decomposition::corner8; }));
}

TEST_CASE("the thesis method gives the same bits for any number of threads") {
    HexMesh one = sample("octree-warped", 4, 1, 0.2), many = one;
    const auto target = GENERATE(UntangleTarget::extended, UntangleTarget::deepest_point);
    run(one, thesis(target), 1);
    run(many, thesis(target), 4);
    CHECK(std::memcmp(one.positions.data(), many.positions.data(), one.positions.size() * sizeof(Point)) ==
          0);
}

TEST_CASE("combinations of options that mean nothing are refused with the alternative") {
    HexMesh mesh = sample("grid", 3, 0, 0);
    const Topology topology = compute_topology(mesh);
    Context context(1);
    const auto reason = [&](auto change) {
        OptimizeOptions options = thesis();
        change(options);
        const auto result = optimize(mesh, topology, nullptr, options, context);
        if (result) return std::string("accepted");
        CHECK(result.error().code == ErrorCode::usage);
        return result.error().one_line();
    };
    using Catch::Contains;
    CHECK(reason([](OptimizeOptions&) {}) == "accepted");
    CHECK_THAT(reason([](OptimizeOptions& o) { o.max_deviation_rel = 0.01; }), Contains("robust"));
    const auto robust = [&](auto change) {
        return reason([&](OptimizeOptions& o) {
            o.method = OptimizeMethod::robust;
            change(o);
        });
    };
    CHECK_THAT(robust([](OptimizeOptions& o) { o.energy = Energy::structural; }), Contains("thesis"));
    CHECK_THAT(robust([](OptimizeOptions& o) { o.energy = Energy::hyperelastic; }), Contains("thesis"));
    CHECK_THAT(robust([](OptimizeOptions& o) { o.untangle = UntangleTarget::axis; }), Contains("thesis"));
    CHECK_THAT(robust([](OptimizeOptions& o) { o.gradient = GradientKind::finite_difference; }),
               Contains("thesis"));
    CHECK(robust([](OptimizeOptions& o) { o.energy = Energy::shape; }) == "accepted");
    mesh.positions[21] = Point(0.99);
    CHECK_THAT(robust([](OptimizeOptions& o) { o.energy = Energy::shape; }), Contains("regularised"));
    CHECK(robust([](OptimizeOptions& o) { o.energy = Energy::regularised; }) == "accepted");
}

TEST_CASE("the robust method optimizes the decomposition asked for") {
    const auto decomposition = GENERATE(Decomposition::corner8, Decomposition::path24);
    HexMesh mesh = sample("grid", 5, 0, 0.2), all = mesh;
    OptimizeOptions options;
    options.boundary = BoundaryMode::fixed;
    options.max_min = false;
    run(all, options);
    options.decomposition = decomposition;
    run(mesh, options);
    const ValidityCounts counts = compute_validity(mesh, Parallel(1));
    CHECK((decomposition == Decomposition::corner8 ? counts.concave8_cells : counts.concave24_cells) == 0);
    CHECK(mesh.positions != all.positions);
}

TEST_CASE("real meshes: the improved thesis method leaves only what is proved to stay concave", "[slow]") {
    struct Expected {
        const char* name;
        std::size_t bad8, bad32;
    };
    const Expected e = GENERATE(Expected{"ec_block.mesh", 0, 0}, Expected{"ec_block_stress.mesh", 0, 0},
                                Expected{"ec_cap.mesh", 0, 0}, Expected{"ho_lower_arm.vtk", 0, 1},
                                Expected{"ho_lower_arm2.vtk", 0, 0}, Expected{"ho_mid2Fem.vtk", 1, 1},
                                Expected{"ho_mid2Fem2.vtk", 1, 1}, Expected{"ho_mid2FemPer.vtk", 1, 1},
                                Expected{"ho_oct_bunny.vtk", 0, 0}, Expected{"mq_pave3.vtk", 0, 0});
    const std::filesystem::path path = std::filesystem::path(HEXOPT_SHARED_DATA) / "hexmeshes" / e.name;
    if (!std::filesystem::exists(path)) HEXOPT_SKIP("no " + path.string());
    Context context(2);
    auto mesh = read_mesh(path, context);
    REQUIRE(mesh);
    const OptimizeStats stats = run(*mesh, thesis());
    const ValidityCounts counts = compute_validity(*mesh, Parallel(2));
    CHECK(counts.concave8_cells == e.bad8);
    CHECK(counts.concave_cells == e.bad32);
    CHECK(stats.min_bad32 == e.bad32);
}
