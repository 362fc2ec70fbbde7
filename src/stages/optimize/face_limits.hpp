#pragma once

#include "domain/boundary_model.hpp"
#include "stages/optimize/motion.hpp"

#include <array>

namespace hexopt {

struct SurfaceLimits;

/// The boundary whose faces are limited, by places in topology.boundary_faces.
struct LimitedFaces {
    const BoundaryModel& surface;
    const Topology& topology;
    const std::vector<Quad>& quads;
    const Csr<Index>& vertex_quad;
    const std::vector<float>& allowed; ///< per quad: how far it may be from the surface, model units
    double start_allowed;              ///< how far places of the boundary at the start may be from it now
};

/// Holds the faces of a moving boundary near the surface, and the boundary where it started near the faces,
/// at the places that DeviationGuard looks at: a smooth energy for each, which rises near the end of what is
/// allowed. Unlike limits of single vertices it lets vertices go wherever their faces allow it. Where
/// band_share of a face's corners is below 1, its range is as much less. Keeps references; not thread-safe.
class FaceLimits {
  public:
    FaceLimits(const Problem& problem, const LimitedFaces& faces, const SurfaceLimits& limits);

    double energy(std::span<const Point> positions) const;
    void append_terms(std::span<const Point> positions, std::vector<FaceTerm>& terms) const;

  private:
    struct Face {
        Index quad;
        std::size_t cell; ///< of the problem
        std::array<std::uint8_t, 4> corner;
        double range; ///< model units
    };
    /// A place on a face that moves and where the surface is from there, at the last look.
    struct Place {
        Point foot{0};
        Index element = kNoIndex;
    };
    /// A place of the boundary at the start, and the closest place now: on the quad, by its corners' weights.
    struct StartPlace {
        Point at;
        double range;
        Index start_quad, quad;
        std::array<double, 4> weight;
        std::vector<Index> around; ///< quads that it may be on now; as soon as they are asked for
    };

    void add_start_places(const SurfaceLimits& limits);
    bool is_surely_within(const Point& at, Place& place, double range) const;
    bool find_closest(std::span<const Point> positions, StartPlace& place) const;
    void look_at(std::span<const Point> positions, Index quad, StartPlace& place, double& least) const;
    template <class Take>
    void visit(std::span<const Point> positions, const Take& take) const;

    LimitedFaces faces_;
    std::vector<Face> face_;
    std::vector<Index> face_of_quad_; ///< kNoIndex: nothing of it moves
    mutable std::vector<Place> place_;
    mutable std::vector<StartPlace> start_place_;
};

} // namespace hexopt
