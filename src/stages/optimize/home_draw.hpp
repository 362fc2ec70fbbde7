#pragma once

#include "stages/optimize/home_motion.hpp"
#include "stages/optimize/newton.hpp"

namespace hexopt {

/// How firmly vertices are drawn home.
struct HomeStep {
    double pull;     ///< see HomeMotion::update()
    double least_sj; ///< for which a vertex is put home though its cells become worse
};

/// Draws the boundary of a valid mesh to what it is bound to, all cells staying valid. Works on the dofs of a
/// problem; the rest of the mesh stays.
class HomeDraw {
  public:
    /// hold: per vertex, how it is held now, the drawn ones are to come home; anchor: as HomeMotion. All
    /// arguments must outlive it.
    HomeDraw(Problem& problem, const BoundaryModel& surface, std::vector<Point>& positions,
             std::vector<Hold>& hold, std::span<const Point> anchor, Budget& budget);

    void run(const HomeStep& step);

  private:
    void put_home(double least_sj);
    bool comes_home(Index dof, double least_sj);
    double least_sj_around(Index dof) const;

    Problem& problem_;
    const BoundaryModel& surface_;
    std::vector<Point>& positions_;
    std::vector<Hold>& hold_;
    Budget& budget_;
    Csr<Index> dof_cell_; ///< cells of the problem that depend on a dof
    Csr<Index> dof_row_;  ///< rows of mesh.hanging that depend on a dof
    HomeMotion motion_;
    Newton newton_;
};

} // namespace hexopt
