// Real meshes with a fixed boundary, and generated ones with hanging vertices.
#include "io/mesh_io.hpp"
#include "mesh/topology.hpp"
#include "quality/mesh_validity.hpp"
#include "samples/samples.hpp"
#include "stages/optimize/optimize.hpp"
#include "support/skip.hpp"

#include <catch2/catch.hpp>
#include <filesystem>

using namespace hexopt;
namespace fs = std::filesystem;

namespace {

/// What an independent prototype reached with a fixed boundary. The bad counts are the fewest possible: where
/// they are not 0, tetrahedra whose corners all lie on the boundary, or a cone test, prove it.
struct Expected {
    const char* file;
    std::size_t bad8, bad32;
    double min_sj, mean_sj;
};

constexpr Expected kExpected[] = {
    {"ec_block.mesh", 0, 0, 0.19, 0.84},
    {"ec_block_stress.mesh", 0, 0, 0.19, 0.85},
    {"ec_bunny.mesh", 0, 0, 0.56, 0.93},
    {"ec_cap.mesh", 0, 0, 0.04, 0.75},
    {"ec_impeller_stress.mesh", 0, 0, 0.18, 0.92},
    {"ho_impellerPer.vtk", 0, 0, 0.18, 0.92},
    {"ho_bunny.vtk", 44, 66, -0.77, 0.75},
    {"ho_bunnyPer.vtk", 44, 66, -0.77, 0.75},
    {"ho_oct_bunny.vtk", 0, 0, 0.29, 0.86},
    {"ho_oct_grayloc.vtk", 0, 0, 0.24, 0.77},
    {"ho_lower_arm2.vtk", 0, 0, 0.15, 0.59},
    {"ho_lower_arm.vtk", 0, 1, 0.10, 0.67},
    {"ho_lower_armPer.vtk", 0, 1, 0.10, 0.67},
    {"ho_mid2Fem.vtk", 1, 1, -0.06, 0.86},
    {"ho_mid2FemPer.vtk", 1, 1, -0.06, 0.86},
    {"ho_mid2Fem2.vtk", 1, 1, -0.01, 0.75},
    {"mo_fandisk.vtk", 0, 0, 0.41, 0.87},
    {"mq_bias1000.vtk", 0, 0, 1, 1},
    {"mq_hex5.vtk", 0, 0, 1, 1},
    {"mq_pave1.vtk", 0, 0, 0.68, 0.94},
    {"mq_pave3.vtk", 0, 0, 0.35, 0.86},
};

ValidityCounts optimized(HexMesh mesh) {
    Context context(2);
    OptimizeOptions options;
    options.boundary = BoundaryMode::fixed;
    REQUIRE(optimize(mesh, compute_topology(mesh), nullptr, options, context));
    return compute_validity(mesh, context.parallel());
}

} // namespace

TEST_CASE("real meshes reach the fewest bad cells possible with a fixed boundary", "[slow]") {
    const fs::path folder = fs::path(HEXOPT_SHARED_DATA) / "hexmeshes";
    if (!fs::exists(folder)) HEXOPT_SKIP("no shared meshes in " + folder.string());
    for (const Expected& expected : kExpected) {
        CAPTURE(expected.file);
        Context context(2);
        Result<HexMesh> mesh = read_mesh(folder / expected.file, context);
        REQUIRE(mesh);
        const ValidityCounts result = optimized(std::move(*mesh));
        CHECK(result.concave8_cells == expected.bad8);
        CHECK(result.concave_cells == expected.bad32);
        CHECK(result.valid == result.cells - result.invalid);
        CHECK(result.min_scaled_jacobian >= expected.min_sj - 0.02);
        CHECK(result.mean_scaled_jacobian >= expected.mean_sj - 0.02);
        if (expected.bad32 == 0) CHECK(result.is_valid());
    }
}

TEST_CASE("octree meshes with hanging vertices untangle completely", "[slow]") {
    const char* name = GENERATE("octree-corner", "octree-sphere", "octree-warped", "octree-ball",
                                "octree-trimmed", "octree-halved");
    const int levels = GENERATE(2, 3, 4);
    const double tangled = GENERATE(0.01, 0.1, 0.6);
    // The larger meshes take seconds each: one of every kind, with one fraction.
    const std::string_view kind = name;
    if (levels == 3 && kind == "octree-trimmed") return;
    if (levels == 3 && tangled != (kind == "octree-corner" || kind == "octree-ball" ? 0.6 : 0.1)) return;
    if (levels == 4 && (kind != "octree-corner" || tangled == 0.1)) return;
    CAPTURE(name, levels, tangled);
    SampleOptions options;
    options.size = kind == "octree-trimmed" ? 6 : levels == 2 ? 4 : 2; // smaller ones leave no coarse cells
    options.levels = levels;
    options.tangled = tangled;
    Context context(2, 11);
    Result<HexMesh> mesh = make_sample(name, options, context);
    REQUIRE(mesh);
    REQUIRE_FALSE(mesh->hanging.empty());
    CHECK(optimized(std::move(*mesh)).is_valid());
}
