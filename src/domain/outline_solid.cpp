#include "domain/outline_solid.hpp"

#include "domain/box_tree.hpp"
#include "domain/triangulate_region.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <map>
#include <set>

namespace hexopt {

namespace {

Error no_slab(std::string reason) {
    return Error{ErrorCode::bad_input,
                 "slab",
                 "",
                 {std::move(reason), "a planar mesh needs two parallel plane sides with equal outlines"}};
}

bool is_before(const Point2& a, const Point2& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; }

enum class Side : std::uint8_t { low, high };

/// A side wall's edge in one of the planes, with the wall below or above it.
struct WallEdge {
    Index to, patch;
};
using WallEdges = std::map<Index, WallEdge>;

class SlabFinder {
  public:
    SlabFinder(const TriangleSoup& surface, const SlabPlanes& planes)
        : surface_(surface), frame_(planes.frame) {
        slab_.low = planes.low;
        slab_.high = planes.high;
        slab_.outline.frame = frame_;
        slab_.outline.height = planes.low;
    }

    Result<Slab> find() {
        flatten();
        if (Status ok = sort_triangles(); !ok) return ok.error();
        if (Status ok = chain(); !ok) return ok.error();
        name_sides();
        return std::move(slab_);
    }

  private:
    /// Vertices in the frame, and which plane they are in.
    void flatten() {
        Box box;
        for (const auto& t : surface_.triangles)
            for (Index v : t) box.add(surface_.vertices[v]);
        tolerance_ = kSlabRounding_rel * glm::distance(box.low, box.high);
        for (const Point& p : surface_.vertices) {
            const Point q = frame_.to_plane(p);
            flat_.emplace_back(q);
            side_.push_back(std::abs(q.z - slab_.low) <= std::abs(q.z - slab_.high) ? Side::low : Side::high);
        }
    }

    Status sort_triangles() {
        for (std::size_t i = 0; i < surface_.triangles.size(); ++i) {
            const auto& t = surface_.triangles[i];
            const Index patch = surface_.patch.empty() ? 0 : surface_.patch[i];
            if (side_[t[0]] == side_[t[1]] && side_[t[1]] == side_[t[2]]) {
                (side_[t[0]] == Side::low ? low_patches_ : high_patches_).insert(patch);
                continue;
            }
            wall_patches_.insert(patch);
            for (int k = 0; k < 3; ++k) {
                const Index a = t[k], b = t[(k + 1) % 3];
                if (side_[a] != side_[b]) continue;
                // Of a wall that points outwards the low edge runs with the region on its left.
                auto& edges = side_[a] == Side::low ? low_ : high_;
                if (!edges.insert({a, {b, patch}}).second)
                    return no_slab("two sides begin at " + describe(surface_.vertices[a]));
            }
        }
        return Done{};
    }

    using EdgeKey = std::array<double, 4>;

    /// Edges of the low plane, chained into loops, each found again in the high plane turned round.
    Status chain() {
        std::map<EdgeKey, Index> above; // edge as in the low plane: the vertex that it begins at
        for (const auto& [a, edge] : high_) above.insert({key(flat_[edge.to], flat_[a]), edge.to});
        std::set<Index> done;
        for (const auto& [start, unused] : low_) {
            if (done.count(start)) continue;
            OutlineLoop loop;
            for (Index v = start; done.insert(v).second;) {
                const auto edge = low_.find(v);
                if (edge == low_.end()) return no_slab("its sides are not closed");
                const Point2 p = flat_[v];
                const Index over = find_above(above, key(p, flat_[edge->second.to]));
                if (over == kNoIndex)
                    return no_slab("the edge at " + describe(surface_.vertices[v]) +
                                   " is not in both planes");
                if (!frame_.axis()) slab_.given.push_back({p, surface_.vertices[v], surface_.vertices[over]});
                loop.points.push_back(p);
                loop.patch.push_back(edge->second.patch);
                v = edge->second.to;
                if (done.count(v) && v != start) return no_slab("its sides are not closed");
            }
            if (loop.points.size() < 3) return no_slab("a side has no extent");
            slab_.outline.loops.push_back(std::move(loop));
        }
        std::sort(slab_.given.begin(), slab_.given.end(),
                  [](const auto& a, const auto& b) { return is_before(a.at, b.at); });
        return low_.size() == high_.size() ? Status(Done{}) : no_slab("the outlines of the planes differ");
    }

    EdgeKey key(const Point2& p, const Point2& q) const {
        const auto rounded = [this](double x) { return std::floor(x / tolerance_); };
        return {rounded(p.x), rounded(p.y), rounded(q.x), rounded(q.y)};
    }

    /// Up to a step of rounding either way.
    static Index find_above(const std::map<EdgeKey, Index>& above, const EdgeKey& key) {
        for (int shift = 0; shift < 81; ++shift) {
            EdgeKey near = key;
            for (int k = 0, rest = shift; k < 4; ++k, rest /= 3) near[k] += (rest % 3 == 2) ? -1 : rest % 3;
            if (const auto found = above.find(near); found != above.end()) return found->second;
        }
        return kNoIndex;
    }

    void name_sides() {
        slab_.outline.patch_names = surface_.patch_names;
        if (surface_.patch.empty()) name_loops();
        const auto own_name = [&](const std::set<Index>& patches, const std::set<Index>& others,
                                  std::string& name) {
            if (surface_.patch.empty() || patches.size() != 1) return;
            const Index patch = *patches.begin();
            if (!wall_patches_.count(patch) && !others.count(patch)) name = surface_.patch_names[patch];
        };
        own_name(low_patches_, high_patches_, slab_.low_name);
        own_name(high_patches_, low_patches_, slab_.high_name);
    }

    /// Without names: a patch a loop.
    void name_loops() {
        auto& names = slab_.outline.patch_names;
        names.clear();
        for (OutlineLoop& loop : slab_.outline.loops) {
            std::fill(loop.patch.begin(), loop.patch.end(), static_cast<Index>(names.size()));
            names.push_back(slab_.outline.loops.size() == 1 ? "wall"
                                                            : fmt::format("wall_{}", names.size() + 1));
        }
    }

    const TriangleSoup& surface_;
    PlaneFrame frame_;
    Slab slab_;
    double tolerance_ = 0;
    std::vector<Point2> flat_;
    std::vector<Side> side_;
    std::set<Index> low_patches_, high_patches_, wall_patches_;
    WallEdges low_, high_;
};

} // namespace

Result<TriangleSoup> make_solid(const Slab& slab) {
    std::vector<std::vector<Point2>> loops;
    for (const OutlineLoop& loop : slab.outline.loops) loops.push_back(loop.points);
    const auto filling = triangulate_region(loops);
    if (!filling) return filling.error();
    TriangleSoup soup;
    soup.patch_names = slab.outline.patch_names;
    const auto name = static_cast<Index>(soup.patch_names.size());
    soup.patch_names.push_back(slab.low_name);
    soup.patch_names.push_back(slab.high_name);
    for (double z : {slab.low, slab.high})
        for (const auto& loop : loops)
            for (const Point2& p : loop) soup.vertices.emplace_back(p, z);
    const auto above = static_cast<Index>(soup.vertices.size() / 2);
    const auto add = [&soup](Index a, Index b, Index c, Index patch) {
        soup.triangles.push_back({a, b, c});
        soup.patch.push_back(patch);
    };
    Index first = 0;
    for (const OutlineLoop& loop : slab.outline.loops) {
        const auto count = static_cast<Index>(loop.points.size());
        for (Index i = 0; i < count; ++i) {
            const Index a = first + i, b = first + (i + 1) % count;
            add(a, b, b + above, loop.patch[i]);
            add(a, b + above, a + above, loop.patch[i]);
        }
        first += count;
    }
    for (const auto& t : *filling) add(t[0], t[2], t[1], name);
    for (const auto& t : *filling) add(t[0] + above, t[1] + above, t[2] + above, name + 1);
    return soup;
}

Result<Slab> recognise_slab(const TriangleSoup& surface, double most_rel) {
    std::optional<Error> first;
    for (const SlabPlanes& planes : find_slab_planes(surface, most_rel)) {
        Result<Slab> slab = SlabFinder(surface, planes).find();
        if (slab) return slab;
        if (!first) first = slab.error();
    }
    return first ? *first : no_slab("no two parallel planes hold all its vertices");
}

void place_in_model(const Slab& slab, std::vector<Point>& positions) {
    const std::size_t count = positions.size() / 2;
    for (std::size_t v = 0; v < count; ++v) {
        Point &low = positions[v], &high = positions[v + count];
        const Point2 at(low);
        const auto given = std::lower_bound(
            slab.given.begin(), slab.given.end(), at,
            [](const Slab::GivenPoint& point, const Point2& p) { return is_before(point.at, p); });
        const bool is_given = given != slab.given.end() && given->at == at;
        low = is_given ? given->low : slab.outline.frame.to_model(low);
        high = is_given ? given->high : slab.outline.frame.to_model(high);
    }
}

} // namespace hexopt
