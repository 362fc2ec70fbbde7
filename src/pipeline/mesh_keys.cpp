#include "pipeline/mesh_keys.hpp"

#include "pipeline/size_texts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <type_traits>

namespace hexopt {

namespace {

using Kind = MeshKey::Kind;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Range {
    double low, high;
};

std::string out_of(Range range) {
    return range.high == kInfinity ? fmt::format("must be at least {}", range.low)
                                   : fmt::format("must lie in {}..{}", range.low, range.high);
}

/// Accessors are generic lambdas from a job, const or not, to the field.
template <class Access>
MeshKey number(const char* name, const char* flag, const char* help, Range range, Access access) {
    using T = std::remove_cvref_t<decltype(access(std::declval<MeshJob&>()))>;
    constexpr bool is_whole = std::is_integral_v<T>;
    return {name,
            flag,
            help,
            is_whole ? Kind::whole : Kind::number,
            is_whole ? "N" : "X",
            [access](const MeshJob& job) { return ConfigValue(static_cast<double>(access(job))); },
            [access, range](MeshJob& job, const ConfigValue& value) -> std::string {
                const double x = std::get<double>(value);
                if (!(x >= range.low && x <= range.high)) return out_of(range);
                access(job) = static_cast<T>(x);
                return {};
            }};
}

template <class Access>
MeshKey yes_no(const char* name, const char* flag, const char* help, Access access) {
    return {name,
            flag,
            help,
            Kind::yes_no,
            "yes|no",
            [access](const MeshJob& job) { return ConfigValue(bool(access(job))); },
            [access](MeshJob& job, const ConfigValue& value) -> std::string {
                access(job) = std::get<bool>(value);
                return {};
            }};
}

template <class T>
using Words = std::vector<std::pair<const char*, T>>;

template <class T, class Access>
MeshKey choice(const char* name, const char* flag, const char* help, Words<T> words, Access access) {
    std::string type;
    for (const auto& [word, value] : words) {
        if (!type.empty()) type += '|';
        type += word;
    }
    return {name,
            flag,
            help,
            Kind::word,
            type,
            [access, words](const MeshJob& job) {
                for (const auto& [word, value] : words)
                    if (value == access(job)) return ConfigValue(std::string(word));
                return ConfigValue(std::string());
            },
            [access, words, type](MeshJob& job, const ConfigValue& text) -> std::string {
                for (const auto& [word, value] : words)
                    if (std::get<std::string>(text) == word) return access(job) = value, std::string();
                return "must be one of " + type;
            }};
}

template <class Access>
MeshKey box(const char* name, const char* flag, const char* help, Access access) {
    return {name,
            flag,
            help,
            Kind::numbers,
            "X,Y,Z,X,Y,Z",
            [access](const MeshJob& job) {
                std::vector<double> list;
                if (const std::optional<Box>& box = access(job))
                    for (const Point& p : {box->low, box->high}) list.insert(list.end(), {p.x, p.y, p.z});
                return ConfigValue(list);
            },
            [access](MeshJob& job, const ConfigValue& value) -> std::string {
                const auto& x = std::get<std::vector<double>>(value);
                if (x.empty()) return access(job).reset(), std::string();
                if (x.size() != 6 || !(x[0] < x[3] && x[1] < x[4] && x[2] < x[5]))
                    return "must be six numbers, first the lowest and then the highest corner";
                access(job) = Box{Point(x[0], x[1], x[2]), Point(x[3], x[4], x[5])};
                return {};
            }};
}

MeshKey farfield_key() {
    MeshKey key = box(
        "farfield.box", "--farfield",
        "External flow: mesh between the surface and this box, model units, in the plane 4 numbers; "
        "none: the surface encloses what is meshed",
        [](auto& job) -> auto& { return job.options.farfield; });
    key.type = "X,Y,Z,X,Y,Z|X,Y,X,Y";
    key.get = [whole = key.get](const MeshJob& job) {
        const std::optional<Box>& box = job.options.farfield;
        if (!box || std::isfinite(box->low.z)) return whole(job);
        return ConfigValue(std::vector<double>{box->low.x, box->low.y, box->high.x, box->high.y});
    };
    key.set = [whole = key.set](MeshJob& job, const ConfigValue& value) -> std::string {
        const auto& x = std::get<std::vector<double>>(value);
        if (x.size() == 4)
            return whole(job, std::vector<double>{x[0], x[1], -kInfinity, x[2], x[3], kInfinity});
        return whole(job, value);
    };
    return key;
}

MeshKey seeds_key() {
    return {
        "trim.seeds",
        "--seeds",
        "Points in what is to be meshed, one after the other; closed surfaces that do not bound it are left "
        "out; none: inside and outside are found by themselves",
        Kind::numbers,
        "X,Y,Z,...",
        [](const MeshJob& job) {
            std::vector<double> list;
            for (const Point& p : job.options.trim.seeds) list.insert(list.end(), {p.x, p.y, p.z});
            return ConfigValue(list);
        },
        [](MeshJob& job, const ConfigValue& value) -> std::string {
            const auto& x = std::get<std::vector<double>>(value);
            if (x.size() % 3 != 0) return "must be three numbers a point";
            job.options.trim.seeds.clear();
            for (std::size_t i = 0; i < x.size(); i += 3)
                job.options.trim.seeds.emplace_back(x[i], x[i + 1], x[i + 2]);
            return {};
        }};
}

MeshKey initial_cells_key() {
    return {"refine.initial_cells",
            "--initial-cells",
            "Cells of the initial mesh along each axis; none: from the cells' size",
            Kind::numbers,
            "N,M,K",
            [](const MeshJob& job) {
                const auto& n = job.options.refine.initial.cells;
                return ConfigValue(n[0] == 0 ? std::vector<double>()
                                             : std::vector<double>(n.begin(), n.end()));
            },
            [](MeshJob& job, const ConfigValue& value) -> std::string {
                const auto& x = std::get<std::vector<double>>(value);
                if (x.empty()) return job.options.refine.initial.cells = {0, 0, 0}, std::string();
                for (double n : x)
                    if (n != std::floor(n) || n < 1 || n > 10000) return "must be whole numbers in 1..10000";
                if (x.size() != 3) return "must be three numbers";
                for (std::size_t k = 0; k < 3; ++k)
                    job.options.refine.initial.cells[k] = static_cast<Index>(x[k]);
                return {};
            }};
}

MeshKey initial_mesh_key() {
    return {"refine.initial_mesh",
            "--initial-mesh",
            "File of hexahedra that enclose the surface, to start from; none: a box of cells",
            Kind::word,
            "FILE",
            [](const MeshJob& job) { return ConfigValue(job.initial_mesh.string()); },
            [](MeshJob& job, const ConfigValue& value) -> std::string {
                job.initial_mesh = std::get<std::string>(value);
                return {};
            }};
}

MeshKey feature_files_key() {
    return {
        "features.lines",
        "--features",
        "File of feature lines (.eMesh, .obj, .vtk, .vtp or .csv), beside those by angle; --feature-angle "
        "180: instead",
        Kind::texts,
        "FILE",
        [](const MeshJob& job) {
            std::vector<std::string> files;
            for (const auto& file : job.feature_files) files.push_back(file.string());
            return ConfigValue(files);
        },
        [](MeshJob& job, const ConfigValue& value) -> std::string {
            const auto& files = std::get<std::vector<std::string>>(value);
            job.feature_files.assign(files.begin(), files.end());
            return {};
        }};
}

MeshKey surface_size_key() {
    return {"refine.size",
            "--size",
            "Longest edge of cells at the surface, model units; 0: from the number of cells",
            Kind::number,
            "X",
            [](const MeshJob& job) { return ConfigValue(job.options.refine.surface.size); },
            [](MeshJob& job, const ConfigValue& value) -> std::string {
                const double x = std::get<double>(value);
                if (!(x >= 0)) return "must be at least 0";
                if (x > 0) job.options.refine.surface = {x, -1};
                return {};
            }};
}

MeshKey surface_level_key() {
    return {
        "refine.level",
        "--level",
        "Halvings of the initial mesh at the surface, instead of a size; -1: not given",
        Kind::whole,
        "N",
        [](const MeshJob& job) { return ConfigValue(static_cast<double>(job.options.refine.surface.level)); },
        [](MeshJob& job, const ConfigValue& value) -> std::string {
            const double x = std::get<double>(value);
            if (!(x >= -1 && x <= 30)) return out_of({-1, 30});
            if (x >= 0) job.options.refine.surface = {0, static_cast<int>(x)};
            return {};
        }};
}

MeshKey regions_key() {
    return {"refine.regions",
            "--region",
            "Sizes in regions: 'box X,Y,Z,X,Y,Z', 'sphere X,Y,Z,R', 'cylinder X,Y,Z,X,Y,Z,R', 'patch NAME', "
            "'inside FILE' of a closed surface or 'near FILE' of any, then "
            "'size=X', 'size=X,Y,Z' along the axes or 'level=N', and 'within=X' for a distance round it, "
            "model units",
            Kind::texts,
            "TEXT",
            [](const MeshJob& job) {
                std::vector<std::string> texts;
                for (const RegionTarget& region : job.options.refine.regions)
                    texts.push_back(to_text(region));
                return ConfigValue(texts);
            },
            [](MeshJob& job, const ConfigValue& value) -> std::string {
                std::vector<RegionTarget> regions;
                for (const std::string& text : std::get<std::vector<std::string>>(value))
                    if (const std::string wrong = parse_region(text, regions.emplace_back()); !wrong.empty())
                        return fmt::format("'{}': {}", text, wrong);
                job.options.refine.regions = std::move(regions);
                return {};
            }};
}

MeshKey curves_key() {
    return {"refine.curves",
            "--curve",
            "Sizes along features between two patches: 'NAME NAME size=X' or 'level=N'; * is any patch",
            Kind::texts,
            "TEXT",
            [](const MeshJob& job) {
                std::vector<std::string> texts;
                for (const CurveTarget& curve : job.options.refine.curves) texts.push_back(to_text(curve));
                return ConfigValue(texts);
            },
            [](MeshJob& job, const ConfigValue& value) -> std::string {
                std::vector<CurveTarget> curves;
                for (const std::string& text : std::get<std::vector<std::string>>(value))
                    if (const std::string wrong = parse_curve(text, curves.emplace_back()); !wrong.empty())
                        return fmt::format("'{}': {}", text, wrong);
                job.options.refine.curves = std::move(curves);
                return {};
            }};
}

MeshKey min_sj_key() {
    return {"optimize.min_sj",
            "--min-sj",
            "Stop at this minimum scaled Jacobian, -1..1; exit code 9 where it is not reached",
            Kind::number,
            "X",
            [](const MeshJob& job) {
                const auto& target = job.options.target_min_sj;
                return target ? ConfigValue(*target) : ConfigValue(std::string());
            },
            [](MeshJob& job, const ConfigValue& value) -> std::string {
                const double x = std::get<double>(value);
                if (!(x >= -1 && x <= 1)) return out_of({-1, 1});
                job.options.target_min_sj = job.options.optimize.min_sj = x;
                return {};
            }};
}

MeshKey time_key() {
    return {"optimize.time",
            "--time",
            "Seconds after which optimizing ends; none: no limit",
            Kind::number,
            "X",
            [](const MeshJob& job) {
                const double limit = job.options.optimize.time_limit_s;
                return std::isfinite(limit) ? ConfigValue(limit) : ConfigValue(std::string());
            },
            [](MeshJob& job, const ConfigValue& value) -> std::string {
                if (!(std::get<double>(value) > 0)) return "must be above 0";
                job.options.optimize.time_limit_s = std::get<double>(value);
                return {};
            }};
}

MeshKey device_key() {
    return {"optimize.device",
            "--device",
            "Where the mesh is optimized on the surface: cpu (the host's vectorised code), auto (a GPU, else "
            "cpu), "
            "vulkan, or index or part of the name of one that hexopt-gpu devices lists",
            Kind::word,
            "DEVICE",
            [](const MeshJob& job) { return ConfigValue(job.options.compute.device); },
            [](MeshJob& job, const ConfigValue& value) -> std::string {
                if (std::get<std::string>(value).empty()) return "must name a device";
                job.options.compute.device = std::get<std::string>(value);
                return {};
            }};
}

#define HEXOPT_FIELD(field)                                                                                  \
    [](auto& job) -> auto& { return job.field; }

std::vector<MeshKey> surface_keys() {
    return {
        number("surface.weld", "--weld", "Gaps to close in the surface, as a fraction of its diagonal",
               {0, 0.01}, HEXOPT_FIELD(options.weld_rel)),
        number("surface.cad_deflection", "--cad-deflection",
               "CAD files: how far triangles may be from the exact surface, as a fraction of its diagonal",
               {1e-7, 0.1}, HEXOPT_FIELD(tessellation.deflection_rel)),
        number("surface.cad_angle", "--cad-angle",
               "CAD files: degrees that the surface may turn along a triangle", {1, 90},
               HEXOPT_FIELD(tessellation.angle_deg)),
        yes_no("surface.cad_borders", "--cad-borders",
               "CAD files: borders between faces that the file does not name are features, smooth ones too",
               HEXOPT_FIELD(tessellation.unnamed_borders)),
        number("features.angle", "--feature-angle", "Edges sharper than this many degrees are features",
               {0, 180}, HEXOPT_FIELD(options.features.feature_angle_deg)),
        number("features.corner_turn", "--corner-turn",
               "Where a feature turns by more than this many degrees there is a corner", {0, 180},
               HEXOPT_FIELD(options.features.corner_turn_deg)),
        yes_no("features.patch_borders", "--patch-borders", "Borders between named patches are features",
               HEXOPT_FIELD(options.features.patch_borders)),
        yes_no("features.weak", "--weak-features",
               "Long creases below the feature angle, and borders of CAD faces along bends narrower than "
               "cells, are features where cells across them would leave the surface",
               HEXOPT_FIELD(options.weak_features)),
        number("features.noise_angle", "--noise-angle",
               "Features blunter than this many degrees are given up where cells fail at them; 0: none",
               {0, 180}, HEXOPT_FIELD(options.noise_angle_deg)),
        number("features.narrow", "--narrow-features",
               "Of features that meet at next to no angle the blunter one is given up where they are nearer "
               "than this many cells, both where they bound a ledge of half of that; 0: none",
               {0, 1}, HEXOPT_FIELD(options.narrow_cells)),
        feature_files_key(),
        number("features.reach", "--features-reach",
               "How far lines of --features may be from the surface, as a fraction of its diagonal",
               {0, 0.01}, HEXOPT_FIELD(options.feature_reach_rel)),
        farfield_key(),
        choice("planar.mesh", "--planar",
               "Mesh in the plane, one cell thick: thin slabs (outlines always), any slab, or none",
               Words<PlanarChoice>{{"automatic", PlanarChoice::automatic},
                                   {"yes", PlanarChoice::yes},
                                   {"no", PlanarChoice::no}},
               HEXOPT_FIELD(options.planar)),
        number("planar.thickness", "--thickness",
               "Of the mesh of outlines (.dat), model units; 0: a hundredth of their diagonal",
               {0, kInfinity}, HEXOPT_FIELD(options.thickness)),
    };
}

std::vector<MeshKey> refine_keys() {
    return {
        surface_size_key(),
        surface_level_key(),
        number("refine.cells", "--cells",
               "About how many cells the mesh shall have where no size is given; 0: 100000, planar 20000",
               {0, 1e9}, HEXOPT_FIELD(options.refine.target_cells)),
        number("refine.max_cells", "--max-cells", "Refinement ends before it would have more cells", {8, 2e9},
               HEXOPT_FIELD(options.refine.max_cells)),
        number("refine.outer_levels", "--outer-levels",
               "Levels by which cells on the sides of a box round a body may be larger", {0, 20},
               HEXOPT_FIELD(options.refine.outer_levels)),
        number("refine.normal_angle", "--normal-angle",
               "Cells are split while the surface in them turns by more degrees; 180: never", {1, 180},
               HEXOPT_FIELD(options.refine.normal_angle_deg)),
        number("refine.chord_error", "--chord-error",
               "The same while the chord leaves the surface by more, as a fraction of the diagonal; 0: never",
               {0, 1}, HEXOPT_FIELD(options.refine.chord_error_rel)),
        number("refine.curvature_levels", "--curvature-levels",
               "Levels that splitting for these two may add; one more where the chord is twice as far off, "
               "unless with "
               "--cells that would take most of them",
               {0, 20}, HEXOPT_FIELD(options.refine.curvature_levels)),
        number("refine.gap_cells", "--gap-cells", "Least number of cells across gaps; 0: any", {0, 100},
               HEXOPT_FIELD(options.refine.gap_cells)),
        number("refine.wall_cells", "--wall-cells",
               "Least number of cells across walls that are not meshed themselves; 0: any", {0, 100},
               HEXOPT_FIELD(options.refine.wall_cells)),
        number("refine.feature_cells", "--feature-cells",
               "Least number of cells along a feature, between features and across a patch; 0: any", {0, 100},
               HEXOPT_FIELD(options.refine.feature_cells)),
        number("refine.gap_levels", "--gap-levels",
               "Levels that splitting for gaps, walls and features may add; with 20,000 cells or more wanted "
               "up to 4 "
               "others where the surface would be left bare (0: none)",
               {0, 20}, HEXOPT_FIELD(options.refine.gap_levels)),
        number("refine.max_level", "--max-level", "Most halvings of the initial mesh; 0: no limit", {0, 30},
               HEXOPT_FIELD(options.refine.max_level)),
        number("refine.rings", "--rings", "Cells of one level between the next finer and the next coarser",
               {1, 20}, HEXOPT_FIELD(options.refine.rings)),
        number("refine.surface_rings", "--surface-rings",
               "Cells on the surface that are split along with one that is split", {0, 20},
               HEXOPT_FIELD(options.refine.surface_rings)),
        number("refine.surface_layers", "--surface-layers",
               "Cells round those on the surface that are no larger", {0, 20},
               HEXOPT_FIELD(options.refine.surface_layers)),
        number("refine.base_size", "--base-size", "Edge of the initial mesh's cells, model units; 0: chosen",
               {0, kInfinity}, HEXOPT_FIELD(options.refine.initial.base_size)),
        initial_cells_key(),
        box("refine.box", "--box", "Box of the initial mesh, model units; none: round the surface",
            HEXOPT_FIELD(options.refine.initial.box)),
        initial_mesh_key(),
        regions_key(),
        curves_key(),
    };
}

std::vector<MeshKey> stage_keys() {
    return {
        choice("trim.rule", "--trim-rule",
               "Cells that are kept: by their centre, or only those not cut at all",
               Words<TrimRule>{{"centre", TrimRule::centre}, {"strict", TrimRule::strict}},
               HEXOPT_FIELD(options.trim.rule)),
        number("trim.depth", "--trim-depth", "How far inside a kept cell's centre is, in cell sizes",
               {0, 0.5}, HEXOPT_FIELD(options.trim.depth_h)),
        number(
            "trim.thinnest_wall", "--thinnest-wall",
            "Thickness in cell sizes down to which walls that the cells' centres would miss get a layer of "
            "cells (not with --cells below 20000, seeds or the rule strict); 0: none",
            {0, 1}, HEXOPT_FIELD(options.trim.thinnest_wall_h)),
        seeds_key(),
        number("trim.part_fraction", "--part-fraction",
               "Without seeds: separate parts below this fraction of the largest one's volume are dropped",
               {0, 1}, HEXOPT_FIELD(options.trim.part_fraction)),
        number("fit.fairing_steps", "--fairing-steps", "Double steps of Taubin's fairing", {0, 1000},
               HEXOPT_FIELD(options.fit.fairing.taubin_steps)),
        number("fit.projection_steps", "--projection-steps", "Steps towards the surface", {1, 100},
               HEXOPT_FIELD(options.fit.fairing.projection_steps)),
        number("fit.corner_reach", "--corner-reach", "How far corners catch vertices, in edge lengths",
               {0.1, 10}, HEXOPT_FIELD(options.fit.capture.reach)),
        number("fit.curve_reach", "--curve-reach", "How far features catch edges, in edge lengths", {0.1, 10},
               HEXOPT_FIELD(options.fit.capture.path_reach)),
        number("fit.surface_sweeps", "--surface-sweeps", "Sweeps that even out the surface mesh", {0, 1000},
               HEXOPT_FIELD(options.fit.surface_sweeps)),
        number("fit.repairs", "--fit-repairs",
               "How often cells at features that were not captured are refined", {0, 5},
               HEXOPT_FIELD(options.fit_repairs)),
        yes_no("buffer.enabled", "--buffers", "Insert buffer layers under the surface",
               HEXOPT_FIELD(options.buffers)),
        choice("buffer.method", "--buffer-method", "Layers by groups of patches, or as the thesis has them",
               Words<BufferMethod>{{"groups", BufferMethod::groups}, {"thesis", BufferMethod::thesis}},
               HEXOPT_FIELD(options.buffer.method)),
        number("buffer.enough", "--buffer-enough",
               "Patches along which the lattice fits, with cells of at least this scaled Jacobian, get no "
               "layers; 2: all get them",
               {0, 2}, HEXOPT_FIELD(options.buffer.enough_sj)),
        number("buffer.join", "--buffer-join", "Patches that meet at more degrees inside share a layer",
               {0, 360}, HEXOPT_FIELD(options.buffer.join_deg)),
        number("buffer.pillow", "--buffer-pillow", "Ridges of more degrees inside get a pillow; 361: none",
               {0, 361}, HEXOPT_FIELD(options.buffer.pillow_deg)),
        number("buffer.band", "--buffer-band",
               "Width, in quads, of the side of a ridge that ends inside a patch", {1, 100},
               HEXOPT_FIELD(options.buffer.band_quads)),
        number("buffer.relax_sweeps", "--buffer-relax-sweeps", "Laplacian steps that spread the layers",
               {0, 1000}, HEXOPT_FIELD(options.buffer.relax_sweeps)),
        yes_no("buffer.collars", "--buffer-collars", "Collars on patches that still have flat quads",
               HEXOPT_FIELD(options.buffer.collars)),
        number("buffer.corner", "--buffer-corner", "Corners of patches below this many degrees get a collar",
               {0, 180}, HEXOPT_FIELD(options.buffer.corner_deg)),
    };
}

std::vector<MeshKey> result_keys() {
    return {
        number("optimize.repairs", "--repairs",
               "How often the mesh is refined round cells that are not valid, and made anew", {0, 10},
               HEXOPT_FIELD(options.repairs)),
        number("optimize.max_deviation", "--max-deviation-rel",
               "Farthest that vertices may stay off the surface where cells need it, as a fraction of the "
               "diagonal",
               {0, 0.1}, HEXOPT_FIELD(options.optimize.max_deviation_rel)),
        choice("optimize.effort", "--effort", "A bounded time a cell, or all that the optimizer can do",
               Words<Effort>{{"quick", Effort::quick}, {"normal", Effort::normal}},
               HEXOPT_FIELD(options.optimize.effort)),
        yes_no("optimize.max_min", "--max-min", "Raise the worst cells at the end",
               HEXOPT_FIELD(options.optimize.max_min)),
        min_sj_key(),
        time_key(),
        number("optimize.iterations", "--iterations", "Most steps and sweeps", {1, 1000000},
               HEXOPT_FIELD(options.optimize.max_iterations)),
        device_key(),
        choice("optimize.precision", "--precision",
               "Of the optimizer's kernels; what is kept is always decided in f64",
               Words<compute::Precision>{{"f32", compute::Precision::f32},
                                         {"f64", compute::Precision::f64},
                                         {"mixed", compute::Precision::mixed}},
               HEXOPT_FIELD(options.compute.precision)),
        yes_no("optimize.cad_projection", "--cad-projection",
               "CAD files: move the boundary onto the exact faces, edges and vertices at the end, where "
               "cells stay good",
               HEXOPT_FIELD(options.cad_projection)),
        choice("output.encoding", "--encoding", "How formats that have both are written",
               Words<Encoding>{{"automatic", Encoding::automatic},
                               {"binary", Encoding::binary},
                               {"text", Encoding::text}},
               HEXOPT_FIELD(write.encoding)),
        number("output.compression", "--compression", "Of VTU: 1 is fast, 9 is small", {1, 9},
               HEXOPT_FIELD(write.compression_level)),
        yes_no("output.polyhedra", "--polyhedra",
               "VTU with polyhedra beside hanging vertices, for other programs",
               HEXOPT_FIELD(write.polyhedra)),
    };
}

#undef HEXOPT_FIELD

} // namespace

const std::vector<MeshKey>& mesh_keys() {
    static const std::vector<MeshKey> keys = [] {
        std::vector<MeshKey> all;
        for (auto* part : {surface_keys, refine_keys, stage_keys, result_keys})
            for (MeshKey& key : part()) all.push_back(std::move(key));
        return all;
    }();
    return keys;
}

bool is_of_domain(const MeshKey& key) {
    // Which features are weak, noise or too narrow depends on the cells of a mesh.
    for (const char* of_mesh : {"features.weak", "features.noise_angle", "features.narrow"})
        if (key.name == of_mesh) return false;
    const std::string_view section = std::string_view(key.name).substr(0, key.name.find('.'));
    return section == "surface" || section == "features" || section == "farfield";
}

} // namespace hexopt
