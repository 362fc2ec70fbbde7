#include "domain/split_curves.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <iterator>

namespace hexopt {

namespace {

using Description = DomainDescription;

/// Part of a curve between two corners.
struct Piece {
    std::vector<Point> points;
    std::array<std::int64_t, 2> ends;
};

class CurveSplitter {
  public:
    CurveSplitter(const Domain& domain) : domain_(domain), out_(describe_domain(domain)) {}

    Status split(std::span<const CurveCut> cuts) {
        for (std::size_t k = 0; k < cuts.size();) {
            std::size_t end = k;
            while (end < cuts.size() && cuts[end].curve == cuts[k].curve) ++end;
            if (Status done = split_curve(cuts.subspan(k, end - k)); !done) return done;
            k = end;
        }
        return Done{};
    }
    const Description& description() const { return out_; }

  private:
    Status split_curve(std::span<const CurveCut> cuts) {
        const Index number = cuts.front().curve;
        if (number < last_curve_ || number >= domain_.model.curve_count())
            return make_error(ErrorCode::usage, "domain", "", "the cuts are not in the order of the curves");
        last_curve_ = number + 1;
        std::vector<Point> points = out_.polylines[number].points;
        std::vector<std::size_t> at;    // of each cut in `points`
        std::vector<std::int64_t> ends; // corners there
        for (const CurveCut& cut : cuts) {
            const std::size_t place = insert_point(points, cut.at, at.empty() ? 0 : at.back());
            if (place == 0)
                return make_error(ErrorCode::usage, "domain", "",
                                  fmt::format("a cut at {} is not inside curve {}", cut.at, number));
            at.push_back(place);
            Description::Corner corner;
            corner.number = static_cast<std::int64_t>(out_.corners.size()) + 1;
            corner.position = points[place];
            out_.corners.push_back(corner);
            ends.push_back(corner.number);
        }
        put_pieces(number, out_.curves[number].ends ? cut_open(points, at, ends, *out_.curves[number].ends)
                                                    : cut_loop(points, at, ends));
        return Done{};
    }

    /// Position of the point at arc length s, which is inserted where there is none; behind `after`. 0: s is
    /// not inside.
    std::size_t insert_point(std::vector<Point>& points, double s, std::size_t after) {
        double length = 0;
        for (std::size_t i = 0; i + 1 < points.size(); ++i) {
            const double segment = glm::distance(points[i], points[i + 1]);
            if (s >= length + segment && i + 2 < points.size()) {
                length += segment;
                continue;
            }
            const double t = segment > 0 ? (s - length) / segment : 0;
            if (!(t >= 0 && t < 1)) return 0;
            const Point middle = points[i] + t * (points[i + 1] - points[i]);
            if (middle == points[i] || middle == points[i + 1]) { // as near as numbers can tell
                const std::size_t at = middle == points[i] ? i : i + 1;
                return at > after && at + 1 < points.size() ? at : 0;
            }
            cut_triangles(points[i], points[i + 1], middle);
            points.insert(points.begin() + static_cast<std::ptrdiff_t>(i) + 1, middle);
            return i + 1 > after ? i + 1 : 0;
        }
        return 0;
    }

    /// Cuts the triangles with edge ab at m.
    void cut_triangles(const Point& a, const Point& b, const Point& m) {
        for (Description::Surface& surface : out_.surfaces) {
            const auto find = [&](const Point& p) {
                const auto found = std::find(surface.points.begin(), surface.points.end(), p);
                return found == surface.points.end() ? kNoIndex
                                                     : static_cast<Index>(found - surface.points.begin());
            };
            const Index from = find(a), to = find(b);
            if (from == kNoIndex || to == kNoIndex) continue;
            const auto middle = static_cast<Index>(surface.points.size());
            const std::size_t count = surface.triangles.size();
            for (std::size_t t = 0; t < count; ++t) cut_triangle(surface, t, from, to, middle);
            if (surface.triangles.size() > count) surface.points.push_back(m);
        }
    }

    static void cut_triangle(Description::Surface& surface, std::size_t t, Index from, Index to,
                             Index middle) {
        std::array<Index, 3>& triangle = surface.triangles[t];
        for (std::size_t k = 0; k < 3; ++k) {
            const Index a = triangle[k], b = triangle[(k + 1) % 3];
            if (!((a == from && b == to) || (a == to && b == from))) continue;
            std::array<Index, 3> rest = triangle;
            rest[k] = middle;
            triangle[(k + 1) % 3] = middle;
            surface.triangles.push_back(rest);
            return;
        }
    }

    static std::vector<Piece> cut_open(const std::vector<Point>& points, const std::vector<std::size_t>& at,
                                       const std::vector<std::int64_t>& corner,
                                       const std::array<std::int64_t, 2>& ends) {
        std::vector<Piece> pieces;
        std::size_t from = 0;
        std::int64_t begin = ends[0];
        for (std::size_t k = 0; k <= at.size(); ++k) {
            const std::size_t to = k < at.size() ? at[k] : points.size() - 1;
            const std::int64_t end = k < at.size() ? corner[k] : ends[1];
            pieces.push_back({{points.begin() + static_cast<std::ptrdiff_t>(from),
                               points.begin() + static_cast<std::ptrdiff_t>(to) + 1},
                              {begin, end}});
            from = to;
            begin = end;
        }
        return pieces;
    }

    /// Pieces of a loop without a corner: the last one runs over its first point.
    static std::vector<Piece> cut_loop(const std::vector<Point>& points, const std::vector<std::size_t>& at,
                                       const std::vector<std::int64_t>& corner) {
        std::vector<Piece> pieces;
        for (std::size_t k = 0; k < at.size(); ++k) {
            const bool is_last = k + 1 == at.size();
            Piece piece;
            piece.ends = {corner[k], is_last ? corner.front() : corner[k + 1]};
            const auto from = points.begin() + static_cast<std::ptrdiff_t>(at[k]);
            piece.points.assign(from, is_last ? points.end()
                                              : points.begin() + static_cast<std::ptrdiff_t>(at[k + 1]) + 1);
            if (is_last)
                piece.points.insert(piece.points.end(), points.begin() + 1,
                                    points.begin() + static_cast<std::ptrdiff_t>(at.front()) + 1);
            pieces.push_back(std::move(piece));
        }
        return pieces;
    }

    void put_pieces(Index number, std::vector<Piece> pieces) {
        for (std::size_t k = 0; k < pieces.size(); ++k) {
            if (k > 0) {
                out_.curves.push_back(out_.curves[number]);
                out_.polylines.emplace_back();
                out_.polylines.back().number = static_cast<std::int64_t>(out_.polylines.size());
                out_.curves.back().number = static_cast<std::int64_t>(out_.curves.size());
                out_.curves.back().polylines = {out_.polylines.back().number};
            }
            const std::size_t at = k > 0 ? out_.curves.size() - 1 : number;
            out_.curves[at].ends = pieces[k].ends;
            out_.polylines[at].points = std::move(pieces[k].points);
        }
    }

    const Domain& domain_;
    Description out_;
    Index last_curve_ = 0; ///< curves below it have been cut
};

} // namespace

Result<Domain> split_curves(const Domain& domain, std::span<const CurveCut> cuts, Context& context) {
    CurveSplitter splitter(domain);
    if (Status done = splitter.split(cuts); !done) return done.error();
    auto split = build_domain(splitter.description(), context);
    if (split) split->name_group = domain.name_group;
    return split;
}

} // namespace hexopt
