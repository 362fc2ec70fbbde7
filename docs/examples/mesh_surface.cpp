// Meshes the flow round an octahedron in a box, and improves the mesh further.
#include <hexopt/hexopt.hpp>

#include <cstdio>
#include <vector>

int main() {
    const std::vector<double> positions = {1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1};
    const std::vector<std::uint32_t> triangles = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4,
                                                  2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
    const char* const config = R"(
        [farfield]
        box = [-3, -3, -3, 3, 3, 3]
        [refine]
        cells = 3000
    )";
    try {
        hexopt::Optimizer optimizer;
        hexopt::MeshResult made = optimizer.mesh({.positions = positions, .triangles = triangles}, config);
        std::printf("%s: %zu cells, %zu hanging vertices, minimum scaled Jacobian %.3f\n",
                    hexopt_status_name(made.status), made.volume.cells.size() / 8,
                    made.volume.hanging_vertex.size(), made.min_sj);
        for (const std::string& name : made.volume.patch_names) std::printf("patch %s\n", name.c_str());
        hexopt::OptimizeOptions fixed;
        fixed.boundary = HEXOPT_BOUNDARY_FIXED;
        fixed.max_iterations = 20;
        const hexopt::OptimizeResult better = optimizer.optimize(made.volume.mesh(), fixed);
        std::printf("optimized: minimum scaled Jacobian %.3f\n", better.min_sj_after);
        return better.min_sj_after >= better.min_sj_before ? made.status : 1;
    } catch (const hexopt::Failure& failure) {
        std::fprintf(stderr, "%s\n", failure.what());
        return failure.status();
    }
}
