#include "stages/fit/fairing.hpp"

#include <glm/geometric.hpp>

namespace hexopt::fit {

namespace {

constexpr std::size_t kChunk = 1024;

Point neighbour_mean(const SurfaceMesh& surface, const std::vector<Point>& x, Index v) {
    Point sum(0);
    for (Index e : surface.vertex_edge[v]) sum += x[surface.other_end(e, v)];
    return sum / static_cast<double>(surface.vertex_edge[v].size());
}

void laplacian_step(const HexMesh& mesh, const SurfaceMesh& surface, double factor, std::vector<Point>& x,
                    const Context& context) {
    std::vector<Point> moved(x.size());
    context.parallel().for_each(x.size(), kChunk, [&](std::size_t i) {
        const auto v = static_cast<Index>(i);
        moved[v] = surface.hanging[v] ? x[v] : x[v] + factor * (neighbour_mean(surface, x, v) - x[v]);
    });
    x.swap(moved);
    place_hanging(mesh, surface, x);
}

/// Half a step towards the surface from between the vertex and its neighbours' mean.
void projection_step(const HexMesh& mesh, const SurfaceMesh& surface, const Domain& domain,
                     std::vector<Point>& x, std::vector<Index>& hint, const Context& context) {
    const std::vector<Point> normal = vertex_normals(surface, x);
    std::vector<Point> moved(x.size());
    context.parallel().for_each(x.size(), kChunk, [&](std::size_t i) {
        const auto v = static_cast<Index>(i);
        moved[v] = x[v];
        if (surface.hanging[v]) return;
        const Point start = 0.5 * (x[v] + neighbour_mean(surface, x, v));
        const Projection at = domain.model.project_patch(kNoIndex, start, hint[v]);
        hint[v] = at.element;
        const double shift = glm::distance(at.point, x[v]);
        const bool accept = glm::dot(at.smooth_direction, normal[v]) > 0 || shift < 0.2 * surface.size[v];
        moved[v] = accept ? 0.5 * (x[v] + at.point) : start;
    });
    x.swap(moved);
    place_hanging(mesh, surface, x);
}

} // namespace

std::vector<Point> vertex_normals(const SurfaceMesh& surface, const std::vector<Point>& x) {
    std::vector<Point> normal(surface.vertex.size(), Point(0));
    for (const Quad& q : surface.quad) {
        const Point n = glm::cross(x[q[2]] - x[q[0]], x[q[3]] - x[q[1]]);
        for (Index v : q) normal[v] += n;
    }
    for (Point& n : normal) {
        const double length = glm::length(n);
        if (length > 0) n /= length;
    }
    return normal;
}

void place_hanging(const HexMesh& mesh, const SurfaceMesh& surface, std::vector<Point>& x) {
    const Hanging& hanging = mesh.hanging;
    for (std::size_t r = 0; r < hanging.count(); ++r) {
        const Index v = surface.local[hanging.vertex[r]];
        if (v == kNoIndex) continue;
        Point sum(0);
        bool complete = true;
        for (std::size_t k = hanging.offset[r]; k < hanging.offset[r + 1]; ++k) {
            const Index master = surface.local[hanging.master[k]];
            if (master == kNoIndex)
                complete = false;
            else
                sum += hanging.weight[k] * x[master];
        }
        if (complete) x[v] = sum;
    }
}

std::vector<Point> fair_and_project(const HexMesh& mesh, const SurfaceMesh& surface, const Domain& domain,
                                    const FairingOptions& options, const Context& context) {
    std::vector<Point> x(surface.vertex.size());
    for (Index v = 0; v < x.size(); ++v) x[v] = mesh.positions[surface.vertex[v]];
    for (int step = 0; step < options.taubin_steps; ++step) {
        laplacian_step(mesh, surface, options.lambda, x, context);
        laplacian_step(mesh, surface, options.mu, x, context);
    }
    std::vector<Index> hint(x.size(), kNoIndex);
    for (int step = 0; step < options.projection_steps; ++step)
        projection_step(mesh, surface, domain, x, hint, context);
    return x;
}

} // namespace hexopt::fit
