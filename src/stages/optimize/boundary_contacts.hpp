#pragma once

#include "stages/optimize/contact_guard.hpp"

#include <memory>

namespace hexopt {

/// The quads of a mesh's boundary, and which of them touch others at given positions.
class BoundaryContacts {
  public:
    BoundaryContacts(const HexMesh& mesh, const Topology& topology, ContactLimits limits);
    BoundaryContacts(const BoundaryContacts&) = delete;
    BoundaryContacts& operator=(const BoundaryContacts&) = delete;

    std::size_t quad_count() const { return quads_.size(); }
    std::span<const Quad> quads() const { return quads_; }
    const Quad& quad(Index i) const { return quads_[i]; } ///< numbered as topology.boundary_faces
    const Csr<Index>& vertex_quad() const { return vertex_quad_; }
    /// Quads with one of the vertices for which flag is set; rising.
    std::vector<Index> quads_with(std::span<const std::uint8_t> vertex_flag) const;
    /// Quads in contact with another one, among `moved` (rising) and their partners; rising.
    std::vector<Index> touching(std::span<const Point> positions, std::span<const Index> moved,
                                const Parallel& parallel) const {
        return guard_->touching(positions, moved, parallel);
    }
    /// The same but for what is allowed.
    std::vector<Index> touching(std::span<const Point> positions, std::span<const Index> moved,
                                const AllowedContacts& allowed, const Parallel& parallel) const {
        return guard_->touching(positions, moved, allowed, parallel);
    }
    /// Adds to `allowed` what is in contact now among `quads` (rising) and their partners.
    void allow_present(std::span<const Point> positions, std::span<const Index> quads,
                       AllowedContacts& allowed, const Parallel& parallel) const {
        guard_->allow_present(positions, quads, allowed, parallel);
    }

  private:
    std::vector<Quad> quads_;
    Csr<Index> vertex_quad_;
    std::unique_ptr<ContactGuard> guard_;
};

} // namespace hexopt
