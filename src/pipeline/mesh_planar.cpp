#include "pipeline/mesh_planar.hpp"

#include "domain/outline_touching.hpp"
#include "domain/weld_surface.hpp"
#include "mesh/hanging.hpp"
#include "mesh/validate_structure.hpp"
#include "pipeline/checkpoint.hpp"
#include "pipeline/planar_options.hpp"
#include "stages/planar/outline_deviation.hpp"
#include "stages/planar/planar.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <glm/geometric.hpp>
#include <numbers>

namespace hexopt {

namespace {

constexpr int kMostRounds = 40; ///< of trimming; each asks for one more level at the most
constexpr int kJoinLevels = 2;  ///< beyond those for gaps: how often cells are refined to join parts
constexpr double kTrimEnd = 0.3, kRelaxEnd = 0.85, kMeasureEnd = 0.97;

void begin(Context& context, const char* stage, double low, double high) {
    context.set_progress_range(low, high);
    context.report(stage, 0);
}

class PlanarRun {
  public:
    PlanarRun(const MeshOptions& options, StageClock& clock, Context& context, Checkpoint* checkpoint)
        : options_(options), clock_(clock), context_(context), checkpoint_(checkpoint) {}

    Result<MeshOutcome> run(Slab slab) {
        if (options_.fit_repairs < 0 || options_.fit_repairs > 5)
            return make_error(ErrorCode::usage, "fit", "", "the repairs must lie in 0..5");
        if (Status ok = choose(std::move(slab)); !ok) return ok.error();
        if (Status ok = check_initial_mesh(); !ok) return ok.error();
        const OutlineCurves curves(slab_.outline, options_.features.feature_angle_deg);
        if (Status ok = start_refinement(); !ok) return ok.error();
        if (Status ok = fit_and_relax(curves); !ok) return ok.error();
        if (Status ok = measure(curves); !ok) return ok.error();
        return std::move(outcome_);
    }

  private:
    Status choose(Slab slab) {
        begin(context_, "outline", 0, 0.05);
        if (Status sound = check_touching(slab.outline); !sound) return sound;
        RegionChoice choice;
        for (const Point& seed : options_.trim.seeds) choice.seeds.emplace_back(seed);
        choice.part_fraction = options_.trim.part_fraction;
        choice.outer_first = options_.farfield.has_value();
        if (options_.farfield) {
            Result<Outline> with_box = add_farfield(
                std::move(slab.outline), {Point2(options_.farfield->low), Point2(options_.farfield->high)});
            if (!with_box) return with_box.error();
            slab.outline = std::move(*with_box);
        }
        PlanarReport& report = outcome_.planar.emplace();
        Result<Outline> chosen = choose_regions(std::move(slab.outline), choice, report.regions);
        if (!chosen) return chosen.error();
        slab.outline = std::move(*chosen);
        slab_ = std::move(slab);
        report.loops = slab_.outline.loops.size();
        report.normal = slab_.outline.frame.normal();
        report.is_turned = !slab_.outline.frame.axis();
        report.low = slab_.low;
        report.high = slab_.high;
        report.plane_patches = {slab_.low_name, slab_.high_name};
        report.diagonal = body_box(slab_.outline).diagonal();
        return Done{};
    }

    /// It is to be one cell thick and to hold the whole outline.
    Status check_initial_mesh() const {
        const InitialMeshOptions& initial = options_.refine.initial;
        if (initial.mesh)
            return make_error(ErrorCode::usage, "refine", "initial mesh",
                              "a planar mesh takes none; give counts");
        if (initial.cells[2] > 1)
            return make_error(ErrorCode::usage, "refine", "initial cells",
                              "a planar mesh is one cell thick: the count across it must be 1");
        if (!initial.box) return Done{};
        for (const OutlineLoop& loop : slab_.outline.loops)
            for (const Point2& p : loop.points)
                if (!(p.x > initial.box->low.x && p.x < initial.box->high.x && p.y > initial.box->low.y &&
                      p.y < initial.box->high.y))
                    return make_error(ErrorCode::usage, "refine", "box",
                                      fmt::format("the point {} of the outline is not inside the box",
                                                  slab_.outline.describe(p)));
        return Done{};
    }

    Status start_refinement() {
        const auto solid = clock_.run("extrude", [&] { return make_solid(slab_); });
        if (!solid) return solid.error();
        auto domain = clock_.run("domain", [&] { return build_domain(*solid, options_.features, context_); });
        if (!domain) return domain.error();
        domain_.emplace(std::move(*domain));
        outcome_.patches = domain_->names.size();
        if (checkpoint_ && checkpoint_->has_state()) {
            auto state = checkpoint_->load(*domain_, clock_, context_);
            if (!state) return state.error();
            state_.emplace(std::move(*state));
            outcome_.resumed = name_of(state_->phase);
            return Done{};
        }
        RefineOptions refining = options_.refine;
        // The sagitta is to be small beside the bodies, not beside the farfield.
        refining.chord_error_rel *= outcome_.planar->diagonal / domain_->model.diagonal();
        context_.set_progress_range(0.05, 0.1);
        auto refined = clock_.run("refine", [&] { return refine(*domain_, refining, context_); });
        if (!refined) return refined.error();
        state_.emplace(std::move(*refined));
        return Done{};
    }

    /// Refines what trimming and matching ask for, until they ask for nothing.
    Result<PlanarFit> fit(const OutlineCurves& curves) {
        begin(context_, "trim", 0.1, kTrimEnd);
        QuadTrimOptions trimming;
        for (int round = 1;; ++round) {
            trimming.may_refine = trimming.may_refine && round < kMostRounds;
            trimming.may_join = state_->joins < options_.refine.gap_levels + kJoinLevels;
            auto fitted = clock_.run("fit", [&] {
                return fit_outline(state_->octree.open(context_).octree, curves, trimming, context_);
            });
            ++state_->counts.trims.count;
            if (fitted && fitted->asked_to_join) ++state_->joins;
            if (!fitted || fitted->refine_cells.empty()) return fitted;
            if (refine_cells(state_->octree.open(context_), fitted->refine_cells, context_).requested == 0)
                trimming.may_refine = false;
        }
    }

    RelaxOptions relax_options() const {
        RelaxOptions relaxing;
        const bool quick = options_.optimize.effort == Effort::quick;
        relaxing.sweeps = std::min(quick ? 100 : 400, options_.optimize.max_iterations);
        relaxing.still = quick ? 1e-3 : 1e-4;
        relaxing.max_min = options_.optimize.max_min;
        relaxing.raise_below = std::max(0.5, options_.optimize.min_sj);
        relaxing.time_limit_s = options_.optimize.time_limit_s;
        return relaxing;
    }

    Status fit_and_relax(const OutlineCurves& curves) {
        PlanarReport& report = *outcome_.planar;
        const double chord = options_.refine.chord_error_rel * report.diagonal;
        for (;; ++state_->round) {
            if (checkpoint_) checkpoint_->save(*state_, clock_, context_);
            auto fitted = fit(curves);
            if (!fitted) return fitted.error();
            ++state_->counts.fit_rounds;
            report.row = fitted->row;
            outcome_.trim.octree_cells = state_->octree.cell_count();
            outcome_.trim.kept_cells = fitted->kept_cells;
            outcome_.trim.cut_cells = fitted->cut_cells;
            outcome_.trim.manifold_removed = fitted->removed_cells - fitted->dropped_cells;
            outcome_.trim.part_cells_dropped = fitted->dropped_cells;
            mesh_ = std::move(fitted->mesh);
            start_ = mesh_.positions;
            begin(context_, "optimize", kTrimEnd, kRelaxEnd);
            auto relaxed =
                clock_.run("optimize", [&] { return relax_quads(mesh_, curves, relax_options(), context_); });
            if (!relaxed) {
                cancelled_ = relaxed.error().code == ErrorCode::cancelled;
                return cancelled_ ? Status(Done{}) : relaxed.error();
            }
            report.relax = *relaxed;
            if (state_->round >= options_.fit_repairs) break;
            const std::vector<Index> coarse =
                find_coarse_cells(mesh_, state_->octree.open(context_).octree, curves, chord);
            if (coarse.empty() ||
                refine_cells(state_->octree.open(context_), coarse, context_).requested == 0)
                break;
        }
        outcome_.refine = state_->octree.stats();
        outcome_.trim_rounds = state_->counts.trims.count;
        outcome_.fit_rounds = state_->counts.fit_rounds;
        outcome_.curves = curves.curve_count();
        outcome_.corners = curves.corner_count();
        outcome_.fit.curves = outcome_.fit.captured_curves = outcome_.curves;
        outcome_.fit.corners = outcome_.fit.captured_corners = outcome_.corners;
        return Done{};
    }

    Status measure(const OutlineCurves& curves) {
        const PlanarReport& report = *outcome_.planar;
        begin(context_, "measure", kRelaxEnd, kMeasureEnd);
        Context unhurried(context_.parallel().threads(), context_.seed()); // measures even after a cancel
        HexMesh& mesh = outcome_.mesh = extrude(
            mesh_, {slab_.low, slab_.high, slab_.outline.patch_names, slab_.low_name, slab_.high_name});
        drop_unused_names(mesh);
        if (Status sound = require_structure(mesh, "mesh", context_.parallel()); !sound) return sound;
        const Topology topology = compute_topology(mesh, context_.parallel());
        for (double z : {slab_.low, slab_.high})
            for (const Point2& p : start_) outcome_.start.emplace_back(p, z);
        for (std::vector<Point>* positions : {&mesh.positions, &outcome_.start}) {
            place_in_model(slab_, *positions);
            if (report.is_turned) apply_hanging(mesh.hanging, *positions, context_.parallel());
        }
        std::swap(mesh.positions, outcome_.start);
        auto before =
            clock_.run("quality_before", [&] { return compute_quality(mesh, topology, {}, unhurried); });
        std::swap(mesh.positions, outcome_.start);
        if (!before) return before.error();
        outcome_.before = std::move(*before);
        auto after =
            clock_.run("quality_after", [&] { return compute_quality(mesh, topology, {}, unhurried); });
        if (!after) return after.error();
        outcome_.after = std::move(*after);
        outcome_.deviation = clock_.run(
            "deviation", [&] { return measure_outline_deviation(mesh_, curves, context_.parallel()); });
        outcome_.deviation.diagonal = domain_->model.diagonal();
        outcome_.contacts = clock_.run("contacts", [&] { return find_wall_contacts(mesh_); });
        const ValidityCounts& validity = outcome_.after.validity;
        const bool is_below =
            options_.target_min_sj && validity.min_scaled_jacobian < *options_.target_min_sj;
        outcome_.verdict = cancelled_                                           ? ErrorCode::cancelled
                           : !validity.is_valid() || !outcome_.contacts.empty() ? ErrorCode::no_valid_mesh
                           : is_below                                           ? ErrorCode::below_target
                                                                                : ErrorCode::ok;
        add_notes(curves);
        return Done{};
    }

    static void drop_unused_names(HexMesh& mesh) {
        std::vector<Index> number(mesh.patch_names.size(), kNoIndex);
        for (const BoundaryQuad& quad : mesh.boundary) number[quad.patch] = 0;
        std::vector<std::string> kept;
        for (std::size_t p = 0; p < number.size(); ++p) {
            if (number[p] == kNoIndex) continue;
            number[p] = static_cast<Index>(kept.size());
            kept.push_back(std::move(mesh.patch_names[p]));
        }
        mesh.patch_names = std::move(kept);
        for (BoundaryQuad& quad : mesh.boundary) quad.patch = number[quad.patch];
    }

    void add_notes(const OutlineCurves& curves) {
        const PlanarReport& report = *outcome_.planar;
        auto& notes = outcome_.notes;
        if (report.regions.dropped_loops > 0)
            notes.push_back(fmt::format("{} loops that bound nothing to mesh were left out.",
                                        report.regions.dropped_loops));
        if (std::string budget = outcome_.refine.describe_budget(); !budget.empty())
            notes.push_back(std::move(budget));
        if (outcome_.trim.part_cells_dropped > 0)
            notes.push_back(
                fmt::format("{} cells in parts that only gaps narrower than a cell lead to were left "
                            "out, and these parts filled from outside: smaller cells (--size, "
                            "--gap-levels) may help.",
                            outcome_.trim.part_cells_dropped));
        if (report.relax.out_of_time) notes.emplace_back("Optimizing ended at its time limit.");
        double sharpest = 360;
        for (Index l = 0; l < curves.loop_count(); ++l)
            for (const OutlineCorner& corner : curves.corners(l))
                if (corner.is_sharp) sharpest = std::min(sharpest, corner.angle_deg);
        if (sharpest < 40)
            notes.push_back(
                fmt::format("The sharpest corner inside has {:.1f} degrees: the cell in it can have "
                            "no scaled Jacobian above {:.2f}.",
                            sharpest, std::sin(sharpest * std::numbers::pi / 180)));
    }

    const MeshOptions& options_;
    StageClock& clock_;
    Context& context_;
    Checkpoint* checkpoint_;
    MeshOutcome outcome_;
    Slab slab_;
    std::optional<Domain> domain_;
    std::optional<MeshState> state_;
    QuadMesh mesh_;
    std::vector<Point2> start_;
    bool cancelled_ = false;
};

} // namespace

Result<MeshOutcome> mesh_planar(Slab slab, const MeshOptions& options, StageClock& clock, Context& context,
                                Checkpoint* checkpoint) {
    const Result<MeshOptions> in_plane = options_in_plane(options, slab.outline.frame);
    if (!in_plane) return in_plane.error();
    return PlanarRun(*in_plane, clock, context, checkpoint).run(std::move(slab));
}

Result<std::optional<Slab>> find_slab(const TriangleSoup& surface, const MeshOptions& options,
                                      StageClock& clock, Context& context) {
    const bool is_told = options.planar == PlanarChoice::yes;
    const double most_rel = is_told ? std::numeric_limits<double>::infinity() : kThinSlab_rel;
    if (!is_told && (options.planar == PlanarChoice::no || find_slab_planes(surface, most_rel).empty()))
        return std::optional<Slab>();
    Box box;
    for (const Point& p : surface.vertices) box.add(p);
    const double gap = surface.vertices.empty() ? 0 : options.weld_rel * glm::distance(box.low, box.high);
    auto welded = clock.run("weld", [&] { return weld_surface(surface, gap, context); });
    if (!welded) return welded.error();
    Result<Slab> slab = clock.run("slab", [&] { return recognise_slab(welded->soup, most_rel); });
    if (slab) return std::optional<Slab>(std::move(*slab));
    if (is_told) return slab.error();
    return std::optional<Slab>();
}

} // namespace hexopt
