#include "pipeline/planar_job.hpp"

#include "domain/outline_touching.hpp"
#include "io/read_outline.hpp"
#include "pipeline/mesh_keys.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace hexopt {

namespace {

Error usage(std::string where, std::string reason) {
    return make_error(ErrorCode::usage, "planar", std::move(where), std::move(reason));
}

/// Keys that only a mesh in space uses; those that end in '.' stand for their section.
constexpr std::string_view kOnlyInSpace[] = {
    "features.corner_turn",
    "features.patch_borders",
    "features.lines",
    "features.reach",
    "features.weak",
    "optimize.cad_projection",
    "optimize.repairs",
    "optimize.device",
    "optimize.precision",
    "refine.feature_cells",
    "refine.initial_mesh",
    "refine.curves",
    "trim.rule",
    "trim.depth",
    "trim.thinnest_wall",
    "fit.",
    "buffer.",
    "optimize.max_deviation",
};

bool is_only_in_space(std::string_view name) {
    if (name == "fit.repairs") return false;
    return std::any_of(std::begin(kOnlyInSpace), std::end(kOnlyInSpace), [name](std::string_view key) {
        return key.back() == '.' ? name.starts_with(key) : name == key;
    });
}

} // namespace

Status check_planar_keys(const MeshJob& job, bool has_outlines) {
    const MeshJob standard;
    for (const MeshKey& key : mesh_keys()) {
        const bool is_unused = is_only_in_space(key.name) || (has_outlines ? key.name.starts_with("surface.")
                                                                           : key.name == "planar.thickness");
        if (is_unused && key.get(job) != key.get(standard))
            return usage(key.flag, fmt::format("{} has no effect on {}; leave it out{}", key.name,
                                               has_outlines ? "meshes of outlines" : "meshes of slabs",
                                               has_outlines ? "" : ", or mesh in space with --planar no"));
    }
    return Done{};
}

Result<Slab> read_outline_slab(const MeshJob& job, Context& context) {
    if (job.options.planar == PlanarChoice::no)
        return usage("--planar", "outlines can only be meshed in the plane; leave out --planar no");
    Slab slab;
    for (const std::filesystem::path& path : job.surfaces) {
        if (!is_outline_name(path))
            return usage(path.string(), "outlines (.dat) and surfaces cannot be meshed together");
        Result<Outline> outline = read_outlines(path, context);
        if (!outline) return outline.error();
        const auto first = static_cast<Index>(slab.outline.patch_names.size());
        for (OutlineLoop& loop : outline->loops) {
            for (Index& patch : loop.patch) patch += first;
            slab.outline.loops.push_back(std::move(loop));
        }
        auto& names = slab.outline.patch_names;
        for (std::string& name : outline->patch_names) {
            std::string unique = name;
            for (int n = 2; std::find(names.begin(), names.end(), unique) != names.end(); ++n)
                unique = fmt::format("{}_{}", name, n);
            names.push_back(std::move(unique));
        }
    }
    // Lines in messages, so before a farfield and other stages change the loops.
    if (Status sound = check_touching(slab.outline); !sound) return sound.error();
    const double thickness = job.options.thickness;
    if (!(thickness >= 0) || !std::isfinite(thickness))
        return usage("--thickness", "must be above 0, or 0 for a hundredth of the diagonal");
    slab.high = thickness > 0 ? thickness : 0.01 * body_box(slab.outline).diagonal();
    return slab;
}

} // namespace hexopt
