#include "stages/buffer/buffer.hpp"

#include "stages/buffer/buffer_counts.hpp"
#include "stages/buffer/good_groups.hpp"
#include "stages/buffer/relax_layers.hpp"
#include "stages/buffer/surface_regions.hpp"

#include <cassert>
#include <fmt/format.h>

namespace hexopt {

namespace {

constexpr const char* kStage = "buffer";
constexpr int kMostAttempts = 8; ///< at a sheet, leaving out more of it each time
constexpr int kRelaxRings = 1;   ///< old vertices that move with the new ones

/// A sheet to be inserted under all quads of its regions.
struct RegionSheet {
    std::vector<Index> regions; ///< rising
};

/// A sheet that could not be inserted, and the regions at the place.
struct FailedSheet {
    RegionSheet sheet;
    SheetProblem problem;
    std::vector<Index> regions_there;
    bool whole; ///< false: it is left out round the problem only
};

Status check_options(const BufferOptions& options) {
    const auto within = [](double value, double limit) { return value >= 0 && value <= limit; };
    if (!within(options.enough_sj, 2))
        return make_error(ErrorCode::usage, kStage, "", "a scaled Jacobian is out of range");
    if (!within(options.join_deg, 360) || !within(options.pillow_deg, 361) ||
        !within(options.corner_deg, 180))
        return make_error(ErrorCode::usage, kStage, "", "an angle is out of range");
    if (options.relax_sweeps < 0 || options.band_quads < 1 || options.reach_quads < 1)
        return make_error(ErrorCode::usage, kStage, "", "sweeps must be 0 or more and bands a quad wide");
    return Done{};
}

Status check_entities(const FittedMesh& fitted, const Domain& domain) {
    const auto bad = [](std::string where) {
        return make_error(ErrorCode::bad_input, kStage, std::move(where), "bound to what the domain has not");
    };
    for (std::size_t v = 0; v < fitted.association.size(); ++v) {
        const auto [kind, entity] = fitted.association[v];
        const std::size_t count = kind == EntityKind::patch    ? domain.model.patch_count()
                                  : kind == EntityKind::curve  ? domain.model.curve_count()
                                  : kind == EntityKind::corner ? domain.model.corner_count()
                                                               : std::size_t{kNoIndex} + 1;
        if (entity >= count) return bad(fmt::format("vertex {}", v));
    }
    for (const FittedMesh::RidgeEdge& ridge : fitted.ridges)
        if (ridge.curve >= domain.angle.size()) return bad(fmt::format("ridge edge {} {}", ridge.a, ridge.b));
    for (std::size_t q = 0; q < fitted.mesh.boundary.size(); ++q) {
        const Index patch = fitted.mesh.boundary[q].patch;
        if (patch != kNoIndex && patch >= domain.model.patch_count())
            return bad(fmt::format("boundary quad {}", q));
    }
    return Done{};
}

/// Inserts sheets of one kind: those that do not touch one another in one pass, in order otherwise.
class SheetSeries {
  public:
    SheetSeries(SheetMesh& mesh, const BoundaryModel& model, SheetKind kind, Context& context)
        : mesh_(mesh), model_(model), kind_(kind), context_(context) {}

    /// Sheets that could not be inserted.
    std::vector<FailedSheet> insert(std::vector<RegionSheet> sheets, Index region_count) {
        sheets_ = std::move(sheets);
        sheet_of_region_.assign(region_count, kNoIndex);
        for (Index s = 0; s < sheets_.size(); ++s)
            for (Index region : sheets_[s].regions) sheet_of_region_[region] = s;
        state_.assign(sheets_.size(), State::waiting);
        attempts_.assign(sheets_.size(), 0);
        while (!context_.is_cancelled() && has_waiting()) insert_some();
        return std::move(failed_);
    }

    std::size_t passes() const { return passes_; }
    std::size_t inserted() const {
        return static_cast<std::size_t>(std::count(state_.begin(), state_.end(), State::inserted));
    }

  private:
    enum class State { waiting, chosen, inserted, failed };

    bool has_waiting() const {
        return std::find(state_.begin(), state_.end(), State::waiting) != state_.end();
    }

    void insert_some() {
        const SheetChoice choice = choose();
        const std::vector<SheetProblem> problems = insert_sheet(mesh_, choice, model_, context_.parallel());
        ++passes_;
        std::vector<Index> blocked;
        for (const SheetProblem& problem : problems) {
            const Index sheet = owner_[problem.vertex];
            assert(sheet != kNoIndex);
            if (state_[sheet] == State::chosen) {
                ++attempts_[sheet];
                const bool give_up = kind_ == SheetKind::group || attempts_[sheet] > kMostAttempts;
                state_[sheet] = give_up ? State::failed : State::waiting;
                failed_.push_back({sheets_[sheet], problem, regions_at(problem.vertex), give_up});
            }
            if (state_[sheet] == State::waiting) blocked.push_back(problem.vertex);
        }
        if (!blocked.empty()) exclude_at(blocked);
        for (State& state : state_)
            if (state == State::chosen) state = problems.empty() ? State::inserted : State::waiting;
    }

    /// Leaves out the cells at vertices (rising): sheets go round them when they are tried again.
    void exclude_at(std::span<const Index> vertices) {
        excluded_.resize(mesh_.surface.size(), 0);
        for (Index q = 0; q < mesh_.surface.size(); ++q) {
            const Cell& cell = mesh_.cells[mesh_.surface[q].face.cell];
            if (std::any_of(cell.begin(), cell.end(),
                            [&](Index v) { return std::binary_search(vertices.begin(), vertices.end(), v); }))
                excluded_[q] = 1;
        }
    }

    /// The first waiting sheets none of which touches an earlier one.
    SheetChoice choose() {
        std::vector<std::vector<Index>> quads(sheets_.size());
        for (Index q = 0; q < mesh_.surface.size(); ++q) {
            const Index sheet = sheet_of_region_[mesh_.surface[q].region];
            const bool open = q >= excluded_.size() || !excluded_[q];
            if (sheet != kNoIndex && open && state_[sheet] == State::waiting) quads[sheet].push_back(q);
        }
        std::vector<std::vector<Index>> between(sheets_.size());
        if (kind_ != SheetKind::group) find_cells_between(quads, between);
        owner_.assign(mesh_.positions.size(), kNoIndex);
        SheetChoice choice;
        choice.all_cells = kind_ == SheetKind::group;
        for (Index s = 0; s < sheets_.size(); ++s) {
            if (state_[s] != State::waiting || !claim(s, quads[s], between[s])) continue;
            state_[s] = State::chosen;
            if (kind_ != SheetKind::collar)
                choice.quads.insert(choice.quads.end(), quads[s].begin(), quads[s].end());
            for (Index q : quads[s]) choice.cells.push_back(mesh_.surface[q].face.cell);
            choice.cells.insert(choice.cells.end(), between[s].begin(), between[s].end());
        }
        std::sort(choice.quads.begin(), choice.quads.end());
        std::sort(choice.cells.begin(), choice.cells.end());
        choice.cells.erase(std::unique(choice.cells.begin(), choice.cells.end()), choice.cells.end());
        if (choice.all_cells) choice.cells.clear();
        return choice;
    }

    /// Cells without a quad on the surface that have an edge between two quads of one sheet (where an earlier
    /// pillow ends): they go with the sheet's cells, as it would leave them behind between two faces that lie
    /// in the surface.
    void find_cells_between(const std::vector<std::vector<Index>>& quads,
                            std::vector<std::vector<Index>>& between) const {
        struct Owned {
            EdgeKey edge;
            Index sheet;
            auto operator<=>(const Owned&) const = default;
        };
        std::vector<Owned> sides;
        std::vector<std::uint8_t> near(mesh_.positions.size(), 0), has_quad(mesh_.cells.size(), 0);
        for (const SurfaceQuad& quad : mesh_.surface) has_quad[quad.face.cell] = 1;
        for (Index s = 0; s < quads.size(); ++s)
            for (Index q : quads[s]) {
                const Quad quad = mesh_.vertices_of(mesh_.surface[q].face);
                for (int k = 0; k < 4; ++k)
                    sides.push_back({edge_key(quad[k], quad[(k + 1) % 4]), s}), near[quad[k]] = 1;
            }
        std::sort(sides.begin(), sides.end());
        for (Index c = 0; c < mesh_.cells.size(); ++c) {
            const Cell& cell = mesh_.cells[c];
            if (has_quad[c] || std::count_if(cell.begin(), cell.end(), [&](Index v) { return near[v]; }) < 2)
                continue;
            for (const auto& edge : hex::kEdgeVertex) {
                const EdgeKey key = edge_key(cell[edge[0]], cell[edge[1]]);
                const auto at = std::lower_bound(sides.begin(), sides.end(), Owned{key, 0});
                if (at == sides.end() || at + 1 == sides.end() || at->edge != key || *(at + 1) != *at)
                    continue;
                between[at->sheet].push_back(c);
                break;
            }
        }
    }

    /// Marks the vertices that a sheet may double; false if some are another's. Pillows keep their order: one
    /// that has to wait keeps those after it away from its vertices too.
    bool claim(Index sheet, std::span<const Index> quads, std::span<const Index> between) {
        std::vector<Index> vertices;
        for (Index q : quads) {
            const CellFace face = mesh_.surface[q].face;
            if (kind_ == SheetKind::group)
                for (Index v : mesh_.vertices_of(face)) vertices.push_back(v);
            else
                vertices.insert(vertices.end(), mesh_.cells[face.cell].begin(), mesh_.cells[face.cell].end());
        }
        for (Index c : between) vertices.insert(vertices.end(), mesh_.cells[c].begin(), mesh_.cells[c].end());
        const bool free = std::all_of(vertices.begin(), vertices.end(),
                                      [&](Index v) { return owner_[v] == kNoIndex || owner_[v] == sheet; });
        if (free || kind_ == SheetKind::pillow)
            for (Index v : vertices)
                if (owner_[v] == kNoIndex) owner_[v] = sheet;
        return free;
    }

    std::vector<Index> regions_at(Index vertex) const {
        std::vector<Index> regions;
        for (const SurfaceQuad& quad : mesh_.surface)
            for (Index v : mesh_.vertices_of(quad.face))
                if (v == vertex) regions.push_back(quad.region);
        std::sort(regions.begin(), regions.end());
        regions.erase(std::unique(regions.begin(), regions.end()), regions.end());
        return regions;
    }

    SheetMesh& mesh_;
    const BoundaryModel& model_;
    SheetKind kind_;
    Context& context_;
    std::vector<RegionSheet> sheets_;
    std::vector<Index> sheet_of_region_;
    std::vector<State> state_;
    std::vector<int> attempts_;
    std::vector<std::uint8_t> excluded_; ///< per surface quad: where sheets do not go
    std::vector<Index> owner_;           ///< per vertex: sheet that claimed it first
    std::vector<FailedSheet> failed_;
    std::size_t passes_ = 0;
};

class BufferRun {
  public:
    BufferRun(SheetMesh mesh, const Domain& domain, const BufferOptions& options, Context& context)
        : mesh_(std::move(mesh)), domain_(domain), options_(options), context_(context),
          regions_(find_regions(mesh_)), patches_(find_patches()) {}

    void run() {
        report_.before = count_for_buffers(mesh_, domain_);
        insert_groups();
        context_.report(kStage, 0.4);
        cut_regions();
        if (options_.method == BufferMethod::groups) insert_pillows();
        context_.report(kStage, 0.7);
        insert_collars();
        relax_layers(mesh_, report_.before.vertices, options_.relax_sweeps, kRelaxRings, domain_.model,
                     context_.parallel());
        report_.after = count_for_buffers(mesh_, domain_);
        context_.report(kStage, 1);
    }

    SheetMesh& mesh() { return mesh_; }
    BufferReport& report() { return report_; }

  private:
    /// Patches of each region, rising.
    std::vector<std::vector<Index>> find_patches() const {
        std::vector<std::vector<Index>> patches(regions_.count);
        for (const SurfaceQuad& quad : mesh_.surface)
            if (quad.patch != kNoIndex) patches[quad.region].push_back(quad.patch);
        for (std::vector<Index>& list : patches) {
            std::sort(list.begin(), list.end());
            list.erase(std::unique(list.begin(), list.end()), list.end());
        }
        return patches;
    }

    /// Regions for sheets that may leave through smooth surface; each stays in its group.
    void cut_regions() {
        std::vector<Index> whole;
        for (const SurfaceQuad& quad : mesh_.surface) whole.push_back(quad.region);
        cut_at_loose_ridges(mesh_, regions_, options_.band_quads);
        std::vector<Index> group(regions_.count, kNoIndex);
        for (Index q = 0; q < mesh_.surface.size(); ++q) group[mesh_.surface[q].region] = group_[whole[q]];
        group_ = std::move(group);
        patches_ = find_patches();
    }

    std::vector<RegionSheet> sheets_of(const std::vector<Index>& number) const {
        std::vector<RegionSheet> sheets;
        for (Index region = 0; region < number.size(); ++region) {
            if (number[region] == kNoIndex) continue;
            if (number[region] >= sheets.size()) sheets.resize(number[region] + 1);
            sheets[number[region]].regions.push_back(region);
        }
        return sheets;
    }

    /// Buffer 1. Groups that cannot be covered one by one are joined, and all is done again.
    void insert_groups() {
        RegionGroups groups = group_for_split(mesh_, regions_, domain_, options_.join_deg);
        if (options_.method == BufferMethod::thesis)
            for (Index region = 1; region < regions_.count; ++region) groups.join(0, region);
        const SheetMesh start = mesh_;
        for (;;) {
            group_ = groups.numbers();
            if (context_.is_cancelled()) return;
            is_spared_ = find_good_groups(mesh_, group_, domain_, options_, context_.parallel());
            report_.spared = static_cast<std::size_t>(std::count(is_spared_.begin(), is_spared_.end(), 1));
            report_.spared_quads = static_cast<std::size_t>(
                std::count_if(mesh_.surface.begin(), mesh_.surface.end(),
                              [&](const SurfaceQuad& quad) { return is_spared_[group_[quad.region]] != 0; }));
            std::vector<RegionSheet> sheets = sheets_of(group_);
            std::erase_if(
                sheets, [&](const RegionSheet& sheet) { return is_spared_[group_[sheet.regions[0]]] != 0; });
            SheetSeries series(mesh_, domain_.model, SheetKind::group, context_);
            const std::vector<FailedSheet> failed = series.insert(std::move(sheets), regions_.count);
            bool joined = false;
            for (const FailedSheet& sheet : failed)
                for (Index region : sheet.regions_there)
                    if (groups.join(sheet.sheet.regions[0], region)) joined = true, ++report_.joined_groups;
            report_.passes += series.passes();
            if (!joined) {
                report_.groups = series.inserted();
                return note_skipped(SheetKind::group, failed);
            }
            mesh_ = start;
        }
    }

    /// Leaves of the regions what is near these quads.
    void narrow(const std::vector<Index>& seeds) {
        narrow_regions(mesh_, regions_, seeds, options_.reach_quads);
        const std::vector<Index> half = group_;
        group_.insert(group_.end(), half.begin(), half.end());
        patches_ = find_patches();
    }

    void insert_series(SheetKind kind, std::vector<RegionSheet> sheets, std::size_t& count) {
        SheetSeries series(mesh_, domain_.model, kind, context_);
        const std::vector<FailedSheet> failed = series.insert(std::move(sheets), regions_.count);
        report_.passes += series.passes();
        count = series.inserted();
        note_skipped(kind, failed);
    }

    /// Buffer 1b: regions beside sharp concave ridges, joined where they meet at another ridge that buffer 1
    /// does not split (at one that it splits a set would close off what it leaves beside a third region's
    /// sharp ridge); sets of several regions first.
    void insert_pillows() {
        narrow(find_quads_at_ridges(mesh_, domain_, options_.pillow_deg));
        std::vector<std::uint8_t> beside(regions_.count, 0);
        const auto is_sharp = [&](const SurfaceRegions::Border& border) {
            return domain_.angle[border.curve].largest >= options_.pillow_deg;
        };
        for (const SurfaceRegions::Border& border : regions_.borders)
            for (Index region : {border.a, border.b})
                if (is_sharp(border) && region < regions_.count / 2 && !is_spared_[group_[region]])
                    beside[region] = 1;
        RegionGroups groups(regions_.count);
        for (const SurfaceRegions::Border& border : regions_.borders) {
            if (is_sharp(border) || !beside[border.a] || !beside[border.b] ||
                group_[border.a] != group_[border.b])
                continue;
            const Index a = groups.find(border.a), b = groups.find(border.b);
            const bool opposed = std::any_of(
                regions_.borders.begin(), regions_.borders.end(), [&](const SurfaceRegions::Border& other) {
                    const Index c = groups.find(other.a), d = groups.find(other.b);
                    return is_sharp(other) && ((c == a && d == b) || (c == b && d == a));
                });
            if (!opposed) groups.join(a, b);
        }
        part_pinched(mesh_, groups);
        std::vector<Index> number(regions_.count, kNoIndex), of_group(regions_.count, kNoIndex);
        Index next = 0;
        for (Index region = 0; region < regions_.count; ++region) {
            if (!beside[region]) continue;
            Index& group = of_group[groups.find(region)];
            if (group == kNoIndex) group = next++;
            number[region] = group;
        }
        std::vector<RegionSheet> sheets = sheets_of(number);
        std::stable_sort(sheets.begin(), sheets.end(), [](const RegionSheet& a, const RegionSheet& b) {
            return a.regions.size() > b.regions.size();
        });
        insert_series(SheetKind::pillow, std::move(sheets), report_.pillows);
        widen_regions(mesh_, regions_);
        group_.resize(regions_.count);
    }

    /// Buffer 2.
    void insert_collars() {
        if (!options_.collars) return;
        const bool everywhere = options_.method == BufferMethod::thesis;
        std::vector<Index> needed = find_flat_quads(mesh_);
        const auto append = [&](const std::vector<Index>& quads) {
            needed.insert(needed.end(), quads.begin(), quads.end());
        };
        append(find_two_face_quads(mesh_));
        append(find_sharp_corner_quads(mesh_, domain_, options_.corner_deg, options_.join_deg));
        if (!everywhere) narrow(needed);
        std::vector<std::uint8_t> wanted(regions_.count, everywhere ? 1 : 0);
        for (Index q : needed) wanted[mesh_.surface[q].region] = 1;
        std::vector<RegionSheet> sheets;
        for (Index region = 0; region < regions_.count; ++region)
            if (wanted[region]) sheets.push_back({{region}});
        insert_series(SheetKind::collar, std::move(sheets), report_.collars);
    }

    void note_skipped(SheetKind kind, const std::vector<FailedSheet>& failed) {
        for (const FailedSheet& sheet : failed) {
            SkippedSheet skipped{kind,
                                 {},
                                 sheet.problem.fault,
                                 sheet.problem.vertex,
                                 mesh_.positions[sheet.problem.vertex],
                                 sheet.whole};
            for (Index region : sheet.sheet.regions)
                skipped.patches.insert(skipped.patches.end(), patches_[region].begin(),
                                       patches_[region].end());
            std::sort(skipped.patches.begin(), skipped.patches.end());
            skipped.patches.erase(std::unique(skipped.patches.begin(), skipped.patches.end()),
                                  skipped.patches.end());
            report_.skipped.push_back(std::move(skipped));
        }
    }

    SheetMesh mesh_;
    const Domain& domain_;
    const BufferOptions& options_;
    Context& context_;
    SurfaceRegions regions_;
    std::vector<std::vector<Index>> patches_; ///< per region, rising
    std::vector<Index> group_;                ///< per region: sheet of buffer 1 that covers it
    std::vector<std::uint8_t> is_spared_;     ///< per group: it has no layers
    BufferReport report_;
};

} // namespace

const char* name_of(SheetKind kind) {
    switch (kind) {
    case SheetKind::group:
        return "group";
    case SheetKind::pillow:
        return "pillow";
    case SheetKind::collar:
        return "collar";
    }
    return "";
}

namespace {

Result<SheetMesh> open_checked(FittedMesh fitted, const Domain& domain, const BufferOptions& options,
                               Context& context) {
    if (Status ok = check_options(options); !ok) return ok.error();
    if (Status ok = check_entities(fitted, domain); !ok) return ok.error();
    return open_sheet_mesh(std::move(fitted), context.parallel());
}

} // namespace

Result<BufferOutput> insert_buffers(FittedMesh fitted, const Domain& domain, const BufferOptions& options,
                                    Context& context) {
    SheetMeshOrigin origin = origin_of(fitted.mesh);
    Result<SheetMesh> opened = open_checked(std::move(fitted), domain, options, context);
    if (!opened) return opened.error();
    BufferRun run(std::move(opened).value(), domain, options, context);
    run.run();
    if (context.is_cancelled()) return make_error(ErrorCode::cancelled, kStage, "", "cancelled");
    Result<FittedMesh> closed =
        close_sheet_mesh(std::move(run.mesh()), std::move(origin), domain.model, context.parallel());
    if (!closed) return closed.error();
    return BufferOutput{std::move(closed).value(), std::move(run.report())};
}

} // namespace hexopt
