#pragma once

#include "core/context.hpp"
#include "core/csr.hpp"
#include "core/result.hpp"
#include "domain/boundary_model.hpp"
#include "mesh/domain_description.hpp"
#include "mesh/triangle_soup.hpp"

#include <span>
#include <string>
#include <vector>

namespace hexopt {

/// Largest and smallest dihedral angle along a curve, degrees, 0..360, measured through the inside of the
/// domain: 90 at the edge of a cube that is meshed inside, 270 outside. 180 where the curve has not two
/// sides.
struct CurveAngle {
    double smallest = 180, largest = 180;
};

/// What is meshed: patches, curves and corners with their geometry (model) and incidence. Thesis section 3.2:
/// topology and geometry are kept apart; the triangles of two patches need not match at their curve.
struct Domain {
    BoundaryModel model;    ///< unbound until the mesh is fitted
    Csr<Index> curve_patch; ///< per curve: patches beside it, rising; one where both sides are the same
    std::vector<std::uint8_t> curve_open; ///< per curve: 1 where an edge of it has not exactly two triangles
    Csr<Index> corner_curve;              ///< per corner: curves that end there, rising; twice for a loop
    std::vector<CurveAngle> angle;        ///< per curve
    std::vector<Index> patch_name;        ///< per patch: its (first) name in `names`
    /// Per triangle of the model: its name in `names`, where some patch has several (their border is no
    /// feature); else empty.
    std::vector<Index> triangle_name;
    std::vector<std::string> names; ///< of patches as the input calls them
    /// Per name: between patches of one group borders are features by their shape alone.
    std::vector<Index> name_group;
    std::size_t dropped_triangles = 0, open_edges = 0, nonmanifold_edges = 0; ///< of the input
};

/// Builds the domain of a soup whose triangles point outwards (away from where the mesh will be). Patches:
/// the soup's, cut along feature edges. features: edges that are features whatever their angle
/// (insert_features()). Errors: usage, bad_input as build_boundary_model(), cancelled.
Result<Domain> build_domain(const TriangleSoup& surface, const BoundaryOptions& options, Context& context,
                            std::span<const std::array<Index, 2>> features = {});

/// Builds the domain that a description (a domain file) states. Polylines need not run along the edges of
/// triangles. Patches that share edges of triangles where no curve runs between them become one. A corner
/// that ends no curve cuts the curve that it lies on, within 1e-4 of the diagonal. Triangles must point
/// outwards. Errors (bad_input, with file and line): entities that do not exist, do not fit one another
/// (within 1e-6 of the diagonal), or are used twice; cancelled. What is left out is logged as a warning.
Result<Domain> build_domain(const DomainDescription& description, Context& context);

/// The description of a domain: build_domain() gives the same bits again (but for the order of triangles in
/// patches of several names).
DomainDescription describe_domain(const Domain& domain);

} // namespace hexopt
