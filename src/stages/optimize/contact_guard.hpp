#pragma once

#include "core/csr.hpp"
#include "core/parallel.hpp"
#include "mesh/hex_mesh.hpp"
#include "mesh/topology.hpp"

#include <array>
#include <span>
#include <vector>

namespace hexopt {

/// When two quads of a boundary are in contact.
struct ContactLimits {
    double clearance_rel =
        0.02;                 ///< least distance across the outside, in mean edges of the smaller quad; > 0
    double folded_rad = 0.07; ///< least outside angle between two quads at an edge; >= 0
};

/// When a finished boundary counts as touching itself.
inline constexpr ContactLimits kTouching{1e-3, 0};

/// Watches that a moving boundary does not close on itself: quads that face one another across the outside
/// must keep a distance, and two quads at an edge must not fold together. What the
/// start does already is allowed.
class ContactGuard {
  public:
    /// quads: the boundary as it is ordered in topology.boundary_faces; start: positions of all vertices;
    /// deviation: how far quads will be allowed to leave their surface (model units), which tells which quads
    /// can meet at all.
    ContactGuard(const HexMesh& mesh, const Topology& topology, std::span<const Quad> quads,
                 const Csr<Index>& vertex_quad, std::span<const Point> start, double deviation,
                 const Parallel& parallel, ContactLimits contact = {});

    /// Watches all quads, wherever they go, and allows no contact.
    ContactGuard(const HexMesh& mesh, const Topology& topology, std::span<const Quad> quads,
                 const Csr<Index>& vertex_quad, ContactLimits contact);

    /// Quads in contact with another one, among `moved` (sorted) and their partners; sorted.
    std::vector<Index> touching(std::span<const Point> positions, std::span<const Index> moved,
                                const Parallel& parallel) const;

  private:
    using Pair = std::array<Index, 2>;

    void find_candidates(std::span<const Point> start, double deviation, const Parallel& parallel);
    std::vector<Pair> find_pairs(std::span<const Point> positions, std::span<const Index> moved,
                                 const Parallel& parallel) const;
    void append_facing(std::span<const Point> positions, const class QuadTree& tree, Index quad,
                       std::vector<Pair>& found) const;
    void append_folded(std::span<const Point> positions, Index quad, std::vector<Pair>& found) const;
    int shared_vertices(Index a, Index b) const;
    double inner_angle(std::span<const Point> positions, Index a, Index b) const;

    const HexMesh& mesh_;
    ContactLimits contact_;
    const Topology& topology_;
    std::span<const Quad> quads_;
    const Csr<Index>& vertex_quad_;
    std::vector<std::uint8_t> is_candidate_; ///< per quad: could meet another one across the outside
    std::vector<Index> candidates_;
    std::vector<std::uint8_t> is_exempt_; ///< per quad: in contact at the start
};

/// Boundary faces (places in topology.boundary_faces, rising) where the boundary of a mesh touches or crosses
/// itself: closer than 0.001 of an edge across the outside, or folded over at an edge.
std::vector<Index> find_boundary_contacts(const HexMesh& mesh, const Topology& topology,
                                          const Parallel& parallel);

} // namespace hexopt
