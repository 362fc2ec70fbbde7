#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "mesh/feature_lines.hpp"
#include "mesh/triangle_soup.hpp"

#include <span>

namespace hexopt {

struct FeaturedSurface {
    TriangleSoup soup; ///< equal vertices merged; triangles that lines cross are cut
    std::vector<std::array<Index, 2>>
        edges;                     ///< vertices, smaller first; sorted: the lines as edges of triangles
    std::size_t cut_triangles = 0; ///< made by cutting
};

/// Finds given lines on a surface. Where they run along its edges (within `tolerance` of creases, borders of
/// patches and open edges, else within 1e-5 of the diagonal) those are taken; where they run across triangles
/// these are cut, in their planes. tolerance: how far lines may be from the surface, model units.
/// Deterministic. Errors: bad_input: a line that leaves the surface, with its file and place; a soup as in
/// clean_surface(); cancelled.
Result<FeaturedSurface> insert_features(const TriangleSoup& surface, std::span<const FeatureLines> lines,
                                        double tolerance, Context& context);

} // namespace hexopt
