#include "pipeline/refine_to_count.hpp"

#include "pipeline/trim_rounds.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace hexopt {

namespace {

constexpr int kTrials = 5;
constexpr double kFirst = 0.5;             ///< of what is wanted, as refine() counts it
constexpr double kAim = 0.95;              ///< of what is wanted
constexpr double kAimBeforeRepairs = 0.65; ///< where fitting will ask for some
constexpr double kGoodRatio = 1.15;        ///< between what is aimed at and what is found
constexpr double kMost = 1.4;              ///< of what is wanted, with repairs
/// Buffer layers are counted on a mesh of this part of the cells wanted, and of so many at most: they hang
/// on the model more than on the size.
constexpr double kCountedShare = 0.5, kMostCounted = 50e3;
constexpr double kUsualLayers = 2;    ///< cells of buffer layers a quad of the trimmed surface
constexpr double kCellsPerRepair = 3; ///< of the finished mesh for each leaf that a repair adds

/// Cells of the finished mesh as far as trimming shows them: `layers` cells a quad come on top.
struct Count {
    double kept = 0, quads = 0;
    bool covered = true; ///< else the run will be refused, whatever else is counted
    double with(double layers) const { return kept + layers * quads; }
};

class CountSearch {
  public:
    CountSearch(const Domain& domain, const MeshOptions& options, Context& context, LeakPath* leak)
        : domain_(domain), options_(options), context_(context), leak_(leak),
          wanted_(wanted_cells(options.refine)) {}

    Result<RefineOutput> run() {
        if (options_.buffers)
            if (Status ok = count_layers(); !ok) return ok.error();
        Result<RefineOutput> refined = first_trial();
        for (int trial = 1;; ++trial) {
            if (!refined) return refined;
            const auto count = count_kept(*refined);
            if (!count) return count.error();
            const double found = count->with(layers_), ratio = found / (aim_ * wanted_);
            context_.log(LogLevel::debug, fmt::format("size {:.4g}: some {:.0f} cells of {:.0f} wanted",
                                                      refined->stats.surface_size, found, wanted_));
            const bool good = ratio < kGoodRatio && ratio > 1 / kGoodRatio;
            if (good || trial == kTrials) {
                leave_room(*refined, found);
                return refined;
            }
            refined =
                refine_at(domain_, options_.refine, next_size(refined->stats.surface_size, ratio), context_);
        }
    }

  private:
    Result<RefineOutput> first_trial() {
        if (size_ > 0) return refine_at(domain_, options_.refine, size_, context_);
        return refine(domain_, at_count(kFirst * wanted_), context_);
    }

    RefineOptions at_count(double cells) const {
        RefineOptions refine = options_.refine;
        refine.target_cells = std::max(cells, 1.0);
        return refine;
    }

    Result<Count> count_kept(RefineOutput& refined) {
        TrimRounds rounds;
        auto trimmed = trim_in_rounds(refined, domain_, options_.trim, rounds, context_, leak_);
        if (!trimmed) return trimmed.error();
        const bool covered = check_coverage(*trimmed).has_value();
        kept_ = std::move(trimmed->kept);
        return Count{static_cast<double>(kept_.cell_count()),
                     static_cast<double>(trimmed->report.surface_quads), covered};
    }

    /// Fits a mesh that is not too large and counts what the buffers add.
    Status count_layers() {
        const double cells = std::min(kCountedShare * wanted_, kMostCounted);
        auto refined = refine(domain_, at_count(kFirst * cells), context_);
        if (!refined) return refined.error();
        const auto count = count_kept(*refined);
        if (!count) return count.error();
        if (!count->covered) return Done{};
        auto fitted = fit_boundary(std::move(kept_), domain_, options_.fit, context_);
        if (!fitted) return fitted.error();
        if (!fitted->refine_cells.empty() && options_.fit_repairs > 0) aim_ = kAimBeforeRepairs;
        BufferOptions unrelaxed = options_.buffer;
        unrelaxed.relax_sweeps = 0; // moves vertices only
        const auto buffered = insert_buffers(std::move(fitted->fitted), domain_, unrelaxed, context_);
        if (!buffered) return buffered.error();
        const double all = static_cast<double>(buffered->fitted.mesh.cell_count());
        layers_ = count->quads > 0 ? (all - count->kept) / count->quads : layers_;
        size_ = next_size(refined->stats.surface_size, all / (aim_ * wanted_));
        last_size_ = 0, too_small_ = 0, too_large_ = 1e300; // the trials that follow count otherwise
        return Done{};
    }

    /// The size for the count that is aimed at, `ratio` below the one found: by the law of two trials, first
    /// by that of cells on a surface (2-D: on a line), where most of a mesh's are.
    double next_size(double size, double ratio) {
        double power = options_.refine.planar ? 1 : 0.45;
        if (last_size_ > 0 && last_size_ != size && last_ratio_ != ratio)
            power = std::clamp(std::log(last_size_ / size) / std::log(ratio / last_ratio_), 0.25, 2.0);
        last_size_ = size, last_ratio_ = ratio;
        (ratio > 1 ? too_small_ : too_large_) = size;
        size *= std::pow(ratio, power);
        if (size <= too_small_ || size >= too_large_) size = std::sqrt(too_small_ * too_large_);
        return size;
    }

    void leave_room(RefineOutput& refined, double found) const {
        const double room = std::max(0.0, kMost * wanted_ - found) / kCellsPerRepair;
        refined.max_cells =
            std::min(options_.refine.max_cells, refined.octree.cell_count() + static_cast<std::size_t>(room));
    }

    const Domain& domain_;
    const MeshOptions& options_;
    Context& context_;
    LeakPath* leak_;
    double wanted_, layers_ = options_.buffers ? kUsualLayers : 0;
    double aim_ = kAim, size_ = 0, last_size_ = 0, last_ratio_ = 1, too_small_ = 0, too_large_ = 1e300;
    HexMesh kept_;
};

} // namespace

Result<RefineOutput> refine_to_count(const Domain& domain, const MeshOptions& options, Context& context,
                                     LeakPath* leak) {
    if (options.refine.surface.is_given()) return refine(domain, options.refine, context);
    return CountSearch(domain, options, context, leak).run();
}

} // namespace hexopt
