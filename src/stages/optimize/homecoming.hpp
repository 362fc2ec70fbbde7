#pragma once

#include "stages/optimize/boundary_contacts.hpp"
#include "stages/optimize/home_draw.hpp"

namespace hexopt {

/// Draws the boundary of a valid mesh to what it is bound to, all cells staying valid and nothing coming into
/// contact that was not. Works on the dofs of a problem; the rest of the mesh stays.
class Homecoming {
  public:
    /// positions: of the mesh, valid; hold: per vertex, how it is held now, the drawn ones are to come home.
    /// allowed: what is in contact at the start is added.
    Homecoming(Problem& problem, const Topology& topology, const BoundaryModel& surface,
               const BoundaryContacts& contacts, std::vector<Point>& positions, std::vector<Hold>& hold,
               AllowedContacts& allowed, Budget& budget);

    void run();

  private:
    std::vector<std::uint8_t> vertices_round_away(std::span<const Hold> hold_last) const;
    void draw(std::span<const std::uint8_t> moving, const HomeStep& step);
    void redo_contacts(const HomeStep& step);
    std::vector<std::uint8_t> take_back_near(std::vector<Index> cells);
    std::vector<Index> new_contacts() const;

    Problem& problem_;
    const Topology& topology_;
    const BoundaryModel& surface_;
    const BoundaryContacts& contacts_;
    std::vector<Point>& positions_;
    std::vector<Hold>& hold_;
    AllowedContacts& allowed_;
    Budget& budget_;
    const std::vector<Point> anchor_;
    std::vector<std::uint8_t> is_dof_; ///< per vertex
    std::vector<Index> moving_quads_;
    std::vector<Point> before_; ///< the step under way
    std::vector<Hold> hold_before_;
};

} // namespace hexopt
