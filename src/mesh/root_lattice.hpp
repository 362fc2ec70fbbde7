#pragma once

#include "core/csr.hpp"
#include "mesh/flat_table.hpp"
#include "mesh/hex_mesh.hpp"
#include "mesh/root_joints.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace hexopt {

/// A place inside a root cell in units of its finest lattice: 0..RootLattice::size() along each axis.
using LatticePoint = std::array<std::uint32_t, 3>;

/// Numbers every place that repeated halving of the cells of an initial mesh can reach, so that cells which
/// share a face or edge, however they are turned, give a common place the same number. It also tells where
/// the same place lies in the neighbouring cells. Where cells hang together, places on the smaller ones'
/// faces and edges have the numbers that the larger ones give them.
class RootLattice {
  public:
    /// roots: structurally sound; joints: find_root_joints() of it.
    explicit RootLattice(const HexMesh& roots, const RootJoints& joints = {});

    /// Halvings along an axis that the numbers have room for: 19 for one cell, 13 for a million.
    int depth() const { return depth_; }
    std::uint32_t size() const { return 1u << depth_; }
    /// Of one root: smaller where it hangs together with larger ones.
    std::uint32_t size(Index root) const { return level_.empty() ? size() : size() >> level_[root]; }

    /// Number of a place that is not a corner of the root: equal for equal places, never ~0.
    std::uint64_t key(Index root, const LatticePoint& at) const {
        const std::uint32_t n = size(root);
        const auto fixed = [&](int axis) { return at[axis] == 0 || at[axis] == n; };
        const auto side = [&](int axis) { return at[axis] == 0 ? 0u : 1u; };
        switch ((fixed(0) ? 1 : 0) | (fixed(1) ? 2 : 0) | (fixed(2) ? 4 : 0)) {
        case 0:
            return pack(first_cell_ + root, at[0], at[1], at[2]);
        case 1:
            return face_key(root, side(0), at[1], at[2]);
        case 2:
            return face_key(root, 2 + side(1), at[0], at[2]);
        case 4:
            return face_key(root, 4 + side(2), at[0], at[1]);
        case 6:
            return edge_key(root, side(1) + 2 * side(2), at[0]);
        case 5:
            return edge_key(root, 4 + side(0) + 2 * side(2), at[1]);
        default:
            return edge_key(root, 8 + side(0) + 2 * side(1), at[2]);
        }
    }

    /// A box of places, ends included.
    struct Range {
        LatticePoint low, high;
    };
    /// The part of a root's face, edge or vertex in the numbering of a neighbour.
    struct Image {
        Index root;
        Range range;
        std::array<int, 3> axis; ///< per axis of the first root: the neighbour's axis along it, -1 where none
    };
    /// Appends the images of `range` in the other roots, for each face, edge and vertex of `root` that it
    /// reaches. Needs connect().
    void append_images(Index root, const Range& range, std::vector<Image>& images) const;
    /// Prepares append_images(): which roots meet at every edge and vertex. Not where cells hang together.
    void connect(const HexMesh& roots);
    bool is_connected() const { return !cells_.empty(); }

  private:
    std::uint64_t pack(std::uint64_t entity, std::uint64_t a, std::uint64_t b, std::uint64_t c) const {
        return ((entity << depth_ | c) << depth_ | b) << depth_ | a;
    }
    std::uint64_t face_key(Index root, std::uint32_t face, std::uint32_t s, std::uint32_t t) const {
        const std::size_t at = 6 * std::size_t{root} + face;
        if (!face_place_.empty() && face_place_[at] != kNoIndex)
            return places_[face_place_[at]].key(*this, s, t);
        const std::uint8_t turn = face_turn_[at];
        const std::uint32_t n = size(root);
        if (turn & 1) s = n - s;
        if (turn & 2) t = n - t;
        return pack(first_face_ + face_id_[at], turn & 4 ? t : s, turn & 4 ? s : t, 0);
    }
    std::uint64_t edge_key(Index root, std::uint32_t edge, std::uint32_t t) const {
        const std::size_t at = 12 * std::size_t{root} + edge;
        if (edge_flip_[at]) t = size(root) - t;
        const Index place = edge_place_.empty() ? kNoIndex : edge_place_[edge_id_[at]];
        return place == kNoIndex ? pack(edge_id_[at], t, 0, 0) : places_[place].key(*this, t, 0);
    }
    /// Where a face or edge lies on a larger one: origin and steps along its axes there.
    struct Place {
        std::uint64_t entity;
        std::array<std::int64_t, 2> origin;
        std::array<std::array<int, 2>, 2> step;

        std::uint64_t key(const RootLattice& lattice, std::uint32_t s, std::uint32_t t) const {
            std::array<std::uint64_t, 2> at;
            for (int d = 0; d < 2; ++d)
                at[d] = static_cast<std::uint64_t>(origin[d] + std::int64_t{s} * step[0][d] +
                                                   std::int64_t{t} * step[1][d]);
            return lattice.pack(entity, at[0], at[1], 0);
        }
    };
    /// A vertex of a larger face or edge in its own coordinates, in halves of it.
    struct HalfPlace {
        Index vertex;
        std::array<int, 2> at;
    };
    Place make_place(std::uint64_t entity, std::uint32_t half, std::span<const HalfPlace> known, Index origin,
                     Index along_s, Index along_t) const;
    void place_on_larger(const HexMesh& roots, const RootJoints& joints);
    void place_on_face(const HexMesh& roots, const RootJoints::Face& face, const FlatTable& edge_at);
    void number_edges(const HexMesh& roots);
    void number_faces(const HexMesh& roots);
    void append_face_image(Index root, std::uint32_t face, const Range& range,
                           std::vector<Image>& images) const;
    void append_edge_images(Index root, std::uint32_t edge, const Range& range,
                            std::vector<Image>& images) const;
    void append_vertex_images(Index root, std::uint32_t corner, std::vector<Image>& images) const;

    int depth_ = 0;
    std::uint64_t first_face_ = 0, first_cell_ = 0; ///< edges, faces and cells share one numbering
    std::vector<Index> edge_id_;                    ///< 12 a root
    std::vector<std::uint8_t> edge_flip_;
    std::vector<Index> face_id_; ///< 6 a root
    /// From a root's coordinates on the face to the common ones: bits flip first, flip second, then swap.
    std::vector<std::uint8_t> face_turn_;
    std::vector<std::array<std::uint32_t, 2>> face_use_; ///< per face: 6 * root + face of both sides
    Csr<std::uint32_t> edge_use_;                        ///< per edge: 12 * root + edge
    Csr<std::uint32_t> vertex_use_;                      ///< per vertex: 8 * root + corner
    std::vector<Cell> cells_;                            ///< of the roots
    std::vector<std::uint8_t> level_; ///< per root; this and the rest empty where nothing hangs
    std::vector<Place> places_;
    std::vector<Index> face_place_; ///< per use: in places_, kNoIndex where the face is its own
    std::vector<Index> edge_place_; ///< per edge: likewise
};

} // namespace hexopt
