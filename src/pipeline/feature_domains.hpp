#pragma once

#include "domain/domain.hpp"
#include "domain/split_curves.hpp"
#include "pipeline/entity_map.hpp"
#include "pipeline/mesh_attempt.hpp"

#include <map>
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
    /// What entities of the domain without some curves are in the one without others. A patch that is several
    /// there is none. What without() gave last is no longer valid. Errors: those of drop_curves().
    Result<EntityMap> map(std::span<const Index> from, std::span<const Index> to, Context& context);

  private:
    /// Numbers without some curves, kNoIndex: none, per patch and corner of the whole domain.
    struct OwnNumbers {
        std::vector<Index> patch, corner;
    };

    Result<const OwnNumbers*> numbers_without(std::span<const Index> curves, Context& context);

    Domain& whole_;
    std::optional<Domain> reduced_;
    std::vector<Index> dropped_; ///< of reduced_
    std::map<std::vector<Index>, OwnNumbers> numbers_;
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
