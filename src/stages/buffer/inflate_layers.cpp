#include "stages/buffer/inflate_layers.hpp"

#include "core/csr.hpp"
#include "mesh/hanging.hpp"
#include "mesh/hex_reference.hpp"

#include <algorithm>
#include <glm/geometric.hpp>
#include <numeric>

namespace hexopt {

namespace {

constexpr std::size_t kChunk = 512;
using Pair = std::array<Index, 2>;

/// Neighbours of every vertex by the given edges, both ways.
Csr<Index> make_neighbours(std::vector<Pair> edges, std::size_t vertex_count) {
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    Csr<Index> csr;
    csr.offset.assign(vertex_count + 1, 0);
    for (const Pair& e : edges)
        for (Index v : e) ++csr.offset[v + 1];
    std::partial_sum(csr.offset.begin(), csr.offset.end(), csr.offset.begin());
    csr.item.resize(csr.offset.back());
    std::vector<std::size_t> next(csr.offset.begin(), csr.offset.end() - 1);
    for (const auto& [a, b] : edges) {
        csr.item[next[a]++] = b;
        csr.item[next[b]++] = a;
    }
    return csr;
}

Pair ordered(Index a, Index b) { return a < b ? Pair{a, b} : Pair{b, a}; }

class Inflation {
  public:
    Inflation(FittedMesh& fitted, const Domain& domain, const InflateOptions& options, Context& context)
        : fitted_(fitted), mesh_(fitted.mesh), domain_(domain), options_(options), context_(context) {}

    Status run() {
        find_surface_neighbours();
        find_layers();
        for (int sweep = 0; sweep < options_.surface_sweeps; ++sweep) {
            if (context_.is_cancelled()) return cancelled();
            sweep_surface();
        }
        for (int sweep = 0; sweep < options_.volume_sweeps; ++sweep) {
            if (context_.is_cancelled()) return cancelled();
            sweep_volume();
        }
        return Done{};
    }

  private:
    static Error cancelled() { return make_error(ErrorCode::cancelled, "buffer", "", "cancelled"); }

    /// On a curve the neighbours along it, elsewhere on the boundary all of the surface.
    void find_surface_neighbours() {
        std::vector<Pair> edges, ridges;
        for (const BoundaryQuad& quad : mesh_.boundary)
            for (int k = 0; k < 4; ++k)
                edges.push_back(ordered(quad.vertices[k], quad.vertices[(k + 1) % 4]));
        for (const FittedMesh::RidgeEdge& ridge : fitted_.ridges) ridges.push_back(ordered(ridge.a, ridge.b));
        on_surface_ = make_neighbours(std::move(edges), mesh_.vertex_count());
        along_ridge_ = make_neighbours(std::move(ridges), mesh_.vertex_count());
        for (Index v = 0; v < mesh_.vertex_count(); ++v) {
            const EntityKind kind = fitted_.association[v].kind;
            if (kind == EntityKind::patch || kind == EntityKind::curve) sliding_.push_back(v);
        }
    }

    void find_layers() {
        std::vector<std::uint8_t> reached(mesh_.vertex_count(), 0);
        for (const BoundaryQuad& quad : mesh_.boundary)
            for (Index v : quad.vertices) reached[v] = 1;
        std::vector<std::uint8_t> near(mesh_.cell_count(), 0);
        for (int ring = 0; ring < options_.rings; ++ring) {
            std::vector<Index> found;
            for (Index c = 0; c < mesh_.cell_count(); ++c) {
                const Cell& cell = mesh_.cells[c];
                if (!near[c] && std::any_of(cell.begin(), cell.end(), [&](Index v) { return reached[v]; }))
                    found.push_back(c);
            }
            for (Index c : found) {
                near[c] = 1;
                for (Index v : mesh_.cells[c]) reached[v] = 1;
            }
        }
        std::vector<Pair> edges;
        for (Index c = 0; c < mesh_.cell_count(); ++c)
            if (std::any_of(mesh_.cells[c].begin(), mesh_.cells[c].end(),
                            [&](Index v) { return reached[v]; }))
                for (const auto& e : hex::kEdgeVertex)
                    edges.push_back(ordered(mesh_.cells[c][e[0]], mesh_.cells[c][e[1]]));
        in_volume_ = make_neighbours(std::move(edges), mesh_.vertex_count());
        for (Index v = 0; v < mesh_.vertex_count(); ++v)
            if (reached[v] && fitted_.association[v].kind == EntityKind::interior) inner_.push_back(v);
    }

    Point mean(std::span<const Index> neighbours) const {
        Point sum(0);
        for (Index u : neighbours) sum += mesh_.positions[u];
        return sum / static_cast<double>(neighbours.size());
    }

    /// Moves the vertices to target(v, i) all at once; i: place in the list.
    template <class Target>
    void move(const std::vector<Index>& vertices, const Target& target) {
        std::vector<Point> moved(vertices.size());
        context_.parallel().for_each(vertices.size(), kChunk,
                                     [&](std::size_t i) { moved[i] = target(vertices[i], i); });
        for (std::size_t i = 0; i < vertices.size(); ++i) mesh_.positions[vertices[i]] = moved[i];
        apply_hanging(mesh_, context_.parallel());
    }

    void sweep_surface() {
        hint_.resize(sliding_.size(), kNoIndex);
        move(sliding_, [&](Index v, std::size_t i) {
            const bool curve = fitted_.association[v].kind == EntityKind::curve;
            const std::span<const Index> neighbours = (curve ? along_ridge_ : on_surface_)[v];
            if (neighbours.empty()) return mesh_.positions[v];
            const Point wanted = 0.5 * (mesh_.positions[v] + mean(neighbours));
            const Projection at = domain_.model.project(fitted_.association[v], wanted, hint_[i]);
            hint_[i] = at.element;
            return at.point;
        });
    }

    void sweep_volume() {
        move(inner_,
             [&](Index v, std::size_t) { return 0.4 * mesh_.positions[v] + 0.6 * mean(in_volume_[v]); });
    }

    FittedMesh& fitted_;
    HexMesh& mesh_;
    const Domain& domain_;
    const InflateOptions& options_;
    Context& context_;
    Csr<Index> on_surface_, along_ridge_, in_volume_;
    std::vector<Index> sliding_, inner_;
    std::vector<Index> hint_; ///< per sliding vertex
};

} // namespace

Status inflate_layers(FittedMesh& fitted, const Domain& domain, const InflateOptions& options,
                      Context& context) {
    return Inflation(fitted, domain, options, context).run();
}

} // namespace hexopt
