#include "mesh/constraint_midpoints.hpp"

#include "mesh/hanging.hpp"

#include <algorithm>

namespace hexopt {

ConstraintMidpoints::ConstraintMidpoints(const HexMesh& mesh)
    : hanging_(mesh.hanging), row_of_(compute_hanging_row(mesh.hanging, mesh.vertex_count())),
      order_(mesh.hanging.count()) {
    for (Index row = 0; row < order_.size(); ++row) order_[row] = row;
    std::stable_sort(order_.begin(), order_.end(), [&](Index a, Index b) {
        const auto x = masters(a), y = masters(b);
        return std::lexicographical_compare(x.begin(), x.end(), y.begin(), y.end());
    });
}

void ConstraintMidpoints::find(Index from, Index to, std::vector<Index>& found) const {
    std::vector<Index> ids;
    std::vector<double> weights;
    merge_halves(from, to, ids, weights);
    const auto less = [&](Index row, const std::vector<Index>& key) {
        const auto x = masters(row);
        return std::lexicographical_compare(x.begin(), x.end(), key.begin(), key.end());
    };
    for (auto it = std::lower_bound(order_.begin(), order_.end(), ids, less); it != order_.end(); ++it) {
        const auto x = masters(*it);
        if (!std::equal(x.begin(), x.end(), ids.begin(), ids.end())) break;
        const double* w = hanging_.weight.data() + hanging_.offset[*it];
        if (std::equal(weights.begin(), weights.end(), w, is_close)) found.push_back(hanging_.vertex[*it]);
    }
}

void ConstraintMidpoints::append_half(Index v, std::vector<std::pair<Index, double>>& terms) const {
    const Index row = row_of_[v];
    if (row == kNoIndex) return terms.emplace_back(v, 0.5), void();
    for (std::size_t k = hanging_.offset[row]; k < hanging_.offset[row + 1]; ++k)
        terms.emplace_back(hanging_.master[k], hanging_.weight[k] / 2);
}

void ConstraintMidpoints::merge_halves(Index from, Index to, std::vector<Index>& ids,
                                       std::vector<double>& weights) const {
    std::vector<std::pair<Index, double>> terms;
    append_half(from, terms);
    append_half(to, terms);
    std::stable_sort(terms.begin(), terms.end(), [](auto a, auto b) { return a.first < b.first; });
    for (auto [id, weight] : terms) {
        if (!ids.empty() && ids.back() == id)
            weights.back() += weight;
        else
            ids.push_back(id), weights.push_back(weight);
    }
}

} // namespace hexopt
