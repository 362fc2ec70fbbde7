#include "stages/planar/match_loop.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

constexpr double kSamplesPerCell = 4;
constexpr double kReach = 2.5;        ///< cells beyond the nearest sample in which a vertex looks for others
constexpr double kLengthWeight = 0.3; ///< of the squared logarithm of an edge's stretch
constexpr double kSlantWeight = 0.5;  ///< of 1 - cosine between a link and the kept loop's normal
constexpr double kShapeWeight = 0.6;  ///< of a kept vertex with too many or few cells for its corner, squared
constexpr double kShortest = 0.05;    ///< of an edge of the outline, to that of the kept loop
constexpr Index kCornerReach = 8;     ///< vertices before and after the nearest one that may take a corner
constexpr std::size_t kMostPairs = 200'000'000; ///< of candidates of neighbouring vertices

struct Sample {
    double s;
    Point2 point;
    Index corner = kNoIndex;
    int cells = 2;
};

/// A kept vertex joined to a sample.
struct Candidate {
    Index sample; ///< counted from the start
    bool is_exit; ///< the last of the links of a corner with more than two cells
    double cost = 1e300;
    Index from = kNoIndex; ///< candidate that it follows
};

class LoopMatcher {
  public:
    LoopMatcher(const KeptLoop& loop, const std::vector<Point2>& positions, const OutlineCurves& curves)
        : loop_(loop), curves_(curves), m_(static_cast<Index>(loop.vertices.size())) {
        for (Index v : loop.vertices) points_.push_back(positions[v]);
        for (Index i = 0; i < m_; ++i) edge_.push_back(glm::distance(point(i), point(i + 1)));
    }

    std::vector<WallLink> run() {
        make_samples();
        choose_start();
        count_corners();
        for (double widen = 1; widen <= 16; widen *= 2)
            if (search(widen)) return links();
        return {};
    }

  private:
    const Point2& point(Index i) const { return points_[i % m_]; }
    double h(Index i) const { return 0.5 * (edge_[(i + m_ - 1) % m_] + edge_[i % m_]); }
    /// Unit normal of the kept loop, away from the cells.
    Point2 normal(Index i) const {
        const Point2 d = point(i + 1) - point(i + m_ - 1);
        const double length = glm::length(d);
        return length > 0 ? Point2(d.y, -d.x) / length : Point2(0);
    }

    void make_samples() {
        std::vector<SegmentTree::Segment> edges;
        for (Index i = 0; i < m_; ++i) edges.push_back({point(i), point(i + 1)});
        kept_ = SegmentTree(std::move(edges));
        const double length = curves_.length(loop_.outline);
        const auto& corners = curves_.corners(loop_.outline);
        const auto fill = [&](double from, double to) {
            double s = from;
            std::vector<double> places;
            while (s < to) {
                places.push_back(s);
                const auto near = kept_.nearest(curves_.point(loop_.outline, s));
                s += edge_[near.segment] / kSamplesPerCell;
            }
            // Spread evenly, so that the last is no shorter than the others.
            const double scale = (to - from) / (s - from);
            for (std::size_t i = 1; i < places.size(); ++i) {
                const double at = from + scale * (places[i] - from);
                samples_.push_back({at, curves_.point(loop_.outline, at), kNoIndex, 2});
            }
        };
        if (corners.empty()) {
            samples_.push_back({0, curves_.point(loop_.outline, 0), kNoIndex, 2});
            fill(0, length);
        }
        for (Index c = 0; c < corners.size(); ++c) {
            const int cells = corners[c].is_sharp ? cells_at_corner(corners[c].angle_deg) : 2;
            samples_.push_back({corners[c].s, corners[c].point, c, cells});
            fill(corners[c].s, c + 1 < corners.size() ? corners[c + 1].s : corners[0].s + length);
        }
        n_ = static_cast<Index>(samples_.size());
        std::vector<SegmentTree::Segment> chords;
        for (Index j = 0; j < n_; ++j) chords.push_back({samples_[j].point, samples_[(j + 1) % n_].point});
        tree_ = SegmentTree(std::move(chords));
    }

    Index nearest_sample(Index i) const {
        const auto near = tree_.nearest(point(i));
        return near.t > 0.5 ? (near.segment + 1) % n_ : near.segment;
    }

    /// A kept vertex close to the outline and far from corners, with its nearest sample.
    void choose_start() {
        constexpr double kFar = 20;           // cells
        std::vector<double> clear(n_, 1e300); // distance along the outline to the nearest corner
        for (int round = 0; round < 2; ++round) {
            for (Index k = 0; k < 2 * n_; ++k) {
                const Index j = round == 0 ? k % n_ : (2 * n_ - 1 - k) % n_;
                const Index before = round == 0 ? (j + n_ - 1) % n_ : (j + 1) % n_;
                if (samples_[j].corner != kNoIndex) clear[j] = 0;
                clear[j] = std::min(clear[j],
                                    clear[before] + glm::distance(samples_[j].point, samples_[before].point));
            }
        }
        double best = -1e300;
        for (Index i = 0; i < m_; ++i) {
            const Index j = nearest_sample(i);
            if (samples_[j].corner != kNoIndex) continue;
            const double score =
                std::min(clear[j] / h(i), kFar) - 2 * glm::distance(point(i), samples_[j].point) / h(i);
            if (score <= best) continue;
            best = score;
            start_vertex_ = i;
            start_sample_ = j;
        }
    }

    const Sample& sample(Index u) const { return samples_[(start_sample_ + u) % n_]; }
    double s(Index u) const {
        const Index j = start_sample_ + u;
        return samples_[j % n_].s + (j / n_) * curves_.length(loop_.outline);
    }

    /// corners_before_[u]: corners among the samples below u.
    void count_corners() {
        corners_before_.assign(n_ + 2, 0);
        for (Index u = 0; u <= n_; ++u)
            corners_before_[u + 1] = corners_before_[u] + (sample(u).corner != kNoIndex);
    }

    double place_cost(Index i, const Sample& at) const {
        const Point2 d = at.point - point(i);
        const double distance = glm::length(d), size = h(i);
        const double slant = distance > 0 ? 1 - glm::dot(d, normal(i)) / distance : 0;
        return distance * distance / (size * size) + kSlantWeight * slant;
    }

    /// Of the kept vertex (for corners with more than two cells: of those between its links).
    double shape_cost(Index i, const Sample& at) const {
        const auto off = [&](Index k, int wanted) {
            const int d = loop_.corners[k % m_] - wanted;
            return kShapeWeight * d * d;
        };
        if (at.corner == kNoIndex) return 0;
        if (at.cells <= 2) return off(i, at.cells);
        double sum = 0;
        for (Index k = 1; k < 2 * static_cast<Index>(at.cells - 2); k += 2) sum += off(i + k, 3);
        for (Index k = 2; k < 2 * static_cast<Index>(at.cells - 2); k += 2) sum += place_cost(i + k, at);
        return sum;
    }

    void collect(double widen, std::vector<std::vector<Candidate>>& columns) const {
        Index first = (start_vertex_) % m_;
        columns[0] = {{0, false, 0, kNoIndex}};
        for (Index k = 1; k < m_; ++k) {
            const Index i = first + k;
            const double reach = widen * (tree_.nearest(point(i)).distance + kReach * h(i));
            Box2 box;
            box.add(point(i) - reach);
            box.add(point(i) + reach);
            tree_.visit_box(box, [&](Index j) {
                const Index u = (j + n_ - start_sample_) % n_;
                if (u > 0 && glm::distance(samples_[j].point, point(i)) <= reach)
                    columns[k].push_back({u, false, 1e300, kNoIndex});
                return true;
            });
        }
        collect_corners(columns);
        for (auto& column : columns) {
            std::sort(column.begin(), column.end(),
                      [](const Candidate& a, const Candidate& b) { return a.sample < b.sample; });
            const auto same = [](const Candidate& a, const Candidate& b) { return a.sample == b.sample; };
            column.erase(std::unique(column.begin(), column.end(), same), column.end());
        }
        columns[m_] = {{n_, false, 1e300, kNoIndex}};
    }

    /// Corners in tips that the kept cells do not reach into.
    void collect_corners(std::vector<std::vector<Candidate>>& columns) const {
        for (Index u = 1; u < n_; ++u) {
            if (sample(u).corner == kNoIndex) continue;
            const Index nearest = (kept_.nearest(sample(u).point).segment + m_ - start_vertex_) % m_;
            const Index first = nearest > kCornerReach ? nearest - kCornerReach : 1;
            for (Index k = first; k <= std::min(nearest + kCornerReach, m_ - 1); ++k)
                columns[k].push_back({u, false, 1e300, kNoIndex});
        }
    }

    /// From column k - 1 to the entries of column k.
    void advance(const std::vector<Candidate>& before, std::vector<Candidate>& column, Index i) const {
        const double length = edge_[(i + m_ - 1) % m_];
        for (Candidate& b : column) {
            if (b.is_exit) continue;
            const double here = place_cost(i, sample(b.sample)) + shape_cost(i, sample(b.sample));
            for (Index a = 0; a < before.size(); ++a) {
                const Candidate& from = before[a];
                if (from.sample >= b.sample || from.cost >= 1e300) continue;
                if (!from.is_exit && sample(from.sample).cells > 2) continue;
                if (corners_before_[b.sample] != corners_before_[from.sample + 1]) continue;
                const double stretch = (s(b.sample) - s(from.sample)) / length;
                if (stretch < kShortest) continue;
                const double log = std::log(stretch);
                const double cost = from.cost + here + kLengthWeight * log * log;
                if (cost < b.cost) b.cost = cost, b.from = a;
            }
        }
    }

    bool search(double widen) {
        columns_.assign(m_ + 1, {});
        collect(widen, columns_);
        std::size_t total = 0;
        for (const auto& column : columns_) total += column.size() * column.size();
        if (total > kMostPairs) return false;
        for (Index k = 1; k <= m_; ++k) {
            advance(columns_[k - 1], columns_[k], start_vertex_ + k);
            for (Index b = 0; b < columns_[k].size(); ++b) {
                const Candidate entry = columns_[k][b];
                const int cells = sample(entry.sample).cells;
                const Index last = k + 2 * static_cast<Index>(std::max(0, cells - 2));
                if (entry.is_exit || cells <= 2 || entry.cost >= 1e300 || last >= m_) continue;
                const double cost = entry.cost + place_cost(start_vertex_ + last, sample(entry.sample));
                columns_[last].push_back({entry.sample, true, cost, b});
            }
        }
        return columns_[m_][0].cost < 1e300;
    }

    std::vector<WallLink> links() const {
        std::vector<WallLink> found;
        Index k = m_, c = 0;
        while (true) {
            c = columns_[k][c].from; // of column k - 1, whose candidate may be the exit of an earlier one
            --k;
            if (k == 0) break;
            const Candidate* at = &columns_[k][c];
            const Sample& to = sample(at->sample);
            if (at->is_exit) {
                c = at->from;
                k -= 2 * static_cast<Index>(to.cells - 2);
                at = &columns_[k][c];
            }
            found.push_back({(start_vertex_ + k) % m_, s(at->sample), to.corner, to.cells});
        }
        found.push_back({start_vertex_, s(0), kNoIndex, 2});
        std::reverse(found.begin(), found.end());
        return found;
    }

    const KeptLoop& loop_;
    const OutlineCurves& curves_;
    Index m_, n_ = 0, start_vertex_ = 0, start_sample_ = 0;
    std::vector<Point2> points_;
    std::vector<double> edge_;
    std::vector<Sample> samples_;
    SegmentTree tree_, kept_; ///< samples joined by chords, and the kept loop
    std::vector<Index> corners_before_;
    std::vector<std::vector<Candidate>> columns_;
};

} // namespace

int cells_at_corner(double angle_deg) {
    return angle_deg <= 120 ? 1 : angle_deg <= 216 ? 2 : angle_deg <= 309 ? 3 : 4;
}

std::vector<WallLink> match_loop(const KeptLoop& loop, const std::vector<Point2>& positions,
                                 const OutlineCurves& curves) {
    if (loop.vertices.size() < 4) return {};
    return LoopMatcher(loop, positions, curves).run();
}

} // namespace hexopt
