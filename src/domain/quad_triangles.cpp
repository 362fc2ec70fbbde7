#include "domain/boundary_model_builder.hpp"
#include "domain/boundary_polygons.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

/// Inner vertex of a quad at (u, v) of its bilinear patch, or the corner itself.
class QuadVertices {
  public:
    QuadVertices(const Quad& quad, BoundaryModelParts& parts) : quad_(quad), parts_(parts) {}

    Index at_corner(int k) const { return quad_[k]; }

    Index add(double u, double v) {
        const std::array<double, 4> w = {(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v};
        const auto& x = parts_.vertices;
        // Opposite corners are added first: the same bits wherever the quad's list of vertices starts, and on
        // an edge from either side.
        const Point p = (w[0] * x[quad_[0]] + w[2] * x[quad_[2]]) + (w[1] * x[quad_[1]] + w[3] * x[quad_[3]]);
        parts_.vertices.push_back(p);
        if (parts_.smooth) parts_.inside.push_back({quad_, w});
        return static_cast<Index>(parts_.vertices.size() - 1);
    }

  private:
    Quad quad_;
    BoundaryModelParts& parts_;
};

void add_quad(const Quad& quad, SourceFace source, int cuts, BoundaryModelParts& parts) {
    QuadVertices vertices(quad, parts);
    std::vector<Index> lattice;
    for (int j = 0; j <= cuts; ++j)
        for (int i = 0; i <= cuts; ++i) {
            const bool corner = i % cuts == 0 && j % cuts == 0;
            const int k = j == 0 ? (i == 0 ? 0 : 1) : (i == 0 ? 3 : 2);
            lattice.push_back(corner ? vertices.at_corner(k)
                                     : vertices.add(double(i) / cuts, double(j) / cuts));
        }
    for (int j = 0; j < cuts; ++j)
        for (int i = 0; i < cuts; ++i) {
            const Index* low = &lattice[static_cast<std::size_t>(j * (cuts + 1) + i)];
            const Quad piece = {low[0], low[1], low[cuts + 2], low[cuts + 1]};
            const Index centre = vertices.add((i + 0.5) / cuts, (j + 0.5) / cuts);
            for (int k = 0; k < 4; ++k) {
                parts.triangles.push_back({piece[k], piece[(k + 1) % 4], centre});
                parts.source.push_back(source);
            }
        }
}

/// Between a bilinear patch and four triangles round its centre there is at most an eighth of the height
/// between the midpoints of its diagonals, which is a quarter as large in each part of a patch cut two by
/// two.
double compute_gap(const std::vector<Point>& x, const Quad& quad) {
    const Point apart = 0.5 * ((x[quad[0]] + x[quad[2]]) - (x[quad[1]] + x[quad[3]]));
    const Point area = glm::cross(x[quad[2]] - x[quad[0]], x[quad[3]] - x[quad[1]]);
    const double length = glm::length(area);
    return (length > 0 ? std::abs(glm::dot(apart, area)) / length : glm::length(apart)) / 8;
}

int choose_cuts(double gap, double tolerance) {
    int cuts = 1;
    while (cuts < kMaxCuts && gap > tolerance * cuts * cuts) cuts *= 2;
    return cuts;
}

} // namespace

double add_quads(std::span<const Quad> quads, double tolerance, BoundaryModelParts& parts) {
    parts.vertices.reserve(parts.vertices.size() + quads.size());
    if (parts.smooth) parts.inside.reserve(parts.inside.size() + quads.size());
    parts.triangles.reserve(parts.triangles.size() + 4 * quads.size());
    parts.source.reserve(parts.source.size() + 4 * quads.size());
    double largest = 0;
    for (Index q = 0; q < quads.size(); ++q) {
        const double gap = compute_gap(parts.vertices, quads[q]);
        const int cuts = choose_cuts(gap, tolerance);
        largest = std::max(largest, gap / (cuts * cuts));
        add_quad(quads[q], q, cuts, parts);
    }
    return largest;
}

double compute_diagonal(const std::vector<Point>& positions, std::span<const Quad> quads) {
    Box box;
    for (const Quad& quad : quads)
        for (Index v : quad) box.add(positions[v]);
    return quads.empty() ? 0 : glm::length(box.high - box.low);
}

TriangleSoup boundary_soup(const HexMesh& mesh, const Topology& topology) {
    const std::vector<Quad> quads = boundary_quads(mesh, topology);
    const double tolerance = kQuadTolerance_rel * compute_diagonal(mesh.positions, quads);
    double gap = 0;
    for (const Quad& quad : quads) gap = std::max(gap, compute_gap(mesh.positions, quad));
    BoundaryModelParts parts;
    parts.vertices = mesh.positions;
    for (Index q = 0; q < quads.size(); ++q) add_quad(quads[q], q, choose_cuts(gap, tolerance), parts);

    TriangleSoup soup;
    soup.patch_names = mesh.patch_names;
    const std::vector<Index> patch = find_named_patches(mesh, quads);
    const auto unnamed = static_cast<Index>(soup.patch_names.size());
    if (std::find(patch.begin(), patch.end(), kNoIndex) != patch.end())
        soup.patch_names.push_back("boundary");
    for (SourceFace q : parts.source) soup.patch.push_back(patch[q] == kNoIndex ? unnamed : patch[q]);
    std::vector<Index> old2new(parts.vertices.size(), kNoIndex);
    soup.triangles = std::move(parts.triangles);
    for (auto& triangle : soup.triangles)
        for (Index& v : triangle) {
            if (old2new[v] == kNoIndex) {
                old2new[v] = static_cast<Index>(soup.vertices.size());
                soup.vertices.push_back(parts.vertices[v]);
            }
            v = old2new[v];
        }
    return soup;
}

} // namespace hexopt
