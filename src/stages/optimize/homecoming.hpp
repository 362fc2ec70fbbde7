#pragma once

#include "stages/optimize/boundary_contacts.hpp"
#include "stages/optimize/home_motion.hpp"
#include "stages/optimize/newton.hpp"

namespace hexopt {

/// Draws the boundary of a valid mesh to what it is bound to, all cells staying valid and nothing coming into
/// contact that was not. Works on the dofs of a problem; the rest of the mesh stays.
class Homecoming {
  public:
    /// positions: of the mesh, valid; hold: per vertex, how it is held now, the drawn ones are to come home.
    /// allowed: what is in contact at the start is added.
    Homecoming(Problem& problem, const BoundaryModel& surface, const BoundaryContacts& contacts,
               std::vector<Point>& positions, std::vector<Hold>& hold, AllowedContacts& allowed,
               Budget& budget);

    void run();

  private:
    struct Step {
        double pull;
        double least_sj; ///< for which a vertex is put home though its cells become worse
    };
    bool try_step(const Step& step);
    void put_home(double least_sj);
    bool comes_home(Index dof, double least_sj);
    double least_sj_around(Index dof) const;
    std::vector<Index> new_contacts() const;

    Problem& problem_;
    const BoundaryModel& surface_;
    const BoundaryContacts& contacts_;
    std::vector<Point>& positions_;
    std::vector<Hold>& hold_;
    AllowedContacts& allowed_;
    Budget& budget_;
    std::vector<Point> anchor_;
    std::vector<Index> moving_quads_;
    Csr<Index> dof_cell_; ///< cells of the problem that depend on a dof
    Csr<Index> dof_row_;  ///< rows of mesh.hanging that depend on a dof
    HomeMotion motion_;
    Newton newton_;
};

} // namespace hexopt
