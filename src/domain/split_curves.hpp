#pragma once

#include "domain/domain.hpp"

#include <compare>
#include <span>

namespace hexopt {

/// Where a curve is cut.
struct CurveCut {
    Index curve;
    double at; ///< arc length from the curve's first point, model units, strictly inside
    auto operator<=>(const CurveCut&) const = default;
};

/// The domain with a new corner at each cut. Of a curve with ends, or a loop with a corner, the piece up to
/// the first cut keeps its number, of a loop without a corner the piece from the first cut to the second one
/// (it has no end where there is no second); the other pieces follow the domain's curves in the order of the
/// cuts, the corners its corners. Triangles at a cut are cut as well. cuts: rising, at most one at a place.
/// Errors: usage (a cut that is not inside its curve, or not in order), cancelled, and bad_input as
/// build_domain().
Result<Domain> split_curves(const Domain& domain, std::span<const CurveCut> cuts, Context& context);

} // namespace hexopt
