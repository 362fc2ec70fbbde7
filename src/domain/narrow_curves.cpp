#include "domain/narrow_curves.hpp"

#include "domain/curve_segments.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>

namespace hexopt {

namespace {

/// Distance of samples on a curve, in cells, and their number on one segment at the most.
constexpr double kStep = 0.2;
constexpr double kMostSteps = 200;
/// Cosine of the angle up to which two curves run side by side.
constexpr double kSideBySide = 0.866;
/// Of the width below which a curve goes for a sharper one: below it both edges of a ledge go.
constexpr double kLedgeWidth = 0.5;
/// In cells: two curves as near as this meet.
constexpr double kTouch = 0.02;
/// In cells: as near to a vertex of the curve it is cut there.
constexpr double kSnap = 0.25;

struct Interval {
    double from, to; ///< arc lengths, model units
};

bool contains(const std::vector<Interval>& intervals, double s) {
    return std::any_of(intervals.begin(), intervals.end(),
                       [&](const Interval& i) { return s >= i.from && s <= i.to; });
}

struct Sample {
    double s; ///< arc length
    Point point;
    Point tangent;
    double cell;
    bool is_vertex;
    bool is_narrow = false;
};

/// By how much the surface turns at a curve, positive where it is convex.
double mean_turn_deg(const Domain& domain, Index curve) {
    return 180 - 0.5 * (domain.angle[curve].smallest + domain.angle[curve].largest);
}

double sharpness_deg(const Domain& domain, Index curve) {
    if (domain.curve_open[curve]) return 360;
    const CurveAngle& angle = domain.angle[curve];
    return 0.5 * (std::abs(180 - angle.smallest) + std::abs(180 - angle.largest));
}

class NarrowFinder {
  public:
    NarrowFinder(const Domain& domain, const std::function<double(const Point&)>& cell_size,
                 const NarrowOptions& options)
        : domain_(domain), cell_size_(cell_size), options_(options), given_up_(domain.model.curve_count()) {
        for (Index c = 0; c < domain.model.curve_count(); ++c)
            segments_.add_curve(domain.model.curve_points(c));
        segments_.build_tree();
        rank_curves();
    }

    NarrowCurves find() {
        std::vector<std::vector<Interval>> ledges(order_.size());
        for (Index curve : order_)
            if (may_give_up(domain_, curve, 180))
                ledges[curve] = find_parts(
                    curve, [&](const Sample& at) { return is_ledge(curve, at); },
                    [](const Sample&) { return true; });
        given_up_ = ledges;
        for (Index curve : order_)
            if (may_give_up(domain_, curve, options_.below_deg))
                given_up_[curve] = find_parts(
                    curve,
                    [&](const Sample& at) {
                        return contains(ledges[curve], at.s) || is_beside_sharper(curve, at, options_.width);
                    },
                    [&](const Sample& at) {
                        return contains(ledges[curve], at.s) || is_beside_sharper(curve, at, kTouch);
                    });
        return number_parts();
    }

  private:
    /// Sharp ones first.
    void rank_curves() {
        std::vector<double> sharpness;
        for (Index c = 0; c < domain_.model.curve_count(); ++c)
            sharpness.push_back(sharpness_deg(domain_, c));
        order_.resize(sharpness.size());
        std::iota(order_.begin(), order_.end(), Index{0});
        std::stable_sort(order_.begin(), order_.end(),
                         [&](Index a, Index b) { return sharpness[a] > sharpness[b]; });
        rank_.resize(order_.size());
        for (Index k = 0; k < order_.size(); ++k) rank_[order_[k]] = k;
    }

    std::vector<Sample> take_samples(Index curve) const {
        const auto points = domain_.model.curve_points(curve);
        std::vector<Sample> samples;
        double s = 0;
        for (std::size_t i = 0; i + 1 < points.size(); ++i) {
            const Point edge = points[i + 1] - points[i];
            const double length = glm::length(edge), cell = cell_size_(points[i]);
            if (!(length > 0)) continue;
            const double steps =
                cell > 0 ? std::clamp(std::ceil(length / (kStep * cell)), 1.0, kMostSteps) : 1.0;
            for (int k = 0; k < static_cast<int>(steps); ++k) {
                const double t = k / steps;
                const Point p = points[i] + t * edge;
                samples.push_back({s + t * length, p, edge / length, k == 0 ? cell : cell_size_(p), k == 0});
            }
            s += length;
        }
        if (!samples.empty())
            samples.push_back({s, points.back(), samples.back().tangent, cell_size_(points.back()), true});
        return samples;
    }

    /// Whether a curve that `counts`(curve, arc length) runs beside this one within `reach` there.
    template <class Counts>
    bool has_beside(Index curve, const Sample& at, double reach, const Counts& counts) const {
        if (!(reach > 0)) return false;
        return segments_.has_near(at.point, reach, [&](const CurveSegment& other, const auto& closest) {
            if (other.curve == curve) return false;
            const Point along = other.end[1] - other.end[0];
            const double length = glm::length(along);
            return glm::distance(closest.point, at.point) <= reach &&
                   std::abs(glm::dot(along, at.tangent)) >= kSideBySide * length &&
                   counts(other.curve, other.s + closest.weight[1] * length);
        });
    }

    bool is_beside_sharper(Index curve, const Sample& at, double cells) const {
        return has_beside(curve, at, cells * at.cell, [&](Index other, double s) {
            return rank_[other] < rank_[curve] && !contains(given_up_[other], s);
        });
    }

    /// Whether this curve and one beside it turn the surface there and back.
    bool is_ledge(Index curve, const Sample& at) const {
        const double turn = mean_turn_deg(domain_, curve);
        return has_beside(curve, at, kLedgeWidth * options_.width * at.cell, [&](Index other, double) {
            return may_give_up(domain_, other, 180) &&
                   std::abs(turn + mean_turn_deg(domain_, other)) < options_.ledge_deg &&
                   turn * mean_turn_deg(domain_, other) < 0;
        });
    }

    /// Parts of a curve that are narrow, with a place in each where it `is_hopeless`.
    template <class IsNarrow, class IsHopeless>
    std::vector<Interval> find_parts(Index curve, const IsNarrow& is_narrow,
                                     const IsHopeless& is_hopeless) const {
        std::vector<Sample> samples = take_samples(curve);
        if (samples.empty()) return {};
        for (Sample& sample : samples) sample.is_narrow = is_narrow(sample);
        std::vector<Interval> parts;
        for (std::size_t i = 0; i < samples.size(); ++i) {
            std::size_t end = i;
            while (end < samples.size() && samples[end].is_narrow) ++end;
            if (end == i) continue;
            const bool is_whole = i == 0 && end == samples.size();
            const Interval part = {snap(samples, i), snap(samples, end - 1)};
            if ((is_whole || part.to - part.from >= options_.shortest * samples[i].cell) &&
                std::any_of(samples.begin() + static_cast<std::ptrdiff_t>(i),
                            samples.begin() + static_cast<std::ptrdiff_t>(end), is_hopeless))
                parts.push_back(part);
            i = end;
        }
        return join_near(curve, std::move(parts), samples);
    }

    /// Arc length of a sample, or of a vertex of the curve next to it.
    static double snap(const std::vector<Sample>& samples, std::size_t i) {
        double best = samples[i].s, away = kSnap * samples[i].cell;
        for (const int step : {-1, 1})
            for (auto k = static_cast<std::ptrdiff_t>(i); k >= 0 && k < std::ssize(samples); k += step) {
                const Sample& other = samples[static_cast<std::size_t>(k)];
                const double distance = std::abs(other.s - samples[i].s);
                if (distance > away) break;
                if (!other.is_vertex) continue;
                away = distance;
                best = other.s;
                break;
            }
        return best;
    }

    /// Parts are given up together with what is left between them and at the ends where that is short.
    std::vector<Interval> join_near(Index curve, std::vector<Interval> parts,
                                    const std::vector<Sample>& samples) const {
        if (parts.empty()) return parts;
        const double length = segments_.length(curve);
        if (domain_.model.curve_ends(curve)[0] == kNoIndex && samples.size() > 2) {
            // A loop is not cut where its points begin: that is no place inside it.
            if (parts.front().from > 0 || parts.front().to < length) {
                parts.front().from = std::max(parts.front().from, samples[1].s);
                parts.back().to = std::min(parts.back().to, samples[samples.size() - 2].s);
            }
            return parts;
        }
        const auto least_rest = [&](double s) {
            const auto at = std::lower_bound(samples.begin(), samples.end(), s,
                                             [](const Sample& a, double b) { return a.s < b; });
            return options_.shortest_rest * (at == samples.end() ? samples.back() : *at).cell;
        };
        if (parts.front().from < least_rest(parts.front().from)) parts.front().from = 0;
        if (length - parts.back().to < least_rest(parts.back().to)) parts.back().to = length;
        std::vector<Interval> joined = {parts.front()};
        for (std::size_t k = 1; k < parts.size(); ++k)
            if (parts[k].from - joined.back().to < least_rest(joined.back().to))
                joined.back().to = parts[k].to;
            else
                joined.push_back(parts[k]);
        return joined;
    }

    NarrowCurves number_parts() const {
        NarrowCurves out;
        auto next = static_cast<Index>(domain_.model.curve_count());
        for (Index c = 0; c < given_up_.size(); ++c) {
            if (given_up_[c].empty()) continue;
            const bool is_loop = domain_.model.curve_ends(c)[0] == kNoIndex;
            std::vector<double> cuts;
            for (const Interval& part : given_up_[c])
                for (double s : {part.from, part.to})
                    if (s > 0 && s < segments_.length(c)) cuts.push_back(s);
            for (double s : cuts) out.cuts.push_back({c, s});
            std::vector<double> bound = cuts; // pieces lie between two of these
            if (is_loop && !cuts.empty()) {
                bound.push_back(cuts.front() + segments_.length(c));
            } else {
                bound.insert(bound.begin(), 0);
                bound.push_back(segments_.length(c));
            }
            for (std::size_t k = 0; k + 1 < bound.size(); ++k) {
                const Index number = k == 0 ? c : next++;
                if (contains(given_up_[c], std::fmod(0.5 * (bound[k] + bound[k + 1]), segments_.length(c))))
                    out.narrow.push_back(number);
            }
        }
        std::sort(out.narrow.begin(), out.narrow.end());
        return out;
    }

    const Domain& domain_;
    const std::function<double(const Point&)>& cell_size_;
    const NarrowOptions& options_;
    CurveSegments segments_;
    std::vector<Index> order_, rank_;             ///< of curves, sharp ones first
    std::vector<std::vector<Interval>> given_up_; ///< per curve, rising
};

} // namespace

bool may_give_up(const Domain& domain, Index curve, double below_deg) {
    const CurveAngle& angle = domain.angle[curve];
    if (domain.curve_open[curve] || std::max(180 - angle.smallest, angle.largest - 180) >= below_deg)
        return false;
    const std::span<const Index> own = domain.curve_patch[curve];
    const auto group = [&](Index patch) { return domain.name_group[domain.patch_name[patch]]; };
    return own.size() < 2 || (own.size() == 2 && group(own[0]) == group(own[1]));
}

NarrowCurves find_narrow_curves(const Domain& domain, const std::function<double(const Point&)>& cell_size,
                                const NarrowOptions& options) {
    return NarrowFinder(domain, cell_size, options).find();
}

} // namespace hexopt
