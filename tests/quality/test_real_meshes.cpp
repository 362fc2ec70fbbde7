// Counts on real meshes against those that came with them (measured by an independent program), and Verdict.
#include "io/mesh_io.hpp"
#include "quality/hexes.hpp"
#include "quality/mesh_quality.hpp"
#include "support/skip.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <vtkHexahedron.h>
#include <vtkMeshQuality.h>
#include <vtkNew.h>
#include <vtkPoints.h>

using namespace hexopt;

namespace {

struct Known {
    const char* file;
    std::size_t cells, concave8, concave32;
    double min_sj, mean_sj; ///< two digits
};

constexpr Known kKnown[] = {{"ec_block.mesh", 2520, 31, 32, -.70, .77},
                            {"ec_block_stress.mesh", 2520, 2357, 2447, -1, -.51},
                            {"ec_bunny.mesh", 37734, 1, 97, -.00, .90},
                            {"ec_cap.mesh", 4420, 50, 57, -.85, .74},
                            {"ec_impeller_stress.mesh", 11174, 8854, 9252, -1, -.27},
                            {"ho_impellerPer.vtk", 11174, 9284, 9505, -1, -.33},
                            {"ho_bunny.vtk", 2832, 45, 67, -.77, .75},
                            {"ho_bunnyPer.vtk", 2832, 2707, 2761, -1, -.52},
                            {"ho_oct_bunny.vtk", 4474, 0, 7, 0, .76},
                            {"ho_oct_grayloc.vtk", 10634, 0, 165, 0, .56},
                            {"ho_lower_arm.vtk", 1328, 0, 5, .10, .65},
                            {"ho_lower_arm2.vtk", 2600, 1272, 1277, 0, .33},
                            {"ho_lower_armPer.vtk", 1328, 1187, 1251, -.99, -.46},
                            {"ho_mid2Fem.vtk", 908, 2, 2, -.15, .88},
                            {"ho_mid2Fem2.vtk", 2158, 1252, 1252, -.15, .37},
                            {"ho_mid2FemPer.vtk", 908, 833, 855, -1, -.47},
                            {"mo_fandisk.vtk", 1774, 0, 0, .22, .91},
                            {"mq_bias1000.vtk", 1000, 0, 0, .13, .38},
                            {"mq_hex5.vtk", 125, 36, 52, -.87, .24},
                            {"mq_pave1.vtk", 7110, 56, 65, -.48, .82},
                            {"mq_pave3.vtk", 1791, 106, 131, -.85, .66}};

} // namespace

TEST_CASE("counts on the real meshes are the known ones") {
    const std::filesystem::path folder = std::filesystem::path(HEXOPT_SHARED_DATA) / "hexmeshes";
    if (!std::filesystem::exists(folder)) HEXOPT_SKIP("no shared meshes at " + folder.string());
    Context context(2);
    vtkNew<vtkHexahedron> vtk_cell;
    for (const Known& known : kKnown) {
        INFO(known.file);
        const Result<HexMesh> mesh = read_mesh(folder / known.file, context);
        REQUIRE(mesh);
        const std::vector<CellValidity> cells = compute_cell_validities(*mesh, context.parallel());
        const ValidityCounts counts = count_validity(cells, context.parallel());
        CHECK(counts.cells == known.cells);
        CHECK(counts.concave8_cells == known.concave8);
        CHECK(counts.concave_cells == known.concave32);
        CHECK(counts.min_scaled_jacobian == Approx(known.min_sj).margin(0.0051));
        CHECK(counts.mean_scaled_jacobian == Approx(known.mean_sj).margin(0.0051));
        std::size_t lower = 0;
        for (std::size_t c = 0; c < cells.size(); ++c) {
            const HexPoints p = cell_points(*mesh, c);
            for (int k = 0; k < 8; ++k) vtk_cell->GetPoints()->SetPoint(k, p[k].x, p[k].y, p[k].z);
            // Verdict's ninth sample, in the centre, can only lower its figure, which is 1e30 for zero edges.
            const double verdict = vtkMeshQuality::HexScaledJacobian(vtk_cell);
            REQUIRE((verdict <= cells[c].scaled_jacobian + 1e-9 ||
                     (verdict == 1e30 && cells[c].scaled_jacobian <= 0)));
            lower += verdict < cells[c].scaled_jacobian - 1e-9;
            // Where the trilinear map is certified, no determinant of a corner may be negative.
            if (cells[c].validity == Validity::valid) REQUIRE(cells[c].concave8 == 0);
        }
        CHECK(lower < cells.size() / 2); // most cells are worst at a corner
    }
}
