#include "pipeline/mesh_pipeline.hpp"

#include "io/atomic_file.hpp"
#include "io/domain_file.hpp"
#include "io/read_outline.hpp"
#include "io/write_openfoam.hpp"
#include "mesh/recognise_hanging.hpp"
#include "pipeline/check_outputs.hpp"
#include "pipeline/checkpoint.hpp"
#include "pipeline/mesh_pictures.hpp"
#include "pipeline/mesh_progress.hpp"
#include "pipeline/planar_job.hpp"
#include "pipeline/quality_fields.hpp"
#include "render/png.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace hexopt {

namespace {

/// Writes what the job asks for. `context` is one that is not cancelled.
Status write_results(const MeshJob& job, StageClock& clock, MeshJobResult& result, Context& context) {
    const MeshOutcome& outcome = result.outcome;
    WriteOptions writing = job.write;
    // `empty` is for planes along the axes: OpenFOAM leaves out every direction that their normals have a
    // part in.
    if (outcome.planar && !outcome.planar->is_turned) writing.empty_patches = outcome.planar->plane_patches;
    Status written = clock.run("write", [&] {
        std::vector<FieldData> fields;
        add_quality_fields(fields, job.output, outcome.mesh, context.parallel());
        return write_mesh(job.output, outcome.mesh, fields, writing, context);
    });
    if (!written) return written;
    result.written.push_back(job.output);
    if (!job.picture.empty()) {
        const Result<Image> picture =
            clock.run("picture", [&] { return draw_whole_and_cut(outcome.mesh, context); });
        if (!picture) return picture.error();
        if (written = write_png(job.picture, *picture, context); !written) return written;
        result.written.push_back(job.picture);
    }
    result.times = clock.times();
    if (!job.report.empty()) {
        const auto keep_odd_bytes = nlohmann::json::error_handler_t::replace;
        written = write_atomically(job.report,
                                   to_json(job, result).dump(2, ' ', false, keep_odd_bytes) + "\n", context);
        if (!written) return written;
        result.written.push_back(job.report);
    }
    if (!job.html.empty()) {
        const Result<std::string> page = make_mesh_page(to_json(job, result), outcome.mesh, context);
        if (!page) return page.error();
        if (written = write_atomically(job.html, *page, context); !written) return written;
        result.written.push_back(job.html);
    }
    return Done{};
}

/// Writes the path beside the output and adds its name to the error.
Error report_leak(const MeshJob& job, const LeakPath& leak, Error error, Context& context) {
    std::filesystem::path file = job.output.has_filename() ? job.output : job.output.parent_path();
    file.replace_extension(".leak.vtu");
    if (write_mesh(file, leak.cells, {}, {}, context))
        error.reasons.push_back("a shortest path of cells through the leak is in " + file.string());
    return error;
}

std::vector<std::filesystem::path> files_read(const MeshJob& job) {
    std::vector<std::filesystem::path> files = job.surfaces;
    files.insert(files.end(), job.feature_files.begin(), job.feature_files.end());
    files.push_back(job.initial_mesh);
    for (const RegionTarget& region : job.options.refine.regions) files.emplace_back(region.file);
    return files;
}

/// None where the job asks for none.
Result<std::optional<Checkpoint>> open_checkpoint(const MeshJob& job, Context& context) {
    if (job.checkpoint.empty()) {
        if (job.resume)
            return make_error(ErrorCode::usage, "checkpoint", "", "--resume needs --checkpoint DIR");
        return std::optional<Checkpoint>();
    }
    auto identity = identify_run(job, context);
    if (!identity) return identity.error();
    auto checkpoint = job.resume ? Checkpoint::resume(job.checkpoint, std::move(*identity), context)
                                 : Checkpoint::start(job.checkpoint, std::move(*identity), context);
    if (!checkpoint) return checkpoint.error();
    return std::optional(std::move(*checkpoint));
}

Result<MeshOutcome> mesh_outlines(const MeshJob& job, StageClock& clock, Context& context,
                                  Checkpoint* checkpoint) {
    if (Status fitting = check_planar_keys(job, true); !fitting) return fitting.error();
    auto slab = clock.run("read", [&] { return read_outline_slab(job, context); });
    if (!slab) return slab.error();
    return mesh_planar(std::move(*slab), job.options, clock, context, checkpoint);
}

/// Formats without constraints leave them to be recognised.
Status name_hanging(HexMesh& mesh, Context& context) {
    if (!mesh.hanging.empty()) return Done{};
    auto recognised = recognise_hanging(mesh, {}, context.parallel());
    if (!recognised) return recognised.error();
    mesh.hanging = std::move(recognised->hanging);
    ++mesh.revision;
    return Done{};
}

Result<MeshOutcome> mesh_prepared(Result<PreparedDomain> prepared, const MeshJob& job, StageClock& clock,
                                  Context& context, Checkpoint* checkpoint) {
    if (!prepared) return prepared.error();
    if (job.options.thickness != 0)
        return make_error(ErrorCode::usage, "planar", "--thickness",
                          "planar.thickness has no effect on meshes in space; leave it out");
    MeshOptions options = job.options;
    if (!job.initial_mesh.empty()) {
        auto initial = clock.run("read_initial", [&] { return read_mesh(job.initial_mesh, context); });
        if (!initial) return initial.error();
        if (Status named = name_hanging(*initial, context); !named) return named.error();
        options.refine.initial.mesh = std::move(*initial);
    }
    LeakPath leak;
    auto outcome = mesh_domain(std::move(*prepared), options, clock, context, &leak, checkpoint);
    if (!outcome && !leak.cells.cells.empty()) return report_leak(job, leak, outcome.error(), context);
    return outcome;
}

void add_slab_notes(MeshOutcome& outcome, const MeshJob& job) {
    const PlanarReport& planar = *outcome.planar;
    if (planar.is_turned && !openfoam_folder(job.output).empty())
        outcome.notes.insert(
            outcome.notes.begin(),
            fmt::format(
                "OpenFOAM knows no `empty` patches in turned planes: {} and {} have the type `patch`.",
                planar.plane_patches[0], planar.plane_patches[1]));
    if (job.options.planar != PlanarChoice::automatic) return;
    std::string across;
    if (const Point& n = planar.normal; planar.is_turned || n.z != 1)
        across = " across " + (planar.is_turned ? describe(n) : std::string(n.x == 1 ? "x" : "y"));
    outcome.notes.insert(outcome.notes.begin(),
                         "The surface is a thin slab" + across +
                             " and was meshed in the plane, one cell thick; --planar no meshes it in space.");
}

/// In space, or in the plane where they are a slab.
Result<MeshOutcome> mesh_surfaces(const MeshJob& job, StageClock& clock, Context& context,
                                  Checkpoint* checkpoint) {
    if (std::any_of(job.surfaces.begin(), job.surfaces.end(), is_domain_name))
        return mesh_prepared(load_domain(job, clock, context), job, clock, context, checkpoint);
    auto surface = clock.run("read", [&] { return read_surfaces(job.surfaces, job.tessellation, context); });
    if (!surface) return surface.error();
    auto slab = find_slab(*surface, job.options, clock, context);
    if (!slab) return slab.error();
    if (*slab) {
        if (Status fitting = check_planar_keys(job, false); !fitting) return fitting.error();
        auto outcome = mesh_planar(std::move(**slab), job.options, clock, context, checkpoint);
        if (outcome) add_slab_notes(*outcome, job);
        return outcome;
    }
    return mesh_prepared(prepare_surface(*surface, job, clock, context), job, clock, context, checkpoint);
}

} // namespace

Result<MeshJobResult> run_mesh_job(const MeshJob& given, Context& context) {
    MeshJob job = given;
    if (auto status =
            check_outputs({job.output, job.picture, job.report, job.html}, job.write, files_read(job));
        !status)
        return status.error();
    if (job.surfaces.empty()) return make_error(ErrorCode::usage, "mesh", "", "no surface is given");
    auto checkpoint = open_checkpoint(job, context);
    if (!checkpoint) return checkpoint.error();
    Checkpoint* kept = *checkpoint ? &**checkpoint : nullptr;
    StageClock clock;
    context.set_progress_range(0, progress::kSurfaceEnd);
    context.report("read", 0);
    if (auto status = load_region_surfaces(job, clock, context); !status) return status.error();
    auto outcome = std::any_of(job.surfaces.begin(), job.surfaces.end(), is_outline_name)
                       ? mesh_outlines(job, clock, context, kept)
                       : mesh_surfaces(job, clock, context, kept);
    if (!outcome) return outcome.error();
    MeshJobResult result;
    result.outcome = std::move(*outcome);
    result.times = clock.times();
    const bool cancelled = result.outcome.verdict == ErrorCode::cancelled;
    if (cancelled && !job.keep_best) return result;
    context.set_progress_range(0, 1);
    context.report("write", 1);
    Context unhurried(context.parallel().threads(), context.seed());
    if (auto status = write_results(job, clock, result, cancelled ? unhurried : context); !status)
        return status.error();
    if (kept && !cancelled) kept->remove();
    return result;
}

} // namespace hexopt
