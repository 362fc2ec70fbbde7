#include "mesh/hanging.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace hexopt {

namespace {

struct Term {
    Index master;
    double weight;
};

Error hanging_error(Index vertex, const char* reason) {
    return make_error(ErrorCode::bad_input, "hanging", "vertex " + std::to_string(vertex), reason);
}

/// Sums the weights of equal masters; sorted by master, without zeros.
void merge_terms(std::vector<Term>& terms) {
    std::stable_sort(terms.begin(), terms.end(), [](Term a, Term b) { return a.master < b.master; });
    std::size_t out = 0;
    for (std::size_t i = 0; i < terms.size();) {
        Term sum = terms[i];
        for (++i; i < terms.size() && terms[i].master == sum.master; ++i) sum.weight += terms[i].weight;
        if (sum.weight != 0) terms[out++] = sum;
    }
    terms.resize(out);
}

/// Expands rows depth first; a row is expanded once, after all rows that it depends on.
class Closure {
  public:
    Closure(const Hanging& rows, std::vector<Index> row_of)
        : rows_(rows), row_of_(std::move(row_of)), state_(rows.count(), State::open),
          expanded_(rows.count()) {}

    /// Vertex of a circular dependence, or kNoIndex.
    Index expand_all() {
        for (Index row = 0; row < rows_.count(); ++row)
            if (!expand_from(row)) return rows_.vertex[row];
        return kNoIndex;
    }
    const std::vector<Term>& expanded(Index row) const { return expanded_[row]; }

  private:
    enum class State : std::uint8_t { open, active, done };

    bool expand_from(Index start) {
        std::vector<Index> stack = {start};
        while (!stack.empty()) {
            const Index row = stack.back();
            if (state_[row] == State::done) {
                stack.pop_back();
                continue;
            }
            const bool revisited = state_[row] == State::active;
            state_[row] = State::active;
            bool waits = false;
            for (std::size_t k = rows_.offset[row]; k < rows_.offset[row + 1]; ++k) {
                const Index next = row_of_[rows_.master[k]];
                if (next == kNoIndex || state_[next] == State::done) continue;
                if (revisited || state_[next] == State::active) return false;
                stack.push_back(next);
                waits = true;
            }
            if (waits) continue;
            substitute(row);
            state_[row] = State::done;
            stack.pop_back();
        }
        return true;
    }

    void substitute(Index row) {
        std::vector<Term> terms;
        for (std::size_t k = rows_.offset[row]; k < rows_.offset[row + 1]; ++k) {
            const Index next = row_of_[rows_.master[k]];
            if (next == kNoIndex)
                terms.push_back({rows_.master[k], rows_.weight[k]});
            else
                for (Term t : expanded_[next]) terms.push_back({t.master, t.weight * rows_.weight[k]});
        }
        merge_terms(terms);
        expanded_[row] = std::move(terms);
    }

    const Hanging& rows_;
    std::vector<Index> row_of_;
    std::vector<State> state_;
    std::vector<std::vector<Term>> expanded_;
};

} // namespace

void append_row(Hanging& rows, Index vertex, std::span<const Index> masters,
                std::span<const double> weights) {
    rows.vertex.push_back(vertex);
    rows.master.insert(rows.master.end(), masters.begin(), masters.end());
    rows.weight.insert(rows.weight.end(), weights.begin(), weights.end());
    rows.offset.push_back(rows.master.size());
}

Result<Hanging> close_hanging(const Hanging& rows, std::size_t vertex_count) {
    std::vector<Index> row_of(vertex_count, kNoIndex);
    for (Index row = 0; row < rows.count(); ++row) {
        const Index vertex = rows.vertex[row];
        if (vertex >= vertex_count) return hanging_error(vertex, "id of a hanging vertex out of range");
        if (row_of[vertex] != kNoIndex) return hanging_error(vertex, "hanging vertex listed twice");
        if (rows.offset[row] == rows.offset[row + 1]) return hanging_error(vertex, "no masters");
        for (std::size_t k = rows.offset[row]; k < rows.offset[row + 1]; ++k) {
            if (rows.master[k] >= vertex_count) return hanging_error(vertex, "id of a master out of range");
            if (!std::isfinite(rows.weight[k])) return hanging_error(vertex, "weight is not finite");
        }
        row_of[vertex] = row;
    }
    Closure closure(rows, std::move(row_of));
    if (const Index vertex = closure.expand_all(); vertex != kNoIndex)
        return hanging_error(vertex, "hanging vertices depend on each other in a circle");

    std::vector<Index> order(rows.count());
    std::iota(order.begin(), order.end(), Index{0});
    std::sort(order.begin(), order.end(), [&](Index a, Index b) { return rows.vertex[a] < rows.vertex[b]; });
    Hanging closed;
    for (Index row : order) {
        closed.vertex.push_back(rows.vertex[row]);
        for (Term t : closure.expanded(row)) {
            closed.master.push_back(t.master);
            closed.weight.push_back(t.weight);
        }
        closed.offset.push_back(closed.master.size());
    }
    return closed;
}

Point hanging_position(const Hanging& hanging, const std::vector<Point>& positions, std::size_t row) {
    Point x(0);
    for (std::size_t k = hanging.offset[row]; k < hanging.offset[row + 1]; ++k)
        x += hanging.weight[k] * positions[hanging.master[k]];
    return x;
}

void apply_hanging(const Hanging& hanging, std::vector<Point>& positions, const Parallel& parallel) {
    parallel.for_each(hanging.count(), 4096, [&](std::size_t row) {
        positions[hanging.vertex[row]] = hanging_position(hanging, positions, row);
    });
}

double max_hanging_deviation(const Hanging& hanging, const std::vector<Point>& positions) {
    double largest = 0;
    for (std::size_t row = 0; row < hanging.count(); ++row) {
        const Point d = hanging_position(hanging, positions, row) - positions[hanging.vertex[row]];
        largest = std::max(largest, std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z));
    }
    return largest;
}

std::vector<Index> compute_hanging_row(const Hanging& hanging, std::size_t vertex_count) {
    if (hanging.empty()) return {};
    std::vector<Index> row_of(vertex_count, kNoIndex);
    for (Index row = 0; row < hanging.count(); ++row) row_of[hanging.vertex[row]] = row;
    return row_of;
}

} // namespace hexopt
