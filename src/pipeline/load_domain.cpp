#include "io/domain_file.hpp"
#include "io/read_feature_lines.hpp"
#include "io/read_outline.hpp"
#include "io/read_surface.hpp"
#include "pipeline/mesh_keys.hpp"
#include "pipeline/mesh_pipeline.hpp"
#include "stages/refine/region_surface.hpp"

#include <algorithm>
#include <fmt/format.h>

namespace hexopt {

namespace {

/// A domain file holds what these keys would say.
Status check_settled(const MeshJob& job, const std::string& file) {
    const MeshJob standard;
    for (const MeshKey& key : mesh_keys())
        if (is_of_domain(key) && key.get(job) != key.get(standard))
            return make_error(
                ErrorCode::usage, "domain", file,
                fmt::format("it settles what {} would; give that to hexopt-gpu domain", key.flag));
    return Done{};
}

Result<PreparedDomain> load_domain_file(const MeshJob& job, StageClock& clock, Context& context) {
    const std::filesystem::path& file = job.surfaces.front();
    if (Status ok = check_settled(job, file.string()); !ok) return ok.error();
    const auto description = clock.run("read", [&] { return read_domain_file(file, context); });
    if (!description) return description.error();
    auto domain = clock.run("domain", [&] { return build_domain(*description, context); });
    if (!domain) return domain.error();
    PreparedDomain prepared;
    prepared.domain = std::move(*domain);
    return prepared;
}

} // namespace

Result<PreparedDomain> load_domain(const MeshJob& job, StageClock& clock, Context& context) {
    if (job.surfaces.empty()) return make_error(ErrorCode::usage, "mesh", "", "no surface is given");
    context.report("read", 0);
    const auto domain_file = std::find_if(job.surfaces.begin(), job.surfaces.end(), is_domain_name);
    if (domain_file != job.surfaces.end()) {
        if (job.surfaces.size() > 1)
            return make_error(ErrorCode::usage, "mesh", domain_file->string(),
                              "a domain file is given alone: it holds all that is meshed");
        return load_domain_file(job, clock, context);
    }
    if (const auto outline = std::find_if(job.surfaces.begin(), job.surfaces.end(), is_outline_name);
        outline != job.surfaces.end())
        return make_error(ErrorCode::usage, "domain", outline->string(),
                          "outlines have no domain file; hexopt-gpu mesh takes them as they are");
    auto surface = clock.run("read", [&] { return read_surfaces(job.surfaces, job.tessellation, context); });
    if (!surface) return surface.error();
    return prepare_surface(*surface, job, clock, context);
}

Result<PreparedDomain> prepare_surface(const TriangleSoup& surface, const MeshJob& job, StageClock& clock,
                                       Context& context) {
    MeshOptions options = job.options;
    for (const std::filesystem::path& file : job.feature_files) {
        Result<FeatureLines> lines = read_feature_lines(file, context);
        if (!lines) return lines.error();
        options.feature_lines.push_back(std::move(*lines));
    }
    context.report("surface", 0.2);
    auto prepared = prepare_domain(surface, options, clock, context);
    if (!prepared || !job.options.cad_projection) return prepared;
    for (const std::filesystem::path& path : job.surfaces) {
        const auto digest = digest_of_cad(path, context);
        if (!digest) return digest.error();
        if (*digest) prepared->cad.push_back({path, **digest, job.tessellation});
    }
    return prepared;
}

Status load_region_surfaces(MeshJob& job, StageClock& clock, Context& context) {
    for (RegionTarget& region : job.options.refine.regions) {
        if (region.file.empty() || region.surface) continue;
        auto made = clock.run("read_region", [&]() -> Result<std::shared_ptr<const RegionSurface>> {
            auto soup = read_surface(region.file, job.tessellation, context);
            if (!soup) return soup.error();
            return RegionSurface::create(*soup, context);
        });
        if (!made) {
            Error error = made.error();
            if (error.where.empty()) error.where = region.file;
            return error;
        }
        region.surface = std::move(*made);
    }
    return Done{};
}

Result<PreparedDomain> run_domain_job(const MeshJob& whole, Context& context) {
    StageClock clock;
    MeshJob job = whole;
    // Which weak ones there are depends on the cells of a mesh; a domain file has settled it.
    if (std::none_of(job.surfaces.begin(), job.surfaces.end(), is_domain_name))
        job.options.weak_features = false;
    auto prepared = load_domain(job, clock, context);
    if (!prepared) return prepared;
    const Status written = write_domain_file(job.output, describe_domain(prepared->domain), context);
    if (!written) return written.error();
    return prepared;
}

} // namespace hexopt
