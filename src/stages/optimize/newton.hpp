#pragma once

#include "stages/optimize/chunk_schedule.hpp"
#include "stages/optimize/hex_kernels.hpp"
#include "stages/optimize/minimiser.hpp"

#include <limits>

namespace hexopt {

/// The minimiser on the host: an assembled matrix over all dofs of a problem at once.
class Newton final : public Minimiser {
  public:
    /// motion: null where every dof is free.
    Newton(Problem& problem, std::vector<Point>& positions, const Motion* motion, Budget& budget);

    const Problem& problem() const override { return problem_; }
    void update_lengths() override { problem_.update_lengths(positions_, budget_.parallel()); }
    ObjectiveValue evaluate(const Objective& objective) override {
        return evaluate_at(objective, positions_).value;
    }
    NewtonResult minimise(const Objective& objective, const NewtonOptions& options) override;
    int start_harmonically(std::span<const std::uint8_t> on_boundary) override;
    std::vector<CellMeasure> measure() override;
    int raise_vertices(double) override { return 0; }

    std::vector<Point>& positions() { return positions_; }
    BlockMatrix& matrix() { return matrix_; }
    /// One a dof, of use between steps.
    std::span<Point> right_hand_side() { return gradient_; }
    std::span<Point> solution() { return step_; }

  private:
    static constexpr double kNoLimit = std::numeric_limits<double>::infinity();
    /// The energy of all cells; beyond `most` it need not be complete. first: of the group of cells that has
    /// most of it.
    struct Evaluation {
        ObjectiveValue value;
        double largest = 0;
        std::size_t first = 0;
    };
    Evaluation evaluate_at(const Objective& objective, std::span<const Point> positions,
                           double most = kNoLimit) const;
    ObjectiveValue compute_gradient(const Objective& objective);
    void assemble(const Objective& objective);
    double limit_energy(const Objective& objective, std::span<const Point> positions) const;
    void add_limit_gradient(const Objective& objective);
    void add_limit_hessian(const Objective& objective);
    enum class Search { moved, stalled, blocked };
    Search search_line(const Objective& objective, double slope, ObjectiveValue& value);
    void stand_before(std::size_t first_cell);
    double barrier_energy(const Objective& objective) const;
    bool is_blocked(double length, double slope) const;
    void hold_blocked(double length);

    Problem& problem_;
    std::vector<Point>& positions_;
    const Motion* motion_;
    Budget& budget_;
    BlockMatrix matrix_;
    ChunkSchedule schedule_; ///< over cells, by the dofs they depend on
    std::vector<Point> gradient_, step_;
    std::vector<FaceTerm> face_terms_; ///< of the last gradient
    std::vector<Point> start_;         ///< of the last line search: dofs, then what hangs on them
    std::vector<Freedom> freedom_;     ///< of motion->on_surface()
    /// The group of cells that had most of the energy of a step that was too long, and what it depends on.
    /// Most steps that are too long raise the energy of one cell beyond all bounds: looked at first, it saves
    /// placing and evaluating all the others. Energies are not negative, so that steps are refused as before.
    struct Barrier {
        std::size_t first = 0, last = 0;
        std::vector<Index> dofs, hanging_rows;
        std::vector<std::uint8_t> has_dof;
    } barrier_;
};

} // namespace hexopt
