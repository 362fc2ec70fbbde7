#pragma once

#include "stages/refine/criteria.hpp"
#include "stages/refine/regions.hpp"

namespace hexopt {

/// One run through the levels: carries the cells that meet the surface down, asks the criteria, and splits.
class Adaptation {
  public:
    /// surface_of_run: elements; the criteria may be changed (given up).
    Adaptation(const SurfaceElements& surface, SurfaceCriteria& criteria, const Regions& regions,
               const RefineOptions& options, RefineOutput& out, Context& context);

    /// Errors: cancelled.
    Status run();
    /// After run(): splits along single axes where regions ask for that. Errors: cancelled.
    Status split_along_axes();

    /// Leaves that meet the surface.
    std::vector<Index> cut_leaves() const;

  private:
    struct Request {
        Index node;
        RefineCriterion why;
    };
    /// Lists the roots by level, and what the balance has made of them.
    void place_roots(int last);
    bool refine_level(int level);
    std::vector<Request> find_requests(int level) const;
    void append_region_requests(int level, std::vector<Request>& requests) const;
    std::vector<Index> spread(int level, const std::vector<Request>& requests) const;
    bool split(int level, const std::vector<Request>& requests);
    bool try_split(int level, const std::vector<Request>& requests);
    bool surround_surface(RefineStats& stats);
    bool give_up_last(std::vector<Request>& requests);

    const SurfaceElements& surface_;
    SurfaceCriteria& criteria_;
    const Regions& regions_;
    const RefineOptions& options_;
    RefineOutput& out_;
    Context& context_;
    std::vector<CellElements> cells_; ///< by level
};

} // namespace hexopt
