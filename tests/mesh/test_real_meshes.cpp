#include "io/mesh_io.hpp"
#include "mesh/recognise_hanging.hpp"
#include "mesh/validate_structure.hpp"
#include "mesh_oracles.hpp"
#include "support/skip.hpp"

using namespace hexopt;
namespace fs = std::filesystem;

TEST_CASE("the real meshes are conforming: sound, closed and without hanging vertices") {
    const fs::path folder = fs::path(HEXOPT_SHARED_DATA) / "hexmeshes";
    if (!fs::exists(folder)) HEXOPT_SKIP("no shared meshes in " + folder.string());
    std::size_t meshes = 0;
    for (const auto& entry : fs::directory_iterator(folder)) {
        if (entry.path().extension() != ".vtk" && entry.path().extension() != ".mesh") continue;
        ++meshes;
        CAPTURE(entry.path());
        Context context(2);
        const auto mesh = read_mesh(entry.path(), context);
        REQUIRE(mesh);
        const Status sound = require_structure(*mesh, "test", context.parallel());
        if (!sound) FAIL_CHECK(sound.error().one_line());
        const auto found = recognise_hanging(*mesh, {}, context.parallel());
        REQUIRE(found);
        CHECK(found->hanging.empty());
        const Topology topology = compute_topology(*mesh, context.parallel());
        double flux = 0;
        for (CellFace face : topology.boundary_faces) flux += test::flux_through(*mesh, face);
        CHECK(flux == Approx(test::volume_of_cells(*mesh)).epsilon(1e-9));
    }
    CHECK(meshes >= 21);
}
