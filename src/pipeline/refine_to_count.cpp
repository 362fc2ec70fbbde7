#include "pipeline/refine_to_count.hpp"

#include "core/freed_memory.hpp"
#include "pipeline/narrow_features.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <utility>

namespace hexopt {

namespace {

constexpr double kAim = 0.98;       ///< of what is wanted: repairs of failing cells come on top
constexpr double kGoodRatio = 1.06; ///< between what is aimed at and what leaves promise
/// Of it, expected once an octree has been fitted: what is near enough to keep the first one, and the second.
constexpr double kFewFinished[] = {0.87, 0.77}, kManyFinished[] = {1.22, 1.3};
constexpr double kMost = 1.4; ///< of what is wanted, with repairs
constexpr int kTrials = 5;    ///< of sizes, for one promise of what leaves come to
/// With fewer cells what steep chords and narrow places take cannot be told beforehand: chords are always
/// followed then, narrow places never refined, thin walls without layers of cells.
constexpr double kLeastForeseen = 20000;
constexpr int kMostFitted = 3; ///< octrees of about the size wanted
constexpr int kMostThin = 2;   ///< of these, after which a model is too thin for so many cells
/// Of what is wanted: what makes larger cells worth trying before any is halved in walls. Up to 2.3 times
/// fewer than promised there were kept.
constexpr double kFarTooMany = 3;
constexpr double kEndless = std::numeric_limits<double>::infinity();
constexpr double kLargelyBare = 0.1; ///< share of the surface; larger cells are not tried then
/// Layers are counted on a mesh of about this part of the cells wanted, within limits.
constexpr double kProbeShare = 0.12, kLeastProbe = 1500, kMostProbe = 10e3;
constexpr double kProbeRatio = 2.5;
constexpr int kProbeTrials = 3;
constexpr int kNarrowLevels = 4;     ///< where the surface would be left bare, beyond those of gaps
constexpr double kNextStep = 1.3;    ///< of sizes, where trials contradict one another
constexpr double kUsualExcess = 8;   ///< over SizeTrials::first_size(), by criteria of shape
constexpr double kUsualLayers = 2;   ///< cells of buffer layers a quad of the trimmed surface
constexpr double kUsualPerCut = 1.7; ///< cells a leaf that the surface meets, beyond those inside
/// Finished cells per cell promised, by the share of cells at features that fitting asks to be refined.
constexpr double kRepairGrowth = 2;
constexpr double kUsualGrowth = 1.2;  ///< where the small mesh could not tell
constexpr double kMostGrowth = 1.3;   ///< no more is made up for: large cells only need more repairs
constexpr double kProbeRepairs = 0.3; ///< share of such cells, for each in the small mesh
constexpr double kCellsPerRepair = 3; ///< of the finished mesh for each leaf that a repair adds

/// Leaves of one size, and what they promise.
struct Counted {
    double size, inside, cut;
};

/// What trimming and layers make of an octree.
struct Found {
    double cells = 0;
    double at_ridges = 0; ///< of these, in layers that end some quads from a ridge: as the ridges' length
};

/// Cells of the finished mesh by its octree's leaves.
struct Promise {
    double per_inside = 1, per_cut = kUsualPerCut;
    double per_ridge = 0; ///< a cell's length of ridges, which go as the square root of the leaves cut
    double operator()(const Counted& c) const {
        return per_inside * c.inside + per_cut * c.cut + per_ridge * std::sqrt(c.cut);
    }

    /// Such that these leaves give so many cells.
    void fit(const Counted& c, const Found& found) {
        const double even = found.cells - found.at_ridges;
        if (even > c.inside && c.cut > 0)
            *this = {1, (even - c.inside) / c.cut, found.at_ridges / std::sqrt(c.cut)};
        else // only part of the inside is meshed
            *this = {found.cells / (c.inside + kUsualPerCut * c.cut),
                     kUsualPerCut * found.cells / (c.inside + kUsualPerCut * c.cut), 0};
    }
};

class CountSearch {
  public:
    CountSearch(SizeTrials trials, const Domain& domain, const MeshOptions& options, Context& context,
                LeakPath* leak)
        : trials_(std::move(trials)), domain_(domain), options_(options), context_(context), leak_(leak),
          wanted_(wanted_cells(options.refine)) {}

    Result<CountedOctree> run(StageClock& clock) {
        if (wanted_ < kLeastForeseen) {
            asked_for_steep_ = steep_ = true;
            trials_.require_steep();
        }
        if (Status ok = clock.run("count", [&] { return probe(); }); !ok) return ok.error();
        for (int round = 1;; ++round) {
            const double most_kept = round < kMostThin ? kFarTooMany * wanted_ / per_wall_cell() : kEndless;
            auto refined = clock.run("refine", [&] { return refine_near(kAim * wanted_ / growth_); });
            if (!refined) return refined.error();
            give_back_freed_memory();
            CountedOctree counted{std::move(*refined), {}, {}, {}, {}};
            auto trimmed = clock.run("trim", [&] {
                return trim_in_rounds(counted.refined, domain_, trim_options(options_),
                                      options_.refine.max_cells, counted.rounds, context_, leak_,
                                      narrow_levels(), most_kept);
            });
            if (!trimmed) return trimmed.error();
            if (const double kept = kept_once_halved(counted.refined, *trimmed); kept > most_kept) {
                promise_.fit(seen_.back(), {kept * per_wall_cell(), 0});
                continue;
            }
            counted.trimmed = std::move(*trimmed);
            if (!check_coverage(*counted.trimmed)) {
                if (round >= kMostThin || growth_ <= 1) return counted; // will be refused
                growth_ = 1; // smaller cells, as if there were no repairs
                if (!std::exchange(steep_, true)) {
                    trials_.require_steep(); // thin walls are curved as a rule
                    seen_.clear();
                }
                continue;
            }
            if (Status ok = fit(counted, clock); !ok) return ok.error();
            const TrimReport& trim = counted.trimmed->report;
            growth_ = growth_by(counted.fitted->refine_cells.size(), trim.kept_cells, 1);
            counted.rounds.memory.set_keys({}); // until it is trimmed again
            give_back_freed_memory();
            const auto found = clock.run("count", [&] { return count_layers(counted); });
            if (!found) return found.error();
            const double finished = growth_ * found->cells, ratio = finished / (kAim * wanted_);
            context_.log(LogLevel::debug,
                         fmt::format("size {:.4g}: {:.0f} cells promised, {:.0f} found, some {:.0f} "
                                     "expected of {:.0f} wanted",
                                     seen_.back().size, promise_(seen_.back()), found->cells, finished,
                                     wanted_));
            if (is_enough(ratio, round) || (ratio > 1 && is_largely_bare(trim))) {
                leave_room(counted.refined, found->cells);
                return counted;
            }
            promise_.fit(seen_.back(), *found);
        }
    }

  private:
    static bool is_enough(double ratio, int round) {
        return round == kMostFitted || (ratio > kFewFinished[round - 1] && ratio < kManyFinished[round - 1]);
    }

    /// Tries sizes until the promise is within `ratio` of `cells`; the nearest of `most`.
    Result<SizeTrials::Trial> find(double cells, double ratio, int most) {
        const std::size_t first = seen_.size();
        for (int count = 1;; ++count) {
            auto trial = trials_.refine_to(next_size(cells));
            if (!trial) return trial;
            see(*trial);
            if (is_near(cells, ratio)) return trial;
            if (count < most) continue;
            const auto nearest = std::min_element(seen_.begin() + static_cast<std::ptrdiff_t>(first),
                                                  seen_.end(), [&](const Counted& a, const Counted& b) {
                                                      return distance_to(a, cells) < distance_to(b, cells);
                                                  });
            std::iter_swap(nearest, seen_.end() - 1); // what was tried last counts
            if (seen_.back().size == trial->out.stats.surface_size) return trial;
            return trials_.refine_to(seen_.back().size);
        }
    }

    double distance_to(const Counted& c, double cells) const {
        return std::abs(std::log(promise_(c) / cells));
    }

    void see(const SizeTrials::Trial& trial) {
        seen_.push_back({trial.out.stats.surface_size, trial.inside, static_cast<double>(trial.cut)});
    }

    /// Whether what was tried last promises so many cells.
    bool is_near(double cells, double ratio) const {
        const double found = promise_(seen_.back()) / cells;
        return found < ratio && found > 1 / ratio;
    }

    Result<RefineOutput> refine_near(double cells) {
        auto trial = find(cells, kGoodRatio, kTrials);
        if (trial && !std::exchange(asked_for_steep_, true)) trial = find_steep(std::move(*trial), cells);
        if (!trial) return trial.error();
        return trials_.finish(std::move(*trial));
    }

    /// The size at which there are so many cells with those that steep chords ask for, if they may.
    Result<SizeTrials::Trial> find_steep(SizeTrials::Trial without, double cells) {
        {
            SizeTrials::Trial last = std::move(without);
            auto steep = trials_.allow_steep(last);
            if (!steep) return steep.error();
            steep_ = steep->has_value();
            if (!steep_) return last;
            seen_.clear();
            see(**steep);
            if (is_near(cells, kGoodRatio)) return std::move(**steep);
        } // neither octree stays while more are tried
        return find(cells, kGoodRatio, kTrials);
    }

    /// Larger cells would leave still more of the surface without any.
    static bool is_largely_bare(const TrimReport& report) {
        return report.bare_area > kLargelyBare * report.surface_area;
    }

    /// Finished cells for each cell in a wall that is one cell thick.
    double per_wall_cell() const { return 1 + 2 * layers_; }

    int narrow_levels() const {
        return options_.refine.gap_levels > 0 && wanted_ >= kLeastForeseen ? kNarrowLevels : 0;
    }

    /// share: of such cells that counts.
    double growth_by(std::size_t refine_cells, std::size_t cells, double share) const {
        if (options_.fit_repairs == 0) return 1;
        const double part = share * static_cast<double>(refine_cells) / static_cast<double>(cells);
        return std::min(1 + kRepairGrowth * std::sqrt(part), kMostGrowth);
    }

    /// Fits what trimming kept to the domain without what is too narrow for its cells.
    Status fit(CountedOctree& counted, StageClock& clock) {
        auto left = clock.run("narrow_features", [&] {
            counted.narrow = find_narrow_features(domain_, counted.refined.octree, options_);
            return leave_out(domain_, counted.narrow, context_);
        });
        if (!left) return left.error();
        own_ = std::move(*left);
        auto fitted = clock.run("fit", [&] {
            return fit_boundary(std::move(counted.trimmed->kept), own(), options_.fit, context_);
        });
        if (!fitted) return fitted.error();
        counted.fitted = std::move(*fitted);
        return Done{};
    }

    /// Counts what buffer layers add on a small mesh, and what its leaves come to.
    Status probe() {
        const double cells = std::clamp(kProbeShare * wanted_, kLeastProbe, kMostProbe);
        auto trial = find(std::min(cells, wanted_), kProbeRatio, kProbeTrials);
        if (!trial) return trial.error();
        CountedOctree small{trials_.finish(std::move(*trial)), {}, {}, {}, {}};
        TrimOptions how = options_.trim;
        how.thinnest_wall_h = 0; // there may be many at this size
        auto trimmed = trim_in_rounds(small.refined, domain_, how, options_.refine.max_cells, small.rounds,
                                      context_, leak_);
        if (!trimmed && trimmed.error().code == ErrorCode::cancelled) return trimmed.error();
        // What is too thin for few cells need not be for many, and tells nothing of them.
        if (!trimmed || !check_coverage(*trimmed)) return Done{};
        small.trimmed = std::move(*trimmed);
        StageClock unused; // the whole probe is one stage
        if (Status ok = fit(small, unused); !ok) return ok;
        growth_ =
            growth_by(small.fitted->refine_cells.size(), small.trimmed->report.kept_cells, kProbeRepairs);
        const auto found = count_layers(small);
        if (!found) return found.error();
        promise_.fit(seen_.back(), *found);
        return Done{};
    }

    /// What a fitted mesh comes to with its layers.
    Result<Found> count_layers(const CountedOctree& counted) {
        const auto kept = static_cast<double>(counted.fitted->fitted.mesh.cell_count());
        if (!options_.buffers) return Found{kept, 0};
        BufferOptions unrelaxed = options_.buffer;
        unrelaxed.relax_sweeps = 0; // moves vertices only
        const auto buffered = insert_buffers(counted.fitted->fitted, own(), unrelaxed, context_);
        if (!buffered) return buffered.error();
        const auto quads = static_cast<double>(counted.trimmed->report.surface_quads);
        const auto cells = static_cast<double>(buffered->fitted.mesh.cell_count());
        if (quads > 0) layers_ = (cells - kept) / quads;
        const double even = quads - static_cast<double>(buffered->report.spared_quads);
        return Found{cells, std::max(0.0, cells - kept - even)};
    }

    const Domain& own() const { return own_ ? *own_ : domain_; }

    /// The size for so many cells, by the law of the two trials nearest to it; first by that of cells on a
    /// surface, where most of a mesh's are. Always between the nearest sizes that gave too many and too few.
    double next_size(double cells) const {
        if (seen_.empty()) return trials_.first_size(cells / kUsualExcess);
        std::vector<Counted> near = seen_;
        std::stable_sort(near.begin(), near.end(), [&](const Counted& a, const Counted& b) {
            return distance_to(a, cells) < distance_to(b, cells);
        });
        double power = 0.45;
        if (near.size() > 1 && near[0].size != near[1].size && promise_(near[0]) != promise_(near[1]))
            power = std::clamp(std::log(near[0].size / near[1].size) /
                                   std::log(promise_(near[1]) / promise_(near[0])),
                               0.25, 2.0);
        double size = near[0].size * std::pow(promise_(near[0]) / cells, power);
        double too_small = 0, too_large = 1e300;
        for (const Counted& c : seen_)
            if (promise_(c) > cells)
                too_small = std::max(too_small, c.size);
            else
                too_large = std::min(too_large, c.size);
        if (size > too_small && size < too_large) return size;
        if (too_small == 0) return too_large / kNextStep;
        return too_large < 1e300 ? std::sqrt(too_small * too_large) : too_small * kNextStep;
    }

    void leave_room(RefineOutput& refined, double found) const {
        const double room = std::max(0.0, kMost * wanted_ - found) / kCellsPerRepair;
        refined.max_cells =
            std::min(options_.refine.max_cells, refined.octree.cell_count() + static_cast<std::size_t>(room));
    }

    SizeTrials trials_;
    const Domain& domain_;
    const MeshOptions& options_;
    Context& context_;
    LeakPath* leak_;
    double wanted_, layers_ = options_.buffers ? kUsualLayers : 0, growth_ = kUsualGrowth;
    std::optional<Domain> own_; ///< the domain without what was too narrow last; none: the whole one
    Promise promise_;
    std::vector<Counted> seen_; ///< of one kind: all with what steep chords ask for, or all without
    bool asked_for_steep_ = false, steep_ = false;
};

} // namespace

TrimOptions trim_options(const MeshOptions& options) {
    TrimOptions how = options.trim;
    if (!options.refine.surface.is_given() && wanted_cells(options.refine) < kLeastForeseen)
        how.thinnest_wall_h = 0;
    return how;
}

Result<CountedOctree> refine_to_count(const Domain& domain, const MeshOptions& options, StageClock& clock,
                                      Context& context, LeakPath* leak) {
    if (options.refine.surface.is_given()) {
        auto refined = clock.run("refine", [&] { return refine(domain, options.refine, context); });
        if (!refined) return refined.error();
        CountedOctree counted{std::move(*refined), {}, {}, {}, {}};
        counted.narrow = clock.run(
            "narrow_features", [&] { return find_narrow_features(domain, counted.refined.octree, options); });
        return counted;
    }
    auto trials = SizeTrials::create(domain, options.refine, context);
    if (!trials) return trials.error();
    return CountSearch(std::move(*trials), domain, options, context, leak).run(clock);
}

} // namespace hexopt
