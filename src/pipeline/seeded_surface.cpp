#include "pipeline/seeded_surface.hpp"

#include "core/union_find.hpp"
#include "domain/surface_pieces.hpp"
#include "domain/surface_polygons.hpp"
#include "domain/triangle_tree.hpp"

#include <algorithm>
#include <cmath>

namespace hexopt {

namespace {

/// Places of a surface that are looked at to tell whether it lies in another.
constexpr std::size_t kPlaces = 16;

bool holds(const Box& box, const Point& p) {
    for (int k = 0; k < 3; ++k)
        if (p[k] < box.low[k] || p[k] > box.high[k]) return false;
    return true;
}

/// A closed surface.
class Body {
  public:
    explicit Body(std::span<const TriangleTree::Corners> triangles) : tree_(triangles), box_(tree_.box()) {
        const Point origin = triangles.front()[0];
        double volume = 0;
        for (const auto& x : triangles)
            volume += glm::dot(x[0] - origin, glm::cross(x[1] - origin, x[2] - origin)) / 6;
        volume_ = std::abs(volume);
        const std::size_t stride = std::max<std::size_t>(1, triangles.size() / kPlaces);
        for (std::size_t t = 0; t < triangles.size(); t += stride)
            places_.push_back((triangles[t][0] + triangles[t][1] + triangles[t][2]) / 3.0);
    }

    bool encloses(const Point& p) const {
        return holds(box_, p) && std::abs(tree_.winding_number(p, 2.5)) > 0.5;
    }
    double volume() const { return volume_; }

    /// How many of the other's places are inside, of all.
    std::pair<std::size_t, std::size_t> count_inside(const Body& other) const {
        const auto inside = std::count_if(other.places_.begin(), other.places_.end(),
                                          [this](const Point& p) { return encloses(p); });
        return {static_cast<std::size_t>(inside), other.places_.size()};
    }

  private:
    TriangleTree tree_;
    Box box_;
    double volume_ = 0;
    std::vector<Point> places_;
};

/// Bodies and what lies in what.
class Nesting {
  public:
    Nesting(std::vector<Body> bodies, const Parallel& parallel)
        : bodies_(std::move(bodies)), inside_(bodies_.size()), crossing_(bodies_.size()) {
        std::vector<std::vector<Index>> crossed(bodies_.size());
        parallel.for_each(bodies_.size(), 1, [&](std::size_t a) {
            for (Index b = 0; b < bodies_.size(); ++b) {
                if (b == a) continue;
                const auto [count, all] = bodies_[b].count_inside(bodies_[a]);
                if (count == all)
                    inside_[a].push_back(b);
                else if (count > 0)
                    crossed[a].push_back(b);
            }
        });
        for (Index a = 0; a < bodies_.size(); ++a)
            for (Index b : crossed[a]) crossing_.join(a, b);
    }

    /// Marks the bodies that bound the part that the seed is in; false where no body encloses it.
    bool mark_bounds(const Point& seed, std::vector<std::uint8_t>& bounds) {
        Index around = kNoIndex;
        for (Index b = 0; b < bodies_.size(); ++b)
            if (bodies_[b].encloses(seed) &&
                (around == kNoIndex || bodies_[b].volume() < bodies_[around].volume()))
                around = b;
        if (around == kNoIndex) return false;
        for (Index b = 0; b < bodies_.size(); ++b)
            if (is_together(b, around) || is_next_inside(b, around)) bounds[crossing_.find(b)] = 1;
        return true;
    }

    bool is_marked(Index body, const std::vector<std::uint8_t>& bounds) {
        return bounds[crossing_.find(body)] != 0;
    }

  private:
    bool is_together(Index a, Index b) { return crossing_.find(a) == crossing_.find(b); }

    /// Inside, with no other between.
    bool is_next_inside(Index body, Index around) {
        const auto& outer = inside_[body];
        const bool is_inside =
            std::any_of(outer.begin(), outer.end(), [&](Index o) { return is_together(o, around); });
        return is_inside && std::none_of(outer.begin(), outer.end(), [&](Index o) {
                   return !is_together(o, around) && !is_together(o, body) &&
                          std::any_of(inside_[o].begin(), inside_[o].end(),
                                      [&](Index p) { return is_together(p, around); });
               });
    }

    std::vector<Body> bodies_;
    std::vector<std::vector<Index>> inside_; ///< per body: those that it lies in as a whole
    UnionFind crossing_;
};

/// A soup's distinct triangles (numbers in it) by the surfaces that they make.
struct Clusters {
    std::vector<Index> triangle;
    std::vector<Index> cluster; ///< per triangle
    std::vector<Index> body_of; ///< per cluster; kNoIndex where it is not closed
    std::vector<Body> bodies;
};

Clusters find_clusters(const TriangleSoup& soup) {
    const std::vector<Index> first = find_first_equal(soup.vertices);
    std::vector<std::array<Index, 3>> merged = soup.triangles;
    for (auto& t : merged)
        for (Index& v : t) v = first[v];
    Clusters clusters;
    clusters.triangle = drop_repeated(merged);
    std::vector<std::array<Index, 3>> triangles;
    for (Index t : clusters.triangle) triangles.push_back(merged[t]);
    const SurfacePieces pieces = find_pieces(std::move(triangles), soup.vertices);
    std::vector<std::vector<TriangleTree::Corners>> corners(pieces.cluster_count);
    for (std::size_t k = 0; k < pieces.triangles.size(); ++k) {
        const Index cluster = clusters.cluster.emplace_back(pieces.cluster[pieces.piece[k]]);
        const auto& [a, b, c] = pieces.triangles[k];
        corners[cluster].push_back({soup.vertices[a], soup.vertices[b], soup.vertices[c]});
    }
    for (Index c = 0; c < pieces.cluster_count; ++c) {
        clusters.body_of.push_back(pieces.closed[c] ? static_cast<Index>(clusters.bodies.size()) : kNoIndex);
        if (pieces.closed[c]) clusters.bodies.emplace_back(corners[c]);
    }
    return clusters;
}

} // namespace

Result<SeededSurface> keep_around_seeds(TriangleSoup soup, std::span<const Point> seeds, Context& context) {
    if (Status ok = check_soup(soup); !ok) return ok.error();
    if (seeds.empty()) return SeededSurface{std::move(soup), 0};
    Clusters clusters = find_clusters(soup);
    const std::size_t body_count = clusters.bodies.size();
    Nesting nesting(std::move(clusters.bodies), context.parallel());
    if (context.is_cancelled()) return make_error(ErrorCode::cancelled, "surface", "", "cancelled");
    std::vector<std::uint8_t> bounds(body_count, 0);
    for (const Point& seed : seeds)
        if (!nesting.mark_bounds(seed, bounds)) return SeededSurface{std::move(soup), 0};
    SeededSurface result;
    for (Index b = 0; b < body_count; ++b) result.left_out_bodies += !nesting.is_marked(b, bounds);
    if (result.left_out_bodies == 0) return SeededSurface{std::move(soup), 0};
    std::vector<Index> number(soup.vertices.size(), kNoIndex);
    for (std::size_t k = 0; k < clusters.triangle.size(); ++k) {
        const Index body = clusters.body_of[clusters.cluster[k]], t = clusters.triangle[k];
        if (body != kNoIndex && !nesting.is_marked(body, bounds)) continue;
        std::array<Index, 3>& triangle = result.soup.triangles.emplace_back(soup.triangles[t]);
        for (Index& v : triangle) {
            if (number[v] == kNoIndex) {
                number[v] = static_cast<Index>(result.soup.vertices.size());
                result.soup.vertices.push_back(soup.vertices[v]);
            }
            v = number[v];
        }
        if (!soup.patch.empty()) result.soup.patch.push_back(soup.patch[t]);
    }
    result.soup.patch_names = std::move(soup.patch_names);
    result.soup.patch_group = std::move(soup.patch_group);
    return result;
}

} // namespace hexopt
