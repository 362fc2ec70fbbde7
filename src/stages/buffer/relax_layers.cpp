#include "stages/buffer/relax_layers.hpp"

#include "quality/cell_quality.hpp"

#include <bit>

namespace hexopt {

namespace {

constexpr double kStep = 0.7;          ///< of the way to the neighbours' mean
constexpr double kEnough = 0.3;        ///< scaled Jacobian down to which cells may get worse
constexpr int kMostColours = 64;       ///< a vertex that finds none free stays
constexpr std::size_t kMostCells = 32; ///< at a vertex whose measures are kept while it is tried

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
        find_cells();
        find_colours();
        find_hanging_cells();
        jacobian_.resize(mesh.cells.size());
        hint_.assign(vertices_.size(), kNoIndex);
    }

    void run(int sweeps, const Parallel& parallel) {
        parallel.for_each(mesh_.cells.size(), 1024, [&](std::size_t c) {
            const Cell& cell = mesh_.cells[c];
            if (std::any_of(cell.begin(), cell.end(), [&](Index v) { return place_[v] != kNoIndex; }))
                jacobian_[c] = jacobian_of(static_cast<Index>(c));
        });
        for (int k = 0; k < sweeps; ++k) sweep(parallel);
    }

  private:
    /// Colour by colour: vertices of one share no cell.
    void sweep(const Parallel& parallel) {
        for (const std::vector<Index>& colour : colours_)
            parallel.for_each(colour.size(), 256, [&](std::size_t k) { try_move(colour[k]); });
        for (const SplitTables::Middle& m : mesh_.splits.middles)
            mesh_.positions[m.vertex] =
                0.5 * (mesh_.positions[low_of(m.edge)] + mesh_.positions[high_of(m.edge)]);
        for (const SplitTables::Centre& c : mesh_.splits.centres) {
            const auto& x = mesh_.positions;
            mesh_.positions[c.vertex] =
                0.25 * (x[c.corners[0]] + x[c.corners[1]] + x[c.corners[2]] + x[c.corners[3]]);
        }
        parallel.for_each(hanging_cells_.size(), 256, [&](std::size_t k) {
            jacobian_[hanging_cells_[k]] = jacobian_of(hanging_cells_[k]);
        });
    }

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

    void find_cells() {
        place_.assign(mesh_.positions.size(), kNoIndex);
        for (Index i = 0; i < vertices_.size(); ++i) place_[vertices_[i]] = i;
        cells_.offset.assign(vertices_.size() + 1, 0);
        const auto each = [&](const auto& visit) {
            for (Index c = static_cast<Index>(mesh_.cells.size()); c-- > 0;)
                for (Index v : mesh_.cells[c])
                    if (place_[v] != kNoIndex) visit(place_[v], c);
        };
        each([&](Index i, Index) { ++cells_.offset[i]; });
        std::size_t end = 0;
        for (std::size_t& offset : cells_.offset) offset = end += offset;
        cells_.item.resize(end);
        each([&](Index i, Index c) { cells_.item[--cells_.offset[i]] = c; });
    }

    void find_colours() {
        std::vector<std::uint8_t> colour(vertices_.size(), kMostColours);
        for (Index i = 0; i < vertices_.size(); ++i) {
            std::uint64_t taken = 0;
            for (Index c : cells_[i])
                for (Index v : mesh_.cells[c])
                    if (place_[v] != kNoIndex && colour[place_[v]] < kMostColours)
                        taken |= std::uint64_t{1} << colour[place_[v]];
            const int free = std::countr_one(taken);
            colour[i] = static_cast<std::uint8_t>(free);
            if (free == kMostColours) continue;
            if (static_cast<std::size_t>(free) >= colours_.size())
                colours_.resize(static_cast<std::size_t>(free) + 1);
            colours_[static_cast<std::size_t>(free)].push_back(i);
        }
    }

    /// Cells whose hanging vertices follow others.
    void find_hanging_cells() {
        std::vector<std::uint8_t> hangs(mesh_.positions.size(), 0);
        for (const SplitTables::Middle& m : mesh_.splits.middles) hangs[m.vertex] = 1;
        for (const SplitTables::Centre& c : mesh_.splits.centres) hangs[c.vertex] = 1;
        for (Index c = 0; c < mesh_.cells.size(); ++c) {
            const Cell& cell = mesh_.cells[c];
            if (std::any_of(cell.begin(), cell.end(), [&](Index v) { return hangs[v] != 0; }) &&
                std::any_of(cell.begin(), cell.end(), [&](Index v) { return place_[v] != kNoIndex; }))
                hanging_cells_.push_back(c);
        }
    }

    double jacobian_of(Index c) const {
        HexPoints points;
        for (int k = 0; k < 8; ++k) points[k] = mesh_.positions[mesh_.cells[c][k]];
        return scaled_jacobian(points);
    }

    /// Moves a vertex unless that makes a cell worse that is not good enough.
    void try_move(Index i) {
        const std::span<const Index> around = neighbour_[i];
        if (around.empty()) return;
        Point& x = mesh_.positions[vertices_[i]];
        const Point old = x;
        Point mean(0);
        for (Index v : around) mean += mesh_.positions[v];
        mean /= static_cast<double>(around.size());
        double before = kEnough;
        for (Index c : cells_[i]) before = std::min(before, jacobian_[c]);
        const Projection on =
            model_.project(mesh_.association[vertices_[i]], old + kStep * (mean - old), hint_[i]);
        hint_[i] = on.element;
        x = on.point;
        std::array<double, kMostCells> after;
        const std::span<const Index> cells = cells_[i];
        for (std::size_t k = 0; k < cells.size(); ++k) {
            const double jacobian = jacobian_of(cells[k]);
            if (jacobian < before) {
                x = old;
                return;
            }
            if (k < kMostCells) after[k] = jacobian;
        }
        for (std::size_t k = 0; k < cells.size(); ++k)
            jacobian_[cells[k]] = k < kMostCells ? after[k] : jacobian_of(cells[k]);
    }

    SheetMesh& mesh_;
    const BoundaryModel& model_;
    std::vector<std::uint8_t> moves_;
    std::vector<Index> vertices_;             ///< that move, rising
    Csr<Index> neighbour_;                    ///< of these
    Csr<Index> cells_;                        ///< at these
    std::vector<Index> place_;                ///< per vertex of the mesh: in vertices_
    std::vector<Index> hanging_cells_;        ///< with hanging vertices, at these
    std::vector<double> jacobian_;            ///< per cell of the mesh at these: its scaled Jacobian
    std::vector<Index> hint_;                 ///< per vertex that moves: what it was projected on last
    std::vector<std::vector<Index>> colours_; ///< places of vertices that share no cell
};

} // namespace

void relax_layers(SheetMesh& mesh, std::size_t first_new, int sweeps, int rings, const BoundaryModel& model,
                  const Parallel& parallel) {
    if (first_new == mesh.positions.size() || sweeps == 0) return;
    LayerRelaxation(mesh, first_new, rings, model).run(sweeps, parallel);
}

} // namespace hexopt
