#include "mesh/recognise_hanging.hpp"

#include "mesh/face_split.hpp"
#include "mesh/hanging.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace hexopt {

namespace {

constexpr int kMaxCuts = 8;

/// Edges of the faces used once, and what lies in the middle of them.
class GeometricMidpoints {
  public:
    GeometricMidpoints(const HexMesh& mesh, const FaceSplitter& faces, double tolerance)
        : positions_(mesh.positions), tolerance_(tolerance) {
        build_neighbours(mesh, faces);
        Point low(HUGE_VAL), high(-HUGE_VAL);
        for (Index v : neighbour_vertices_)
            low = glm::min(low, positions_[v]), high = glm::max(high, positions_[v]);
        if (!neighbour_vertices_.empty()) rounding_ = 1e-7 * glm::distance(low, high);
    }

    std::span<const Index> neighbours(Index v) const { return neighbours_[v]; }
    bool are_neighbours(Index a, Index b) const {
        return std::binary_search(neighbours(a).begin(), neighbours(a).end(), b);
    }

    /// Vertices in the middle of a line, reached from its start along edges that lie on it; nearest first.
    void find(Index from, Index to, std::vector<Index>& found) const {
        const Line line(positions_[from], positions_[to]);
        if (line.length <= 2 * rounding_)
            find_common(from, to, 0, found);
        else
            walk({from, to, line}, from, 0, 0, found);
        sort_by_distance(0.5 * (positions_[from] + positions_[to]), found);
    }

    /// Common neighbours at most `tolerance` of the line's length from its middle; nearest first.
    void find_common(Index from, Index to, double tolerance, std::vector<Index>& found) const {
        const Point middle = 0.5 * (positions_[from] + positions_[to]);
        const double reach = tolerance * glm::distance(positions_[from], positions_[to]) + rounding_;
        for (Index v : neighbours(from))
            if (v != to && are_neighbours(v, to) && glm::distance(positions_[v], middle) <= reach)
                found.push_back(v);
        sort_by_distance(middle, found);
    }

    const Point& position(Index v) const { return positions_[v]; }
    double rounding() const { return rounding_; }

  private:
    struct Line {
        Line(const Point& a, const Point& b) : start(a), along(b - a), length(glm::distance(a, b)) {}
        Point start, along;
        double length;
    };
    struct Walk {
        Index from, to;
        Line line;
    };

    void build_neighbours(const HexMesh& mesh, const FaceSplitter& faces) {
        neighbours_.offset.assign(mesh.vertex_count() + 1, 0);
        std::vector<std::pair<Index, Index>> edges;
        edges.reserve(faces.count() * 8);
        for (Index face = 0; face < faces.count(); ++face)
            for (int k = 0; k < 4; ++k) {
                const Index a = faces.quad(face)[k], b = faces.quad(face)[(k + 1) % 4];
                edges.emplace_back(a, b);
                edges.emplace_back(b, a);
            }
        std::sort(edges.begin(), edges.end());
        edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
        for (auto [a, b] : edges) {
            if (neighbours_.offset[a + 1]++ == 0) neighbour_vertices_.push_back(a);
            neighbours_.item.push_back(b);
        }
        for (std::size_t v = 0; v < mesh.vertex_count(); ++v)
            neighbours_.offset[v + 1] += neighbours_.offset[v];
    }

    void walk(const Walk& on, Index at, double t_at, int steps, std::vector<Index>& found) const {
        if (steps == 1 << (kMaxCuts / 2)) return;
        const double reach = tolerance_ * on.line.length + rounding_;
        for (Index v : neighbours(at)) {
            if (v == on.to || v == on.from) continue;
            const Point offset = positions_[v] - on.line.start;
            const double t = glm::dot(offset, on.line.along) / (on.line.length * on.line.length);
            if (!(t > t_at && t < 0.5 + tolerance_)) continue;
            if (glm::distance(offset, t * on.line.along) > reach) continue;
            if (glm::distance(offset, 0.5 * on.line.along) <= reach)
                found.push_back(v);
            else if (t < 0.5)
                walk(on, v, t, steps + 1, found);
        }
    }

    void sort_by_distance(const Point& middle, std::vector<Index>& found) const {
        std::sort(found.begin(), found.end());
        found.erase(std::unique(found.begin(), found.end()), found.end());
        std::stable_sort(found.begin(), found.end(), [&](Index a, Index b) {
            return glm::distance(positions_[a], middle) < glm::distance(positions_[b], middle);
        });
    }

    const std::vector<Point>& positions_;
    double tolerance_;
    double rounding_ = 0; ///< distances that files in single precision cannot tell from none
    Csr<Index> neighbours_;
    std::vector<Index> neighbour_vertices_; ///< those with neighbours
};

class Recogniser {
  public:
    Recogniser(const HexMesh& mesh, const RecogniseOptions& options, FaceSplitter faces)
        : options_(options), faces_(std::move(faces)), midpoints_(mesh, faces_, options.tolerance_rel),
          is_part_(faces_.count(), 0), is_coarse_(faces_.count(), 0), has_row_(mesh.vertex_count(), 0) {}

    void search_faces() {
        const MidpointFinder finder = [&](Index from, Index to, std::vector<Index>& found) {
            midpoints_.find(from, to, found);
        };
        FaceCover cover;
        for (Index face = 0; face < faces_.count(); ++face)
            if (!is_part_[face] && faces_.cover(face, finder, kMaxCuts, cover)) accept(face, cover);
        for (Index face = 0; face < faces_.count(); ++face)
            if (!is_part_[face] && !is_coarse_[face] && split_in_four(face, cover)) accept(face, cover);
    }

    /// Edges whose middle carries a vertex although none of their faces is split: cells of two levels that
    /// touch along an edge only.
    void search_edges() {
        std::vector<Index> found;
        for (Index face = 0; face < faces_.count(); ++face)
            for (int k = 0; k < 4; ++k) {
                const Index a = faces_.quad(face)[k], b = faces_.quad(face)[(k + 1) % 4];
                found.clear();
                midpoints_.find_common(a, b, options_.tolerance_rel, found);
                if (found.empty() || has_row_[found.front()]) continue;
                add_row(found.front(), {a, b}, {0.5, 0.5});
                ++result_.single_edge_count;
            }
    }

    Result<RecognisedHanging> finish(const HexMesh& mesh) {
        auto closed = close_hanging(rows_, mesh.vertex_count());
        if (!closed) return closed.error();
        result_.hanging = std::move(closed).value();
        count_conflicts();
        result_.max_deviation = max_hanging_deviation(result_.hanging, mesh.positions);
        return std::move(result_);
    }

  private:
    void accept(Index face, const FaceCover& cover) {
        for (Index part : cover.parts)
            if (is_part_[part] || is_coarse_[part]) return; // taken by another face already
        is_coarse_[face] = 1;
        for (Index part : cover.parts) is_part_[part] = 1;
        ++result_.coarse_face_count;
        const Quad& q = faces_.quad(face);
        for (const auto& at : cover.vertices) {
            const std::array<double, 4> weight = {(1 - at.u) * (1 - at.v), at.u * (1 - at.v), at.u * at.v,
                                                  (1 - at.u) * at.v};
            std::vector<Index> masters;
            std::vector<double> weights;
            for (int k = 0; k < 4; ++k)
                if (weight[k] != 0) masters.push_back(q[k]), weights.push_back(weight[k]);
            add_row(at.vertex, masters, weights);
        }
    }

    /// One level, by the vertex ids, with the loose tolerance.
    bool split_in_four(Index face, FaceCover& cover) const {
        const Quad& q = faces_.quad(face);
        std::array<std::vector<Index>, 4> middle;
        for (int k = 0; k < 4; ++k) {
            midpoints_.find_common(q[k], q[(k + 1) % 4], options_.split4_tolerance_rel, middle[k]);
            if (middle[k].empty()) return false;
        }
        for (Index m0 : middle[0])
            for (Index m1 : middle[1])
                for (Index m2 : middle[2])
                    for (Index m3 : middle[3])
                        if (is_split(q, {m0, m1, m2, m3}, cover)) return true;
        return false;
    }

    bool is_split(const Quad& q, const Quad& middle, FaceCover& cover) const {
        Point centre(0);
        double edge = 0;
        for (int k = 0; k < 4; ++k) {
            centre += 0.25 * midpoints_.position(q[k]);
            edge += 0.25 * glm::distance(midpoints_.position(q[k]), midpoints_.position(q[(k + 1) % 4]));
        }
        const double reach = options_.split4_tolerance_rel * edge + midpoints_.rounding();
        for (Index f : midpoints_.neighbours(middle[0])) {
            if (glm::distance(midpoints_.position(f), centre) > reach) continue;
            cover.parts.clear();
            for (int k = 0; k < 4; ++k)
                cover.parts.push_back(faces_.find_opposite({q[k], middle[k], f, middle[(k + 3) % 4]}));
            if (std::count(cover.parts.begin(), cover.parts.end(), kNoIndex)) continue;
            cover.vertices = {{middle[0], 0.5, 0},
                              {middle[1], 1, 0.5},
                              {middle[2], 0.5, 1},
                              {middle[3], 0, 0.5},
                              {f, 0.5, 0.5}};
            return true;
        }
        return false;
    }

    /// The first row of a vertex counts; the others must agree with it, which finish() checks.
    void add_row(Index vertex, const std::vector<Index>& masters, const std::vector<double>& weights) {
        append_row(has_row_[vertex] ? repeated_ : rows_, vertex, masters, weights);
        has_row_[vertex] = 1;
    }

    /// Terms of a vertex over free vertices.
    void append_terms(Index vertex, double weight, std::vector<std::pair<Index, double>>& terms) const {
        const Hanging& h = result_.hanging;
        const auto at = std::lower_bound(h.vertex.begin(), h.vertex.end(), vertex);
        if (at == h.vertex.end() || *at != vertex) return terms.emplace_back(vertex, weight), void();
        const std::size_t row = at - h.vertex.begin();
        for (std::size_t k = h.offset[row]; k < h.offset[row + 1]; ++k)
            terms.emplace_back(h.master[k], weight * h.weight[k]);
    }

    /// Rows of vertices that got another one first must say the same once closed.
    void count_conflicts() {
        std::vector<std::pair<Index, double>> terms;
        for (std::size_t row = 0; row < repeated_.count(); ++row) {
            terms.clear();
            for (std::size_t k = repeated_.offset[row]; k < repeated_.offset[row + 1]; ++k)
                append_terms(repeated_.master[k], repeated_.weight[k], terms);
            append_terms(repeated_.vertex[row], -1, terms);
            std::sort(terms.begin(), terms.end());
            double largest = 0;
            for (std::size_t i = 0; i < terms.size();) {
                const Index id = terms[i].first;
                double sum = 0;
                for (; i < terms.size() && terms[i].first == id; ++i) sum += terms[i].second;
                largest = std::max(largest, std::abs(sum));
            }
            result_.conflict_count += largest > 1e-9;
        }
    }

    const RecogniseOptions& options_;
    FaceSplitter faces_;
    GeometricMidpoints midpoints_;
    std::vector<std::uint8_t> is_part_, is_coarse_;
    Hanging rows_, repeated_; ///< not closed; repeated_: further rows of the same vertices
    std::vector<std::uint8_t> has_row_;
    RecognisedHanging result_;
};

} // namespace

Result<RecognisedHanging> recognise_hanging(const HexMesh& mesh, const RecogniseOptions& options,
                                            const Parallel& parallel) {
    std::vector<Quad> quads;
    {
        const auto vertex_cell = compute_vertex_cell(mesh);
        for (CellFace face : find_faces_used_once(mesh, vertex_cell, parallel))
            quads.push_back(face_vertices(mesh, face));
    }
    Recogniser recogniser(mesh, options, FaceSplitter(std::move(quads)));
    recogniser.search_faces();
    recogniser.search_edges();
    return recogniser.finish(mesh);
}

} // namespace hexopt
