#include "stages/trim/kept_cells.hpp"

#include "mesh/hex_reference.hpp"

#include <algorithm>
#include <numeric>
#include <set>

namespace hexopt::trimming {

namespace {

constexpr std::size_t kChunk = 4096;
constexpr int kMaxRounds = 50;
constexpr int kFillRounds = 3;       ///< later rounds only remove, so that they end
constexpr std::uint8_t kMaxTips = 2; ///< longer thorns are thin parts of the model
constexpr float kPitDepth_h = -0.25f;

/// Groups of a vertex's cells, by their place in the star.
class StarGroups {
  public:
    StarGroups(const CellGraph& graph, std::span<const std::uint8_t> kept, std::span<const Index> star,
               Index vertex, const HexMesh& mesh)
        : kept_(kept), star_(star), parent_(star.size() + 1) {
        std::iota(parent_.begin(), parent_.end(), Index{0});
        for (Index i = 0; i < star.size(); ++i)
            for (int f = 0; f < 6; ++f) {
                if (graph.is_outer(star[i], f)) {
                    if (touches(mesh, star[i], f, vertex)) outer_ = true, join_outer(i);
                    continue;
                }
                graph.visit_behind(star[i], f, [&](Index other) { join(i, other); });
            }
    }

    Index group(Index place) const {
        while (parent_[place] != place) place = parent_[place];
        return place;
    }
    /// Number of groups of kept cells, or of the others with the outside.
    int count(bool of_kept) const {
        int groups = 0;
        for (Index i = 0; i < star_.size(); ++i) groups += is_kept(i) == of_kept && group(i) == i;
        if (!of_kept && outer_) groups += group(outside()) == outside();
        return groups;
    }
    bool is_kept(Index place) const { return kept_[star_[place]]; }

  private:
    Index outside() const { return static_cast<Index>(star_.size()); }

    /// A vertex that hangs on a cell is taken to touch all its outer faces.
    static bool touches(const HexMesh& mesh, Index cell, int face, Index vertex) {
        const Cell& v = mesh.cells[cell];
        const bool corner = std::find(v.begin(), v.end(), vertex) != v.end();
        const auto& local = hex::kFaceVertex[static_cast<std::size_t>(face)];
        return !corner || std::any_of(local.begin(), local.end(), [&](int k) { return v[k] == vertex; });
    }
    void unite(Index a, Index b) {
        a = group(a), b = group(b);
        parent_[std::max(a, b)] = std::min(a, b);
    }
    void join_outer(Index place) {
        if (!is_kept(place)) unite(place, outside());
    }
    /// Two cells of one star that share a face share the vertex in it.
    void join(Index place, Index other) {
        for (Index j = 0; j < star_.size(); ++j)
            if (star_[j] == other && is_kept(j) == is_kept(place)) unite(place, j);
    }

    std::span<const std::uint8_t> kept_;
    std::span<const Index> star_;
    std::vector<Index> parent_;
    bool outer_ = false;
};

} // namespace

void KeptCells::choose(const TrimOptions& options) {
    kept_.resize(mesh_.cell_count());
    removed_.assign(mesh_.cell_count(), 0);
    tip_age_.assign(mesh_.cell_count(), 0);
    const auto least = static_cast<float>(options.depth_h);
    for (Index c = 0; c < kept_.size(); ++c) {
        const bool deep = options.rule == TrimRule::strict ? !sides_.cut[c] : sides_.depth_h[c] >= least;
        kept_[c] = sides_.inside[c] && deep;
    }
}

bool KeptCells::is_gap_between(Index a, Index b, const Quad& quad) const {
    const Point from = point_inside(a), to = point_inside(b);
    const double contact = kContact_h * cell_size(mesh_, a);
    if (!queries_.leaves_inside(from, to, contact)) return false;
    // A notch that the straight line clips can be got round, a gap cannot.
    Point centre(0);
    for (Index v : quad) centre += 0.25 * mesh_.positions[v];
    for (int k = 0; k < 8; ++k) {
        const Point &x = mesh_.positions[quad[k / 2]], &y = mesh_.positions[quad[(k + 1) / 2 % 4]];
        const Point by = centre + 0.9 * (0.5 * (x + y) - centre);
        if (queries_.is_inside(by) && !queries_.leaves_inside(from, by, contact) &&
            !queries_.leaves_inside(by, to, contact))
            return false;
    }
    return true;
}

void KeptCells::gather_gaps(Index cell, std::vector<Pair>& pairs) const {
    const auto check = [&](Index other, CellFace between) {
        const bool twice = sides_.cut[other] && other < cell;
        if (kept_[other] && !twice && is_gap_between(cell, other, face_vertices(mesh_, between)))
            pairs.push_back({cell, other});
    };
    for (std::uint32_t f = 0; f < 6; ++f) {
        const Index behind = graph_.neighbour[cell][f];
        if (behind == kNoIndex) continue;
        if (!(behind & CellGraph::kFine)) {
            check(behind, {cell, f});
            continue;
        }
        for (CellFace fine : graph_.fine_faces[behind & ~CellGraph::kFine]) check(fine.cell, fine);
    }
}

void KeptCells::open_gaps() {
    std::vector<std::vector<Pair>> found((kept_.size() + kChunk - 1) / kChunk);
    context_.parallel().for_chunks(kept_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        for (auto c = static_cast<Index>(begin); c < end; ++c)
            if (kept_[c] && sides_.cut[c]) gather_gaps(c, found[begin / kChunk]);
    });
    for (const auto& part : found)
        for (const Pair& pair : part) {
            if (!kept_[pair.a] || !kept_[pair.b]) continue;
            remove(shallower(pair.a, pair.b) ? pair.a : pair.b);
            ++report_.gap_removed;
        }
}

bool KeptCells::on_surface(Index vertex) const {
    bool any = false, other = false;
    const auto look_at = [&](Index c) { (kept_[c] ? any : other) = true; };
    for (CellCorner at : graph_.vertex_cell[vertex]) look_at(at.cell);
    for (Index c : graph_.vertex_coarse[vertex]) look_at(c);
    if (!any || other) return any;
    const auto is_outer = [&](Index c) {
        const auto& behind = graph_.neighbour[c];
        return std::find(behind.begin(), behind.end(), kNoIndex) != behind.end();
    };
    for (CellCorner at : graph_.vertex_cell[vertex])
        if (is_outer(at.cell)) return true;
    for (Index c : graph_.vertex_coarse[vertex])
        if (is_outer(c)) return true;
    return false;
}

Index KeptCells::find_culprit(Index vertex, std::vector<Index>& star) const {
    if (!on_surface(vertex)) return kNoIndex;
    graph_.gather_star(vertex, star);
    const StarGroups groups(graph_, kept_, star, vertex, mesh_);
    const int kept_groups = groups.count(true);
    if (kept_groups <= 1 && groups.count(false) <= 1) return kNoIndex;
    std::vector<int> size(star.size(), 0);
    for (Index i = 0; i < star.size(); ++i) ++size[groups.group(i)];
    Index best = kNoIndex;
    int best_size = 0;
    for (Index i = 0; i < star.size(); ++i) {
        if (!groups.is_kept(i)) continue;
        const int own = size[groups.group(i)];
        if (best == kNoIndex || own < best_size || (own == best_size && shallower(star[i], best)))
            best = star[i], best_size = own;
    }
    return best;
}

std::vector<Index> KeptCells::doubtful_vertices() const {
    std::vector<Index> vertices;
    if (!is_mended_) {
        vertices.resize(mesh_.vertex_count());
        std::iota(vertices.begin(), vertices.end(), Index{0});
        return vertices;
    }
    for (Index c : changed_) {
        vertices.insert(vertices.end(), mesh_.cells[c].begin(), mesh_.cells[c].end());
        const auto hanging = graph_.cell_hanging[c];
        vertices.insert(vertices.end(), hanging.begin(), hanging.end());
    }
    std::sort(vertices.begin(), vertices.end());
    vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
    return vertices;
}

std::size_t KeptCells::mend_vertices() {
    const std::vector<Index> doubtful = doubtful_vertices();
    std::vector<std::vector<Index>> bad((doubtful.size() + kChunk - 1) / kChunk);
    context_.parallel().for_chunks(doubtful.size(), kChunk, [&](std::size_t begin, std::size_t end) {
        std::vector<Index> star;
        for (std::size_t i = begin; i < end; ++i)
            if (find_culprit(doubtful[i], star) != kNoIndex) bad[begin / kChunk].push_back(doubtful[i]);
    });
    std::set<Index> queue;
    for (const auto& part : bad) queue.insert(part.begin(), part.end());
    std::size_t removed = 0;
    std::vector<Index> star;
    while (!queue.empty()) {
        const Index v = *queue.begin();
        queue.erase(queue.begin());
        const Index culprit = find_culprit(v, star);
        if (culprit == kNoIndex) continue;
        remove(culprit);
        ++removed;
        queue.insert(mesh_.cells[culprit].begin(), mesh_.cells[culprit].end());
        const auto hanging = graph_.cell_hanging[culprit];
        queue.insert(hanging.begin(), hanging.end());
    }
    is_mended_ = true;
    changed_.clear();
    report_.manifold_removed += removed;
    return removed;
}

bool KeptCells::is_in_layer(Index cell) const {
    if (!kept_[cell]) return false;
    const auto is_open = [&](int face) {
        bool open = graph_.is_outer(cell, face);
        graph_.visit_behind(cell, face, [&](Index other) { open = open || !kept_[other]; });
        return open;
    };
    for (int f = 0; f < 6; f += 2)
        if (is_open(f) && is_open(f + 1)) return true;
    return false;
}

/// Faces with nothing but kept cells behind them, or without any.
int KeptCells::count_faces(Index cell, bool towards_kept) const {
    int count = 0;
    for (int f = 0; f < 6; ++f) {
        bool all = !(towards_kept && graph_.is_outer(cell, f));
        graph_.visit_behind(cell, f, [&](Index other) { all = all && kept_[other] == towards_kept; });
        count += all;
    }
    return count;
}

std::size_t KeptCells::mend_tips(bool fill_pits) {
    std::vector<Index> changed;
    for (Index c = 0; c < kept_.size(); ++c) {
        if (kept_[c] && tip_age_[c] < kMaxTips && count_faces(c, false) >= 5) {
            changed.push_back(c);
            ++report_.tips_removed;
        } else if (fill_pits && !kept_[c] && may_fill(c) && sides_.cut[c] &&
                   sides_.depth_h[c] >= kPitDepth_h && count_faces(c, true) >= 5) {
            changed.push_back(c);
            ++report_.pits_filled;
        }
    }
    for (Index c : changed) {
        if (!kept_[c]) {
            fill(c);
            continue;
        }
        remove(c);
        for (int f = 0; f < 6; ++f)
            graph_.visit_behind(c, f, [&](Index d) {
                tip_age_[d] = std::max(tip_age_[d], static_cast<std::uint8_t>(tip_age_[c] + 1));
            });
    }
    return changed.size();
}

void KeptCells::mend() {
    for (int round = 0; round < kMaxRounds && !context_.is_cancelled(); ++round) {
        const std::size_t tips = mend_tips(round < kFillRounds), vertices = mend_vertices();
        if (tips + vertices == 0) break;
    }
}

void KeptCells::keep_parts(std::span<const Index> seed_cells, double part_fraction) {
    std::vector<Index> part(kept_.size(), kNoIndex), queue;
    std::vector<double> volume;
    std::vector<std::size_t> cells;
    for (Index seed = 0; seed < kept_.size(); ++seed) {
        if (!kept_[seed] || part[seed] != kNoIndex) continue;
        const auto number = static_cast<Index>(volume.size());
        double sum = 0;
        queue.assign(1, seed);
        part[seed] = number;
        for (std::size_t i = 0; i < queue.size(); ++i) {
            sum += cell_volume(mesh_, queue[i]);
            for (int f = 0; f < 6; ++f)
                graph_.visit_behind(queue[i], f, [&](Index d) {
                    if (!kept_[d] || part[d] != kNoIndex) return;
                    part[d] = number;
                    queue.push_back(d);
                });
        }
        volume.push_back(sum);
        cells.push_back(queue.size());
    }
    std::vector<std::uint8_t> wanted(volume.size(), 0);
    const double largest = volume.empty() ? 0 : *std::max_element(volume.begin(), volume.end());
    for (std::size_t p = 0; p < volume.size(); ++p)
        wanted[p] = seed_cells.empty() && volume[p] >= part_fraction * largest;
    for (Index c : seed_cells) wanted[part[c]] = 1;
    for (Index c = 0; c < kept_.size(); ++c)
        if (kept_[c] && !wanted[part[c]]) remove(c);
    report_.parts = 0;
    for (std::size_t p = 0; p < volume.size(); ++p) {
        report_.parts += wanted[p];
        report_.parts_dropped += !wanted[p];
        report_.part_cells_dropped += wanted[p] ? 0 : cells[p];
    }
}

} // namespace hexopt::trimming
