#pragma once

#include "stages/optimize/block_matrix.hpp"

#include <array>
#include <glm/mat3x3.hpp>
#include <vector>

namespace hexopt {

/// What holds a dof within its range: a smooth energy that is 0 well inside and 1 at the end of the range.
struct LimitTerm {
    double energy = 0;
    Point gradient{0};
    glm::dmat3 hessian{0}; ///< positive semidefinite model
};

/// The same of a place on a cell's face, the mean of its corners' positions.
struct FaceTerm {
    std::size_t cell;                   ///< of the problem
    std::array<std::uint8_t, 4> corner; ///< of the cell
    std::array<double, 4> weight;
    LimitTerm limit;
};

/// Where the dofs of a problem may go: interior vertices anywhere, boundary vertices on their surface or
/// curve.
class Motion {
  public:
    virtual ~Motion() = default;
    /// Dofs bound to the surface, rising; the others are always free.
    virtual std::span<const Index> on_surface() const = 0;
    /// Fills the freedom of each of them at the given positions (of all vertices).
    virtual void freedoms(std::span<const Point> positions, std::span<Freedom> out) const = 0;
    /// The point nearest to where dof `dof` wants to go that it can take: on its entity, or anywhere.
    virtual Point place(Index dof, const Point& wanted) const = 0;
    /// Dofs whose range is limited.
    virtual std::span<const Index> limited() const = 0;
    virtual LimitTerm limit(Index dof, const Point& at) const = 0;
    /// What holds faces of the boundary: its energy, and the terms that are not 0.
    virtual double face_energy(std::span<const Point> /*positions*/) const { return 0; }
    virtual void append_face_terms(std::span<const Point> /*positions*/,
                                   std::vector<FaceTerm>& /*terms*/) const {}
    /// Whether freedoms are those of the elements themselves: then a dof that gets less of its step than they
    /// promise has come to an end or a bend of its entity, and is held there while the others go on.
    virtual bool has_exact_freedoms() const = 0;
};

} // namespace hexopt
