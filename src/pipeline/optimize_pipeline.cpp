#include "pipeline/optimize_pipeline.hpp"

#include "io/atomic_file.hpp"
#include "io/mesh_io.hpp"
#include "io/read_feature_lines.hpp"
#include "io/read_surface.hpp"
#include "io/write_openfoam.hpp"
#include "pipeline/check_outputs.hpp"
#include "pipeline/optimize_pictures.hpp"
#include "pipeline/quality_fields.hpp"
#include "render/png.hpp"

#include <nlohmann/json.hpp>

namespace hexopt {

namespace {

Status write_picture(const OptimizeJob& job, const HexMesh& mesh, const std::vector<Point>& start,
                     Context& context) {
    const Result<Image> picture = draw_before_and_after(mesh, start, context);
    if (!picture) return picture.error();
    return write_png(job.picture, *picture, context);
}

/// Writes what the job asks for. `context` is one that is not cancelled.
Status write_results(const OptimizeJob& job, MeshFile& file, const std::vector<Point>& start,
                     StageClock& clock, OptimizeJobResult& result, Context& context) {
    Status written = clock.run("write", [&] {
        add_quality_fields(file.fields, job.output, file.mesh, context.parallel());
        return write_mesh(job.output, file.mesh, file.fields, {}, context);
    });
    if (!written) return written;
    result.written.push_back(job.output);
    if (!job.picture.empty()) {
        written = clock.run("picture", [&] { return write_picture(job, file.mesh, start, context); });
        if (!written) return written;
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
        const Result<std::string> page = make_page(to_json(job, result), file.mesh, start, context);
        if (!page) return page.error();
        written = write_atomically(job.html, *page, context);
        if (!written) return written;
        result.written.push_back(job.html);
    }
    return Done{};
}

/// The mesh may be written over the one that is read; nothing else may.
Status check_places(const OptimizeJob& job) {
    std::vector<std::filesystem::path> read = job.feature_files;
    read.push_back(job.surface);
    const Status ok = check_outputs({job.output, job.picture, job.report, job.html}, {}, read);
    if (!ok) return ok;
    for (const auto& path : {job.picture, job.report, job.html})
        if (!path.empty())
            if (Status kept = check_not_read(path, {job.input}); !kept) return kept;
    return Done{};
}

} // namespace

bool flattens(const OptimizeJob& job) {
    if (job.flatten) return *job.flatten;
    const auto format = format_of_name(job.output);
    return format && *format == MeshFormat::openfoam;
}

Result<OptimizeJobResult> run_optimize_job(const OptimizeJob& job, Context& context) {
    if (auto status = check_places(job); !status) return status.error();
    StageClock clock;
    context.report("read", 0);
    auto file = clock.run("read", [&] { return read_mesh_file(job.input, context); });
    if (!file) return file.error();

    ImproveOptions improve = job.improve;
    improve.flatten = flattens(job);
    TriangleSoup soup;
    if (!job.surface.empty()) {
        auto read = clock.run("read_surface", [&] { return read_surface(job.surface, context); });
        if (!read) return read.error();
        soup = std::move(*read);
        improve.surface = &soup;
    }
    for (const std::filesystem::path& path : job.feature_files) {
        auto lines = clock.run("read_features", [&] { return read_feature_lines(path, context); });
        if (!lines) return lines.error();
        improve.feature_lines.push_back(std::move(*lines));
    }
    std::vector<Point> start;
    if (!job.picture.empty() || !job.html.empty()) start = file->mesh.positions;

    auto outcome = improve_mesh(file->mesh, improve, clock, context);
    if (!outcome) return outcome.error();
    OptimizeJobResult result;
    result.outcome = std::move(*outcome);
    result.times = clock.times();
    if (result.outcome.verdict == ErrorCode::cancelled) {
        if (!job.keep_best) return result;
        Context unhurried(context.parallel().threads(), context.seed());
        if (auto status = write_results(job, *file, start, clock, result, unhurried); !status)
            return status.error();
        return result;
    }
    context.report("write", 1);
    if (auto status = write_results(job, *file, start, clock, result, context); !status)
        return status.error();
    return result;
}

} // namespace hexopt
