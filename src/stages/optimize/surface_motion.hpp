#pragma once

#include "domain/boundary_model.hpp"
#include "stages/optimize/face_limits.hpp"
#include "stages/optimize/motion.hpp"

#include <limits>
#include <optional>

namespace hexopt {

/// How far the boundary vertices of a mesh may go on their surface, and off it. Arrays are per vertex; all
/// empty: on their entities anywhere.
struct SurfaceLimits {
    std::vector<Point> start;      ///< where the vertex began, on its entity
    std::vector<float> reach;      ///< largest distance from start; infinite in flat places
    std::vector<float> band;       ///< largest distance from the surface; 0: exactly on its entity
    std::vector<float> band_share; ///< of the allowed band that `band` may be opened to, 0..1

    float reach_of(Index vertex) const {
        return reach.empty() ? std::numeric_limits<float>::infinity() : reach[vertex];
    }
    bool is_off_surface(Index vertex) const { return !band.empty() && band[vertex] > 0; }
};

/// First limits for quads that are to stay within `deviation` (model units, > 0) of the surface: a vertex
/// moves at most a multiple of deviation / sin(spread of the normals nearby). Bands start at 0.
SurfaceLimits compute_surface_limits(const HexMesh& mesh, const Topology& topology,
                                     const BoundaryModel& surface, std::span<const Point> positions,
                                     double deviation, const Parallel& parallel);

/// No limits but the entities themselves. Bands start at 0.
SurfaceLimits unlimited_on_surface(std::span<const Point> positions);

/// Which way a surface lies where a vertex slides on it.
enum class Tangents {
    /// Interpolated from those of the elements' ends: best where elements are as large as cells and vertices
    /// sit at their ends, as on a mesh's own boundary.
    smooth,
    /// Those of the triangle or segment itself: where large triangles lie beside small ones the smooth ones
    /// lean far out of their plane, and steps along these push against the surface.
    exact,
};

/// Adds s^2 with s rising from 0 at free_share of the range to 1 at its end.
void add_limit(const Point& offset, double range, double free_share, LimitTerm& term);

/// Boundary dofs slide on their patch or curve, or near it where their band is open; interior ones are free.
/// Limits are soft: an energy holds the dofs back, DeviationGuard has the last word.
class SurfaceMotion final : public Motion {
  public:
    /// faces: limits these instead of the single vertices.
    SurfaceMotion(const Problem& problem, const BoundaryModel& surface, const SurfaceLimits& limits,
                  Tangents tangents, const LimitedFaces* faces = nullptr);

    std::span<const Index> on_surface() const override { return on_surface_; }
    void freedoms(std::span<const Point> positions, std::span<Freedom> out) const override;
    Point place(Index dof, const Point& wanted) const override;
    std::span<const Index> limited() const override { return limited_; }
    LimitTerm limit(Index dof, const Point& at) const override;
    double face_energy(std::span<const Point> positions) const override;
    void append_face_terms(std::span<const Point> positions, std::vector<FaceTerm>& terms) const override;
    bool has_exact_freedoms() const override { return tangents_ == Tangents::exact; }

    const BoundaryModel& surface() const { return surface_; }
    const SurfaceLimits& limits() const { return limits_; }

  private:
    /// A dof's last projection.
    struct Last {
        Point query{0}, foot{0}, direction{0};
        Index element = kNoIndex;
    };

    bool is_off_surface(Index vertex) const { return limits_.is_off_surface(vertex); }
    Last& last(Index dof) const { return last_[place_[dof]]; }
    Projection project(Index dof, const Point& query) const;
    bool is_well_within(Index dof, const Point& at) const;

    const Problem& problem_;
    const BoundaryModel& surface_;
    const SurfaceLimits& limits_;
    Tangents tangents_;
    std::vector<Index> on_surface_, limited_;
    std::optional<FaceLimits> faces_;
    std::vector<Index> place_;       ///< per dof: its place in on_surface_, kNoIndex: none
    mutable std::vector<Last> last_; ///< per dof on the surface; only saves time
};

} // namespace hexopt
