#include "stages/buffer/relax_layers.hpp"

namespace hexopt {

namespace {

constexpr double kStep = 0.7; ///< of the way to the neighbours' mean

class LayerRelaxation {
  public:
    LayerRelaxation(SheetMesh& mesh, std::size_t first_new, int rings, const BoundaryModel& model)
        : mesh_(mesh), model_(model), moves_(mesh.positions.size(), 0) {
        std::fill(moves_.begin() + static_cast<std::ptrdiff_t>(first_new), moves_.end(), 1);
        for (int ring = 0; ring < rings; ++ring) grow();
        mark_hanging();
        for (Index v = 0; v < moves_.size(); ++v)
            if (moves_[v] && mesh.association[v].kind != EntityKind::corner) vertices_.push_back(v);
        find_neighbours();
    }

    void sweep(const Parallel& parallel) {
        std::vector<Point> moved(vertices_.size());
        parallel.for_each(vertices_.size(), 256, [&](std::size_t i) { moved[i] = target_of(i); });
        for (std::size_t i = 0; i < vertices_.size(); ++i) mesh_.positions[vertices_[i]] = moved[i];
        for (const SplitTables::Middle& m : mesh_.splits.middles)
            mesh_.positions[m.vertex] =
                0.5 * (mesh_.positions[low_of(m.edge)] + mesh_.positions[high_of(m.edge)]);
        for (const SplitTables::Centre& c : mesh_.splits.centres) {
            const auto& x = mesh_.positions;
            mesh_.positions[c.vertex] =
                0.25 * (x[c.corners[0]] + x[c.corners[1]] + x[c.corners[2]] + x[c.corners[3]]);
        }
    }

  private:
    void grow() {
        std::vector<std::uint8_t> wider = moves_;
        for (const Cell& cell : mesh_.cells)
            for (const auto& edge : hex::kEdgeVertex)
                if (moves_[cell[edge[0]]] != moves_[cell[edge[1]]])
                    wider[cell[edge[0]]] = wider[cell[edge[1]]] = 1;
        moves_ = std::move(wider);
    }

    void mark_hanging() {
        for (const SplitTables::Middle& m : mesh_.splits.middles) moves_[m.vertex] = 0;
        for (const SplitTables::Centre& c : mesh_.splits.centres) moves_[c.vertex] = 0;
    }

    void find_neighbours() {
        constexpr std::uint8_t kInterior = 0, kSurface = 1, kRidge = 2;
        std::vector<std::uint8_t> kind(mesh_.positions.size(), kInterior);
        for (const SurfaceQuad& quad : mesh_.surface)
            for (Index v : mesh_.vertices_of(quad.face)) kind[v] = kSurface;
        for (Index v = 0; v < kind.size(); ++v)
            if (mesh_.association[v].kind == EntityKind::curve) kind[v] = kRidge;
        std::vector<std::array<Index, 2>> pairs;
        const auto add = [&](Index a, Index b, std::uint8_t wanted) {
            if (moves_[a] && kind[a] == wanted) pairs.push_back({a, b});
            if (moves_[b] && kind[b] == wanted) pairs.push_back({b, a});
        };
        for (const Cell& cell : mesh_.cells)
            for (const auto& edge : hex::kEdgeVertex) add(cell[edge[0]], cell[edge[1]], kInterior);
        for (const SurfaceQuad& quad : mesh_.surface) {
            const Quad q = mesh_.vertices_of(quad.face);
            for (int s = 0; s < 4; ++s) add(q[s], q[(s + 1) % 4], kSurface);
        }
        for (const FittedMesh::RidgeEdge& ridge : mesh_.ridges) add(ridge.a, ridge.b, kRidge);
        std::sort(pairs.begin(), pairs.end());
        pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
        std::size_t next = 0;
        for (Index v : vertices_) {
            while (next < pairs.size() && pairs[next][0] < v) ++next;
            for (; next < pairs.size() && pairs[next][0] == v; ++next)
                neighbour_.item.push_back(pairs[next][1]);
            neighbour_.offset.push_back(neighbour_.item.size());
        }
    }

    Point target_of(std::size_t i) const {
        const Point x = mesh_.positions[vertices_[i]];
        const std::span<const Index> around = neighbour_[i];
        if (around.empty()) return x;
        Point mean(0);
        for (Index v : around) mean += mesh_.positions[v];
        mean /= static_cast<double>(around.size());
        return model_.project(mesh_.association[vertices_[i]], x + kStep * (mean - x)).point;
    }

    SheetMesh& mesh_;
    const BoundaryModel& model_;
    std::vector<std::uint8_t> moves_;
    std::vector<Index> vertices_; ///< that move, rising
    Csr<Index> neighbour_;        ///< of these
};

} // namespace

void relax_layers(SheetMesh& mesh, std::size_t first_new, int sweeps, int rings, const BoundaryModel& model,
                  const Parallel& parallel) {
    if (first_new == mesh.positions.size()) return;
    LayerRelaxation relaxation(mesh, first_new, rings, model);
    for (int k = 0; k < sweeps; ++k) relaxation.sweep(parallel);
}

} // namespace hexopt
