#pragma once

#include "core/parallel.hpp"
#include "core/result.hpp"
#include "mesh/hex_mesh.hpp"
#include "mesh/topology.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace hexopt {

/// How the cells of an initial mesh with hanging vertices meet.
struct RootJoints {
    /// Per cell: how many halvings smaller it is than the largest cells that it hangs together with; empty
    /// where nothing hangs.
    std::vector<std::uint8_t> level;

    /// A face that four smaller ones cover.
    struct Face {
        CellFace coarse;
        std::array<CellFace, 4> fine;
        Quad corner, middle; ///< middle[k]: of the edge from corner[k] to corner[(k + 1) % 4]
        Index centre;
    };
    std::vector<Face> faces; ///< in the order of Topology::coarse_faces

    /// An edge with a vertex in its middle; from < to.
    struct Edge {
        Index from, to, middle;
    };
    std::vector<Edge> edges; ///< in the order in which cells list them

    bool empty() const { return level.empty(); }
};

/// Joints of a structurally sound mesh whose hanging vertices are named. Errors (bad_input, with a place): a
/// face cut otherwise than into four, cells more than one halving apart over a face or edge, sizes that
/// cannot be halvings of one another.
Result<RootJoints> find_root_joints(const HexMesh& mesh, const Parallel& parallel);

} // namespace hexopt
