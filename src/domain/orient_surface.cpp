#include "domain/orient_surface.hpp"

#include "core/random.hpp"
#include "domain/surface_pieces.hpp"
#include "domain/surface_polygons.hpp"
#include "domain/triangle_tree.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace hexopt {

namespace {

enum class UnitKind : std::uint8_t { body, cavity, piece, sheet };

/// What is oriented as a whole: a closed cluster, or a piece of an open one.
struct Unit {
    bool closed;
    std::vector<Index> triangles;
    double volume = 0; ///< model units cubed, as oriented now
    UnitKind kind = UnitKind::piece;
    bool turn = false; ///< to be turned over
};

std::vector<Unit> make_units(const SurfacePieces& pieces, std::span<const TriangleTree::Corners> corners) {
    std::vector<Index> unit_of_piece(pieces.piece_count), unit_of_cluster(pieces.cluster_count, kNoIndex);
    std::vector<Unit> units;
    for (Index p = 0; p < pieces.piece_count; ++p) {
        const Index cluster = pieces.cluster[p];
        const bool closed = pieces.closed[cluster];
        if (closed && unit_of_cluster[cluster] != kNoIndex) {
            unit_of_piece[p] = unit_of_cluster[cluster];
            continue;
        }
        unit_of_piece[p] = unit_of_cluster[cluster] = static_cast<Index>(units.size());
        units.push_back({closed, {}});
    }
    for (Index t = 0; t < pieces.piece.size(); ++t)
        units[unit_of_piece[pieces.piece[t]]].triangles.push_back(t);
    for (Unit& unit : units) {
        const Point origin = corners[unit.triangles[0]][0];
        for (Index t : unit.triangles)
            unit.volume +=
                glm::dot(corners[t][0] - origin, glm::cross(corners[t][1] - origin, corners[t][2] - origin)) /
                6;
    }
    return units;
}

Point random_direction(Random& random) {
    for (;;) {
        const Point p(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        const double length2 = glm::dot(p, p);
        if (length2 > 0.01 && length2 < 1) return p / std::sqrt(length2);
    }
}

/// Random points of a unit, uniform by area, with their triangle.
class UnitSampler {
  public:
    UnitSampler(const Unit& unit, std::span<const TriangleTree::Corners> corners)
        : unit_(unit), corners_(corners) {
        for (Index t : unit.triangles) {
            const auto& x = corners[t];
            const double before = area_.empty() ? 0 : area_.back();
            area_.push_back(before + glm::length(glm::cross(x[1] - x[0], x[2] - x[0])));
        }
    }
    bool has_area() const { return area_.back() > 0; }

    std::pair<Index, Point> draw(Random& random) const {
        const double at = random.uniform() * area_.back();
        const auto found = std::upper_bound(area_.begin(), area_.end(), at);
        const Index t =
            unit_.triangles[std::min<std::size_t>(found - area_.begin(), unit_.triangles.size() - 1)];
        double u = random.uniform(), v = random.uniform();
        if (u + v > 1) u = 1 - u, v = 1 - v;
        const auto& x = corners_[t];
        return {t, x[0] + u * (x[1] - x[0]) + v * (x[2] - x[0])};
    }

  private:
    const Unit& unit_;
    std::span<const TriangleTree::Corners> corners_;
    std::vector<double> area_; ///< twice, summed up
};

/// Decides every unit by casting rays against all of them but the sheets.
class RayVotes {
  public:
    RayVotes(std::vector<Unit>& units, std::span<const TriangleTree::Corners> corners, Context& context)
        : units_(units), corners_(corners), context_(context), tree_(solid_corners()) {
        unit_of_.resize(corners.size());
        Box box;
        for (Index u = 0; u < units.size(); ++u)
            for (Index t : units[u].triangles) {
                unit_of_[t] = u;
                for (const Point& x : corners[t]) box.add(x);
            }
        far_ = 2 * glm::length(box.high - box.low);
        samples_ = std::clamp<std::size_t>(200000 / std::max<std::size_t>(1, units.size()), 9, 49);
    }

    void decide() {
        context_.parallel().for_each(units_.size(), 1, [&](std::size_t u) {
            if (units_[u].kind == UnitKind::sheet || context_.is_cancelled()) return;
            const UnitSampler sampler(units_[u], corners_);
            if (!sampler.has_area()) return;
            Random random(context_.seed(), u);
            if (units_[u].closed)
                decide_body(static_cast<Index>(u), sampler, random);
            else
                decide_piece(static_cast<Index>(u), sampler, random);
        });
    }

  private:
    /// Those of sheets shrink to a point that no ray meets, so that numbers stay.
    std::vector<TriangleTree::Corners> solid_corners() const {
        std::vector<TriangleTree::Corners> solid(corners_.begin(), corners_.end());
        for (const Unit& unit : units_)
            if (unit.kind == UnitKind::sheet)
                for (Index t : unit.triangles) solid[t][1] = solid[t][2] = solid[t][0];
        return solid;
    }

    /// A cavity is wholly inside the rest, which it does not touch.
    void decide_body(Index u, const UnitSampler& sampler, Random& random) const {
        std::size_t odd = 0;
        for (std::size_t s = 0; s < samples_; ++s) {
            std::size_t met = 0;
            tree_.visit_line(sampler.draw(random).second, random_direction(random), 0, far_,
                             [&](Index t, double, bool) { met += unit_of_[t] != u; });
            odd += met % 2;
        }
        const bool cavity = 10 * odd > 9 * samples_ && !touches_others(u);
        units_[u].kind = cavity ? UnitKind::cavity : UnitKind::body;
        units_[u].turn = cavity != (units_[u].volume < 0);
    }

    bool touches_others(Index u) const {
        bool touches = false;
        for (Index t : units_[u].triangles)
            for (int k = 0; k < 3 && !touches; ++k)
                tree_.visit_line(
                    corners_[t][k], corners_[t][(k + 1) % 3] - corners_[t][k], 0, 1,
                    [&](Index other, double, bool) { touches = touches || unit_of_[other] != u; });
        return touches;
    }

    void decide_piece(Index u, const UnitSampler& sampler, Random& random) const {
        std::size_t right = 0, wrong = 0, inside = 0;
        for (std::size_t s = 0; s < samples_; ++s) {
            const auto [t, p] = sampler.draw(random);
            const auto& x = corners_[t];
            const Point normal = glm::normalize(glm::cross(x[1] - x[0], x[2] - x[0]));
            Point direction = random_direction(random);
            while (std::abs(glm::dot(direction, normal)) < 0.2) direction = random_direction(random);
            if (glm::dot(direction, normal) < 0) direction = -direction;
            const bool front = is_odd(p, direction), back = is_odd(p, -direction);
            right += !front && back;
            wrong += front && !back;
            inside += front && back;
        }
        const bool sheet = 10 * inside > 8 * samples_;
        units_[u].kind = sheet ? UnitKind::sheet : UnitKind::piece;
        units_[u].turn = wrong > right;
    }

    /// Coincident triangles, met at once, do not count: between touching solids both sides are inside.
    bool is_odd(const Point& from, const Point& direction) const {
        std::size_t met = 0;
        tree_.visit_line(from, direction, 1e-7 * far_, far_, [&](Index, double, bool) { ++met; });
        return met % 2 == 1;
    }

    std::vector<Unit>& units_;
    std::span<const TriangleTree::Corners> corners_;
    Context& context_;
    TriangleTree tree_;
    std::vector<Index> unit_of_;
    double far_ = 0;
    std::size_t samples_ = 0;
};

bool has_sheets(std::span<const Unit> units) {
    return std::any_of(units.begin(), units.end(), [](const Unit& u) { return u.kind == UnitKind::sheet; });
}

OrientedSurface assemble(const TriangleSoup& soup, std::span<const Index> kept, const SurfacePieces& pieces,
                         std::span<const Unit> units) {
    OrientedSurface result;
    OrientationReport& report = result.report;
    std::vector<std::uint8_t> leave_out(kept.size(), 0), flip = pieces.flipped;
    for (const Unit& unit : units) {
        report.bodies += unit.kind == UnitKind::body;
        report.cavities += unit.kind == UnitKind::cavity;
        report.open_pieces += unit.kind == UnitKind::piece;
        for (Index t : unit.triangles) {
            leave_out[t] = unit.kind == UnitKind::sheet;
            flip[t] ^= unit.turn;
        }
    }
    result.soup.vertices = soup.vertices;
    result.soup.patch_names = soup.patch_names;
    result.soup.patch_group = soup.patch_group;
    for (std::size_t k = 0; k < kept.size(); ++k) {
        report.sheet_triangles += leave_out[k];
        if (leave_out[k]) continue;
        std::array<Index, 3> triangle = soup.triangles[kept[k]];
        if (flip[k]) std::swap(triangle[1], triangle[2]);
        report.flipped_triangles += flip[k];
        result.soup.triangles.push_back(triangle);
        if (!soup.patch.empty()) result.soup.patch.push_back(soup.patch[kept[k]]);
    }
    report.pieces = pieces.piece_count;
    report.unorientable_edges = pieces.unorientable_edges;
    return result;
}

} // namespace

Result<OrientedSurface> orient_surface(const TriangleSoup& soup, Context& context) {
    if (Status ok = check_soup(soup); !ok) return ok.error();
    const std::vector<Index> first = find_first_equal(soup.vertices);
    std::vector<std::array<Index, 3>> merged = soup.triangles;
    for (auto& t : merged)
        for (Index& v : t) v = first[v];
    const std::vector<Index> kept = drop_repeated(merged);
    if (kept.empty()) return make_error(ErrorCode::bad_input, "surface", "", "no triangle bounds anything");
    std::vector<std::array<Index, 3>> triangles;
    for (Index t : kept) triangles.push_back(merged[t]);
    const SurfacePieces pieces = find_pieces(std::move(triangles), soup.vertices);
    std::vector<TriangleTree::Corners> corners;
    for (const auto& v : pieces.triangles)
        corners.push_back({soup.vertices[v[0]], soup.vertices[v[1]], soup.vertices[v[2]]});
    std::vector<Unit> units = make_units(pieces, corners);
    RayVotes(units, corners, context).decide();
    // Rays that met a sheet voted wrongly.
    if (has_sheets(units)) RayVotes(units, corners, context).decide();
    if (context.is_cancelled()) return make_error(ErrorCode::cancelled, "surface", "", "cancelled");
    OrientedSurface result = assemble(soup, kept, pieces, units);
    result.report.repeated_triangles = soup.triangles.size() - kept.size();
    if (result.soup.triangles.empty())
        return make_error(ErrorCode::bad_input, "surface", "", "no triangle bounds anything");
    return result;
}

} // namespace hexopt
