#include "io/read_surface.hpp"
#include "mesh/topology.hpp"
#include "mesh/validate_structure.hpp"
#include "stages/refine/refine.hpp"
#include "support/skip.hpp"
#include "surfaces.hpp"

#include <filesystem>
#include <glm/geometric.hpp>

using namespace hexopt;

TEST_CASE("real models are adapted by default: sound, closed, of a sensible size") {
    const std::filesystem::path folder = std::filesystem::path(HEXOPT_SHARED_DATA) / "geometry";
    for (const char* name : {"three_pipe_joint.stl", "knife_fan.stl", "ahmed_25_domain.stl"}) {
        if (!std::filesystem::exists(folder / name)) HEXOPT_SKIP("no shared geometry " + std::string(name));
        CAPTURE(name);
        Context context(2);
        const auto soup = read_surface(folder / name, context);
        REQUIRE(soup.has_value());
        const Domain domain = test::make_domain(*soup);
        RefineOptions options;
        options.target_cells = 20e3;
        const auto out = refine(domain, options, context);
        REQUIRE(out.has_value());
        const HexMesh& mesh = out->octree;
        for (const Violation& violation : validate_structure(mesh, Parallel(2))) FAIL(violation.one_line());
        REQUIRE(mesh.cell_count() > 10e3);
        REQUIRE(mesh.cell_count() < 120e3);
        REQUIRE_FALSE(out->stats.budget_hit());
        // What is left of the faces used once, after those between levels, is the outside of the box.
        Box box;
        for (const Point& p : mesh.positions) box.add(p);
        double area = 0;
        for (CellFace face : compute_topology(mesh).boundary_faces) {
            const Quad q = face_vertices(mesh, face);
            area += glm::length(glm::cross(mesh.positions[q[2]] - mesh.positions[q[0]],
                                           mesh.positions[q[3]] - mesh.positions[q[1]])) /
                    2;
        }
        const Point e = box.high - box.low;
        REQUIRE(area == Approx(2 * (e.x * e.y + e.y * e.z + e.z * e.x)));
        for (Index t = 0; t < domain.model.triangle_count(); ++t)
            for (const Point& p : domain.model.triangle(t))
                for (int d = 0; d < 3; ++d) REQUIRE((p[d] > box.low[d] && p[d] < box.high[d]));
    }
}
