#pragma once

#include "core/csr.hpp"
#include "domain/boundary_model.hpp"
#include "mesh/topology.hpp"

#include <optional>

namespace hexopt {

/// The boundary quads of a mesh and its edges on curves, and how far they are from the surface and the curves
/// where the mesh's vertices are now.
class SurfaceQuads {
  public:
    /// model holds the bindings of the mesh; all three outlive this.
    SurfaceQuads(const HexMesh& mesh, const Topology& topology, const BoundaryModel& model);

    /// In the order of Topology::boundary_faces.
    std::size_t size() const { return quads_.size(); }
    const Quad& operator[](std::size_t q) const { return quads_[q]; }
    std::span<const Quad> quads() const { return quads_; }
    std::array<Point, 4> corners(Index q) const;
    /// Quads at a vertex of the mesh, rising.
    std::span<const Index> at(Index v) const { return vertex_quad_[v]; }
    const Csr<Index>& at_vertices() const { return vertex_quad_; }
    /// Other ends of the feature edges at a vertex.
    std::span<const Index> ridge(Index v) const { return ridge_[v]; }

    /// Distance of a place on or near a quad to the surface, model units. Not for one quad by two threads.
    double distance(Index q, const Point& place);
    /// Of a vertex to the surface, model units.
    double vertex_distance(Index v) const;
    /// Largest of the quad's corners, edge midpoints and centre, model units.
    double distance(Index q);
    /// How far a mesh edge between two vertices of one curve cuts across its bends, model units.
    double edge_distance(Index a, Index b) const;
    /// Where a vertex that may slide lies on its patch or curve; none for those off it.
    std::optional<Projection> find_place(Index v) const;

  private:
    const HexMesh& mesh_;
    const Topology& topology_;
    const BoundaryModel& model_;
    std::vector<Quad> quads_;
    Csr<Index> vertex_quad_;                ///< per vertex of the mesh
    std::vector<std::vector<Index>> ridge_; ///< per vertex
    std::vector<Index> hint_;               ///< per quad: triangle
};

} // namespace hexopt
