#include "command.hpp"
#include "mesh_flags.hpp"
#include "quality/report_text.hpp"

#include <fmt/format.h>

namespace hexopt::cli {

namespace {

struct MeshCommand {
    MeshJob job;
    std::vector<std::string> surfaces;
    bool dump = false;
    MeshFlags flags;
};

void report_verdict(const MeshCommand& command, const MeshJobResult& result, Session& session) {
    const MeshOutcome& outcome = result.outcome;
    const ValidityCounts& after = outcome.after.validity;
    Error error{outcome.verdict, "mesh", command.job.output.string(), {}};
    switch (outcome.verdict) {
    case ErrorCode::no_valid_mesh: {
        if (after.is_valid()) {
            const Point p =
                outcome.mesh.positions[outcome.mesh.boundary[outcome.contacts.front()].vertices[0]];
            error.reasons = {
                fmt::format("written, but its boundary touches or crosses itself in {} quads, the "
                            "first at ({:.6g}, {:.6g}, {:.6g})",
                            outcome.contacts.size(), p.x, p.y, p.z),
                "try a smaller --size there, or more --gap-cells"};
            break;
        }
        const ListedCell& worst = outcome.after.worst.front();
        error.reasons = {
            fmt::format("written, but {} of {} cells are not valid, the worst at ({:.6g}, {:.6g}, {:.6g})",
                        std::max(after.concave_cells, after.cells - after.valid), after.cells, worst.centre.x,
                        worst.centre.y, worst.centre.z),
            "try a smaller --size there, or --max-deviation-rel"};
        break;
    }
    case ErrorCode::below_target:
        error.reasons = {
            fmt::format("valid, but the minimum scaled Jacobian is {:.4f}, below the target {:.4f}",
                        after.min_scaled_jacobian, *command.job.options.target_min_sj)};
        break;
    case ErrorCode::cancelled:
        error.reasons = {
            result.written.empty()
                ? std::string("interrupted; nothing was written (--keep-best writes what was reached)")
                : fmt::format("interrupted; the best mesh so far was written, {} of {} cells valid",
                              after.valid, after.cells)};
        if (!command.job.checkpoint.empty()) error.reasons.emplace_back("--resume goes on with the run");
        break;
    default:
        return;
    }
    session.fail(error);
}

/// Before there was a mesh.
Error describe_cancelled(const MeshCommand& command, const std::string& stage) {
    Error error = make_error(ErrorCode::cancelled, "mesh", command.job.output.string(),
                             fmt::format("interrupted ({}); nothing was written{}", stage,
                                         command.job.keep_best ? ", as there was no mesh yet" : ""));
    if (!command.job.checkpoint.empty()) error.reasons.emplace_back("--resume goes on with the run");
    return error;
}

void run_mesh(MeshCommand& command, Session& session) {
    Context& context = session.context();
    if (Status status = configure(command.flags, command.job, context); !status)
        return session.fail(status.error());
    if (command.dump) {
        std::string text = dump_mesh_config(command.job);
        text.pop_back();
        fmt::print("{}\n", text);
        return;
    }
    if (command.surfaces.empty() || command.job.output.empty())
        return session.fail(make_error(ErrorCode::usage, "mesh", "",
                                       "give at least one SURFACE and -o OUT; see hexopt-gpu mesh --help"));
    command.job.surfaces.assign(command.surfaces.begin(), command.surfaces.end());
    const Result<MeshJobResult> result = run_mesh_job(command.job, context);
    if (!result && result.error().code == ErrorCode::cancelled)
        return session.fail(describe_cancelled(command, result.error().stage));
    if (!result) return session.fail(result.error());
    const MeshOutcome& outcome = result->outcome;
    session.say(fmt::format("surface: {} patches, {} feature curves ({} followed), {} corners ({} met)",
                            outcome.patches, outcome.curves, outcome.fit.captured_curves, outcome.corners,
                            outcome.reached ? outcome.reached->corners_after : outcome.fit.captured_corners));
    if (!outcome.device.empty()) session.say("optimized on " + outcome.device);
    for (const std::string& note : outcome.notes) session.say("note: " + note);
    session.say("mesh:    " + to_line(outcome.after.validity));
    session.say(fmt::format("largest distance between mesh and surface: {:.3g}, {:.2g} of the diagonal",
                            outcome.deviation.largest(), outcome.deviation.largest_rel()));
    double seconds = 0;
    for (const StageTime& time : result->times) seconds += time.seconds;
    for (const std::filesystem::path& path : result->written) session.say("wrote " + path.string());
    session.say(fmt::format("{:.2f} s", seconds));
    report_verdict(command, *result, session);
}

} // namespace

void add_mesh(CLI::App& app, Session& session) {
    CLI::App* command = app.add_subcommand("mesh", "Mesh what a surface encloses, with hexahedra");
    const auto options = std::make_shared<MeshCommand>();
    command
        ->add_option(
            "SURFACE", options->surfaces,
            "STL, OBJ, OFF, PLY, VTP or CAD; of several files each is a patch named after it. Or one domain "
            "file (.hxd), or outlines (.dat) that are meshed in the plane")
        ->type_name("FILE...");
    command
        ->add_option("-o,--output", options->job.output,
                     "Mesh to write: .vtu, .vtk, .mesh, .foam or a folder polyMesh")
        ->type_name("FILE");
    add_config_flag(*command, options->flags);
    command->add_flag("--dump-config", options->dump,
                      "Print the configuration with all keys, and do nothing");
    command->add_option("--report", options->job.report, "Writes the run as JSON")->type_name("FILE");
    command->add_option("--picture", options->job.picture, "Draws the mesh, whole and cut")
        ->type_name("FILE.png");
    command->add_option("--html", options->job.html, "Writes the run as a web page with pictures")
        ->type_name("FILE.html");
    command
        ->add_option("--checkpoint", options->job.checkpoint,
                     "Keeps the run's state between stages in this folder, until the mesh is written")
        ->type_name("DIR");
    command->add_flag("--resume", options->job.resume,
                      "Goes on with the run whose state --checkpoint's folder holds; the mesh is the same as "
                      "if it had not been interrupted");
    command->add_flag("--keep-best", options->job.keep_best,
                      "Interrupted while optimizing: write the best mesh so far");
    add_mesh_flags(*command, MeshFlagSet::all, options->flags);
    session.add_common_options(*command);
    command->callback([options, &session] { run_mesh(*options, session); });
}

} // namespace hexopt::cli
