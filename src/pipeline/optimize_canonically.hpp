#pragma once

#include "pipeline/improve_mesh.hpp"

namespace hexopt {

/// Where sliding ends depends on each decision on the way, and these on the last digits of positions and on
/// the order of sums. So that neither place, unit nor numbering of the input does, optimize() works on the
/// canonical form of the mesh (CanonicalForm), with the boundary model of that, and vertices that moved are
/// moved as far in the given pose, then put onto `surface`, the model in that pose, where they slid. Where
/// this has left the mesh worse than the input by rounding, optimize() goes on in the given pose.
/// Errors: those of optimize(); as there, a cancelled run leaves the best state so far in `mesh`.
Result<OptimizeStats> optimize_canonically(HexMesh& mesh, const Topology& topology,
                                           const BoundaryModel& surface, const ImproveOptions& options,
                                           Context& context, const DeviceTarget* device);

/// Whether runs with these options take the canonical form: where the boundary slides and the host's default
/// method or the same on a device has its full effort, without target lengths or given feature lines.
bool takes_canonical_form(const ImproveOptions& options);

} // namespace hexopt
