#pragma once

#include "domain/outline_curves.hpp"
#include "mesh/hex_mesh.hpp"

namespace hexopt {

/// A mesh of quadrilaterals in the plane whose boundary lies on outlines.
struct QuadMesh {
    /// Where a vertex is bound to an outline.
    struct Place {
        Index loop = kNoIndex; ///< kNoIndex: it is free
        double s = 0;          ///< arc length along the loop, model units
        bool is_corner = false;
    };
    /// Edge on an outline; the mesh lies on its left.
    struct WallEdge {
        Index a, b, patch;
    };

    std::vector<Point2> positions; ///< model units
    std::vector<Quad> quads;       ///< counter-clockwise
    std::vector<std::uint8_t> level;
    std::vector<double> size; ///< per quad: edge of the quadtree's cell there, model units
    Hanging hanging;
    std::vector<Place> place;   ///< per vertex
    std::vector<WallEdge> wall; ///< loop by loop, in the loop's order
    std::vector<Index> cell;    ///< per quad: the quadtree's cell that it is, or lies beside
};

} // namespace hexopt
