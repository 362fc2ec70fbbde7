#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "io/read_cad.hpp"

#include <filesystem>
#include <optional>
#include <span>
#include <vector>

namespace hexopt {

/// A point on the triangles, polylines or vertices that a CAD file was read as.
struct CadQuery {
    Point point;   ///< mm, as read_cad() has them
    int dimension; ///< of what it lies on: 2 a face, 1 an edge, 0 a vertex
};

/// Where a query lies exactly.
struct CadPoint {
    Point point;  ///< on the exact face, edge or vertex
    double match; ///< distance of the query from the triangles, polyline or vertex that it was found on, mm
};

/// Digest of a file's bytes where it is CAD, none where it is not. Errors: as read_file().
Result<std::optional<std::uint64_t>> digest_of_cad(const std::filesystem::path& path, Context& context);

/// For each query the closest point of the exact face (edge, vertex) whose triangles (polyline, place) it
/// lies on within match_rel of the diagonal, found by Newton's method from the parameters there; none where
/// it lies on none, or the closest point is farther than match_rel and 20 times the deflection. Reads and
/// tessellates the file as read_cad() did, in a process of its own. digest: Digest of what the file's bytes
/// must still be. Errors: as read_cad(); bad_input where the file has changed.
Result<std::vector<std::optional<CadPoint>>>
project_on_cad(const std::filesystem::path& path, std::uint64_t digest,
               const TessellationOptions& tessellation, double match_rel, std::span<const CadQuery> queries,
               Context& context);

} // namespace hexopt
