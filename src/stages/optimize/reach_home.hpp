#pragma once

#include "core/context.hpp"
#include "domain/boundary_model.hpp"
#include "mesh/topology.hpp"

#include <limits>
#include <memory>
#include <span>
#include <vector>

namespace hexopt {

struct ReachOptions {
    /// Cells round a vertex may become worse than the worst of them down to this, -1..1.
    double min_sj = 0.2;
    double time_limit_s = std::numeric_limits<double>::infinity(); ///< > 0
};

/// Brings boundary vertices of a valid mesh to their places one by one: each is put there, and the rings of
/// cells round it are untangled and raised, with the boundary sliding on what it is bound to. A neighbourhood
/// goes back where it does not get valid with a scaled Jacobian of min_sj or of its worst cell before, where
/// its boundary comes to touch what it did not, and where another vertex that is off ends farther off.
class HomeReacher {
  public:
    /// All must outlive the reacher, surface as it is bound; the mesh is changed by the reacher only.
    HomeReacher(HexMesh& mesh, const Topology& topology, const BoundaryModel& surface,
                const ReachOptions& options, Context& context);
    ~HomeReacher();
    HomeReacher(const HomeReacher&) = delete;
    HomeReacher& operator=(const HomeReacher&) = delete;

    /// Brings vertices that are off what they are bound to back to it, at first with all that is off beside
    /// them. wanted: the most important first; where neighbourhoods overlap it has the first try. most: how
    /// many neighbourhoods may be tried, less those that were. Returns how many are at home.
    std::size_t reach(std::span<const Index> wanted, std::size_t& most);

    struct Place {
        Index vertex; ///< of the boundary; neither hangs nor is bound to a corner
        Point at;     ///< on what the vertex is bound to
    };
    /// Puts vertices to places of theirs, where they stay. Each vertex once; where two rings of cells do
    /// not do, three give way. Returns for each whether it is there. most: as above.
    std::vector<std::uint8_t> put(std::span<const Place> wanted, std::size_t& most);

  private:
    class Work;
    std::unique_ptr<Work> work_;
};

} // namespace hexopt
