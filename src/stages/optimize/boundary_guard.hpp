#pragma once

#include "core/parallel.hpp"
#include "stages/optimize/surface_motion.hpp"

#include <span>
#include <vector>

namespace hexopt {

/// Watches a boundary that moves.
class BoundaryGuard {
  public:
    virtual ~BoundaryGuard() = default;

    /// Boundary vertices whose quads are where they must not be, among those that `vertices` touch.
    virtual std::vector<Index> violators(std::span<const Point> positions, std::span<const Index> vertices,
                                         const Parallel& parallel) const = 0;

    /// Narrows the limits of the violators to `share` (0..1) of how far they went, so that their next
    /// excursion is shorter.
    void tighten(std::span<const Point> positions, std::span<const Index> violators, float share,
                 SurfaceLimits& limits) const;
};

} // namespace hexopt
