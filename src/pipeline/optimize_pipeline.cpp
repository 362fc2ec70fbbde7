#include "pipeline/optimize_pipeline.hpp"

#include "io/atomic_file.hpp"
#include "io/mesh_io.hpp"

#include <nlohmann/json.hpp>

namespace hexopt {

namespace {

/// Where results go is checked before hours are spent on them.
Status check_outputs(const OptimizeJob& job) {
    for (const std::filesystem::path& path : {job.output, job.report}) {
        if (path.empty()) continue;
        const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
        std::error_code error;
        if (!std::filesystem::is_directory(folder, error))
            return make_error(ErrorCode::output_failed, "write", path.string(),
                              "no such directory: " + folder.string());
        if (std::filesystem::is_directory(path, error))
            return make_error(ErrorCode::output_failed, "write", path.string(), "is a directory");
    }
    return Done{};
}

} // namespace

Result<OptimizeJobResult> run_optimize_job(const OptimizeJob& job, Context& context) {
    if (auto status = check_outputs(job); !status) return status.error();
    StageClock clock;
    context.report("read", 0);
    auto file = clock.run("read", [&] { return read_mesh_file(job.input, context); });
    if (!file) return file.error();

    auto outcome = improve_mesh(file->mesh, job.improve, clock, context);
    if (!outcome) return outcome.error();
    OptimizeJobResult result;
    result.outcome = std::move(*outcome);

    const bool wanted = result.outcome.verdict != ErrorCode::cancelled || job.keep_best;
    if (wanted) {
        context.report("write", 1);
        const Status written =
            clock.run("write", [&] { return write_mesh(job.output, file->mesh, file->fields, {}, context); });
        if (!written) return written.error();
        result.written.push_back(job.output);
    }
    result.times = clock.times();
    if (wanted && !job.report.empty()) {
        const Status written = write_atomically(
            job.report,
            to_json(job, result).dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n",
            context);
        if (!written) return written.error();
        result.written.push_back(job.report);
    }
    return result;
}

} // namespace hexopt
