#include "core/union_find.hpp"
#include "domain/surface_creases.hpp"
#include "domain/surface_polygons.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <numbers>

namespace hexopt {

namespace {

/// In cells: how wide faces beside a weak crease must be, how long it must be, and how far it may be
/// continued.
constexpr double kLeastWidth = 3, kLeastLength = 3, kFarthestLink = 3;
/// Below this a crease is part of a smooth surface, degrees.
constexpr double kLeastTurn_deg = 5;
/// A continuation may bend by less than this, degrees.
constexpr double kStraight_deg = 30;

class WeakCreases {
  public:
    WeakCreases(const CleanSurface& surface, const BoundaryOptions& options, const WeakCreaseLimits& limits)
        : surface_(surface), options_(options), limits_(limits) {}

    std::vector<std::array<Index, 2>> find() {
        const double width = kLeastWidth * limits_.size;
        crease_ = find_creases(surface_.vertices, surface_.triangles, surface_.polygons.normal,
                               kLeastTurn_deg * std::numbers::pi / 180, width);
        kind_.reserve(crease_.size());
        for (const Crease& crease : crease_) {
            const bool wide = std::min(crease.width[0], crease.width[1]) >= width;
            kind_.push_back(is_strong(crease)                                                 ? Kind::strong
                            : wide && chord_distance(crease, limits_.size) > limits_.distance ? Kind::weak
                                                                                              : Kind::other);
        }
        for (Index c = 0; c < crease_.size(); ++c)
            for (Index v : crease_[c].vertex) at_[v].push_back(c);
        drop_short();
        link();
        std::vector<std::array<Index, 2>> edges;
        for (Index c = 0; c < crease_.size(); ++c)
            if (kind_[c] == Kind::weak) edges.push_back(crease_[c].vertex);
        return edges;
    }

  private:
    enum class Kind : std::uint8_t { other, weak, strong };

    bool is_strong(const Crease& crease) const {
        const auto& patch = surface_.polygons.patch;
        return crease.turn > options_.feature_angle_deg * std::numbers::pi / 180 ||
               (options_.patch_borders && patch[crease.triangle[0]] != patch[crease.triangle[1]]);
    }

    double length(Index c) const {
        return glm::distance(surface_.vertices[crease_[c].vertex[0]],
                             surface_.vertices[crease_[c].vertex[1]]);
    }

    void drop_short() {
        UnionFind sets(surface_.vertices.size());
        for (Index c = 0; c < crease_.size(); ++c)
            if (kind_[c] == Kind::weak) sets.join(crease_[c].vertex[0], crease_[c].vertex[1]);
        std::map<Index, double> total;
        for (Index c = 0; c < crease_.size(); ++c)
            if (kind_[c] == Kind::weak) total[sets.find(crease_[c].vertex[0])] += length(c);
        for (Index c = 0; c < crease_.size(); ++c)
            if (kind_[c] == Kind::weak &&
                total[sets.find(crease_[c].vertex[0])] < kLeastLength * limits_.size)
                kind_[c] = Kind::other;
    }

    /// Continues loose ends over other creases to the next feature.
    void link() {
        std::vector<std::array<Index, 2>> loose; // vertex, the weak crease that ends there
        for (const auto& [v, creases] : at_) {
            Index only = kNoIndex;
            int count = 0;
            for (Index c : creases)
                if (kind_[c] != Kind::other) ++count, only = c;
            if (count == 1 && kind_[only] == Kind::weak) loose.push_back({v, only});
        }
        for (const auto& [v, c] : loose) follow(v, c);
    }

    void follow(Index v, Index c) {
        std::vector<Index> path;
        double way = 0;
        while (way < kFarthestLink * limits_.size) {
            const Index next = straightest(v, c);
            if (next == kNoIndex) return;
            path.push_back(next);
            way += length(next);
            v = other_end(next, v);
            c = next;
            const auto& there = at_.at(v);
            if (std::none_of(there.begin(), there.end(), [&](Index k) { return kind_[k] != Kind::other; }))
                continue;
            for (Index k : path) kind_[k] = Kind::weak;
            return;
        }
    }

    Index other_end(Index c, Index v) const {
        return crease_[c].vertex[0] == v ? crease_[c].vertex[1] : crease_[c].vertex[0];
    }

    Index straightest(Index v, Index c) const {
        const Point in = surface_.vertices[v] - surface_.vertices[other_end(c, v)];
        Index best = kNoIndex;
        double most = std::cos(kStraight_deg * std::numbers::pi / 180);
        for (Index k : at_.at(v)) {
            if (k == c || kind_[k] != Kind::other) continue;
            const Point out = surface_.vertices[other_end(k, v)] - surface_.vertices[v];
            const double cosine = glm::dot(in, out) / std::max(glm::length(in) * glm::length(out), 1e-300);
            if (cosine > most) most = cosine, best = k;
        }
        return best;
    }

    const CleanSurface& surface_;
    const BoundaryOptions& options_;
    WeakCreaseLimits limits_;
    std::vector<Crease> crease_;
    std::vector<Kind> kind_;                 ///< per crease
    std::map<Index, std::vector<Index>> at_; ///< per vertex with creases
};

} // namespace

Result<std::vector<std::array<Index, 2>>> find_weak_creases(const TriangleSoup& surface,
                                                            const BoundaryOptions& options,
                                                            const WeakCreaseLimits& limits) {
    const auto clean = clean_surface(surface);
    if (!clean) return clean.error();
    if (!(limits.size > 0) || !(limits.distance > 0)) return std::vector<std::array<Index, 2>>();
    return WeakCreases(*clean, options, limits).find();
}

} // namespace hexopt
