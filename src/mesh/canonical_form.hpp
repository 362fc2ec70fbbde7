#pragma once

#include "mesh/remap.hpp"
#include "mesh/topology.hpp"

#include <glm/mat3x3.hpp>

namespace hexopt {

/// A frame that moves, turns and scales with a mesh. Places in it are rounded to a grid so much coarser than
/// what a rigid motion or another unit leaves of rounding that this vanishes: a mesh that lies elsewhere has
/// the same numbers to the last bit.
struct CanonicalPose {
    Point centre{0};
    glm::dmat3 turn{1}; ///< to the axes of the grid
    glm::dmat3 box{1};  ///< from these to the tightest box's
    double scale = 1;   ///< of model units; makes the mean squared distance from the centre 1
    double grid = 0;    ///< width, a power of two

    Point place(const Point& x) const;
    /// A displacement in this frame, in model units.
    Point way_back(const Point& step) const;
};

/// A mesh in its canonical pose and numbering: the same, bit for bit, wherever it lies, in whatever unit it
/// is given and however its vertices, its cells and the corners of these are numbered.
struct CanonicalForm {
    CanonicalPose pose;
    HexMesh mesh;
    Remap remap; ///< from the given numbering
};

/// The frame comes from moments of the vertices, weighted by what the cells round each look like, so that
/// most meshes of symmetric shape have one too, where these vanish from a vertex far out; then it is turned
/// to the tightest box round the boundary. Hanging vertices are where their masters put them. O(n log n).
CanonicalForm compute_canonical_form(const HexMesh& mesh, const Topology& topology, const Parallel& parallel);

} // namespace hexopt
