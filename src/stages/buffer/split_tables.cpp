#include "stages/buffer/sheet_mesh.hpp"

#include "mesh/hanging.hpp"

#include <cmath>
#include <numeric>

namespace hexopt {

namespace {

struct Term {
    Index master;
    double weight;
};
using Terms = std::vector<Term>;

bool same_terms(std::span<const Term> a, std::span<const Term> b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](Term x, Term y) {
        return x.master == y.master && std::abs(x.weight - y.weight) < 1e-6;
    });
}

bool masters_less(std::span<const Term> a, std::span<const Term> b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(),
                                        [](Term x, Term y) { return x.master < y.master; });
}

/// Explains constraints by edges and faces of cells whose mean they are.
class SplitSearch {
  public:
    explicit SplitSearch(const HexMesh& mesh)
        : mesh_(mesh), row_of_(compute_hanging_row(mesh.hanging, mesh.vertex_count())),
          concerned_(mesh.vertex_count(), 0) {}

    SplitTables search() {
        for (Index row = 0; row < mesh_.hanging.count(); ++row)
            if (!take_halves(row)) open_.push_back(row);
        if (!open_.empty()) search_cells();
        std::sort(tables_.middles.begin(), tables_.middles.end());
        std::sort(tables_.centres.begin(), tables_.centres.end());
        return std::move(tables_);
    }

  private:
    Terms terms_of_row(Index row) const {
        const Hanging& h = mesh_.hanging;
        Terms terms;
        for (std::size_t k = h.offset[row]; k < h.offset[row + 1]; ++k)
            terms.push_back({h.master[k], h.weight[k]});
        return terms;
    }

    bool take_halves(Index row) {
        const Terms terms = terms_of_row(row);
        if (terms.size() != 2 || std::abs(terms[0].weight - 0.5) > 1e-6) return false;
        tables_.middles.push_back({edge_key(terms[0].master, terms[1].master), mesh_.hanging.vertex[row]});
        return true;
    }

    void search_cells() {
        std::vector<Terms> terms(mesh_.hanging.count());
        for (Index row : open_) {
            terms[row] = terms_of_row(row);
            for (Term t : terms[row]) concerned_[t.master] = 1;
        }
        for (Index v : mesh_.hanging.vertex) concerned_[v] = 1;
        open_terms_ = std::move(terms);
        std::sort(open_.begin(), open_.end(), [&](Index a, Index b) {
            if (masters_less(open_terms_[a], open_terms_[b])) return true;
            return !masters_less(open_terms_[b], open_terms_[a]) && a < b;
        });
        found_.assign(mesh_.hanging.count(), 0);
        for (const Cell& cell : mesh_.cells)
            for (const auto& edge : hex::kEdgeVertex) try_edge(cell[edge[0]], cell[edge[1]]);
        for (const Cell& cell : mesh_.cells)
            for (const auto& face : hex::kFaceVertex)
                try_face({cell[face[0]], cell[face[1]], cell[face[2]], cell[face[3]]});
    }

    bool hangs(Index v) const { return row_of_[v] != kNoIndex; }

    void try_edge(Index a, Index b) {
        if (!concerned_[a] || !concerned_[b] || !(hangs(a) || hangs(b))) return;
        if (const Index row = find_row(mean_of(std::array{a, b})); row != kNoIndex)
            tables_.middles.push_back({edge_key(a, b), mesh_.hanging.vertex[row]});
    }

    void try_face(const Quad& quad) {
        for (Index v : quad)
            if (!concerned_[v]) return;
        if (const Index row = find_row(mean_of(quad)); row != kNoIndex)
            tables_.centres.push_back({sorted_quad(quad), mesh_.hanging.vertex[row]});
    }

    Terms mean_of(std::span<const Index> vertices) const {
        Terms terms;
        const double share = 1.0 / static_cast<double>(vertices.size());
        for (Index v : vertices) {
            if (!hangs(v)) {
                terms.push_back({v, share});
                continue;
            }
            for (Term t : terms_of_row(row_of_[v])) terms.push_back({t.master, t.weight * share});
        }
        std::stable_sort(terms.begin(), terms.end(), [](Term x, Term y) { return x.master < y.master; });
        std::size_t out = 0;
        for (std::size_t i = 0; i < terms.size(); ++i)
            if (out > 0 && terms[out - 1].master == terms[i].master)
                terms[out - 1].weight += terms[i].weight;
            else
                terms[out++] = terms[i];
        terms.resize(out);
        return terms;
    }

    /// An open row with these terms that nothing explains yet.
    Index find_row(const Terms& terms) {
        const auto less = [&](Index row, const Terms& key) { return masters_less(open_terms_[row], key); };
        for (auto at = std::lower_bound(open_.begin(), open_.end(), terms, less); at != open_.end(); ++at) {
            if (masters_less(terms, open_terms_[*at])) break;
            if (found_[*at] || !same_terms(open_terms_[*at], terms)) continue;
            found_[*at] = 1;
            return *at;
        }
        return kNoIndex;
    }

    const HexMesh& mesh_;
    std::vector<Index> row_of_;
    std::vector<std::uint8_t> concerned_; ///< vertex may be an end of an edge or face to look at
    std::vector<Index> open_;             ///< rows to be explained, sorted by their masters
    std::vector<Terms> open_terms_;       ///< by row
    std::vector<std::uint8_t> found_;     ///< by row
    SplitTables tables_;
};

} // namespace

Index SplitTables::middle(Index a, Index b) const {
    const EdgeKey key = edge_key(a, b);
    const auto at = std::lower_bound(middles.begin(), middles.end(), Middle{key, 0});
    return at != middles.end() && at->edge == key ? at->vertex : kNoIndex;
}

Index SplitTables::centre(const Quad& any_order) const {
    const Quad key = sorted_quad(any_order);
    const auto at = std::lower_bound(centres.begin(), centres.end(), Centre{key, 0});
    return at != centres.end() && at->corners == key ? at->vertex : kNoIndex;
}

std::vector<SplitTables::Middle> SplitTables::middles_by_vertex() const {
    std::vector<Middle> list = middles;
    std::sort(list.begin(), list.end(), [](const Middle& x, const Middle& y) { return x.vertex < y.vertex; });
    return list;
}

SplitTables find_splits(const HexMesh& mesh) {
    if (mesh.hanging.empty()) return {};
    return SplitSearch(mesh).search();
}

} // namespace hexopt
