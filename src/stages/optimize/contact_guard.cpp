#include "stages/optimize/contact_guard.hpp"

#include "domain/box_tree.hpp"
#include "domain/closest_point.hpp"
#include "mesh/hex_reference.hpp"
#include "stages/optimize/boundary_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

namespace hexopt {

namespace {

constexpr double kFacing = 0.3; ///< cosine between normals below which quads face one another
/// The same between the normal at a sample of a quad and that of the quad it lies on, and of quads at a
/// common edge.
constexpr double kOpposite = -0.5;
constexpr double kFolded = -0.9; ///< the same of quads at one edge, at its ends, that may be folded over
/// What is nearer to a quad's plane or border, of its edge, is on it: where a vertex hangs, edges run along
/// or end on those of a larger quad, but for rounding.
constexpr double kOn_rel = 1e-6;
/// One in so many quads, or fewer, count as few.
constexpr std::size_t kFewMoved = 8;
constexpr double kBoxReach = 1.75; ///< of a quad's box from its centre, over its radius: sqrt(3) and rounding
constexpr double kRounding = 1.001; ///< of a distance beyond which boxes are apart
/// Of a quad's extent squared: what the normals at its corners have at least along a direction for all
/// normals between them to be on its side for certain.
constexpr double kSameSide_rel = 1e-6;

Box box_of(std::span<const Point> points) {
    Box box;
    for (const Point& p : points) box.add(p);
    return box;
}

/// Whether boxes are farther apart than `distance`, in some direction.
bool are_apart(const Box& a, const Box& b, double distance) {
    for (int k = 0; k < 3; ++k)
        if (a.low[k] > b.high[k] + distance || b.low[k] > a.high[k] + distance) return true;
    return false;
}

/// A quad as four triangles round its centre.
struct Patch {
    struct Sample {
        Point at, normal;
    };

    std::array<Point, 4> x;
    Point centre, normal;
    double edge = 0, radius = 0; ///< mean edge; of the ball round the centre that holds the corners

    Patch(std::span<const Point> positions, const Quad& quad) {
        for (int k = 0; k < 4; ++k) x[k] = positions[quad[k]];
        centre = 0.25 * ((x[0] + x[2]) + (x[1] + x[3]));
        normal = unit(glm::cross(x[2] - x[0], x[3] - x[1]));
        for (int k = 0; k < 4; ++k) {
            edge += 0.25 * glm::distance(x[k], x[(k + 1) % 4]);
            radius = std::max(radius, glm::distance(x[k], centre));
        }
    }

    static Point unit(const Point& p) {
        const double length = glm::length(p);
        return length > 0 ? p / length : Point(0);
    }

    /// At parameters in 0..1 along the sides 0-1 and 0-3.
    Sample sample(double u, double v) const {
        const Point low = x[0] + u * (x[1] - x[0]), high = x[3] + u * (x[2] - x[3]);
        const Point along_u = (1 - v) * (x[1] - x[0]) + v * (x[2] - x[3]);
        return {low + v * (high - low), unit(glm::cross(along_u, high - low))};
    }

    using Samples = std::array<Sample, 5>;
    Samples compute_samples() const {
        return {sample(0.5, 0.5), sample(0.25, 0.25), sample(0.75, 0.25), sample(0.75, 0.75),
                sample(0.25, 0.75)};
    }

    Point corner_normal(int k) const {
        return unit(glm::cross(x[(k + 1) % 4] - x[k], x[(k + 3) % 4] - x[k]));
    }

    /// Whether p lies within `clearance` of the patch; only_before: on its outer side.
    bool is_near(const Point& p, double clearance, bool only_before) const {
        if (glm::distance(p, centre) > radius + clearance) return false;
        if (are_apart(box_of(x), {p, p}, kRounding * clearance)) return false;
        for (int k = 0; k < 4; ++k) {
            const Point d = p - closest_on_triangle(p, x[k], x[(k + 1) % 4], centre).point;
            if (glm::dot(d, d) < clearance * clearance && (!only_before || glm::dot(d, normal) >= 0))
                return true;
        }
        return false;
    }

    /// Whether the segment pq passes through the inside of the patch.
    bool is_crossed_by(const Point& p, const Point& q) const {
        const auto side = [](const Point& a, const Point& b, const Point& c, const Point& d) {
            return glm::dot(glm::cross(b - a, c - a), d - a);
        };
        for (int k = 0; k < 4; ++k) {
            const Point &a = x[k], &b = x[(k + 1) % 4];
            const double above = side(a, b, centre, p), below = side(a, b, centre, q);
            const double least = kOn_rel * edge * glm::length(glm::cross(b - a, centre - a));
            if (above * below >= 0 || std::min(std::abs(above), std::abs(below)) < least) continue;
            const double u = side(p, q, a, b), v = side(p, q, b, centre), w = side(p, q, centre, a);
            const bool is_inside = (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
            if (is_inside && std::abs(u) > kOn_rel * std::abs(u + v + w)) return true;
        }
        return false;
    }
};

bool contains(const Quad& quad, Index v) {
    return quad[0] == v || quad[1] == v || quad[2] == v || quad[3] == v;
}

/// Whether an edge of quad q crosses quad r elsewhere than at a common vertex.
bool crosses(const Quad& q, const Patch& at_q, const Quad& r, const Patch& at_r) {
    for (int k = 0; k < 4; ++k)
        if ((!contains(r, q[k]) || !contains(r, q[(k + 1) % 4])) &&
            at_r.is_crossed_by(at_q.x[k], at_q.x[(k + 1) % 4]))
            return true;
    return false;
}

/// Which way a quad faces at its corners, between which its normals are.
struct CornerNormals {
    std::array<Point, 4> at_corner; ///< not of unit length
    Point normal;                   ///< as Patch::normal
    double least;                   ///< of a corner's normal along a direction, to be on its side for certain

    CornerNormals(const std::array<Point, 4>& x, const Box& box)
        : normal(Patch::unit(glm::cross(x[2] - x[0], x[3] - x[1]))) {
        for (int k = 0; k < 4; ++k) at_corner[k] = glm::cross(x[(k + 1) % 4] - x[k], x[(k + 3) % 4] - x[k]);
        const Point extent = box.high - box.low;
        least = kSameSide_rel * glm::dot(extent, extent);
    }

    bool are_along(const Point& direction) const {
        return std::all_of(at_corner.begin(), at_corner.end(),
                           [&](const Point& n) { return glm::dot(n, direction) > least; });
    }
};

bool share_vertex(const Quad& q, const Quad& r) {
    return std::any_of(q.begin(), q.end(), [&](Index v) { return contains(r, v); });
}

/// Whether quads face about the same way all over: such are in no contact where they share a vertex.
bool face_alike(const CornerNormals& a, const CornerNormals& b) {
    return glm::dot(a.normal, b.normal) >= kFacing && a.are_along(b.normal) && b.are_along(a.normal);
}

/// Round a quad's centre, in which it looks for others.
double search_radius(const Patch& at, const ContactLimits& limits) {
    return at.radius + 4 * limits.clearance_rel * at.edge;
}

void make_unique(std::vector<Index>& items) {
    std::sort(items.begin(), items.end());
    items.erase(std::unique(items.begin(), items.end()), items.end());
}

} // namespace

/// A quad and places on it.
struct PlacedQuad : Patch {
    Samples samples;

    explicit PlacedQuad(const Patch& patch) : Patch(patch), samples(compute_samples()) {}

    /// Whether a sample lies on another quad that faces the other way, on whichever side.
    bool lies_on(const Patch& other, double clearance) const {
        return std::any_of(samples.begin(), samples.end(), [&](const Sample& sample) {
            return glm::dot(sample.normal, other.normal) < kOpposite &&
                   other.is_near(sample.at, clearance, false);
        });
    }

    /// Whether a place on it is too near before another quad. apart: they share no vertex.
    bool is_before(const Patch& other, bool apart, double clearance) const {
        const auto near = [&](const Point& p) { return other.is_near(p, clearance, true); };
        return std::any_of(samples.begin(), samples.end(), [&](const auto& s) { return near(s.at); }) ||
               (apart && std::any_of(x.begin(), x.end(), near));
    }
};

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
        box_.reserve(boxes.size());
        for (Index& item : order_) {
            box_.push_back(boxes[item]);
            item = which[item];
        }
    }

    /// Whether the box of one of the quads may be within `radius` of a point.
    bool is_near(const Point& at, double radius) const {
        bool found = false;
        if (order_.empty()) return found;
        double radius2 = radius * radius;
        tree_.visit_near(root_, at, radius2, [&](Index, Index) { found = true, radius2 = 0; });
        return found;
    }

    /// visit(quad, box) for every quad whose box may be within `radius` of a point.
    template <class Visit>
    void visit_near(const Point& at, double radius, const Visit& visit) const {
        if (order_.empty()) return;
        const double radius2 = radius * radius;
        tree_.visit_near(root_, at, radius2, [&](Index first, Index last) {
            for (Index i = first; i < last; ++i) visit(order_[i], box_[i]);
        });
    }

  private:
    BoxTree tree_;
    Index root_ = kNoIndex;
    std::vector<Index> order_;
    std::vector<Box> box_; ///< in that order
};

ContactGuard::ContactGuard(const HexMesh& mesh, const Topology& topology, std::span<const Quad> quads,
                           const Csr<Index>& vertex_quad, std::span<const Point> start, double deviation,
                           const Parallel& parallel, ContactLimits contact)
    : mesh_(mesh), contact_(contact), topology_(topology), quads_(quads), vertex_quad_(vertex_quad),
      is_candidate_(quads.size(), 0) {
    find_candidates(start, deviation, parallel);
    std::vector<Index> all(quads.size());
    for (Index q = 0; q < quads.size(); ++q) all[q] = q;
    allow_present(start, all, allowed_, parallel);
}

ContactGuard::ContactGuard(const HexMesh& mesh, const Topology& topology, std::span<const Quad> quads,
                           const Csr<Index>& vertex_quad, ContactLimits contact)
    : mesh_(mesh), contact_(contact), topology_(topology), quads_(quads), vertex_quad_(vertex_quad),
      is_candidate_(quads.size(), 1), candidates_(quads.size()) {
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
        tree.visit_near(at.centre, at.radius + at.edge + 2 * deviation, [&](Index r, const Box&) {
            if (r == q || faces[q]) return;
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
                                 const ContactLimits& limits, std::vector<Pair>& found) const {
    const PlacedQuad at(Patch(positions, quads_[quad]));
    const Box box = box_of(at.x);
    const CornerNormals normals(at.x, box);
    tree.visit_near(at.centre, search_radius(at, limits), [&](Index r, const Box& other_box) {
        if (r == quad) return;
        const Point extent = other_box.high - other_box.low; // no edge is longer than its sum
        const double longest = std::max(at.edge, extent.x + extent.y + extent.z);
        if (are_apart(box, other_box, kRounding * limits.clearance_rel * longest)) return;
        // Nearly all pairs that come up are neighbours on a smooth surface.
        if (share_vertex(quads_[quad], quads_[r])) {
            std::array<Point, 4> x;
            for (int k = 0; k < 4; ++k) x[k] = positions[quads_[r][k]];
            if (face_alike(normals, CornerNormals(x, other_box))) return;
        }
        const Patch other(positions, quads_[r]);
        if (glm::distance(at.centre, other.centre) >
            at.radius + other.radius + limits.clearance_rel * std::max(at.edge, other.edge))
            return;
        if (is_in_contact(quad, at, r, PlacedQuad(other), limits.clearance_rel))
            found.push_back({std::min(quad, r), std::max(quad, r)});
    });
}

bool ContactGuard::is_in_contact(Index quad, const PlacedQuad& at, Index other_quad, const PlacedQuad& other,
                                 double clearance_rel) const {
    const double touching_rel = std::min(clearance_rel, kTouching.clearance_rel);
    if (at.lies_on(other, touching_rel * at.edge) || other.lies_on(at, touching_rel * other.edge))
        return true;
    const double facing = glm::dot(at.normal, other.normal);
    const int shared = shared_vertices(quad, other_quad);
    if (facing >= kFacing && shared > 0) return false;
    if (shared > 2) return false;
    const Quad &q = quads_[quad], &r = quads_[other_quad];
    if (!are_apart(box_of(at.x), box_of(other.x), kOn_rel * std::min(at.edge, other.edge)) &&
        (crosses(q, at, r, other) || crosses(r, other, q, at)))
        return true;
    if (facing >= (shared == 2 ? kOpposite : kFacing)) return false;
    const double clearance = clearance_rel * std::min(at.edge, other.edge);
    return at.is_before(other, shared == 0, clearance) || other.is_before(at, shared == 0, clearance);
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

void ContactGuard::append_folded(std::span<const Point> positions, Index quad, const ContactLimits& limits,
                                 std::vector<Pair>& found) const {
    const Quad& q = quads_[quad];
    const Patch at(positions, q);
    for (int k = 0; k < 4; ++k) {
        const Index a = q[k], b = q[(k + 1) % 4];
        Index neighbour = kNoIndex;
        int count = 0;
        for (Index r : vertex_quad_[a])
            if (r != quad && contains(quads_[r], b)) neighbour = r, ++count;
        if (count != 1) continue;
        const Patch other(positions, quads_[neighbour]);
        const auto is_bent_at = [&](int corner) {
            const Quad& r = quads_[neighbour];
            const auto there = std::find(r.begin(), r.end(), q[corner % 4]) - r.begin();
            return glm::dot(at.corner_normal(corner % 4), other.corner_normal(static_cast<int>(there))) <=
                   kFolded;
        };
        if (glm::dot(at.normal, other.normal) > kFolded && !is_bent_at(k) && !is_bent_at(k + 1)) continue;
        const double most = 2 * std::numbers::pi - limits.folded_rad;
        if (inner_angle(positions, a, b) > most || inner_angle(positions, b, a) > most)
            found.push_back({std::min(quad, neighbour), std::max(quad, neighbour)});
    }
}

/// Candidates that append_facing() may meet from one of `moved`: where few have moved, a tree over all would
/// cost more than everything else.
std::vector<Index> ContactGuard::candidates_near(std::span<const Point> positions,
                                                 std::span<const Index> moved, const ContactLimits& limits,
                                                 const Parallel& parallel) const {
    std::vector<Index> asking;
    double largest = 0;
    for (Index q : moved) {
        if (!is_candidate_[q]) continue;
        asking.push_back(q);
        largest = std::max(largest, search_radius(Patch(positions, quads_[q]), limits));
    }
    if (asking.empty()) return {};
    if (kFewMoved * asking.size() > candidates_.size()) return candidates_;
    const QuadTree tree(positions, quads_, asking);
    std::vector<std::uint8_t> is_near(candidates_.size(), 0);
    parallel.for_each(candidates_.size(), 1024, [&](std::size_t i) {
        const Patch at(positions, quads_[candidates_[i]]);
        is_near[i] = tree.is_near(at.centre, kBoxReach * at.radius + 1.01 * largest);
    });
    std::vector<Index> near;
    for (std::size_t i = 0; i < is_near.size(); ++i)
        if (is_near[i]) near.push_back(candidates_[i]);
    return near;
}

std::vector<ContactGuard::Pair> ContactGuard::find_pairs(std::span<const Point> positions,
                                                         std::span<const Index> moved,
                                                         const ContactLimits& limits,
                                                         const Parallel& parallel) const {
    const QuadTree tree(positions, quads_, candidates_near(positions, moved, limits, parallel));
    static constexpr std::size_t kChunk = 64;
    std::vector<std::vector<Pair>> partial((moved.size() + kChunk - 1) / kChunk);
    parallel.for_each(moved.size(), kChunk, [&](std::size_t i) {
        std::vector<Pair>& found = partial[i / kChunk];
        append_folded(positions, moved[i], limits, found);
        if (is_candidate_[moved[i]]) append_facing(positions, tree, moved[i], limits, found);
    });
    std::vector<Pair> pairs;
    for (const auto& part : partial) pairs.insert(pairs.end(), part.begin(), part.end());
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    return pairs;
}

void ContactGuard::allow_present(std::span<const Point> positions, std::span<const Index> quads,
                                 AllowedContacts& allowed, const Parallel& parallel) const {
    allowed.near.resize(quads_.size(), 0);
    allowed.touching.resize(quads_.size(), 0);
    std::vector<Index> near;
    for (const Pair& pair : find_pairs(positions, quads, contact_, parallel))
        near.insert(near.end(), pair.begin(), pair.end());
    make_unique(near);
    for (Index q : near) allowed.near[q] = 1;
    if (near.empty()) return;
    for (const Pair& pair : find_pairs(positions, near, kTouching, parallel))
        for (Index q : pair) allowed.touching[q] = 1;
}

std::vector<Index> ContactGuard::touching(std::span<const Point> positions, std::span<const Index> moved,
                                          const AllowedContacts& allowed, const Parallel& parallel) const {
    std::vector<Index> quads, near;
    const auto append = [&](const Pair& pair, const std::vector<std::uint8_t>& exempt) {
        const bool is_exempt = !exempt.empty() && (exempt[pair[0]] || exempt[pair[1]]);
        if (!is_exempt) quads.insert(quads.end(), pair.begin(), pair.end());
        return !is_exempt;
    };
    for (const Pair& pair : find_pairs(positions, moved, contact_, parallel))
        if (!append(pair, allowed.near)) near.insert(near.end(), pair.begin(), pair.end());
    // What was near may go on so, but not come to touch.
    make_unique(near);
    if (!near.empty())
        for (const Pair& pair : find_pairs(positions, near, kTouching, parallel))
            append(pair, allowed.touching);
    make_unique(quads);
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
