#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "mesh/hex_mesh.hpp"

#include <cstdint>
#include <filesystem>
#include <span>
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

struct ReadOptions {
    /// Recognise hanging vertices by topology and position where the file holds no constraints
    /// (mesh/recognise_hanging.hpp); false takes such a mesh as it is.
    bool recognise_hanging = true;
};

/// Reads a mesh of hexahedra: legacy VTK, VTU, MEDIT (.mesh) or Gmsh (.msh 2.2, 4.1), told apart by
/// content, whatever the name. Vertices keep their order, cells theirs. Formats, arrays and limits:
/// docs/io.md.
///
/// Everything is checked before use: counts against the bytes that are there, ids against the number of
/// vertices, coordinates for finiteness, cells for repeated vertices. Errors: bad_input with file, line or
/// byte and what to do; out_of_memory; cancelled. What is left out (points, lines, triangles, quadrilaterals
/// inside the mesh, arrays that cannot be kept) is logged as a warning.
Result<MeshFile> read_mesh_file(const std::filesystem::path& path, Context& context,
                                const ReadOptions& options = {});

/// The mesh of read_mesh_file() without its arrays.
Result<HexMesh> read_mesh(const std::filesystem::path& path, Context& context,
                          const ReadOptions& options = {});

enum class MeshFormat : std::uint8_t {
    from_name, ///< by the extension: .vtu, .vtk, .mesh, .foam, or a folder named polyMesh
    vtu,       ///< appended raw data, zlib, 64-bit headers
    vtk,       ///< legacy VTK, layout of versions before 5, which every program reads
    medit,     ///< text; holds references and patches, but no arrays and no hanging constraints
    openfoam,  ///< a folder, as write_openfoam() describes; holds no arrays
};

enum class Encoding : std::uint8_t {
    automatic, ///< binary where the format has both
    binary,
    text, ///< shortest digits that read back to the same bits; not for VTU
};

/// The format that the extension of a file's name stands for. Error: usage for any other extension.
Result<MeshFormat> format_of_name(const std::filesystem::path& path);

struct WriteOptions {
    MeshFormat format = MeshFormat::from_name;
    Encoding encoding = Encoding::automatic;
    int compression_level = 3; ///< of zlib, 1 (fast) to 9 (small); VTU only
    /// VTU only: cells beside hanging vertices as polyhedra, which makes the mesh conforming for programs
    /// that know nothing of hanging vertices. Such a file is not read again as a mesh of hexahedra.
    bool polyhedra = false;
    /// OpenFOAM only: patches of the type `empty`, by name: the plane sides of a planar mesh.
    std::vector<std::string> empty_patches = {};
};

/// The format that write_mesh() would write, for who wants to know before there is a mesh. Errors: usage
/// (unknown extension, format and encoding that exclude one another).
Result<MeshFormat> choose_format(const std::filesystem::path& path, const WriteOptions& options);

/// Writes a mesh with its levels, hanging constraints and patches, and arrays on vertices and cells. Of two
/// arrays with the same name and location the later is written. The file appears whole or not at all, as
/// AtomicFile describes; same input, same bytes. Errors: usage (unknown extension, format and encoding that
/// exclude one another), output_failed (an array of the wrong size, a coordinate that is not finite, a
/// failing disk), cancelled, out_of_memory.
Status write_mesh(const std::filesystem::path& path, const HexMesh& mesh, std::span<const FieldData> fields,
                  const WriteOptions& options, Context& context);

} // namespace hexopt
