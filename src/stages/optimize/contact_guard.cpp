#include "stages/optimize/contact_guard.hpp"

#include "domain/box_tree.hpp"
#include "domain/closest_point.hpp"
#include "mesh/hex_reference.hpp"
#include "stages/optimize/boundary_contacts.hpp"

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

namespace hexopt {

namespace {

constexpr double kFacing = 0.3;  ///< cosine between normals below which quads face one another
constexpr double kFolded = -0.9; ///< the same of quads at one edge that may be folded over
/// Ends of an edge nearer to a quad's plane, of its edge, are on it: hanging vertices on the edge of a larger
/// quad are, but for rounding.
constexpr double kOnPlane_rel = 1e-6;

/// A quad as four triangles round its centre.
struct Patch {
    std::array<Point, 4> x;
    Point centre, normal;
    double edge = 0, radius = 0; ///< mean edge; of the ball round the centre that holds the corners

    Patch(std::span<const Point> positions, const Quad& quad) {
        for (int k = 0; k < 4; ++k) x[k] = positions[quad[k]];
        centre = 0.25 * ((x[0] + x[2]) + (x[1] + x[3]));
        const Point cross = glm::cross(x[2] - x[0], x[3] - x[1]);
        const double length = glm::length(cross);
        normal = length > 0 ? cross / length : Point(0);
        for (int k = 0; k < 4; ++k) {
            edge += 0.25 * glm::distance(x[k], x[(k + 1) % 4]);
            radius = std::max(radius, glm::distance(x[k], centre));
        }
    }

    /// Whether p lies before the patch (outside the mesh), closer than `clearance`.
    bool is_before(const Point& p, double clearance) const {
        for (int k = 0; k < 4; ++k) {
            const Point d = p - closest_on_triangle(p, x[k], x[(k + 1) % 4], centre).point;
            if (glm::dot(d, d) < clearance * clearance && glm::dot(d, normal) >= 0) return true;
        }
        return false;
    }

    bool is_crossed_by(const Point& p, const Point& q) const {
        const auto side = [](const Point& a, const Point& b, const Point& c, const Point& d) {
            return glm::dot(glm::cross(b - a, c - a), d - a);
        };
        for (int k = 0; k < 4; ++k) {
            const Point &a = x[k], &b = x[(k + 1) % 4];
            const double above = side(a, b, centre, p), below = side(a, b, centre, q);
            const double least = kOnPlane_rel * edge * glm::length(glm::cross(b - a, centre - a));
            if (above * below >= 0 || std::min(std::abs(above), std::abs(below)) < least) continue;
            const double u = side(p, q, a, b), v = side(p, q, b, centre), w = side(p, q, centre, a);
            if ((u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0)) return true;
        }
        return false;
    }
};

bool contains(const Quad& quad, Index v) {
    return quad[0] == v || quad[1] == v || quad[2] == v || quad[3] == v;
}

/// Whether a point of quad q is too near to quad r or an edge of q crosses it. apart: they share no vertex.
bool touches(const Quad& q, const Patch& at_q, const Quad& r, const Patch& at_r, bool apart,
             double clearance_rel) {
    const double clearance = clearance_rel * std::min(at_q.edge, at_r.edge);
    if (at_r.is_before(at_q.centre, clearance)) return true;
    for (const Point& x : at_q.x)
        if (at_r.is_before(0.5 * (at_q.centre + x), clearance) || (apart && at_r.is_before(x, clearance)))
            return true;
    for (int k = 0; k < 4; ++k)
        if (!contains(r, q[k]) && !contains(r, q[(k + 1) % 4]) &&
            at_r.is_crossed_by(at_q.x[k], at_q.x[(k + 1) % 4]))
            return true;
    return false;
}

} // namespace

/// Boxes of some quads at given positions.
class QuadTree {
  public:
    QuadTree(std::span<const Point> positions, std::span<const Quad> quads, std::span<const Index> which) {
        std::vector<Box> boxes(which.size());
        Box frame;
        for (std::size_t i = 0; i < which.size(); ++i) {
            for (Index v : quads[which[i]]) boxes[i].add(positions[v]);
            frame.add(boxes[i]);
        }
        if (boxes.empty()) return;
        tree_ = BoxTree(frame);
        root_ = tree_.add_tree(boxes, 0, order_);
        for (Index& item : order_) item = which[item];
    }

    /// visit(quad) for every quad whose box may be within `radius` of a point.
    template <class Visit>
    void visit_near(const Point& at, double radius, const Visit& visit) const {
        if (order_.empty()) return;
        const double radius2 = radius * radius;
        tree_.visit_near(root_, at, radius2, [&](Index first, Index last) {
            for (Index i = first; i < last; ++i) visit(order_[i]);
        });
    }

  private:
    BoxTree tree_;
    Index root_ = kNoIndex;
    std::vector<Index> order_;
};

ContactGuard::ContactGuard(const HexMesh& mesh, const Topology& topology, std::span<const Quad> quads,
                           const Csr<Index>& vertex_quad, std::span<const Point> start, double deviation,
                           const Parallel& parallel, ContactLimits contact)
    : mesh_(mesh), contact_(contact), topology_(topology), quads_(quads), vertex_quad_(vertex_quad),
      is_candidate_(quads.size(), 0), is_exempt_(quads.size(), 0) {
    find_candidates(start, deviation, parallel);
    std::vector<Index> all(quads.size());
    for (Index q = 0; q < quads.size(); ++q) all[q] = q;
    for (const Pair& pair : find_pairs(start, all, parallel))
        for (Index q : pair) is_exempt_[q] = 1;
}

ContactGuard::ContactGuard(const HexMesh& mesh, const Topology& topology, std::span<const Quad> quads,
                           const Csr<Index>& vertex_quad, ContactLimits contact)
    : mesh_(mesh), contact_(contact), topology_(topology), quads_(quads), vertex_quad_(vertex_quad),
      is_candidate_(quads.size(), 1), candidates_(quads.size()), is_exempt_(quads.size(), 0) {
    for (Index q = 0; q < quads.size(); ++q) candidates_[q] = q;
}

/// Quads slide on their surface or stay within the deviation of it: only where the surface faces itself
/// closer than that can they meet.
void ContactGuard::find_candidates(std::span<const Point> start, double deviation, const Parallel& parallel) {
    std::vector<Index> all(quads_.size());
    for (Index q = 0; q < quads_.size(); ++q) all[q] = q;
    const QuadTree tree(start, quads_, all);
    const auto can_meet = [&](const Patch& at, const Patch& other) {
        return glm::dot(at.normal, other.normal) < kFacing &&
               glm::dot(other.centre - at.centre, at.normal) > -contact_.clearance_rel * at.edge;
    };
    std::vector<std::uint8_t> faces(quads_.size(), 0);
    parallel.for_each(quads_.size(), 64, [&](std::size_t q) {
        const Patch at(start, quads_[q]);
        tree.visit_near(at.centre, at.radius + at.edge + 2 * deviation, [&](Index r) {
            if (r == q || faces[q] || shared_vertices(static_cast<Index>(q), r) > 1) return;
            const Patch other(start, quads_[r]);
            faces[q] = can_meet(at, other) || can_meet(other, at);
        });
    });
    is_candidate_ = std::move(faces);
    for (Index q = 0; q < quads_.size(); ++q)
        if (is_candidate_[q]) candidates_.push_back(q);
}

/// Vertices that two quads have in common; what hangs counts as its masters too, so that a quad and the
/// smaller ones along its edge are neighbours.
int ContactGuard::shared_vertices(Index a, Index b) const {
    const Hanging& hanging = mesh_.hanging;
    const auto has = [&](Index quad, Index vertex) {
        for (Index v : quads_[quad]) {
            if (v == vertex) return true;
            if (hanging.empty() || topology_.hanging_row[v] == kNoIndex) continue;
            const Index row = topology_.hanging_row[v];
            for (std::size_t k = hanging.offset[row]; k < hanging.offset[row + 1]; ++k)
                if (hanging.master[k] == vertex) return true;
        }
        return false;
    };
    int count = 0;
    for (Index v : quads_[a]) {
        count += has(b, v);
        if (hanging.empty() || topology_.hanging_row[v] == kNoIndex || has(b, v)) continue;
        const Index row = topology_.hanging_row[v];
        for (std::size_t k = hanging.offset[row]; k < hanging.offset[row + 1]; ++k)
            count += !contains(quads_[a], hanging.master[k]) && contains(quads_[b], hanging.master[k]);
    }
    return count;
}

void ContactGuard::append_facing(std::span<const Point> positions, const QuadTree& tree, Index quad,
                                 std::vector<Pair>& found) const {
    const Patch at(positions, quads_[quad]);
    tree.visit_near(at.centre, at.radius + contact_.clearance_rel * at.edge, [&](Index r) {
        if (r == quad) return;
        const Patch other(positions, quads_[r]);
        const double facing = glm::dot(at.normal, other.normal);
        if (facing >= kFacing) return;
        const int shared = shared_vertices(quad, r);
        // At a common edge the angle alone does not tell: warped quads may cross away from its ends.
        if (shared > 2 || (shared == 2 && facing > kFolded)) return;
        if (touches(quads_[quad], at, quads_[r], other, shared == 0, contact_.clearance_rel) ||
            touches(quads_[r], other, quads_[quad], at, shared == 0, contact_.clearance_rel))
            found.push_back({std::min(quad, r), std::max(quad, r)});
    });
}

/// Angle inside the mesh at edge ab near a: the sum over the cells round it.
double ContactGuard::inner_angle(std::span<const Point> positions, Index a, Index b) const {
    const Point along = glm::normalize(positions[b] - positions[a]);
    double sum = 0;
    for (CellCorner corner : topology_.vertex_cell[a]) {
        const Cell& cell = mesh_.cells[corner.cell];
        std::array<Point, 2> side;
        int sides = 0;
        bool has_edge = false;
        for (const auto& edge : hex::kEdgeVertex) {
            if (edge[0] != corner.corner && edge[1] != corner.corner) continue;
            const Index other = cell[edge[0] == corner.corner ? edge[1] : edge[0]];
            if (other == b)
                has_edge = true;
            else if (sides < 2)
                side[sides++] = positions[other] - positions[a];
        }
        if (!has_edge || sides < 2) continue;
        for (Point& s : side) s -= glm::dot(s, along) * along;
        sum += std::atan2(glm::length(glm::cross(side[0], side[1])), glm::dot(side[0], side[1]));
    }
    return sum;
}

void ContactGuard::append_folded(std::span<const Point> positions, Index quad,
                                 std::vector<Pair>& found) const {
    const Quad& q = quads_[quad];
    const Point normal = Patch(positions, q).normal;
    for (int k = 0; k < 4; ++k) {
        const Index a = q[k], b = q[(k + 1) % 4];
        Index neighbour = kNoIndex;
        int count = 0;
        for (Index r : vertex_quad_[a])
            if (r != quad && contains(quads_[r], b)) neighbour = r, ++count;
        if (count != 1 || glm::dot(normal, Patch(positions, quads_[neighbour]).normal) > kFolded) continue;
        const double most = 2 * std::numbers::pi - contact_.folded_rad;
        if (inner_angle(positions, a, b) > most || inner_angle(positions, b, a) > most)
            found.push_back({std::min(quad, neighbour), std::max(quad, neighbour)});
    }
}

std::vector<ContactGuard::Pair> ContactGuard::find_pairs(std::span<const Point> positions,
                                                         std::span<const Index> moved,
                                                         const Parallel& parallel) const {
    bool any = false;
    for (Index q : moved) any = any || is_candidate_[q];
    const QuadTree tree(positions, quads_, any ? candidates_ : std::vector<Index>{});
    static constexpr std::size_t kChunk = 64;
    std::vector<std::vector<Pair>> partial((moved.size() + kChunk - 1) / kChunk);
    parallel.for_each(moved.size(), kChunk, [&](std::size_t i) {
        std::vector<Pair>& found = partial[i / kChunk];
        append_folded(positions, moved[i], found);
        if (is_candidate_[moved[i]]) append_facing(positions, tree, moved[i], found);
    });
    std::vector<Pair> pairs;
    for (const auto& part : partial) pairs.insert(pairs.end(), part.begin(), part.end());
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    return pairs;
}

std::vector<Index> ContactGuard::touching(std::span<const Point> positions, std::span<const Index> moved,
                                          const Parallel& parallel) const {
    std::vector<Index> quads;
    for (const Pair& pair : find_pairs(positions, moved, parallel))
        if (!is_exempt_[pair[0]] && !is_exempt_[pair[1]]) quads.insert(quads.end(), pair.begin(), pair.end());
    std::sort(quads.begin(), quads.end());
    quads.erase(std::unique(quads.begin(), quads.end()), quads.end());
    return quads;
}

std::vector<Index> find_boundary_contacts(const HexMesh& mesh, const Topology& topology,
                                          const Parallel& parallel) {
    const BoundaryContacts contacts(mesh, topology, kTouching);
    std::vector<Index> all(contacts.quad_count());
    for (Index q = 0; q < all.size(); ++q) all[q] = q;
    return contacts.touching(mesh.positions, all, parallel);
}

} // namespace hexopt
