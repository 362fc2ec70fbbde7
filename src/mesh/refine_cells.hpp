#pragma once

#include "core/parallel.hpp"
#include "core/result.hpp"
#include "mesh/flat_table.hpp"
#include "mesh/hex_mesh.hpp"
#include "mesh/root_lattice.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace hexopt {

/// Axes along which a cell is halved: bits 1 (xi), 2 (eta), 4 (zeta). The seven values but 0 are the
/// refinement patterns of thesis fig. 3.5.
using AxisMask = std::uint8_t;
inline constexpr AxisMask kAllAxes = 7;

/// A cell of the hierarchy: a leaf, or cut into 2, 4 or 8 children.
struct RefineNode {
    Cell vertices;
    LatticePoint low; ///< lowest corner in the root's lattice
    Index root;
    Index first_child = kNoIndex;
    std::array<std::uint8_t, 3> level = {}; ///< halvings along each axis of the root
    AxisMask mask = 0;                      ///< 0: a leaf

    bool is_leaf() const { return mask == 0; }
    int child_count() const { return 1 << ((mask & 1) + (mask >> 1 & 1) + (mask >> 2)); }
    /// The largest of the levels.
    std::uint8_t depth() const { return std::max({level[0], level[1], level[2]}); }
};

/// A leaf to be halved along some axes.
struct RefineRequest {
    Index node;
    AxisMask mask = kAllAxes;
};

struct RefineCount {
    std::size_t requested = 0; ///< leaves split because they were asked for
    std::size_t balance = 0;   ///< split to keep the steps between levels small
    std::size_t refused = 0;   ///< requests for what is no leaf or has no halvings left (max_level())
    bool over_budget = false;  ///< nothing was split: there would be too many leaves
};

/// The leaves as a mesh.
struct LeafMesh {
    HexMesh mesh;                 ///< with level, closed hanging rows and the patches of the roots' boundary
    std::vector<Index> leaf_node; ///< per cell: its node
};

/// Hierarchical refinement of any mesh of hexahedra by halving cells along one, two or three axes. A new
/// vertex is found by its place in the initial mesh, whatever cell and order of cuts made it, so that
/// hanging vertices fall out of the look-up. Neighbouring cells never differ by more than one level:
/// - where all cuts used one mask: over faces, edges and vertices, by that mask's common level;
/// - else along each axis that two cells share (over faces and edges, also of different roots); moreover no
///   axis of a cell may be two levels below the least level of any cell that touches it; and of two faces
///   that overlap one contains the other.
/// Order of nodes, and so of everything else, depends on the requests alone. About 60 bytes a node, 24 a
/// vertex and 16-32 for its place. Source: thesis 3.4 and figure 3.5.
class CellRefinement {
  public:
    /// Starts with every cell of `roots` as a leaf. Where it has hanging vertices these must be named, and
    /// its cells at most one halving apart over faces and edges; levels of the smaller ones count from the
    /// largest that they hang together with, and cells are only ever split along all axes (other requests are
    /// refused). Errors (bad_input): unsound structure, joints that find_root_joints() refuses, no cells.
    static Result<CellRefinement> create(HexMesh roots, const Parallel& parallel);

    /// The hierarchy with these roots() and splits(): the same nodes, vertices and later behaviour. Errors
    /// (bad_input): as create(); a split of what is no leaf then or has no halvings left.
    static Result<CellRefinement> replay(HexMesh roots, std::span<const RefineRequest> splits,
                                         const Parallel& parallel);
    /// The initial mesh, and all splits in their order.
    HexMesh roots() const;
    std::vector<RefineRequest> splits() const;

    /// Splits leaves and whatever the balance asks for. rings: at least that many cells of each level
    /// between those of the next finer and the next coarser one (1: balance only; more only where all cuts
    /// use one mask, and only as far as this call's splits go). max_leaves: nothing is split if there would
    /// be more (where masks differ, without what the balance adds).
    RefineCount refine(std::span<const RefineRequest> requests, int rings = 1,
                       std::size_t max_leaves = ~std::size_t{0});

    /// Splits leaves so that `layers` cells round each of the given leaves are no larger than it (1: those
    /// that touch it). The given ones themselves are only split where the balance with `rings` asks for it.
    /// Only where all cuts so far used one mask: asserts.
    RefineCount surround(std::span<const Index> leaves, int layers, int rings = 1,
                         std::size_t max_leaves = ~std::size_t{0});

    /// Splits leaves until none is two levels below one at a common vertex, which an initial mesh with
    /// hanging vertices may have; nothing else does.
    RefineCount balance(std::size_t max_leaves = ~std::size_t{0});

    /// How far the hierarchy is, to go back to that.
    struct Mark {
        std::size_t nodes, vertices, leaves;
        AxisMask uniform_mask;
        bool mixed;
    };
    Mark mark() const;
    /// Takes back all splits since `mark`: nodes, vertices and later behaviour are as they were then.
    void go_back(const Mark& mark);

    /// Leaves, depth first: children by xi, then eta, then zeta; roots in their order.
    std::vector<Index> leaves() const;
    LeafMesh leaf_mesh(const Parallel& parallel) const;

    std::size_t root_count() const { return root_count_; }
    std::size_t leaf_count() const { return leaf_count_; }
    std::size_t node_count() const { return nodes_.size(); }
    std::size_t vertex_count() const { return positions_.size(); }
    const RefineNode& node(Index node) const { return nodes_[node]; }
    const Point& position(Index vertex) const { return positions_[vertex]; }
    /// Halvings along an axis that a cell of the initial mesh can take, counted from the largest cells.
    int max_level() const { return lattice_.depth(); }
    /// Level of the smallest cells of the initial mesh; 0 where nothing hangs.
    int max_root_level() const { return max_root_level_; }

  private:
    CellRefinement(HexMesh roots, const RootJoints& joints);
    void take_hanging(const RootJoints& joints);
    void keep_patches(const HexMesh& roots);

    using Mid27 = std::array<Index, 27>; ///< vertices at 0, 1/2, 1 along each axis, xi first
    Mid27 make_vertices(Index node, AxisMask mask);
    void split(Index node, AxisMask mask);
    void split_all(const std::vector<Index>& nodes);
    LatticePoint middle_point(const RefineNode& node, const std::array<int, 3>& half) const;
    Index find_middle(const RefineNode& node, const std::array<int, 3>& half) const;

    bool keep_request(const RefineRequest& request, RefineCount& count) const;
    struct Marks;
    std::vector<Index> mark_uniform(std::span<const RefineRequest> requests, int rings,
                                    std::span<const Index> sources, int layers, RefineCount& count) const;
    void spread_marks(int level, int rings, std::uint8_t kind, Marks& marks) const;
    void spread_ring(const std::vector<Index>& leaves, int level, int reach, bool spare, Marks& marks) const;

    struct Contact;
    void refine_mixed(std::span<const RefineRequest> requests, RefineCount& count);
    void find_touching(Index root, const RootLattice::Range& range, std::vector<Index>& stack,
                       std::vector<Index>& found) const;
    void find_contacts(Index node, std::vector<Contact>& contacts) const;

    void append_hanging(const std::vector<Index>& leaves, const std::vector<Index>& number,
                        HexMesh& mesh) const;
    void append_boundary(const std::vector<Index>& leaves, HexMesh& mesh) const;

    RootLattice lattice_;
    std::size_t root_count_ = 0, leaf_count_ = 0;
    std::vector<RefineNode> nodes_; ///< the roots, then children in order of splitting, siblings together
    std::vector<Point> positions_;
    FlatTable vertex_at_;       ///< by RootLattice::key()
    AxisMask uniform_mask_ = 0; ///< mask of all splits so far; 0: none yet
    bool mixed_ = false;        ///< splits with different masks
    int max_root_level_ = 0;
    HexMesh root_mesh_;                  ///< cells, hanging vertices and patch names; positions of no value
    std::vector<Index> root_face_patch_; ///< per root and face: its patch, kNoIndex; empty without any
};

} // namespace hexopt
