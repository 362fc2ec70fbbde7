#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "mesh/hex_mesh.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace hexopt {

enum class FieldLocation : std::uint8_t { point, cell };

/// How an array is stored in a file. Every value of FieldData::values must be exact in it: integers are
/// limited to 53 bits, float32 values to what a float holds.
enum class FieldType : std::uint8_t { float64, float32, int32, int64, uint8 };

/// A named array on the vertices or cells of a mesh.
struct FieldData {
    std::string name; ///< not empty; names that start with "hexopt_" are reserved
    FieldLocation location = FieldLocation::cell;
    std::uint32_t components = 1;
    std::vector<double> values; ///< components values for vertex or cell 0, then 1, ...
    FieldType type = FieldType::float64;
};

/// What a file holds.
struct MeshFile {
    HexMesh mesh;
    std::vector<FieldData> fields; ///< the file's own arrays, in its order; valid until the mesh changes
};

/// Reads a mesh of hexahedra: legacy VTK, VTU, MEDIT (.mesh, .meshb) or Gmsh (.msh 2.2, 4.1), told apart by
/// content, whatever the name. Vertices keep their order, cells theirs. Formats, arrays and limits:
/// docs/io.md.
///
/// Everything is checked before use: counts against the bytes that are there, ids against the number of
/// vertices, coordinates for finiteness, cells for repeated vertices. Errors: bad_input with file, line or
/// byte and what to do; out_of_memory; cancelled. What is left out (points, lines, triangles, quadrilaterals
/// inside the mesh, arrays that cannot be kept) is logged as a warning.
Result<MeshFile> read_mesh_file(const std::filesystem::path& path, Context& context);

/// The mesh of read_mesh_file() without its arrays.
Result<HexMesh> read_mesh(const std::filesystem::path& path, Context& context);

} // namespace hexopt
