#include "stages/planar/quad_quality.hpp"

#include <algorithm>
#include <glm/geometric.hpp>

namespace hexopt {

double quad_scaled_jacobian(const QuadMesh& mesh, std::size_t quad) {
    const Quad& q = mesh.quads[quad];
    double least = 1;
    for (int k = 0; k < 4; ++k) {
        const Point2 p = mesh.positions[q[k]];
        const Point2 e = mesh.positions[q[(k + 1) % 4]] - p, f = mesh.positions[q[(k + 3) % 4]] - p;
        const double lengths = glm::length(e) * glm::length(f);
        least = std::min(least, lengths > 0 ? (e.x * f.y - e.y * f.x) / lengths : -1);
    }
    return least;
}

QuadQuality measure_quads(const QuadMesh& mesh, const Parallel& parallel) {
    return parallel.reduce<QuadQuality>(
        mesh.quads.size(), 1024, {},
        [&](std::size_t begin, std::size_t end) {
            QuadQuality part;
            for (std::size_t i = begin; i < end; ++i) {
                const double sj = quad_scaled_jacobian(mesh, i);
                part.smallest = std::min(part.smallest, sj);
                part.inverted += sj <= 0;
            }
            return part;
        },
        [](const QuadQuality& a, const QuadQuality& b) {
            return QuadQuality{std::min(a.smallest, b.smallest), a.inverted + b.inverted};
        });
}

} // namespace hexopt
