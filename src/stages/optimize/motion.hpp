#pragma once

#include "stages/optimize/block_matrix.hpp"

namespace hexopt {

/// Where the dofs of a problem may go: interior vertices anywhere, boundary vertices on their surface or
/// curve.
class Motion {
  public:
    virtual ~Motion() = default;
    /// Fills the freedom of every dof at the given positions (of all vertices). descent: per dof, where the
    /// energy pulls it; a dof at the end of its range loses the direction that leads out of it.
    virtual void freedoms(std::span<const Point> positions, std::span<const Point> descent,
                          std::span<Freedom> out) const = 0;
    /// The admissible point nearest to where dof `dof` wants to go; `from`: its admissible place now.
    virtual Point place(Index dof, const Point& from, const Point& wanted) const = 0;
};

} // namespace hexopt
