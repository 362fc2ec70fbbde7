#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace hexopt {

/// The simplex method in dictionary form, dense: maximise c.x subject to rows a.x <= b and x >= 0. Few
/// variables, many rows: a pivot costs rows * variables. Number: double, or an exact type with tolerance 0,
/// for which every answer is exact. Another objective starts from the last solution. Source: thesis 4.2.3;
/// Chvatal 1983 for the dictionaries; Bland 1977 against cycling.
template <class Number>
class Simplex {
  public:
    /// tolerance: magnitudes up to it count as zero; rows should be scaled to about 1.
    Simplex(std::size_t variables, Number tolerance)
        : variables_(variables), columns_(variables + 1), tolerance_(tolerance), objective_(columns_),
          nonbasic_(columns_) {
        for (std::size_t j = 0; j < columns_; ++j) nonbasic_[j] = j;
    }

    /// Before find_feasible().
    void add_row(std::span<const Number> a, Number b) {
        basic_.push_back(columns_ + bound_.size());
        bound_.push_back(b);
        entry_.insert(entry_.end(), a.begin(), a.end());
        entry_.push_back(Number(0));
    }

    /// Finds a vertex of the polyhedron; false: there is none (or, with double, none was found in time).
    bool find_feasible() {
        std::size_t lowest = 0;
        for (std::size_t i = 1; i < rows(); ++i)
            if (bound_[i] < bound_[lowest]) lowest = i;
        if (rows() == 0 || !(bound_[lowest] < Number(0))) return true;
        for (std::size_t i = 0; i < rows(); ++i) at(i, variables_) = Number(-1);
        for (Number& c : objective_) c = Number(0);
        objective_[variables_] = Number(-1);
        value_ = Number(0);
        pivot(lowest, variables_);
        if (!climb() || value_ < -tolerance_) return false;
        return retire_auxiliary();
    }

    /// False: unbounded (or, with double, no end in sight).
    bool maximise(std::span<const Number> c) {
        for (Number& o : objective_) o = Number(0);
        value_ = Number(0);
        for (std::size_t j = 0; j < columns_; ++j)
            if (nonbasic_[j] < variables_) objective_[j] = c[nonbasic_[j]];
        for (std::size_t i = 0; i < rows(); ++i) {
            if (basic_[i] >= variables_) continue;
            const Number& weight = c[basic_[i]];
            value_ += weight * bound_[i];
            for (std::size_t j = 0; j < columns_; ++j) objective_[j] -= weight * at(i, j);
        }
        return climb();
    }

    const Number& value() const { return value_; }

    std::vector<Number> solution() const {
        std::vector<Number> x(variables_, Number(0));
        for (std::size_t i = 0; i < rows(); ++i)
            if (basic_[i] < variables_) x[basic_[i]] = bound_[i];
        return x;
    }

    /// Optimal multiplier of every row, >= 0: c = sum of multiplier * a, as far as x > 0.
    std::vector<Number> multipliers() const {
        std::vector<Number> y(rows(), Number(0));
        for (std::size_t j = 0; j < columns_; ++j)
            if (nonbasic_[j] >= columns_) y[nonbasic_[j] - columns_] = -objective_[j];
        return y;
    }

  private:
    std::size_t rows() const { return bound_.size(); }
    Number& at(std::size_t i, std::size_t j) { return entry_[i * columns_ + j]; }
    const Number& at(std::size_t i, std::size_t j) const { return entry_[i * columns_ + j]; }
    bool may_enter(std::size_t j) const { return nonbasic_[j] != variables_ || !auxiliary_retired_; }

    /// x[basic_[i]] = bound_[i] - sum of at(i, j) * x[nonbasic_[j]]: exchanges row r's variable with column
    /// c's.
    void pivot(std::size_t r, std::size_t c) {
        const Number inverse = Number(1) / at(r, c);
        for (std::size_t j = 0; j < columns_; ++j) at(r, j) *= inverse;
        at(r, c) = inverse;
        bound_[r] *= inverse;
        for (std::size_t i = 0; i < rows(); ++i) {
            if (i == r || at(i, c) == Number(0)) continue;
            const Number factor = at(i, c);
            at(i, c) = Number(0);
            for (std::size_t j = 0; j < columns_; ++j) at(i, j) -= factor * at(r, j);
            bound_[i] -= factor * bound_[r];
        }
        const Number factor = objective_[c];
        objective_[c] = Number(0);
        for (std::size_t j = 0; j < columns_; ++j) objective_[j] -= factor * at(r, j);
        value_ += factor * bound_[r];
        std::swap(basic_[r], nonbasic_[c]);
    }

    static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

    /// Steepest column at first; Bland's rule, which cannot cycle, once that takes long.
    std::size_t entering(bool bland) const {
        std::size_t best = kNone;
        for (std::size_t j = 0; j < columns_; ++j) {
            if (!may_enter(j) || !(objective_[j] > tolerance_)) continue;
            if (best == kNone || (bland ? nonbasic_[j] < nonbasic_[best] : objective_[j] > objective_[best]))
                best = j;
        }
        return best;
    }

    std::size_t leaving(std::size_t c) const {
        std::size_t best = kNone;
        Number least{};
        for (std::size_t i = 0; i < rows(); ++i) {
            if (!(at(i, c) > tolerance_)) continue;
            const Number ratio = bound_[i] / at(i, c);
            if (best == kNone || ratio < least || (ratio == least && basic_[i] < basic_[best])) {
                best = i;
                least = ratio;
            }
        }
        return best;
    }

    bool climb() {
        const std::size_t patience = 4 * columns_ + 20, limit = 50 * (columns_ + rows());
        const bool exact = tolerance_ == Number(0);
        for (std::size_t step = 0; exact || step < limit; ++step) {
            const std::size_t c = entering(step > patience);
            if (c == kNone) return true;
            const std::size_t r = leaving(c);
            if (r == kNone) return false;
            pivot(r, c);
        }
        return false;
    }

    /// Takes the auxiliary variable of the first phase out of the basis and forbids it.
    bool retire_auxiliary() {
        for (std::size_t i = 0; i < rows(); ++i) {
            if (basic_[i] != variables_) continue;
            std::size_t best = 0;
            const auto size = [&](std::size_t j) { return at(i, j) < Number(0) ? -at(i, j) : at(i, j); };
            for (std::size_t j = 1; j < columns_; ++j)
                if (size(j) > size(best)) best = j;
            if (!(size(best) > tolerance_)) return false;
            pivot(i, best);
        }
        auxiliary_retired_ = true;
        for (std::size_t i = 0; i < rows(); ++i)
            if (bound_[i] < Number(0)) bound_[i] = Number(0); // rounding of the first phase
        return true;
    }

    std::size_t variables_, columns_; ///< the last column is the auxiliary variable's
    Number tolerance_;
    std::vector<Number> entry_, bound_, objective_;
    Number value_{};
    std::vector<std::size_t> basic_, nonbasic_; ///< variables, auxiliary, slack of row 0, 1, ...
    bool auxiliary_retired_ = false;
};

} // namespace hexopt
