#include "stages/fit/regions.hpp"

#include "core/union_find.hpp"
#include "stages/fit/curve_sides.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <numeric>
#include <set>

namespace hexopt::fit {

namespace {

constexpr std::size_t kChunk = 512;
/// A quad farther from its region's patch than this, in local edge lengths, does not belong to it.
constexpr double kLeak = 1;
/// Fewer quads than these are an island even where they are all that a patch has.
constexpr std::size_t kIsland = 5;
constexpr int kIslandRounds = 4; ///< islands within islands

/// Finds the patch that a quad lies on.
class PatchFinder {
  public:
    PatchFinder(const SurfaceMesh& surface, const std::vector<Point>& x, const Domain& domain)
        : surface_(surface), x_(x), model_(domain.model) {
        for (Index p = 0; p < model_.patch_count(); ++p) {
            Box& box = box_.emplace_back();
            const auto [first, last] = model_.patch_triangles(p);
            for (Index t = first; t < last; ++t)
                for (const Point& corner : model_.triangle(t)) box.add(corner);
        }
    }

    /// The nearest patch; where that faces another way than the quad, one that does not and is not much
    /// farther away counts: beside thin walls and fins the nearest may be the wrong side.
    Index find(Index q) const {
        const Quad& quad = surface_.quad[q];
        const Point centre = 0.25 * (x_[quad[0]] + x_[quad[1]] + x_[quad[2]] + x_[quad[3]]);
        const Point area = glm::cross(x_[quad[2]] - x_[quad[0]], x_[quad[3]] - x_[quad[1]]);
        const Point normal = area / std::max(glm::length(area), 1e-300);
        const double size = std::sqrt(0.5 * glm::length(area));
        const Projection nearest = model_.project_patch(kNoIndex, centre);
        Index best = model_.patch_of_triangle(nearest.element);
        double least = cost(nearest, normal, size);
        if (glm::dot(nearest.direction, normal) > kAgrees) return best;
        for (Index p = 0; p < box_.size(); ++p) {
            if (distance_to(box_[p], centre) > least * size) continue;
            const double c = cost(model_.project_patch(p, centre), normal, size);
            if (c >= least) continue;
            least = c;
            best = p;
        }
        return best;
    }

  private:
    static constexpr double kAgrees = 0.5; ///< cosine of the angle between normals
    /// What facing the other way counts, in edge lengths.
    static constexpr double kTurned = 0.5;

    static double cost(const Projection& at, const Point& normal, double size) {
        return at.distance / size + kTurned * (1 - glm::dot(at.direction, normal));
    }
    static double distance_to(const Box& box, const Point& p) {
        return glm::length(glm::max(glm::max(box.low - p, p - box.high), Point(0)));
    }

    const SurfaceMesh& surface_;
    const std::vector<Point>& x_;
    const BoundaryModel& model_;
    std::vector<Box> box_; ///< per patch
};

std::vector<Index> nearest_patches(const SurfaceMesh& surface, const std::vector<Point>& x,
                                   const Domain& domain, const Context& context) {
    const PatchFinder finder(surface, x, domain);
    std::vector<Index> patch(surface.quad.size());
    context.parallel().for_each(patch.size(), kChunk,
                                [&](std::size_t q) { patch[q] = finder.find(static_cast<Index>(q)); });
    return patch;
}

class RegionFinder {
  public:
    RegionFinder(const SurfaceMesh& surface, const std::vector<Point>& placed, const Domain& domain,
                 const CurveNet& net, const Capture& capture, const Context& context)
        : surface_(surface), placed_(placed), domain_(domain), net_(net), capture_(capture),
          left_(find_left_patches(domain, net)), nearest_(nearest_patches(surface, placed, domain, context)) {
    }

    Regions run() {
        regions_.released.assign(net_.curve_legs.size(), Release::none);
        dropped_.assign(surface_.edge.size(), 0);
        for (std::size_t c = 0; c < net_.curve_legs.size(); ++c)
            if (net_.too_small[c]) regions_.released[c] = Release::small;
        for (std::size_t c = 0; c < net_.curve_legs.size(); ++c)
            for (Index l = net_.curve_legs[c][0]; l < net_.curve_legs[c][1]; ++l)
                if (capture_.path[l].empty()) regions_.released[c] = why_missing(net_.legs[l]);
        do {
            mark_edges();
            label();
        } while (release_inconsistent() || drop_misfits());
        return std::move(regions_);
    }

  private:
    Release why_missing(const Leg& leg) const {
        if (domain_.curve_open[leg.curve]) return Release::open;
        for (Index a : leg.anchor)
            if (capture_.anchor_vertex[a] == kNoIndex) return Release::corner;
        return Release::blocked;
    }

    void mark_edges() {
        regions_.edge_curve.assign(surface_.edge.size(), kNoIndex);
        for (Index l = 0; l < net_.legs.size(); ++l) mark_path(capture_.path[l], net_.legs[l].curve);
        for (const Piece& piece : capture_.pieces) mark_path(piece.path, net_.legs[piece.leg].curve);
    }

    void mark_path(const std::vector<Index>& path, Index curve) {
        for (std::size_t i = 0; i + 1 < path.size(); ++i) {
            const Index e = find_edge(surface_, path[i], path[i + 1]);
            if (!dropped_[e]) regions_.edge_curve[e] = curve;
        }
    }

    UnionFind connect_quads() const {
        UnionFind sets(surface_.quad.size());
        for (Index e = 0; e < surface_.edge.size(); ++e)
            if (regions_.edge_curve[e] == kNoIndex && surface_.edge[e].quad[1] != kNoIndex)
                sets.join(surface_.edge[e].quad[0], surface_.edge[e].quad[1]);
        for (const auto& [q, r] : surface_.across) sets.join(q, r);
        return sets;
    }

    /// Patches joined over the released curves.
    UnionFind connect_patches() const {
        UnionFind sets(domain_.model.patch_count());
        for (Index c = 0; c < domain_.curve_patch.rows(); ++c)
            if (!regions_.kept(c) && !net_.too_small[c])
                for (Index p : domain_.curve_patch[c]) sets.join(domain_.curve_patch[c][0], p);
        for (const auto& [p, q] : leaks_) sets.join(p, q);
        return sets;
    }

    double distance_to_group(Index q, Index group, UnionFind& patches) const {
        const Point centre = quad_centre_of(q);
        double least = std::numeric_limits<double>::infinity();
        for (Index p = 0; p < domain_.model.patch_count(); ++p)
            if (patches.find(p) == group)
                least = std::min(least, domain_.model.project_patch(p, centre).distance);
        return least;
    }

    double size_of(Index q) const {
        double sum = 0;
        for (Index v : surface_.quad[q]) sum += 0.25 * surface_.size[v];
        return sum;
    }

    /// Where a region holds quads that are far from the patch that won it, the curves do not enclose it: that
    /// patch and theirs count as one. True if such quads were found.
    bool find_leaks(UnionFind& quads, UnionFind& patches,
                    const std::map<Index, std::pair<std::size_t, Index>>& winner) {
        std::set<std::array<Index, 2>> seen;
        for (Index q = 0; q < surface_.quad.size(); ++q) {
            const Index group = winner.at(quads.find(q)).second, own = patches.find(nearest_[q]);
            if (own == group || seen.contains({group, own})) continue;
            if (distance_to_group(q, group, patches) < kLeak * size_of(q)) continue;
            seen.insert({group, own});
            leaks_.push_back({group, own});
        }
        return !seen.empty();
    }

    void label() {
        find_expected();
        while (!label_regions()) {
        }
    }

    /// False if regions were found that curves do not enclose; they are to be labelled again.
    bool label_regions() {
        UnionFind quads = connect_quads(), patches = connect_patches();
        std::map<std::array<Index, 2>, std::size_t> votes; // of a region for a group of patches
        for (Index q = 0; q < surface_.quad.size(); ++q) ++votes[{quads.find(q), patches.find(nearest_[q])}];
        std::map<Index, std::pair<std::size_t, Index>> winner;
        for (const auto& [key, count] : votes)
            if (auto& best = winner[key[0]]; count > best.first) best = {count, key[1]};
        for (const auto& [region, patch] : find_enclosed(quads)) winner[region].second = patches.find(patch);
        if (find_leaks(quads, patches, winner)) return false;
        std::vector<Index> only(domain_.model.patch_count(), kNoIndex); // per group: its patch if it has one
        std::vector<std::size_t> members(domain_.model.patch_count(), 0);
        for (Index p = 0; p < domain_.model.patch_count(); ++p) {
            ++members[patches.find(p)];
            only[patches.find(p)] = p;
        }
        regions_.quad_patch.resize(surface_.quad.size());
        group_.assign(surface_.quad.size(), kNoIndex);
        for (Index q = 0; q < surface_.quad.size(); ++q) {
            const Index group = winner[quads.find(q)].second;
            if (members[group] == 1)
                regions_.quad_patch[q] = only[group];
            else
                regions_.quad_patch[q] = patches.find(nearest_[q]) == group ? nearest_[q] : kNoIndex;
            if (members[group] > 1) group_[q] = group;
        }
        label_beside_ridges(patches);
        spread_labels();
        for (int round = 0; round < kIslandRounds && absorb_islands(); ++round) {
        }
        return true;
    }

    void find_expected() {
        expected_.assign(surface_.edge.size(), {kNoIndex, kNoIndex});
        for (Index l = 0; l < net_.legs.size(); ++l) expect_beside(capture_.path[l], l);
        for (const Piece& piece : capture_.pieces) expect_beside(piece.path, piece.leg);
    }

    /// Per region (by its representative) the patch that all edges round it ask for; not those where they
    /// ask for several or some for none.
    std::map<Index, Index> find_enclosed(UnionFind& quads) const {
        std::map<Index, Index> patch;
        for (Index e = 0; e < surface_.edge.size(); ++e)
            for (std::size_t side = 0; side < 2 && regions_.edge_curve[e] != kNoIndex; ++side) {
                const Index p = expected_[e][side];
                const auto [at, first] = patch.try_emplace(quads.find(surface_.edge[e].quad[side]), p);
                if (at->second != p) at->second = kNoIndex;
            }
        std::erase_if(patch, [](const auto& entry) { return entry.second == kNoIndex; });
        return patch;
    }

    /// In a region of several patches the quads beside a curve belong to those that the curve bounds.
    void label_beside_ridges(UnionFind& patches) {
        for (Index e = 0; e < surface_.edge.size(); ++e) {
            if (regions_.edge_curve[e] == kNoIndex) continue;
            const std::span<const Index> own = domain_.curve_patch[regions_.edge_curve[e]];
            for (std::size_t side = 0; side < 2; ++side) {
                const Index q = surface_.edge[e].quad[side];
                const auto belongs = [&](Index p) { return p != kNoIndex && patches.find(p) == group_[q]; };
                if (group_[q] == kNoIndex) continue;
                if (expected_[e][side] == kNoIndex) {
                    const auto found = std::find_if(own.begin(), own.end(), belongs);
                    if (found != own.end()) regions_.quad_patch[q] = *found;
                } else if (belongs(expected_[e][side])) {
                    regions_.quad_patch[q] = expected_[e][side];
                }
            }
        }
    }

    /// The patches that belong left and right of a path along a curve of two.
    void expect_beside(const std::vector<Index>& path, Index l) {
        const Index curve = net_.legs[l].curve;
        const std::span<const Index> own = domain_.curve_patch[curve];
        if (own.size() != 2) return;
        const Index left = left_[l] != kNoIndex ? left_[l] : nearest_left(path, curve);
        const Index right = own[0] == left ? own[1] : own[0];
        for (std::size_t i = 0; i + 1 < path.size(); ++i) {
            const Index e = find_edge(surface_, path[i], path[i + 1]);
            if (regions_.edge_curve[e] != curve) continue;
            const bool back = runs_backwards(surface_.edge[e].quad[0], path[i], path[i + 1]);
            expected_[e] = {back ? right : left, back ? left : right};
        }
    }

    /// Where the triangles do not tell: the patch that the quads on the left are nearer to than those on the
    /// right.
    Index nearest_left(const std::vector<Index>& path, Index curve) const {
        const std::span<const Index> own = domain_.curve_patch[curve];
        double first = 0, second = 0;
        for (std::size_t i = 0; i + 1 < path.size(); ++i) {
            auto [left, right] = surface_.edge[find_edge(surface_, path[i], path[i + 1])].quad;
            if (runs_backwards(left, path[i], path[i + 1])) std::swap(left, right);
            first += offset(left, own[0]) + offset(right, own[1]);
            second += offset(left, own[1]) + offset(right, own[0]);
        }
        return own[second < first ? 1 : 0];
    }

    bool runs_backwards(Index q, Index from, Index to) const {
        const Quad& quad = surface_.quad[q];
        for (std::size_t i = 0; i < 4; ++i)
            if (quad[i] == to && quad[(i + 1) % 4] == from) return true;
        return false;
    }

    double offset(Index q, Index patch) const {
        return domain_.model.project_patch(patch, quad_centre_of(q)).distance;
    }
    Point quad_centre_of(Index q) const {
        const Quad& quad = surface_.quad[q];
        return 0.25 * (placed_[quad[0]] + placed_[quad[1]] + placed_[quad[2]] + placed_[quad[3]]);
    }

    /// A quad nearest to a patch outside its region's group takes a neighbour's.
    void spread_labels() {
        bool changed = true;
        while (changed) {
            changed = false;
            for_each_open_side([&](Index q, Index r) { changed |= copy_label(q, r); });
        }
    }

    /// Where patches are told apart quad by quad, quads of one that no curve puts there, within another
    /// one's, are nearer to the wrong side of a curve or of a thin part: they take the label round them. A
    /// patch keeps its largest piece, if that is not a few quads only, and pieces far from what is round
    /// them. True if there were any.
    bool absorb_islands() {
        UnionFind islands(surface_.quad.size());
        for_each_open_side([&](Index q, Index r) {
            if (regions_.quad_patch[q] == regions_.quad_patch[r]) islands.join(q, r);
        });
        std::vector<std::size_t> size(surface_.quad.size(), 0);
        for (Index q = 0; q < surface_.quad.size(); ++q) ++size[islands.find(q)];
        std::vector<std::size_t> largest(domain_.model.patch_count(), 0);
        for (Index q = 0; q < surface_.quad.size(); ++q)
            if (const Index p = regions_.quad_patch[q]; p != kNoIndex)
                largest[p] = std::max(largest[p], size[islands.find(q)]);
        const std::vector<std::uint8_t> has_curve = find_islands_of_curves(islands);
        std::map<std::array<Index, 2>, std::size_t> votes; // of an island for a patch
        const auto vote = [&](Index q, Index r) {
            const Index island = islands.find(q);
            if (group_[q] == kNoIndex || group_[q] != group_[r] || island == islands.find(r) ||
                has_curve[island])
                return;
            const Index p = regions_.quad_patch[q];
            const bool is_rest = p != kNoIndex && size[island] < std::min(largest[p], size[islands.find(r)]);
            if (size[island] < kIsland || is_rest) ++votes[{island, regions_.quad_patch[r]}];
        };
        for_each_open_side([&](Index q, Index r) {
            vote(q, r);
            vote(r, q);
        });
        std::map<Index, std::pair<std::size_t, Index>> winner;
        for (const auto& [key, count] : votes)
            if (auto& best = winner[key[0]]; count > best.first) best = {count, key[1]};
        leave_distant(islands, size, winner);
        for (Index q = 0; q < surface_.quad.size(); ++q)
            if (const auto found = winner.find(islands.find(q)); found != winner.end())
                regions_.quad_patch[q] = found->second.second;
        return !winner.empty();
    }

    /// Takes larger islands out again that lie, on average, more than an edge from the patch round them.
    void leave_distant(UnionFind& islands, const std::vector<std::size_t>& size,
                       std::map<Index, std::pair<std::size_t, Index>>& winner) const {
        std::map<Index, double> distance;
        for (Index q = 0; q < surface_.quad.size(); ++q) {
            const Index island = islands.find(q);
            const auto found = winner.find(island);
            if (found == winner.end() || size[island] < kIsland) continue;
            const Index patch = found->second.second;
            distance[island] +=
                patch == kNoIndex ? std::numeric_limits<double>::infinity() : offset(q, patch) / size_of(q);
        }
        for (const auto& [island, sum] : distance)
            if (sum > kLeak * static_cast<double>(size[island])) winner.erase(island);
    }

    /// Flags (by their representatives) the islands with a quad where its curve asks for its patch.
    std::vector<std::uint8_t> find_islands_of_curves(UnionFind& islands) const {
        std::vector<std::uint8_t> has_curve(surface_.quad.size(), 0);
        for (Index e = 0; e < surface_.edge.size(); ++e)
            for (std::size_t side = 0; side < 2 && regions_.edge_curve[e] != kNoIndex; ++side)
                if (const Index q = surface_.edge[e].quad[side];
                    expected_[e][side] != kNoIndex && expected_[e][side] == regions_.quad_patch[q])
                    has_curve[islands.find(q)] = 1;
        return has_curve;
    }

    /// Visits pairs of quads side by side that no curve parts.
    template <class Visit>
    void for_each_open_side(const Visit& visit) const {
        for (Index e = 0; e < surface_.edge.size(); ++e) {
            const auto [q, r] = surface_.edge[e].quad;
            if (regions_.edge_curve[e] == kNoIndex && r != kNoIndex) visit(q, r);
        }
        for (const auto& [q, r] : surface_.across) visit(q, r);
    }

    bool copy_label(Index q, Index r) {
        std::vector<Index>& patch = regions_.quad_patch;
        if ((patch[q] == kNoIndex) == (patch[r] == kNoIndex)) return false;
        (patch[q] == kNoIndex ? patch[q] : patch[r]) = patch[q] == kNoIndex ? patch[r] : patch[q];
        return true;
    }

    /// True if a curve was released.
    bool release_inconsistent() {
        bool released = false;
        for (Index e = 0; e < surface_.edge.size(); ++e) {
            const Index c = regions_.edge_curve[e];
            if (c == kNoIndex || !regions_.kept(c) || has_own_patches(e, c)) continue;
            regions_.released[c] = Release::sides;
            released = true;
        }
        return released;
    }

    /// Whether the patches beside an edge are its curve's, each on its side.
    bool has_own_patches(Index e, Index curve) const {
        const std::span<const Index> own = domain_.curve_patch[curve];
        for (std::size_t side = 0; side < 2; ++side) {
            const Index patch = regions_.quad_patch[surface_.edge[e].quad[side]];
            if (std::find(own.begin(), own.end(), patch) == own.end()) return false;
            if (own.size() == 2 && patch != expected_[e][side]) return false;
        }
        return true;
    }

    /// Drops edges of released curves that have not the curve's own patches beside them, and single edges
    /// that are left. True if there were any.
    bool drop_misfits() {
        bool dropped = false;
        for (Index e = 0; e < surface_.edge.size(); ++e) {
            const Index c = regions_.edge_curve[e];
            if (c == kNoIndex || regions_.kept(c) || (fits(e, c) && !is_single(e, c))) continue;
            dropped_[e] = 1;
            dropped = true;
        }
        return dropped;
    }

    bool fits(Index e, Index curve) const {
        if (domain_.curve_patch[curve].size() > 2 || !has_own_patches(e, curve)) return false;
        const auto is_near = [&](Index q) { return offset(q, regions_.quad_patch[q]) <= kLeak * size_of(q); };
        return is_near(surface_.edge[e].quad[0]) && is_near(surface_.edge[e].quad[1]);
    }

    bool is_single(Index e, Index curve) const {
        for (Index v : {surface_.edge[e].a, surface_.edge[e].b})
            for (Index f : surface_.vertex_edge[v])
                if (f != e && regions_.edge_curve[f] == curve) return false;
        return true;
    }

    const SurfaceMesh& surface_;
    const std::vector<Point>& placed_;
    const Domain& domain_;
    const CurveNet& net_;
    const Capture& capture_;
    std::vector<std::uint8_t> dropped_; ///< per edge: of a path, but not used
    std::vector<Index> left_;           ///< per leg: patch on its left, kNoIndex where that is not known
    std::vector<Index> nearest_;        ///< per quad
    /// Per edge: patches of its quads that its curve asks for; only where that has two.
    std::vector<std::array<Index, 2>> expected_;
    std::vector<Index> group_;                ///< per quad of a region of several patches: their group
    std::vector<std::array<Index, 2>> leaks_; ///< patches that no captured curve parts
    Regions regions_;
};

} // namespace

const char* name_of(Release reason) {
    constexpr const char* kNames[] = {"none", "open", "corner", "blocked", "sides", "small"};
    return kNames[static_cast<std::size_t>(reason)];
}

Regions find_regions(const SurfaceMesh& surface, const std::vector<Point>& placed, const Domain& domain,
                     const CurveNet& net, const Capture& capture, const Context& context) {
    return RegionFinder(surface, placed, domain, net, capture, context).run();
}

} // namespace hexopt::fit
