#pragma once

#include "mesh/topology.hpp"

#include <cstdint>
#include <functional>
#include <vector>

namespace hexopt {

/// A vertex found in the middle of a line between two others.
using MidpointFinder = std::function<void(Index from, Index to, std::vector<Index>& found)>;

/// A face covered by smaller ones of the cells on its other side, and the vertices that lie on it.
struct FaceCover {
    struct Vertex {
        Index vertex;
        double u, v; ///< 0..1 along the face's edges 0-1 and 0-3
    };
    std::vector<Index> parts;     ///< numbers of the covering faces in FaceSplitter's list
    std::vector<Vertex> vertices; ///< those that are no corners of the face; one may be listed more than once
};

/// Finds how faces that belong to one cell only cover one another: a face is covered when it can be cut in
/// halves, again and again, along either direction, until every part is a face of the list that is listed in
/// the opposite sense (a 1:4 split is two cuts). What lies in the middle of an edge is up to the finder, so
/// the same search serves given constraints and geometry.
class FaceSplitter {
  public:
    /// faces: quads of faces used once, seen from outside their cell.
    explicit FaceSplitter(std::vector<Quad> faces);

    std::size_t count() const { return quads_.size(); }
    const Quad& quad(Index face) const { return quads_[face]; }

    /// Number of the face with these vertices in the opposite sense, or kNoIndex.
    Index find_opposite(const Quad& quad) const;

    /// Tries to cover a face with at most `max_cuts` cuts in a row; false if that is not possible.
    bool cover(Index face, const MidpointFinder& finder, int max_cuts, FaceCover& cover) const;

  private:
    std::vector<Quad> quads_;
    std::vector<Quad> keys_;   ///< sorted vertices
    std::vector<Index> table_; ///< open addressing by key
};

} // namespace hexopt
