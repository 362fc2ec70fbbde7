#pragma once

#include "stages/optimize/boundary_guard.hpp"
#include "stages/optimize/contact_guard.hpp"
#include "stages/optimize/surface_motion.hpp"

#include <optional>

namespace hexopt {

/// Watches how far the quads of a moving boundary are from the surface it slides on, in both directions, at
/// sampled places: corners, edge midpoints and centres of the quads against the surface; the vertices'
/// starting places, where the surface bends, against the quads now around them. Also that the boundary does
/// not touch itself where it did not at the start (ContactGuard).
class DeviationGuard final : public BoundaryGuard {
  public:
    /// allowed: deviation that is admitted, model units; a quad that deviates more at the start may go on so.
    DeviationGuard(const HexMesh& mesh, const Topology& topology, const BoundaryModel& surface,
                   const SurfaceLimits& limits, double allowed, const Parallel& parallel);
    DeviationGuard(const DeviationGuard&) = delete;
    DeviationGuard& operator=(const DeviationGuard&) = delete;

    /// Boundary vertices whose quads deviate too far or touch others, among those that `vertices` touch.
    std::vector<Index> violators(std::span<const Point> positions, std::span<const Index> vertices,
                                 const Parallel& parallel) const override;

    /// Whether all quads are within `share` of what is admitted of them, at 289 places where they come close:
    /// what violators(), which is asked often, may miss between its places.
    bool is_within(std::span<const Point> positions, double share, const Parallel& parallel) const;

    /// Moves vertices that are beyond their range back into it.
    void pull_back(std::span<Point> positions, std::span<const Index> vertices) const;

    /// The faces that it watches and what is allowed of them.
    LimitedFaces faces() const {
        return {surface_, topology_, quads_, vertex_quad_, allowed_, start_allowed_};
    }

    /// All vertices of the boundary.
    std::span<const Index> boundary_vertices() const { return boundary_vertices_; }

  private:
    double quad_deviation(std::span<const Point> positions, Index quad, double refine_above) const;
    bool is_near_last_feet(std::span<const Point> positions, Index quad, double within) const;
    bool quad_deviates(std::span<const Point> positions, Index quad) const;
    bool start_deviates(std::span<const Point> positions, Index vertex) const;

    const BoundaryModel& surface_;
    const Topology& topology_;
    const SurfaceLimits& limits_;
    std::vector<float> allowed_; ///< per quad, model units
    double start_allowed_;
    std::vector<Quad> quads_;
    Csr<Index> vertex_quad_;
    std::vector<Index> boundary_vertices_;
    mutable std::vector<Index> hint_;                ///< per quad
    mutable std::vector<std::array<Point, 9>> foot_; ///< per quad: last closest points of nine places
    std::optional<ContactGuard> contact_;
};

} // namespace hexopt
