#pragma once

#include "io/mesh_io.hpp"

#include <functional>
#include <map>
#include <span>

namespace hexopt::io_detail {

/// "FILE:LINE" or "FILE: byte N" of the k'th id of the list that is being checked.
using Locate = std::function<std::string(std::size_t id)>;

/// A quadrilateral of the file, before it is matched with a face of a cell.
struct SourceQuad {
    Quad vertices;
    Index patch;
};

/// What a reader collects from a file, and the checks that turn it into a mesh.
struct MeshBuilder {
    explicit MeshBuilder(std::string file_name) : file(std::move(file_name)) {}

    std::string file;
    HexMesh mesh; ///< positions, cells, level, hanging, patch_names; boundary is filled by finish()
    std::vector<FieldData> fields;
    std::vector<SourceQuad> quads;
    std::map<std::string, std::size_t> unsupported; ///< cells with a volume that are no hexahedra, by type
    std::map<std::string, std::size_t> ignored;     ///< cells of lower dimension, by type
    int first_id = 0;                               ///< what the file calls its first vertex, for messages

    /// Number of the patch with this name; added where it is new.
    Index patch_of(const std::string& name);

    /// Checks ids, finiteness, repeated vertices, constraints; matches quads with faces. locate_cell names
    /// the place of a cell, locate_point that of a vertex, both by 0-based number.
    Result<MeshFile> finish(const Locate& locate_point, const Locate& locate_cell, const Context& context);

  private:
    std::map<std::string, Index> patch_number_;
};

/// Checks hanging constraints read from a file: sizes, order, ranges, closure, weights. Empty if all is well.
std::string describe_violation(const Hanging& hanging, std::size_t vertex_count);

} // namespace hexopt::io_detail
