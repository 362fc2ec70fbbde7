#pragma once

#include "core/parallel.hpp"
#include "core/result.hpp"
#include "mesh/hex_mesh.hpp"

namespace hexopt {

/// How far a vertex may be from where a split would put it and still be recognised.
struct RecogniseOptions {
    /// Splits in two, over several levels, and of single edges: distance from the middle as a fraction of the
    /// edge's length, 0..0.2. They are only recognised where the vertex ids fit too.
    double tolerance_rel = 0.05;
    /// Splits of a face in four, which vertex ids alone all but prove: fraction of the face's mean edge,
    /// 0..0.5.
    double split4_tolerance_rel = 0.35;
};

struct RecognisedHanging {
    Hanging hanging;                   ///< closed
    std::size_t coarse_face_count = 0; ///< faces found to be covered by smaller ones
    std::size_t single_edge_count = 0; ///< vertices in the middle of an edge of no such face
    std::size_t conflict_count = 0;    ///< vertices that two splits put in different places (first one taken)
    double max_deviation = 0;          ///< of a hanging vertex from where it belongs, model units
};

/// Recognises the hanging vertices of a mesh that does not name them (mesh.hanging is ignored), from the
/// faces that one cell only lists: a face hangs together with smaller ones on its other side if the vertices
/// in the middle of its edges cut it, again and again in two, into listed faces of the opposite sense. Depth:
/// 4 levels. A conforming mesh yields none. A face covered only in part is not recognised, only the vertices
/// on its edges. Error (bad_input): the splits found depend on each other in a circle.
Result<RecognisedHanging> recognise_hanging(const HexMesh& mesh, const RecogniseOptions& options,
                                            const Parallel& parallel);

} // namespace hexopt
