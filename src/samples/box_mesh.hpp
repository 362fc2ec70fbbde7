#pragma once

#include "core/result.hpp"
#include "mesh/hex_mesh.hpp"

#include <array>
#include <functional>
#include <vector>

namespace hexopt {

/// An axis-parallel box of an integer lattice; one becomes one cell.
struct LatticeBox {
    std::array<std::uint32_t, 3> low;  ///< lattice units, < 2^21
    std::array<std::uint32_t, 3> size; ///< lattice units, powers of two
    std::uint8_t level;
};

/// Boxes of a forest of octrees: refined where asked for, balanced 2:1 over faces, edges and corners.
struct OctreeOptions {
    std::array<std::uint32_t, 3> roots = {4, 4, 4}; ///< cells of level 0 along each axis; >= 1
    int levels = 2;                                 ///< deepest level; 0..8
    /// True if the box [low, high], in units of level-0 cells, should be refined further.
    std::function<bool(Point low, Point high)> refine;
    std::function<bool(Point low, Point high)> keep; ///< boxes for which it says no are left out; empty: all
    std::function<bool(Point low, Point high)>
        halve_x; ///< leaves for which it says yes are cut in two along x
};

/// Lattice units in a level-0 cell for the given deepest level.
constexpr std::uint32_t lattice_units(int levels) { return 1u << (levels + 1); }

/// Leaves of the balanced forest in Morton order. Source: thesis 2.3 for the balance.
std::vector<LatticeBox> make_octree_boxes(const OctreeOptions& options);

/// Mesh of boxes that tile a region such that touching faces and edges contain one another: a vertex inside
/// another box's edge or face hangs on that edge's or face's corners with (bi)linear weights, closed.
/// Positions are lattice coordinates divided by `units`. Error (bad_input) if constraints go round in a
/// circle, i.e. the boxes do not nest.
Result<HexMesh> make_box_mesh(const std::vector<LatticeBox>& boxes, std::uint32_t units);

} // namespace hexopt
