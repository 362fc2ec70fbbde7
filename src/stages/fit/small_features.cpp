#include "core/union_find.hpp"
#include "stages/fit/curve_net.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>

namespace hexopt::fit {

namespace {

/// In cells: curves below kMerged join their corners into one, which may become kWidest wide; curves that end
/// inside a patch are left out below kBranch from others, kLoose on their own, kLoop from a corner to itself.
constexpr double kMerged = 0.5, kWidest = 1, kBranch = 0.8, kLoose = 1.2, kLoop = 2;
/// Curves that turn the surface by less are no ends of walls and gaps.
constexpr double kEndAngle_deg = 50;
/// Cosine of the angle between curves that go on beside one another from such an end.
constexpr double kBeside = 0.8;

class SmallFeatureFinder {
  public:
    SmallFeatureFinder(const Domain& domain, std::span<const double> cell_size)
        : domain_(domain), cell_size_(cell_size), sets_(domain.model.corner_count()),
          degree_(domain.model.corner_count()) {
        small_.too_small.assign(domain.model.curve_count(), 0);
        for (Index c = 0; c < domain.model.curve_count(); ++c) {
            const auto points = domain.model.curve_points(c);
            double length = 0;
            for (std::size_t i = 1; i < points.size(); ++i) length += glm::distance(points[i - 1], points[i]);
            length_.push_back(length);
        }
        for (Index k = 0; k < degree_.size(); ++k)
            degree_[k] = static_cast<int>(domain.corner_curve[k].size());
    }

    SmallFeatures run(std::span<const Index> as_points) {
        drop_loose_ends();
        find_ends(as_points);
        join_corners();
        choose_corners();
        return std::move(small_);
    }

  private:
    bool has_corners(Index c) const { return domain_.model.curve_ends(c)[0] != kNoIndex; }
    bool may_go(Index c) const { return has_corners(c) && !domain_.curve_open[c] && !small_.too_small[c]; }
    /// Length in cells.
    double cells(Index c) const {
        const auto [a, b] = domain_.model.curve_ends(c);
        return length_[c] / std::min(cell_size_[a], cell_size_[b]);
    }

    void drop_loose_ends() {
        for (bool changed = true; changed;) {
            changed = false;
            for (Index c = 0; c < length_.size(); ++c) {
                if (!may_go(c)) continue;
                const auto [a, b] = domain_.model.curve_ends(c);
                const int loose = (degree_[a] == 1) + (degree_[b] == 1);
                if (a == b || loose == 0 || cells(c) >= (loose == 2 ? kLoose : kBranch)) continue;
                small_.too_small[c] = 1;
                --degree_[a];
                --degree_[b];
                changed = true;
            }
        }
    }

    bool is_short(Index c) const { return may_go(c) && cells(c) < kMerged; }

    /// Curves across the ends of thin walls and gaps.
    void find_ends(std::span<const Index> as_points) {
        small_.one_edge.assign(length_.size(), 0);
        for (Index c = 0; c < length_.size(); ++c)
            small_.one_edge[c] =
                is_short(c) && is_end(c) && !std::binary_search(as_points.begin(), as_points.end(), c);
    }

    bool is_end(Index c) const {
        const auto [a, b] = domain_.model.curve_ends(c);
        const CurveAngle& angle = domain_.angle[c];
        const double turn = std::min(std::abs(180 - angle.smallest), std::abs(angle.largest - 180));
        if (a == b || turn < kEndAngle_deg) return false;
        for (Index corner : {a, b})
            for (Index other : domain_.corner_curve[corner])
                if (other != c && is_short(other)) return false;
        for (Index from_a : domain_.corner_curve[a])
            for (Index from_b : domain_.corner_curve[b])
                if (from_a != c && from_b != c && go_beside(from_a, a, from_b, b)) return true;
        return false;
    }

    bool go_beside(Index c, Index from, Index d, Index from_d) const {
        return glm::dot(leaving(c, from), leaving(d, from_d)) > kBeside;
    }

    /// Direction in which a curve leaves a corner, over one cell.
    Point leaving(Index c, Index corner) const {
        const auto points = domain_.model.curve_points(c);
        const bool forward = domain_.model.curve_ends(c)[0] == corner;
        const Point from = domain_.model.corner_point(corner);
        Point to = from;
        for (std::size_t i = 1; i < points.size() && glm::distance(from, to) < cell_size_[corner]; ++i)
            to = points[forward ? i : points.size() - 1 - i];
        const double length = glm::distance(from, to);
        return length > 0 ? (to - from) / length : Point(0);
    }

    void join_corners() {
        std::vector<Index> order(length_.size());
        std::iota(order.begin(), order.end(), Index{0});
        std::stable_sort(order.begin(), order.end(),
                         [&](Index a, Index b) { return length_[a] < length_[b]; });
        std::vector<std::vector<Index>> members(cell_size_.size());
        for (Index k = 0; k < members.size(); ++k) members[k] = {k};
        for (Index c : order) {
            if (!is_short(c) || small_.one_edge[c]) continue;
            Index a = sets_.find(domain_.model.curve_ends(c)[0]);
            Index b = sets_.find(domain_.model.curve_ends(c)[1]);
            if (a == b || !are_close(members[a], members[b])) continue;
            sets_.join(a, b);
            if (sets_.find(a) != a) std::swap(a, b);
            members[a].insert(members[a].end(), members[b].begin(), members[b].end());
        }
        for (Index c = 0; c < length_.size(); ++c) {
            if (!may_go(c)) continue;
            const auto [a, b] = domain_.model.curve_ends(c);
            if (a != b && sets_.find(a) == sets_.find(b) && cells(c) < kLoop) small_.too_small[c] = 1;
        }
    }

    bool are_close(const std::vector<Index>& some, const std::vector<Index>& others) const {
        for (Index a : some)
            for (Index b : others)
                if (glm::distance(domain_.model.corner_point(a), domain_.model.corner_point(b)) >
                    kWidest * std::min(cell_size_[a], cell_size_[b]))
                    return false;
        return true;
    }

    /// How much a corner matters: its curves' lengths, up to three cells each, times how sharp they are.
    double weight(Index corner) const {
        double sum = 0;
        for (Index c : domain_.corner_curve[corner]) {
            if (small_.too_small[c] || domain_.curve_open[c]) continue;
            const double sharp =
                std::max(std::abs(180 - domain_.angle[c].smallest), std::abs(domain_.angle[c].largest - 180));
            sum += std::min(length_[c] / cell_size_[corner], 3.0) * sharp;
        }
        return sum;
    }

    void choose_corners() {
        const std::size_t count = cell_size_.size();
        std::vector<Index> best(count, kNoIndex); // per set
        std::vector<double> most(count, -1);
        for (Index k = 0; k < count; ++k) {
            const Index set = sets_.find(k);
            const double w = weight(k);
            if (w > most[set]) {
                most[set] = w;
                best[set] = k;
            }
        }
        for (Index k = 0; k < count; ++k) small_.corner.push_back(best[sets_.find(k)]);
    }

    const Domain& domain_;
    std::span<const double> cell_size_;
    UnionFind sets_;             ///< of corners that become one
    std::vector<int> degree_;    ///< per corner: curves that are left
    std::vector<double> length_; ///< per curve
    SmallFeatures small_;
};

} // namespace

SmallFeatures find_small_features(const Domain& domain, std::span<const double> cell_size,
                                  std::span<const Index> as_points) {
    return SmallFeatureFinder(domain, cell_size).run(as_points);
}

} // namespace hexopt::fit
