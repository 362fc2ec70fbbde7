#pragma once

#include "core/parallel.hpp"
#include "core/result.hpp"
#include "mesh/hex_mesh.hpp"

namespace hexopt {

enum class ViolationKind {
    too_large,             ///< more vertices than an Index holds, or cells than a CellCorner does
    vertex_out_of_range,   ///< a cell names a vertex that does not exist
    repeated_vertex,       ///< a cell names a vertex twice
    position_not_finite,   ///< of a vertex that a cell uses
    duplicate_cell,        ///< two cells have the same eight vertices
    face_overused,         ///< more than two cells share a face
    face_inconsistent,     ///< two cells list their common face in the same sense: one is turned over
    face_twisted,          ///< two cells list the vertices of their common face in different cyclic orders
    level_count,           ///< as many levels as cells, or none
    hanging_shape,         ///< arrays of the constraints do not fit each other or are not sorted
    hanging_out_of_range,  ///< a hanging vertex or master that does not exist
    hanging_weights,       ///< weights of a row are not positive or do not sum to 1 (within 1e-6)
    hanging_open,          ///< a master hangs itself
    boundary_out_of_range, ///< a boundary quad names a vertex or patch that does not exist
    boundary_not_a_face,   ///< notice: a boundary quad is no face of a cell, or one between two cells
    unused_vertex,         ///< notice: no cell uses a vertex
};

/// Short stable name, e.g. "repeated_vertex".
const char* name_of(ViolationKind kind);

struct Violation {
    ViolationKind kind;
    bool is_notice = false; ///< the mesh can be used all the same
    std::size_t count = 0;
    std::vector<std::string> places; ///< the first few, e.g. "cell 17: vertex 4"

    /// One line: kind, count and places.
    std::string one_line() const;
};

/// Checks what every stage relies on; nothing is assumed about the input. Violations in the order of
/// ViolationKind, none for a sound mesh. Checks that need sound ids are left out while those are violated.
std::vector<Violation> validate_structure(const HexMesh& mesh, const Parallel& parallel);

/// The first violation that is no notice as an error (bad_input) of stage `stage`, naming all; Done if there
/// is none.
Status require_structure(const HexMesh& mesh, const std::string& stage, const Parallel& parallel);

} // namespace hexopt
