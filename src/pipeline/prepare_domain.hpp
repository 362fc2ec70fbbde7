#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "domain/domain.hpp"
#include "domain/insert_features.hpp"
#include "domain/orient_surface.hpp"
#include "domain/weld_surface.hpp"
#include "mesh/triangle_soup.hpp"
#include "pipeline/mesh_options.hpp"
#include "pipeline/move_onto_cad.hpp"
#include "pipeline/stage_clock.hpp"

#include <optional>

namespace hexopt {

/// A domain, and what was done to the surface for it.
struct PreparedDomain {
    Domain domain;
    WeldReport weld;
    OrientationReport orientation;
    std::size_t left_out_bodies = 0;   ///< closed surfaces that bound nothing that the seeds are in
    std::vector<CadSource> cad;        ///< CAD files among those that it was read from; set by load_domain()
    std::size_t feature_triangles = 0; ///< made by cutting others along given feature lines
    /// What the domain was built of, where follow_borders() may find borders of faces beside which cells fit.
    std::optional<FeaturedSurface> bordered;
};

/// From triangles to what is meshed: weld, farfield box, what bounds the seeds' parts, orient, given feature
/// lines, features by angle. Errors: usage (an option out of range), bad_input (a surface that cannot be
/// meshed), cancelled.
Result<PreparedDomain> prepare_domain(const TriangleSoup& surface, const MeshOptions& options,
                                      StageClock& clock, Context& context);

} // namespace hexopt
