#include "mesh/renumber.hpp"

#include "core/morton.hpp"

#include <glm/common.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace hexopt {

namespace {

/// Remap of cells in a new order and vertices by first use.
Remap remap_of(const HexMesh& mesh, const std::vector<Index>& cell_new2old) {
    Remap remap;
    remap.vertex_count = mesh.vertex_count();
    remap.cell_count = mesh.cell_count();
    remap.cell_old2new = invert_order(cell_new2old, mesh.cell_count());
    remap.vertex_old2new.assign(mesh.vertex_count(), kNoIndex);
    Index next = 0;
    for (Index c : cell_new2old)
        for (Index v : mesh.cells[c])
            if (remap.vertex_old2new[v] == kNoIndex) remap.vertex_old2new[v] = next++;
    for (Index& v : remap.vertex_old2new)
        if (v == kNoIndex) v = next++;
    return remap;
}

Point centre_of(const HexMesh& mesh, const Cell& cell) {
    Point sum(0);
    for (Index v : cell) sum += mesh.positions[v];
    return sum / 8.0;
}

/// Cells numbered breadth first; each start is the last cell reached from the previous guess.
class BreadthFirst {
  public:
    BreadthFirst(const HexMesh& mesh, const Topology& topology)
        : mesh_(mesh), topology_(topology), seen_(mesh.cell_count(), 0), has_order_(mesh.cell_count(), 0) {}

    std::vector<Index> order_all() {
        std::vector<Index> order;
        order.reserve(mesh_.cell_count());
        std::vector<Index> reached;
        for (Index c = 0; c < mesh_.cell_count(); ++c) {
            if (has_order_[c]) continue;
            search(c, reached); // the far end of the part makes for thin layers
            search(reached.back(), reached);
            for (Index cell : reached) has_order_[cell] = 1;
            order.insert(order.end(), reached.begin(), reached.end());
        }
        std::reverse(order.begin(), order.end());
        return order;
    }

  private:
    void search(Index start, std::vector<Index>& reached) {
        ++round_;
        reached.assign(1, start);
        seen_[start] = round_;
        for (std::size_t i = 0; i < reached.size(); ++i) {
            const std::size_t first = reached.size();
            for (Index v : mesh_.cells[reached[i]])
                for (CellCorner at : topology_.vertex_cell[v])
                    if (seen_[at.cell] != round_) {
                        seen_[at.cell] = round_;
                        reached.push_back(at.cell);
                    }
            std::sort(
                reached.begin() + static_cast<std::ptrdiff_t>(first), reached.end(),
                [&](Index a, Index b) { return degree(a) != degree(b) ? degree(a) < degree(b) : a < b; });
        }
    }

    std::size_t degree(Index cell) const {
        std::size_t sum = 0;
        for (Index v : mesh_.cells[cell]) sum += topology_.vertex_cell[v].size();
        return sum;
    }

    const HexMesh& mesh_;
    const Topology& topology_;
    std::vector<Index> seen_; ///< round in which a cell was reached last
    std::vector<std::uint8_t> has_order_;
    Index round_ = 0;
};

} // namespace

Remap compute_spatial_order(const HexMesh& mesh) {
    Point low(HUGE_VAL), high(-HUGE_VAL);
    for (const Cell& cell : mesh.cells) {
        const Point p = centre_of(mesh, cell);
        low = glm::min(low, p), high = glm::max(high, p);
    }
    const Point size = high - low;
    const double scale = 2097151.0 / std::max({size.x, size.y, size.z, 1e-300});
    std::vector<std::pair<std::uint64_t, Index>> keyed(mesh.cell_count());
    for (Index c = 0; c < mesh.cell_count(); ++c) {
        const Point p = (centre_of(mesh, mesh.cells[c]) - low) * scale;
        keyed[c] = {morton_code(static_cast<std::uint64_t>(p.x), static_cast<std::uint64_t>(p.y),
                                static_cast<std::uint64_t>(p.z)),
                    c};
    }
    std::sort(keyed.begin(), keyed.end());
    std::vector<Index> order(mesh.cell_count());
    std::transform(keyed.begin(), keyed.end(), order.begin(), [](const auto& k) { return k.second; });
    return remap_of(mesh, order);
}

Remap compute_bandwidth_order(const HexMesh& mesh, const Topology& topology) {
    assert(topology.revision == mesh.revision);
    return remap_of(mesh, BreadthFirst(mesh, topology).order_all());
}

Remap compute_colour_order(const HexMesh& mesh, const Colouring& colouring) {
    assert(colouring.revision == mesh.revision);
    Remap remap = identity_remap(mesh);
    std::vector<Index> order = colouring.vertices.item;
    for (Index v = 0; v < mesh.vertex_count(); ++v)
        if (colouring.colour[v] == kNoColour) order.push_back(v);
    remap.vertex_old2new = invert_order(order, mesh.vertex_count());
    return remap;
}

} // namespace hexopt
