#pragma once

#include "domain/domain.hpp"
#include "domain/split_curves.hpp"
#include "pipeline/mesh_attempt.hpp"

#include <optional>
#include <span>
#include <vector>

namespace hexopt {

/// The domain that was given, and the same without some of its curves, which attempts may go on with.
class FeatureDomains {
  public:
    /// whole: outlives this.
    explicit FeatureDomains(Domain& whole) : whole_(whole) {}

    Domain& whole() { return whole_; }
    /// Cuts curves of the whole domain for good. Errors: those of split_curves().
    Status split(std::span<const CurveCut> cuts, Context& context);
    /// The domain without the given curves of the whole one (rising); valid until it is asked for others.
    /// Errors: those of drop_curves().
    Result<Domain*> without(std::span<const Index> curves, Context& context);

  private:
    Domain& whole_;
    std::optional<Domain> reduced_;
    std::vector<Index> dropped_; ///< of reduced_
};

/// Curves of the whole domain that noise of a tessellation looks like where an attempt failed: blunter than
/// `below_deg` all along, between patches of one name, and with a quarter of their vertices at cells that
/// failed (where none did: are low), or next to them. own: the attempt's domain, that is `whole` without
/// attempt.dropped. Rising; none where that has not the curves that are left of the whole one.
std::vector<Index> find_noisy_curves(const MeshAttempt& attempt, const Domain& own, const Domain& whole,
                                     double below_deg);

/// Of the given cells those that are not at the given curves (rising) of the whole domain.
std::vector<Index> cells_elsewhere(const std::vector<Index>& cells, const MeshAttempt& attempt,
                                   const Domain& own, const Domain& whole, std::span<const Index> curves);

} // namespace hexopt
