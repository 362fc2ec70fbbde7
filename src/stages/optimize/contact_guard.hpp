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

/// Quads in contact from the start, which may go on so. Flags per quad, or empty: none.
struct AllowedContacts {
    std::vector<std::uint8_t> near;     ///< within the guard's limits, but may not come to touch
    std::vector<std::uint8_t> touching; ///< within kTouching
};

/// Watches that a moving boundary does not close on itself: quads that face one another across the outside
/// must keep a distance, and two quads at an edge must not fold together. Quads that
/// are too near at the start may stay so, but not come to touch; what touches at the start may go on.
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
                                const Parallel& parallel) const {
        return touching(positions, moved, allowed_, parallel);
    }
    std::vector<Index> touching(std::span<const Point> positions, std::span<const Index> moved,
                                const AllowedContacts& allowed, const Parallel& parallel) const;

    /// Adds to `allowed` what is in contact now among `quads` (sorted) and their partners.
    void allow_present(std::span<const Point> positions, std::span<const Index> quads,
                       AllowedContacts& allowed, const Parallel& parallel) const;

  private:
    using Pair = std::array<Index, 2>;

    void find_candidates(std::span<const Point> start, double deviation, const Parallel& parallel);
    std::vector<Index> candidates_near(std::span<const Point> positions, std::span<const Index> moved,
                                       const ContactLimits& limits, const Parallel& parallel) const;
    std::vector<Pair> find_pairs(std::span<const Point> positions, std::span<const Index> moved,
                                 const ContactLimits& limits, const Parallel& parallel) const;
    void append_facing(std::span<const Point> positions, const class QuadTree& tree, Index quad,
                       const ContactLimits& limits, std::vector<Pair>& found) const;
    bool is_in_contact(Index quad, const struct PlacedQuad& at, Index other_quad, const PlacedQuad& other,
                       double clearance_rel) const;
    void append_folded(std::span<const Point> positions, Index quad, const ContactLimits& limits,
                       std::vector<Pair>& found) const;
    int shared_vertices(Index a, Index b) const;
    double inner_angle(std::span<const Point> positions, Index a, Index b) const;

    const HexMesh& mesh_;
    ContactLimits contact_;
    const Topology& topology_;
    std::span<const Quad> quads_;
    const Csr<Index>& vertex_quad_;
    std::vector<std::uint8_t> is_candidate_; ///< per quad: could meet another one across the outside
    std::vector<Index> candidates_;
    AllowedContacts allowed_;
};

/// Boundary faces (places in topology.boundary_faces, rising) where the boundary of a mesh touches or crosses
/// itself: closer than 0.001 of an edge to quads that face the other way, crossed by others' edges, or folded
/// over at an edge.
std::vector<Index> find_boundary_contacts(const HexMesh& mesh, const Topology& topology,
                                          const Parallel& parallel);

} // namespace hexopt
