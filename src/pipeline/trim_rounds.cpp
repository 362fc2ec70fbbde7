#include "pipeline/trim_rounds.hpp"

#include "pipeline/repair_cells.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace hexopt {

namespace {

constexpr int kMostRounds = 12, kWallRounds = 6;
/// After so many rounds in a row that partial faces alone ask for, their front is taken to move through a
/// layer of cells; after so many never to come to rest, and cells there are removed.
constexpr int kMovingFront = 2, kMostAsked = 3;
/// Cells are kept all over a wall of at least so many cells; a thinner one is worth a try.
constexpr double kLeastCells = 0.8, kNeededCells = 1.5;
constexpr double kLeastCovered = 0.7, kClearlyBare = 0.1;
/// Cells across a narrow place; and thickness of walls for which cells are halved, over that of the thinnest
/// that are kept.
constexpr double kNarrowCells = 3, kAboveThinnest = 1.4;
/// How far the octree may grow for narrow places; layers in walls, which cover more of the surface by fewer
/// cells, have some room besides.
constexpr double kMostNarrowGrowth = 1.3, kMostWallGrowth = 1.45;
/// How far for partial faces, beyond the room that repairs have: cells are removed there otherwise.
constexpr double kAskedGrowth = 1.01;
constexpr double kWorthTelling = 1e-3;
/// Cells of a mesh with buffer layers per square of their size on the surface, roughly.
constexpr double kCellsPerSquare = 4;

HexMesh take_cells(const HexMesh& mesh, const std::vector<Index>& cells) {
    HexMesh part;
    std::vector<Index> number(mesh.vertex_count(), kNoIndex);
    for (Index c : cells) {
        Cell cell = mesh.cells[c];
        for (Index& v : cell) {
            if (number[v] == kNoIndex) {
                number[v] = static_cast<Index>(part.positions.size());
                part.positions.push_back(mesh.positions[v]);
            }
            v = number[v];
        }
        part.cells.push_back(cell);
        if (!mesh.level.empty()) part.level.push_back(mesh.level[c]);
    }
    return part;
}

/// Bare places where cells may be halved beyond what gaps get: more cells fit in there.
class NarrowPlaces {
  public:
    NarrowPlaces(const RefineOutput& refined, int levels, double cells_across, double most_growth)
        : refined_(refined), cells_across_(cells_across), finest_part_(std::ldexp(1, -levels)),
          first_cells_(static_cast<double>(refined.octree.cell_count())), most_growth_(most_growth) {}

    /// Those of a round that may, widest first. Where not all may have the cells that they need, places as
    /// wide as the first that may not, or nearly so, have none: parts of a wall would be no better than
    /// nothing.
    std::vector<const BareSpot*> choose(const std::vector<BareSpot>& spots) const {
        std::vector<const BareSpot*> chosen;
        if (finest_part_ == 1) return chosen;
        for (const BareSpot& spot : spots)
            if (const double size = size_for(spot);
                size >= finest_part_ * refined_.finest_size[spot.patch] && spot.cell_size > size)
                chosen.push_back(&spot);
        std::stable_sort(chosen.begin(), chosen.end(),
                         [](const BareSpot* a, const BareSpot* b) { return a->thickness > b->thickness; });
        double needed = 0, widest_left = 0;
        for (const BareSpot* spot : chosen) {
            const double size = size_for(*spot);
            needed += kCellsPerSquare * spot->area / (size * size);
            if (needed > kNarrowShare * first_cells_) {
                widest_left = kAsWide * spot->thickness;
                break;
            }
        }
        std::erase_if(chosen, [&](const BareSpot* spot) { return spot->thickness <= widest_left; });
        return chosen;
    }

    /// Whether there is room for so many cells more to be halved.
    bool may_halve(std::size_t cells) const {
        const auto now = static_cast<double>(refined_.octree.cell_count());
        return now + 7 * static_cast<double>(cells) <= most_growth_ * first_cells_;
    }

  private:
    double size_for(const BareSpot& spot) const { return spot.thickness / cells_across_; }

    static constexpr double kNarrowShare = 0.1, kAsWide = 1.5;

    const RefineOutput& refined_;
    double cells_across_;
    double finest_part_; ///< of the size of the smallest cells in gaps
    double first_cells_;
    double most_growth_; ///< of the octree
};

/// Levels of the vertices round narrow places, for as many rings of cells as there is room for: fronts
/// between levels are better off outside.
std::vector<int> mark_narrow(const HexMesh& octree, const std::vector<BareSpot>& spots,
                             const NarrowPlaces& narrow) {
    constexpr int kMostRings = 3;
    const std::vector<int> none(octree.vertex_count(), -1);
    std::vector<int> level = none, with_room = none;
    for (const BareSpot* spot : narrow.choose(spots)) mark_vertices(octree, spot->cell, level);
    for (int ring = 1; ring <= kMostRings; ++ring) {
        const std::vector<Index> cells = find_marked(octree, level);
        if (cells.empty() || !narrow.may_halve(cells.size())) break;
        with_room = level;
        for (Index c : cells) mark_vertices(octree, c, level);
    }
    return with_room;
}

/// Cells of bare places that may be halved, and those of their size and larger round them, rising.
std::vector<Index> choose_bare_cells(const RefineOutput& refined, const std::vector<BareSpot>& spots,
                                     const NarrowPlaces& narrow) {
    std::vector<int> level = mark_narrow(refined.octree, spots, narrow);
    for (const BareSpot& spot : spots) {
        const double finest = refined.finest_size[spot.patch];
        if (spot.cell_size >= 2 * finest * (1 - 1e-6) && spot.thickness >= kLeastCells * finest)
            mark_vertices(refined.octree, spot.cell, level);
    }
    return find_marked(refined.octree, level);
}

/// Splits the cells; false where that was not possible.
bool refine_more(RefineOutput& refined, const std::vector<Index>& cells, Context& context) {
    return !cells.empty() && refine_cells(refined, cells, context).requested > 0;
}

/// The same for what trimming asks for, with room for `most` cells if that is more than repairs have.
bool refine_asked(RefineOutput& refined, const std::vector<Index>& cells, std::size_t most,
                  Context& context) {
    const std::size_t room = std::exchange(refined.max_cells, std::max(refined.max_cells, most));
    const bool done = refine_more(refined, cells, context);
    refined.max_cells = room;
    return done;
}

/// Whether layers of cells in walls are worth while: for much of the surface, or where it goes on bare for
/// farther than fitting reaches and is that of a wall for which there are layers. Of ragged ends of
/// what is thicker cells can make no sound layers.
bool is_worth_walls(const TrimOutput& trimmed, double thinnest_wall_h) {
    constexpr double kMuchBare = 2e-3, kLeastWall = 0.9;
    constexpr Index kFitReach = 2; // cells
    if (trimmed.report.bare_area > kMuchBare * trimmed.report.surface_area) return true;
    std::vector<double> wall(trimmed.bare_parts.size(), 0);
    for (const BareSpot& spot : trimmed.bare_spots)
        if (spot.thickness >= thinnest_wall_h * spot.cell_size &&
            spot.thickness <= kThickestWall_h * spot.cell_size)
            wall[spot.part] += spot.area;
    for (std::size_t i = 0; i < wall.size(); ++i)
        if (const BarePart& part = trimmed.bare_parts[i];
            part.depth >= kFitReach && wall[i] > kLeastWall * part.area)
            return true;
    return false;
}

/// The place with the thickness that only a tenth of the bare surface is below.
BareSpot thin_spot(std::vector<BareSpot> spots) {
    std::sort(spots.begin(), spots.end(),
              [](const BareSpot& a, const BareSpot& b) { return a.thickness < b.thickness; });
    double area = 0, below = 0;
    for (const BareSpot& spot : spots) area += spot.area;
    for (const BareSpot& spot : spots)
        if ((below += spot.area) >= 0.1 * area) return spot;
    return spots.front();
}

/// What to try where a place that is this thick stayed bare.
std::string advise(const BareSpot& spot, const TrimReport& report) {
    const double size = spot.thickness / kNeededCells;
    if (!(size < spot.cell_size)) return "try other --cells, a smaller --size, or --outer-levels 0";
    const double cells = kCellsPerSquare * report.surface_area / (size * size),
                 unit = std::pow(10, std::floor(std::log10(std::max(cells, 1.0))) - 1); // two digits
    std::string advice = fmt::format("try --size {:.2g}", size);
    if (cells > static_cast<double>(report.octree_cells)) // else they are finer elsewhere
        advice += fmt::format(", or --cells {:.0f}", std::ceil(cells / unit) * unit);
    return advice;
}

/// What is done where the surface is bare, one after the other: room for three cells, then for cells that are
/// kept by their centres, then layers of cells in walls.
class CoverSteps {
  public:
    CoverSteps(const RefineOutput& refined, int narrow_levels, double thinnest_wall_h)
        : refined_(refined), thinnest_wall_h_(thinnest_wall_h),
          narrow_(refined, narrow_levels, kNarrowCells, kMostNarrowGrowth),
          needed_(refined, narrow_levels, kNeededCells, kMostNarrowGrowth),
          walls_(refined, narrow_levels, kAboveThinnest * thinnest_wall_h, kMostWallGrowth) {}

    /// Cells to be halved, with those that trimming asks for; none where this step has come to its end.
    std::vector<Index> choose(const TrimOutput& trimmed) {
        std::vector<Index> cells;
        if (step_ == Step::narrow) {
            cells = choose_bare_cells(refined_, trimmed.bare_spots, narrow_);
            if (cells.empty()) step_ = is_worth_layers(trimmed) ? Step::needed : Step::end;
        }
        if (step_ == Step::needed) cells = choose_bare_cells(refined_, trimmed.bare_spots, needed_);
        if (step_ == Step::walls) cells = choose_bare_cells(refined_, trimmed.bare_spots, walls_);
        if (cells.empty()) return cells;
        cells.insert(cells.end(), trimmed.refine_cells.begin(), trimmed.refine_cells.end());
        std::sort(cells.begin(), cells.end());
        cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
        return cells;
    }

    /// After a step at whose end nothing can be halved: whether layers of cells in walls are next.
    bool begin_layers(const TrimOutput& trimmed) {
        const bool begin = (step_ == Step::narrow || step_ == Step::needed) && is_worth_layers(trimmed);
        step_ = begin ? Step::walls : Step::end;
        bare_before_layers_ = trimmed.report.bare_area;
        return begin;
    }

    /// Where nothing more can be halved for layers: whether they are to be given up, since they leave most of
    /// what was bare as it was. Ragged patches of layers bring more edges than surface.
    bool give_up_layers(const TrimReport& report) {
        constexpr double kMostLeft = 0.8;
        if (step_ != Step::walls || report.bare_area <= kMostLeft * bare_before_layers_) return false;
        step_ = Step::end;
        return true;
    }

  private:
    enum class Step { narrow, needed, walls, end };

    bool is_worth_layers(const TrimOutput& trimmed) const {
        return thinnest_wall_h_ > 0 && is_worth_walls(trimmed, thinnest_wall_h_);
    }

    const RefineOutput& refined_;
    double thinnest_wall_h_;
    NarrowPlaces narrow_, needed_, walls_;
    Step step_ = Step::narrow;
    double bare_before_layers_ = 0;
};

/// trim_in_rounds() with `options` as they are.
Result<TrimOutput> repeat_trim(RefineOutput& refined, const Domain& domain, TrimOptions options,
                               std::size_t max_cells, TrimRounds& rounds, Context& context, LeakPath* leak,
                               int narrow_levels, double most_kept) {
    const auto grown = kAskedGrowth * static_cast<double>(refined.octree.cell_count());
    const std::size_t most = std::min(max_cells, static_cast<std::size_t>(grown));
    const double thinnest_wall_h = std::exchange(options.thinnest_wall_h, 0);
    CoverSteps steps(refined, narrow_levels, thinnest_wall_h);
    int last_round = kMostRounds, asked = 0; // rounds in a row in which trimming alone asked for cells
    for (int round = 1;; ++round) {
        options.whole_layers = asked >= kMovingFront;
        if (round == last_round || asked >= kMostAsked) options.partial = PartialFaces::remove;
        std::vector<Index> path;
        rounds.memory.set_keys(refined.leaf_node);
        auto trimmed = trim(refined.octree, domain, options, context, &path, &rounds.memory);
        ++rounds.count;
        if (!trimmed) {
            if (leak && !path.empty()) leak->cells = take_cells(refined.octree, path);
            return trimmed;
        }
        context.report(
            "trim", static_cast<double>(round) / last_round,
            fmt::format("{} of {} cells", trimmed->kept.cell_count(), refined.octree.cell_count()));
        if (context.is_cancelled()) return make_error(ErrorCode::cancelled, "trim", "", "cancelled");
        if (round == 1 && kept_once_halved(refined, *trimmed) > most_kept) return trimmed;
        if (round < last_round) {
            const bool chosen = refine_more(refined, steps.choose(*trimmed), context);
            asked = chosen ? 0 : asked + 1;
            if (chosen) continue;
            if (steps.give_up_layers(trimmed->report)) {
                options.thinnest_wall_h = 0;
                continue;
            }
            if (steps.begin_layers(*trimmed)) {
                options.thinnest_wall_h = thinnest_wall_h;
                last_round = std::max(last_round, round + kWallRounds);
                continue;
            }
        }
        if (trimmed->refine_cells.empty()) return trimmed;
        if (!refine_asked(refined, trimmed->refine_cells, most, context))
            options.partial = PartialFaces::remove;
    }
}

} // namespace

Result<TrimOutput> trim_in_rounds(RefineOutput& refined, const Domain& domain, TrimOptions options,
                                  std::size_t max_cells, TrimRounds& rounds, Context& context, LeakPath* leak,
                                  int narrow_levels, double most_kept) {
    options.count_faults = false; // but once, of what is left in the end
    auto trimmed =
        repeat_trim(refined, domain, options, max_cells, rounds, context, leak, narrow_levels, most_kept);
    if (trimmed && trimmed->report.kept_cells > 0) count_faults(*trimmed, context.parallel());
    return trimmed;
}

double kept_once_halved(const RefineOutput& refined, const TrimOutput& trimmed) {
    constexpr double kNearlyAll = 0.9;
    if (trimmed.report.bare_area < kNearlyAll * trimmed.report.surface_area) return 0;
    double cells = 0;
    for (const BareSpot& spot : trimmed.bare_spots) {
        const double least = refined.finest_size[spot.patch] * (1 - 1e-6);
        double size = spot.cell_size;
        while (size / 2 >= least && spot.thickness < kLeastCells * size) size /= 2;
        if (spot.thickness >= kLeastCells * size) cells += spot.area / (2 * size * size); // of two sides
    }
    return cells;
}

Status check_coverage(const TrimOutput& trimmed) {
    const TrimReport& report = trimmed.report;
    const double bare = report.bare_area, area = report.surface_area;
    const bool volume_lost = report.enclosed_volume > 0 && bare > kClearlyBare * area &&
                             report.kept_volume < kLeastCovered * report.enclosed_volume;
    const bool all_lost = report.kept_cells == 0;
    if (bare <= (1 - kLeastCovered) * area && !volume_lost && !all_lost) return Done{};
    const BareSpot spot = thin_spot(trimmed.bare_spots);
    return make_error(
        ErrorCode::no_valid_mesh, "trim",
        fmt::format("near ({:.6g}, {:.6g}, {:.6g})", spot.at.x, spot.at.y, spot.at.z),
        fmt::format("{:.0f} % of the surface has no cells {}: the model is {:.3g} thick there, the "
                    "cells are {:.3g}; {}",
                    100 * bare / area, all_lost ? "in it" : "near it", spot.thickness, spot.cell_size,
                    advise(spot, report)));
}

std::string describe_bare_surface(const TrimReport& report) {
    if (!(report.bare_area > kWorthTelling * report.surface_area)) return {};
    const Point p = report.first_bare;
    return fmt::format("{:.2g} % of the surface has no cells near it, first near ({:.6g}, {:.6g}, {:.6g}): "
                       "smaller cells there (--size, --gap-levels, --cells) may help.",
                       100 * report.bare_area / report.surface_area, p.x, p.y, p.z);
}

} // namespace hexopt
