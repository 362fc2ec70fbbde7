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
    return Error{
        ErrorCode::bad_input,
        "slab",
        "",
        {std::move(reason), "a planar mesh needs two plane sides of constant z with equal outlines"}};
}

constexpr double kPlane = 1e-6; ///< of the diagonal: how far vertices may be off the planes
enum class Side : std::uint8_t { low, high };

/// A side wall's edge in one of the planes, with the wall below or above it.
struct WallEdge {
    Index to, patch;
};
using WallEdges = std::map<Index, WallEdge>;

class SlabFinder {
  public:
    explicit SlabFinder(const TriangleSoup& surface) : surface_(surface) {}

    Result<Slab> find() {
        if (Status ok = find_planes(); !ok) return ok.error();
        if (Status ok = sort_triangles(); !ok) return ok.error();
        if (Status ok = chain(); !ok) return ok.error();
        name_sides();
        return std::move(slab_);
    }

  private:
    Status find_planes() {
        Box box;
        for (const auto& t : surface_.triangles)
            for (Index v : t) box.add(surface_.vertices[v]);
        if (surface_.triangles.empty()) return no_slab("there are no triangles");
        tolerance_ = kPlane * glm::distance(box.low, box.high);
        slab_.low = box.low.z;
        slab_.high = box.high.z;
        if (!(slab_.high - slab_.low > 10 * tolerance_)) return no_slab("the surface is flat");
        side_.assign(surface_.vertices.size(), Side::low);
        for (const auto& t : surface_.triangles)
            for (Index v : t) {
                const Point& p = surface_.vertices[v];
                const bool is_low = p.z - slab_.low <= tolerance_, is_high = slab_.high - p.z <= tolerance_;
                if (!is_low && !is_high)
                    return no_slab(fmt::format("the point ({:.6g}, {:.6g}, {:.6g}) lies between the planes "
                                               "z = {:.6g} and {:.6g}",
                                               p.x, p.y, p.z, slab_.low, slab_.high));
                side_[v] = is_low ? Side::low : Side::high;
            }
        return Done{};
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
                if (!edges.insert({a, {b, patch}}).second) {
                    const Point& p = surface_.vertices[a];
                    return no_slab(fmt::format("two sides begin at ({:.6g}, {:.6g}, {:.6g})", p.x, p.y, p.z));
                }
            }
        }
        return Done{};
    }

    Point2 flat(Index v) const { return Point2(surface_.vertices[v]); }

    /// Edges of the low plane, chained into loops, each found again in the high plane turned round.
    Status chain() {
        std::set<std::array<double, 4>> above;
        for (const auto& [a, edge] : high_) {
            const Point2 p = flat(edge.to), q = flat(a);
            above.insert({rounded(p.x), rounded(p.y), rounded(q.x), rounded(q.y)});
        }
        std::set<Index> done;
        for (const auto& [start, unused] : low_) {
            if (done.count(start)) continue;
            OutlineLoop loop;
            for (Index v = start; done.insert(v).second;) {
                const auto edge = low_.find(v);
                if (edge == low_.end()) return no_slab("its sides are not closed");
                const Point2 p = flat(v), q = flat(edge->second.to);
                if (!has_above(above, p, q))
                    return no_slab(
                        fmt::format("the edge at ({:.6g}, {:.6g}) is not in both planes", p.x, p.y));
                loop.points.push_back(p);
                loop.patch.push_back(edge->second.patch);
                v = edge->second.to;
                if (done.count(v) && v != start) return no_slab("its sides are not closed");
            }
            if (loop.points.size() < 3) return no_slab("a side has no extent");
            slab_.outline.loops.push_back(std::move(loop));
        }
        return low_.size() == high_.size() ? Status(Done{}) : no_slab("the outlines of the planes differ");
    }

    double rounded(double x) const { return std::floor(x / tolerance_); }

    /// Up to a step of rounding either way.
    bool has_above(const std::set<std::array<double, 4>>& above, const Point2& p, const Point2& q) const {
        const std::array<double, 4> key = {rounded(p.x), rounded(p.y), rounded(q.x), rounded(q.y)};
        for (int shift = 0; shift < 81; ++shift) {
            std::array<double, 4> near = key;
            for (int k = 0, rest = shift; k < 4; ++k, rest /= 3) near[k] += (rest % 3 == 2) ? -1 : rest % 3;
            if (above.count(near)) return true;
        }
        return false;
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
    Slab slab_;
    double tolerance_ = 0;
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

Result<Slab> recognise_slab(const TriangleSoup& surface) { return SlabFinder(surface).find(); }

} // namespace hexopt
