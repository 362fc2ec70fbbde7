#include "choice.hpp"
#include "command.hpp"
#include "pipeline/optimize_pipeline.hpp"
#include "quality/report_text.hpp"

#include <fmt/core.h>

namespace hexopt::cli {

namespace {

struct Arguments {
    OptimizeJob job;
    double min_sj = 1;
    CLI::Option* boundary_option = nullptr;
    CLI::Option* min_sj_option = nullptr;
    std::vector<CLI::Option*> sliding_options; ///< without effect on a fixed boundary
};

void add_boundary_options(CLI::App& command, Arguments& arguments) {
    OptimizeOptions& o = arguments.job.improve.optimize;
    arguments.boundary_option = add_choice<BoundaryMode>(
        command, "--boundary", o.boundary, {{"fixed", BoundaryMode::fixed}, {"slide", BoundaryMode::slide}},
        "Whether it slides, along the surface and its features "
        "[slide; with --method thesis fixed]");
    auto& sliding = arguments.sliding_options;
    sliding.push_back(
        command
            .add_option(
                "--surface", arguments.job.surface,
                "STL, OBJ, OFF, PLY or VTP that the boundary slides on; default: the mesh's own boundary")
            ->type_name("FILE"));
    sliding.push_back(command
                          .add_option("--feature-angle", arguments.job.improve.features.feature_angle_deg,
                                      "Boundary edges sharper than this many degrees are features")
                          ->check(CLI::Range(0.0, 180.0))
                          ->capture_default_str());
    CLI::Option* lines =
        command
            .add_option("--features", arguments.job.feature_files,
                        "File of feature lines (.eMesh, .obj, .vtk, .vtp or .csv), beside those by angle; "
                        "--feature-angle 180: instead")
            ->type_name("FILE");
    sliding.push_back(lines);
    sliding.push_back(
        command
            .add_option("--features-reach", arguments.job.improve.feature_reach_rel,
                        "How far lines of --features may be from the surface, or from vertices of "
                        "the mesh where its own boundary is that, as a fraction of the diagonal")
            ->needs(lines)
            ->check(CLI::Range(0.0, 0.01))
            ->capture_default_str());
    sliding.push_back(
        command
            .add_option(
                "--max-deviation-rel", o.max_deviation_rel,
                "How far boundary vertices may leave the surface where cells need it, as a fraction of the "
                "diagonal; 0: not at all")
            ->check(CLI::Range(0.0, 0.1))
            ->capture_default_str());
    sliding.push_back(
        command
            .add_option(
                "--starts", o.starts,
                "With --boundary slide and at most 40,000 cells: from how many states the worst cells are "
                "raised, one after another; the best result is kept")
            ->check(CLI::Range(1, 4))
            ->type_name("COUNT")
            ->capture_default_str());
}

void add_method_options(CLI::App& command, Arguments& arguments) {
    OptimizeOptions& o = arguments.job.improve.optimize;
    add_choice<OptimizeMethod>(command, "--method", o.method,
                               {{"robust", OptimizeMethod::robust}, {"thesis", OptimizeMethod::thesis}},
                               "How; thesis: its Algorithms 1-3, boundary fixed [robust]");
    add_choice<Energy>(command, "--energy", o.energy,
                       {{"regularised", Energy::regularised},
                        {"shape", Energy::shape},
                        {"structural", Energy::structural},
                        {"hyperelastic", Energy::hyperelastic}},
                       "What is minimised; shape: for untangled input; the last two with --method thesis "
                       "[regularised; with --method thesis structural]");
    add_choice<Decomposition>(
        command, "--decomposition", o.decomposition,
        {{"8", Decomposition::corner8}, {"24", Decomposition::path24}, {"32", Decomposition::all32}},
        "Tetrahedra a cell to optimize [32]");
    add_choice<UntangleTarget>(command, "--untangle", o.untangle,
                               {{"axis", UntangleTarget::axis},
                                {"extended", UntangleTarget::extended},
                                {"deepest", UntangleTarget::deepest_point}},
                               "With --method thesis: the point of the kernel taken [deepest]");
    add_choice<GradientKind>(
        command, "--gradient", o.gradient,
        {{"analytic", GradientKind::analytic}, {"differences", GradientKind::finite_difference}},
        "With --method thesis: how gradients are computed [analytic]");
}

void add_compute_options(CLI::App& command, Arguments& arguments) {
    command
        .add_option("--device", arguments.job.improve.compute.device,
                    "auto (default) | cpu | vulkan | index or part of the name of one that `devices` lists")
        ->type_name("DEVICE");
    add_choice<compute::Precision>(command, "--precision", arguments.job.improve.compute.precision,
                                   {{"f32", compute::Precision::f32},
                                    {"f64", compute::Precision::f64},
                                    {"mixed", compute::Precision::mixed}},
                                   "Of the kernels; what is kept is always decided in f64 [f64]");
}

void add_termination_options(CLI::App& command, Arguments& arguments) {
    OptimizeOptions& o = arguments.job.improve.optimize;
    arguments.min_sj_option =
        command
            .add_option("--min-sj", arguments.min_sj,
                        "Stop at this minimum scaled Jacobian; exit code 9 where it is not reached")
            ->check(CLI::Range(-1.0, 1.0));
    command.add_option("--time", o.time_limit_s, "Stop after this many seconds")->check(CLI::PositiveNumber);
    command.add_option("--iterations", o.max_iterations, "Stop after this many steps and sweeps")
        ->check(CLI::Range(1, 1000000));
    add_choice<std::optional<bool>>(
        command, "--flatten", arguments.job.flatten, {{"yes", true}, {"no", false}},
        "Whether faces that OpenFOAM cannot cut into tetrahedra are flattened [yes for OpenFOAM]");
    command.add_flag("--keep-best", arguments.job.keep_best,
                     "Interrupted: write the best mesh reached so far");
}

/// "cell 12 at (1, 2, 3)", the first few of those that are not valid.
std::string describe_places(const QualityReport& quality) {
    std::string places;
    int listed = 0;
    for (const ListedCell& cell : quality.worst) {
        if (!cell.quality.validity.is_concave() && cell.quality.validity.validity == Validity::valid)
            continue;
        if (++listed > 3) return places + ", ...";
        places += fmt::format("{}cell {} at ({:.6g}, {:.6g}, {:.6g})", places.empty() ? "" : ", ", cell.cell,
                              cell.centre.x, cell.centre.y, cell.centre.z);
    }
    return places;
}

std::size_t count_unfit(const ValidityCounts& counts) {
    return std::max(counts.concave_cells, counts.cells - counts.valid);
}

void report_verdict(const Arguments& arguments, const OptimizeJobResult& result, Session& session) {
    const ImproveOutcome& outcome = result.outcome;
    const ValidityCounts& after = outcome.after.validity;
    const std::string output = arguments.job.output.string();
    Error error{outcome.verdict, "optimize", output, {}};
    switch (outcome.verdict) {
    case ErrorCode::no_valid_mesh:
        error.reasons = {fmt::format("written, but {} of {} cells are not valid: {}", count_unfit(after),
                                     after.cells, describe_places(outcome.after))};
        if (outcome.stats && outcome.stats->min_bad32 > 0)
            error.reasons.push_back(
                fmt::format("{} of them cannot become valid with this boundary; try --boundary slide, or a "
                            "larger --max-deviation-rel",
                            outcome.stats->min_bad32));
        break;
    case ErrorCode::below_target:
        error.reasons = {
            fmt::format("valid, but the minimum scaled Jacobian is {:.4f}, below the target {:.4f}",
                        after.min_scaled_jacobian, arguments.min_sj)};
        break;
    case ErrorCode::cancelled:
        error.reasons = {
            result.written.empty()
                ? std::string("interrupted; nothing was written (--keep-best writes what was reached)")
                : fmt::format("interrupted; the best mesh so far was written, with {} cells that are "
                              "not valid",
                              count_unfit(after))};
        break;
    default:
        return;
    }
    session.fail(error);
}

Status check_all_used(const Arguments& arguments) {
    if (arguments.job.improve.optimize.boundary != BoundaryMode::fixed) return Done{};
    for (const CLI::Option* option : arguments.sliding_options)
        if (*option)
            return make_error(ErrorCode::usage, "optimize", option->get_name(),
                              "has no effect on a boundary that is fixed; leave it out, or let it slide");
    return Done{};
}

void run_optimize(Arguments& arguments, Session& session) {
    if (*arguments.min_sj_option) {
        arguments.job.improve.optimize.min_sj = arguments.min_sj;
        arguments.job.improve.target_min_sj = arguments.min_sj;
    }
    OptimizeOptions& options = arguments.job.improve.optimize;
    if (options.method == OptimizeMethod::thesis && !*arguments.boundary_option)
        options.boundary = BoundaryMode::fixed;
    if (Status used = check_all_used(arguments); !used) return session.fail(used.error());
    Result<OptimizeJobResult> result = run_optimize_job(arguments.job, session.context());
    if (!result) return session.fail(result.error());
    const ImproveOutcome& outcome = result->outcome;
    for (const std::string& note : outcome.notes) session.say("note: " + note);
    session.say("computed on " + outcome.device);
    session.say("before: " + to_line(outcome.before.validity));
    session.say("after:  " + to_line(outcome.after.validity));
    double seconds = 0;
    for (const StageTime& time : result->times) seconds += time.seconds;
    for (const std::filesystem::path& path : result->written) session.say("wrote " + path.string());
    session.say(fmt::format("{:.2f} s", seconds));
    report_verdict(arguments, *result, session);
}

} // namespace

void add_optimize(CLI::App& app, Session& session) {
    auto arguments = std::make_shared<Arguments>();
    CLI::App* command = app.add_subcommand("optimize", "Untangle and improve a mesh");
    command->add_option("IN", arguments->job.input, "Mesh: VTK, VTU, MEDIT or Gmsh")->required();
    command->add_option("OUT", arguments->job.output, "Mesh to write: .vtu, .vtk, .mesh or .foam")
        ->required();
    add_method_options(*command, *arguments);
    add_boundary_options(*command, *arguments);
    add_termination_options(*command, *arguments);
    command->add_option("--report", arguments->job.report, "Writes the run as JSON")->type_name("FILE");
    command->add_option("--picture", arguments->job.picture, "Draws the mesh before and after")
        ->type_name("FILE.png");
    command->add_option("--html", arguments->job.html, "Writes the run as a web page with pictures")
        ->type_name("FILE.html");
    add_compute_options(*command, *arguments);
    session.add_common_options(*command);
    command->callback([arguments, &session] { run_optimize(*arguments, session); });
}

} // namespace hexopt::cli
