#include "stages/planar/trim_quads.hpp"

#include "core/union_find.hpp"
#include "mesh/flat_table.hpp"
#include "mesh/hanging.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <glm/geometric.hpp>

namespace hexopt {

namespace {

constexpr double kLargestToCurve = 2;  ///< cell size over the length of a curve it meets
constexpr double kLeastLoopCells = 12; ///< cells along a loop without corners
constexpr double kSmallPart = 6;       ///< cells: parts below this are dropped without trying to join them

std::uint64_t key_of(Index a, Index b) { return std::uint64_t{a} << 32 | b; }
std::uint64_t edge_key(Index a, Index b) { return key_of(std::min(a, b), std::max(a, b)); }

class QuadTrimmer {
  public:
    QuadTrimmer(const HexMesh& tree, const OutlineCurves& curves, const QuadTrimOptions& options,
                Context& context)
        : tree_(tree), curves_(curves), options_(options), context_(context) {}

    Result<TrimmedQuads> run() {
        find_edges();
        classify();
        if (context_.is_cancelled()) return make_error(ErrorCode::cancelled, "trim", "", "cancelled");
        ask_for_short_curves();
        if (out_.refine_cells.empty()) {
            do {
                while (settle_half_edges() || remove_pinches()) {
                }
            } while (out_.refine_cells.empty() && remove_islands());
        }
        if (out_.refine_cells.empty())
            if (Status ok = collect_loops(); !ok) return ok.error();
        auto& wanted = out_.refine_cells;
        std::sort(wanted.begin(), wanted.end());
        wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
        if (wanted.empty()) emit();
        return std::move(out_);
    }

  private:
    Quad quad(std::size_t c) const {
        const Cell& cell = tree_.cells[c];
        return {cell[0], cell[1], cell[2], cell[3]};
    }
    Point2 at(Index v) const { return Point2(tree_.positions[v]); }
    double size(std::size_t c) const {
        const Quad q = quad(c);
        return std::max(glm::distance(at(q[0]), at(q[1])), glm::distance(at(q[0]), at(q[3])));
    }
    Point2 centre(std::size_t c) const {
        const Quad q = quad(c);
        return 0.25 * ((at(q[0]) + at(q[1])) + (at(q[2]) + at(q[3])));
    }

    void find_edges() {
        middle_of_.assign(tree_.vertex_count(), {kNoIndex, kNoIndex});
        std::vector<std::uint8_t> is_low(tree_.vertex_count(), 0);
        for (std::size_t c = 0; c < tree_.cell_count(); ++c) {
            const Quad q = quad(c);
            for (int k = 0; k < 4; ++k) {
                is_low[q[k]] = 1;
                cell_at_.find_or_insert(key_of(q[k], q[(k + 1) % 4]), static_cast<Index>(c));
            }
        }
        const Hanging& rows = tree_.hanging;
        for (std::size_t r = 0; r < rows.count(); ++r) {
            const Index m = rows.vertex[r], a = rows.master[rows.offset[r]],
                        b = rows.master[rows.offset[r] + 1];
            if (!is_low[m] || rows.offset[r + 1] - rows.offset[r] != 2) continue;
            middle_.find_or_insert(edge_key(a, b), m);
            middle_of_[m] = {a, b};
        }
    }

    void classify() {
        kept_.assign(tree_.cell_count(), 0);
        cut_.assign(tree_.cell_count(), 0);
        context_.parallel().for_each(tree_.cell_count(), 256, [&](std::size_t c) {
            const double margin = options_.margin_h * size(c);
            Box2 box;
            for (Index v : quad(c)) box.add(at(v));
            cut_[c] = curves_.tree().meets(box);
            const Box2 wide = {box.low - margin, box.high + margin};
            kept_[c] = !curves_.tree().meets(wide) && curves_.is_inside(centre(c));
        });
        out_.cut_cells = static_cast<std::size_t>(std::count(cut_.begin(), cut_.end(), 1));
    }

    bool is_kept(Index c) const { return c != kNoIndex && kept_[c]; }
    Index cell_at(Index a, Index b) const { return cell_at_.find(key_of(a, b)); }

    /// Cells on the other side of a cell's edge from a to b: none, one, or two smaller ones.
    std::array<Index, 2> across(Index a, Index b) const {
        if (const Index c = cell_at(b, a); c != kNoIndex) return {c, kNoIndex};
        if (const Index m = middle_.find(edge_key(a, b)); m != kNoIndex) {
            const Index one = cell_at(m, a), two = cell_at(b, m);
            if (one != kNoIndex || two != kNoIndex) return {one, two};
        }
        for (const auto& [m, end] : {std::pair(a, b), std::pair(b, a)}) {
            const auto [p, q] = middle_of_[m];
            if (p == kNoIndex || (end != p && end != q)) continue;
            const Index far = end == p ? q : p; // the whole edge runs from `far` over m to `end`, or back
            const Index c = m == a ? cell_at(end, far) : cell_at(far, end);
            if (c != kNoIndex) return {c, kNoIndex};
        }
        return {kNoIndex, kNoIndex};
    }
    bool is_boundary(Index a, Index b) const {
        const auto [one, two] = across(a, b);
        return !is_kept(one) && !is_kept(two);
    }

    void remove(std::size_t c) {
        kept_[c] = 0;
        ++out_.removed_cells;
    }

    /// Coarse cells with an edge that is boundary on one half only. True where any was removed.
    bool settle_half_edges() {
        bool removed = false;
        for (std::size_t c = 0; c < tree_.cell_count(); ++c) {
            if (!kept_[c]) continue;
            const Quad q = quad(c);
            for (int k = 0; k < 4; ++k) {
                const Index a = q[k], b = q[(k + 1) % 4];
                if (cell_at(b, a) != kNoIndex || middle_.find(edge_key(a, b)) == kNoIndex) continue;
                const auto [one, two] = across(a, b);
                if (is_kept(one) == is_kept(two)) continue;
                if (options_.may_refine) {
                    out_.refine_cells.push_back(static_cast<Index>(c));
                } else {
                    remove(c);
                    removed = true;
                }
                break;
            }
        }
        return removed;
    }

    /// Of cells that touch others at a vertex only, the one nearest to the outline.
    bool remove_pinches() {
        std::vector<std::uint8_t> starts(tree_.vertex_count(), 0);
        std::vector<Index> pinched;
        for_boundary_edges([&](std::size_t, Index a, Index) {
            if (++starts[a] == 2) pinched.push_back(a);
        });
        if (pinched.empty()) return false;
        std::sort(pinched.begin(), pinched.end());
        std::vector<std::pair<double, Index>> nearest(pinched.size(), {1e300, kNoIndex});
        for (std::size_t c = 0; c < tree_.cell_count(); ++c) {
            if (!kept_[c]) continue;
            for (Index v : quad(c)) {
                const auto place = std::lower_bound(pinched.begin(), pinched.end(), v);
                if (place == pinched.end() || *place != v) continue;
                const double depth = curves_.tree().nearest(centre(c)).distance;
                auto& best = nearest[static_cast<std::size_t>(place - pinched.begin())];
                best = std::min(best, {depth, static_cast<Index>(c)});
            }
        }
        for (const auto& [depth, c] : nearest)
            if (kept_[c]) remove(c);
        return true;
    }

    template <class Visit>
    void for_boundary_edges(const Visit& visit) const {
        for (std::size_t c = 0; c < tree_.cell_count(); ++c) {
            if (!kept_[c]) continue;
            const Quad q = quad(c);
            for (int k = 0; k < 4; ++k)
                if (is_boundary(q[k], q[(k + 1) % 4])) visit(c, q[k], q[(k + 1) % 4]);
        }
    }

    /// Parts that are not a region's largest. True where any was removed.
    bool remove_islands() {
        UnionFind sets(tree_.cell_count());
        for (std::size_t c = 0; c < tree_.cell_count(); ++c) {
            if (!kept_[c]) continue;
            const Quad q = quad(c);
            for (int k = 0; k < 4; ++k)
                for (Index other : across(q[k], q[(k + 1) % 4]))
                    if (is_kept(other)) sets.join(static_cast<Index>(c), other);
        }
        std::vector<double> area(tree_.cell_count(), 0), cells(tree_.cell_count(), 0);
        std::vector<Index> roots;
        for (std::size_t c = 0; c < tree_.cell_count(); ++c) {
            if (!kept_[c]) continue;
            const Index root = sets.find(static_cast<Index>(c));
            if (cells[root] == 0) roots.push_back(root);
            area[root] += size(c) * size(c);
            cells[root] += 1;
        }
        std::vector<Index> largest(curves_.loop_count(), kNoIndex), region(roots.size());
        for (std::size_t r = 0; r < roots.size(); ++r) {
            region[r] = curves_.innermost_loop(centre(roots[r]));
            Index& best = largest[region[r]];
            if (best == kNoIndex || area[roots[r]] > area[best]) best = roots[r];
        }
        if (roots.size() == static_cast<std::size_t>(std::count_if(largest.begin(), largest.end(),
                                                                   [](Index l) { return l != kNoIndex; })))
            return false;
        std::vector<std::uint8_t> is_main(tree_.cell_count(), 0);
        for (Index root : largest)
            if (root != kNoIndex) is_main[root] = 1;
        return drop_islands(sets, is_main, cells);
    }

    bool drop_islands(UnionFind& sets, const std::vector<std::uint8_t>& is_main,
                      const std::vector<double>& cells) {
        std::vector<std::uint8_t> beside(tree_.vertex_count(), 0);
        bool asks = false, removed = false;
        for (std::size_t c = 0; c < tree_.cell_count(); ++c) {
            if (!kept_[c]) continue;
            const Index root = sets.find(static_cast<Index>(c));
            if (is_main[root]) continue;
            if (options_.may_refine && options_.may_join && cells[root] >= kSmallPart) {
                for (Index v : quad(c)) beside[v] = 1;
                asks = true;
            } else {
                remove(c);
                out_.dropped_cells += cells[root] >= kSmallPart;
                removed = true;
            }
        }
        out_.asked_to_join = asks;
        for (std::size_t c = 0; asks && c < tree_.cell_count(); ++c) {
            const Quad q = quad(c);
            if (!kept_[c] && cut_[c] &&
                std::any_of(q.begin(), q.end(), [&](Index v) { return beside[v] != 0; }))
                out_.refine_cells.push_back(static_cast<Index>(c));
        }
        return removed;
    }

    void ask_for_short_curves() {
        if (!options_.may_refine) return;
        for (std::size_t c = 0; c < tree_.cell_count(); ++c) {
            if (!cut_[c]) continue;
            Box2 box;
            for (Index v : quad(c)) box.add(at(v));
            const double h = size(c);
            bool is_large = false;
            curves_.tree().visit_box(box, [&](Index s) {
                is_large = h > kLargestToCurve * curves_.curve_length(s) ||
                           h * kLeastLoopCells > curves_.length(curves_.loop_of(s));
                return !is_large;
            });
            if (is_large) out_.refine_cells.push_back(static_cast<Index>(c));
        }
    }

    /// Chains boundary edges and gives each chain to the loop of the outline that most of it is nearest to.
    Status collect_loops() {
        FlatTable next, cell;
        std::vector<Index> starts;
        for_boundary_edges([&](std::size_t c, Index a, Index b) {
            next.find_or_insert(a, b);
            cell.find_or_insert(a, static_cast<Index>(c));
            starts.push_back(a);
        });
        std::sort(starts.begin(), starts.end());
        std::vector<std::uint8_t> done(tree_.vertex_count(), 0);
        std::vector<Index> owner(curves_.loop_count(), kNoIndex);
        std::vector<std::uint8_t> wanting(curves_.loop_count(), 0);
        for (Index start : starts) {
            if (done[start]) continue;
            KeptLoop loop;
            for (Index v = start; v != kNoIndex && !done[v]; v = next.find(v)) {
                done[v] = 1;
                loop.vertices.push_back(v);
                loop.quads.push_back(cell.find(v));
            }
            loop.outline = vote(loop);
            if (owner[loop.outline] != kNoIndex) wanting[loop.outline] = 1;
            owner[loop.outline] = static_cast<Index>(out_.loops.size());
            if (is_turned(loop)) wanting[loop.outline] = 1;
            out_.loops.push_back(std::move(loop));
        }
        for (std::size_t l = 0; l < owner.size(); ++l) wanting[l] = wanting[l] || owner[l] == kNoIndex;
        if (std::count(wanting.begin(), wanting.end(), 1) == 0) return Done{};
        return settle_loops(wanting);
    }

    Index vote(const KeptLoop& loop) const {
        std::vector<std::size_t> votes(curves_.loop_count(), 0);
        for (std::size_t i = 0; i < loop.vertices.size(); ++i) {
            const Point2 p = 0.5 * (at(loop.vertices[i]) + at(loop.vertices[(i + 1) % loop.vertices.size()]));
            ++votes[curves_.loop_of(curves_.tree().nearest(p).segment)];
        }
        return static_cast<Index>(std::max_element(votes.begin(), votes.end()) - votes.begin());
    }

    /// Whether it runs the other way than the outline: an outer loop round a hole's outline.
    bool is_turned(const KeptLoop& loop) const {
        std::vector<Point2> points;
        for (Index v : loop.vertices) points.push_back(at(v));
        return (twice_area(points) > 0) != curves_.is_outer(loop.outline);
    }

    /// Refines along loops of the outline that have no loop of kept cells, or several.
    Status settle_loops(const std::vector<std::uint8_t>& wanting) {
        Point2 place(0);
        for (std::size_t c = 0; c < tree_.cell_count(); ++c) {
            if (!cut_[c]) continue;
            const auto nearest = curves_.tree().nearest(centre(c));
            if (!wanting[curves_.loop_of(nearest.segment)]) continue;
            out_.refine_cells.push_back(static_cast<Index>(c));
            place = nearest.point;
        }
        if (options_.may_refine) return Done{};
        return Error{ErrorCode::bad_input,
                     "trim",
                     "",
                     {fmt::format("cells are too large for the gaps of the outline, e.g. near {}",
                                  curves_.describe(place)),
                      "give smaller cells (--size, --cells) or more --gap-levels"}};
    }

    void emit() {
        QuadMesh& mesh = out_.mesh;
        std::vector<Index> number(tree_.vertex_count(), kNoIndex), quad_of(tree_.cell_count(), kNoIndex);
        std::vector<std::uint8_t> corners(tree_.vertex_count(), 0);
        for (std::size_t c = 0; c < tree_.cell_count(); ++c) {
            if (!kept_[c]) continue;
            Quad q = quad(c);
            for (Index& v : q) {
                ++corners[v];
                if (number[v] == kNoIndex) {
                    number[v] = static_cast<Index>(mesh.positions.size());
                    mesh.positions.push_back(at(v));
                }
                v = number[v];
            }
            quad_of[c] = static_cast<Index>(mesh.quads.size());
            mesh.quads.push_back(q);
            mesh.level.push_back(tree_.level.empty() ? 0 : tree_.level[c]);
            mesh.size.push_back(size(c));
            mesh.cell.push_back(static_cast<Index>(c));
        }
        mesh.place.resize(mesh.positions.size());
        emit_hanging(number);
        for (KeptLoop& loop : out_.loops)
            for (std::size_t i = 0; i < loop.vertices.size(); ++i) {
                loop.corners.push_back(corners[loop.vertices[i]]);
                loop.vertices[i] = number[loop.vertices[i]];
                loop.quads[i] = quad_of[loop.quads[i]];
            }
    }

    /// In the middle of an edge of a kept cell, with kept cells on both halves.
    void emit_hanging(const std::vector<Index>& number) {
        std::vector<std::array<Index, 3>> rows;
        for (Index m = 0; m < middle_of_.size(); ++m) {
            const auto [a, b] = middle_of_[m];
            if (a == kNoIndex || number[m] == kNoIndex) continue;
            if (is_kept(cell_at(a, b)) || is_kept(cell_at(b, a)))
                rows.push_back({number[m], std::min(number[a], number[b]), std::max(number[a], number[b])});
        }
        std::sort(rows.begin(), rows.end());
        constexpr double kHalf[2] = {0.5, 0.5};
        for (const auto& [m, a, b] : rows) append_row(out_.mesh.hanging, m, std::array{a, b}, kHalf);
    }

    const HexMesh& tree_;
    const OutlineCurves& curves_;
    const QuadTrimOptions& options_;
    Context& context_;
    TrimmedQuads out_;
    FlatTable cell_at_;                           ///< by directed edge
    FlatTable middle_;                            ///< by edge: vertex in its middle
    std::vector<std::array<Index, 2>> middle_of_; ///< per vertex: ends of the edge in whose middle it hangs
    std::vector<std::uint8_t> kept_, cut_;
};

} // namespace

Result<TrimmedQuads> trim_quads(const HexMesh& quadtree, const OutlineCurves& curves,
                                const QuadTrimOptions& options, Context& context) {
    return QuadTrimmer(quadtree, curves, options, context).run();
}

} // namespace hexopt
