#pragma once

#include "domain/domain.hpp"
#include "domain/feature_graph.hpp"
#include "domain/surface_polygons.hpp"

#include <span>

namespace hexopt {

/// Fills curve_patch, curve_open, angle and corner_curve of a domain whose model is there. Segments of curves
/// that are no edges of the surface have no triangles beside them.
void add_incidence(const FeatureGraph& graph, const CleanSurface& surface, Domain& domain);

/// Fills patch_name and, where a patch has triangles of several names, triangle_name.
/// source_name: per triangle of the soup that the model's triangles come from, index into domain.names.
void add_names(std::span<const Index> source_name, Domain& domain);

} // namespace hexopt
