#pragma once

#include "stages/optimize/boundary_contacts.hpp"
#include "stages/optimize/budget.hpp"
#include "stages/optimize/home_motion.hpp"

namespace hexopt {

/// What bring_home() works on; all must outlive the call.
struct AwayMesh {
    const HexMesh* mesh;
    const Topology* topology;
    const BoundaryModel* surface;
    const BoundaryContacts* contacts;
    const AllowedContacts* allowed;
    std::span<const std::uint8_t> movable; ///< per vertex
};

/// Puts all vertices of a kind that are still drawn home at once and untangles round them, whatever that does
/// to their cells at first. Parts that share no cells are judged one by one: those that do not get valid
/// with a scaled Jacobian of at least `least_sj` (or as good as before), or come into contact, go back. Where
/// many share a part none is tried.
/// Returns how many vertices came home.
std::size_t bring_home(const AwayMesh& away, EntityKind kind, double least_sj, std::vector<Point>& positions,
                       std::vector<Hold>& hold, Budget& budget);

} // namespace hexopt
