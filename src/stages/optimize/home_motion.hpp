#pragma once

#include "domain/boundary_model.hpp"
#include "stages/optimize/motion.hpp"
#include "stages/optimize/problem.hpp"

namespace hexopt {

/// How a boundary vertex is held.
enum class Hold : std::uint8_t {
    home,     ///< slides on its patch or curve; a corner stays
    drawn,    ///< goes anywhere, drawn towards what it is bound to
    anchored, ///< goes anywhere, drawn towards a place of its own
    fixed,    ///< stays
};

/// Boundary dofs on their way to the surface. Interior dofs are free.
class HomeMotion final : public Motion {
  public:
    /// hold, anchor: per vertex, may change between minimisations (call update() then). All must outlive the
    /// motion.
    HomeMotion(const Problem& problem, const BoundaryModel& surface, std::span<const Hold> hold,
               std::span<const Point> anchor);

    /// Takes over the holds and the problem's lengths. pull: energy of a vertex one cell size away from home,
    /// in hundreds of tetrahedra.
    void update(double pull);

    std::span<const Index> on_surface() const override { return on_surface_; }
    void freedoms(std::span<const Point> positions, std::span<Freedom> out) const override;
    Point place(Index dof, const Point& wanted) const override;
    std::span<const Index> limited() const override { return limited_; }
    LimitTerm limit(Index dof, const Point& at) const override;
    bool has_exact_freedoms() const override { return true; }

  private:
    /// A dof's last projection.
    struct Last {
        Point query{0};
        Projection at;
        bool is_known = false;
    };
    const Projection& project(Index dof, const Point& query) const;

    const Problem& problem_;
    const BoundaryModel& surface_;
    std::span<const Hold> hold_;
    std::span<const Point> anchor_;
    std::vector<Index> on_surface_, limited_;
    std::vector<double> stiffness_; ///< per dof
    mutable std::vector<Last> last_;
};

} // namespace hexopt
