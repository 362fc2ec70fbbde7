#pragma once

#include "domain/boundary_model.hpp"
#include "domain/feature_graph.hpp"

namespace hexopt {

/// Bindings of a mesh's vertices to a model of another surface.
struct SurfaceAssociation {
    std::vector<Association> association;
    std::vector<std::array<Index, 2>> feature_edges; ///< mesh edges that follow curves
    AssociationReport report;                        ///< the counts of the surface itself are left at zero
};

/// graph: features of the mesh's own boundary. reach: BoundaryOptions::reach.
SurfaceAssociation associate(const HexMesh& mesh, const Topology& topology, const FeatureGraph& graph,
                             const BoundaryModel& model, double reach, const Context& context);

} // namespace hexopt
