#pragma once

#include "domain/surface_queries.hpp"

#include <memory>

namespace hexopt {

/// A surface that bounds a region of refinement; it need have nothing to do with what is meshed. Queries are
/// thread-safe.
class RegionSurface {
  public:
    /// Closes cracks of up to 1e-4 of the diagonal and turns the triangles outwards: closed surfaces inside
    /// others bound cavities, those that cross count as their union. Errors: bad_input as weld_surface(),
    /// orient_surface() and build_domain(); cancelled.
    static Result<std::shared_ptr<const RegionSurface>> create(const TriangleSoup& soup, Context& context);

    RegionSurface(const RegionSurface&) = delete;
    RegionSurface& operator=(const RegionSurface&) = delete;

    bool is_closed() const { return queries_.is_closed(); }
    std::size_t open_edges() const { return domain_.open_edges; }
    /// Whether the surface comes within `reach` of a point, model units.
    bool is_near(const Point& at, double reach) const;
    bool is_inside(const Point& at) const;

  private:
    explicit RegionSurface(Domain domain);

    Domain domain_;
    SurfaceQueries queries_;
    Box box_;
};

} // namespace hexopt
