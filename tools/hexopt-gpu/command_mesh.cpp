#include "command.hpp"
#include "pipeline/mesh_keys.hpp"
#include "quality/report_text.hpp"

#include <fmt/format.h>

#include <map>

namespace hexopt::cli {

namespace {

struct MeshCommand {
    MeshJob job;
    std::vector<std::string> surfaces, patch_sizes, patch_levels;
    std::string config;
    bool dump = false;
    std::map<std::string, std::vector<std::string>> flags; ///< by key, as often as given
};

/// "NAME=VALUE" of --patch-size and --patch-level.
Status set_patch(MeshJob& job, const char* flag, const char* what, const std::string& text) {
    const std::size_t equals = text.rfind('=');
    double value = 0;
    const MeshKey number{"", flag, "", MeshKey::Kind::number, "", {}, {}};
    const auto parsed = equals == std::string::npos || equals == 0
                            ? Result<ConfigValue>(make_error(ErrorCode::usage, "configuration", flag,
                                                             fmt::format("'{}' is not NAME=VALUE", text)))
                            : parse_value(number, text.substr(equals + 1));
    if (!parsed) return parsed.error();
    value = std::get<double>(*parsed);
    return set_mesh_key(job, fmt::format("patches.{}.{}", text.substr(0, equals), what), value, flag);
}

/// The file first, then the flags, which count more.
Status configure(MeshCommand& command, Context& context) {
    if (!command.config.empty())
        if (Status status = read_mesh_config(command.config, command.job, context); !status) return status;
    for (const MeshKey& key : mesh_keys()) {
        const auto given = command.flags.find(key.name);
        if (given == command.flags.end()) continue;
        if (key.kind == MeshKey::Kind::texts) {
            if (Status status = set_mesh_key(command.job, key.name, given->second, key.flag); !status)
                return status;
            continue;
        }
        const auto value = parse_value(key, given->second.back());
        if (!value) return value.error();
        if (Status status = set_mesh_key(command.job, key.name, *value, key.flag); !status) return status;
    }
    for (const std::string& text : command.patch_sizes)
        if (Status status = set_patch(command.job, "--patch-size", "size", text); !status) return status;
    for (const std::string& text : command.patch_levels)
        if (Status status = set_patch(command.job, "--patch-level", "level", text); !status) return status;
    return Done{};
}

void report_verdict(const MeshCommand& command, const MeshJobResult& result, Session& session) {
    const MeshOutcome& outcome = result.outcome;
    const ValidityCounts& after = outcome.after.validity;
    Error error{outcome.verdict, "mesh", command.job.output.string(), {}};
    switch (outcome.verdict) {
    case ErrorCode::no_valid_mesh: {
        if (after.is_valid()) {
            error.reasons = {fmt::format("written, but its boundary touches or crosses itself in {} quads",
                                         outcome.contacts.size()),
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
        break;
    default:
        return;
    }
    session.fail(error);
}

void run_mesh(MeshCommand& command, Session& session) {
    Context& context = session.context();
    if (Status status = configure(command, context); !status) return session.fail(status.error());
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
    if (!result) return session.fail(result.error());
    const MeshOutcome& outcome = result->outcome;
    session.say(fmt::format("surface: {} patches, {} feature curves ({} followed), {} corners ({} met)",
                            outcome.patches, outcome.curves, outcome.fit.captured_curves, outcome.corners,
                            outcome.fit.captured_corners));
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

void add_keys(CLI::App& app, MeshCommand& command) {
    for (const MeshKey& key : mesh_keys()) {
        const ConfigValue standard = key.get(command.job);
        std::string value = std::visit(
            [](const auto& v) -> std::string {
                using T = std::decay_t<decltype(v)>;
                if constexpr (std::is_same_v<T, bool>)
                    return v ? "yes" : "no";
                else if constexpr (std::is_same_v<T, double> || std::is_same_v<T, std::string>)
                    return fmt::format("{}", v);
                else
                    return fmt::format("{}", fmt::join(v, ","));
            },
            standard);
        if (!value.empty()) value = " [" + value + "]";
        const bool is_list = key.kind == MeshKey::Kind::texts;
        app.add_option_function<std::vector<std::string>>(
               key.flag,
               [&command, name = key.name](const std::vector<std::string>& texts) {
                   command.flags[name] = texts;
               },
               key.help + value + (is_list ? "; repeatable" : ""))
            ->type_name(key.type)
            ->allow_extra_args(false)
            ->multi_option_policy(is_list ? CLI::MultiOptionPolicy::TakeAll : CLI::MultiOptionPolicy::Throw)
            ->expected(is_list ? -1 : 1)
            ->group(key.name.substr(0, key.name.find('.')));
    }
    app.add_option("--patch-size", command.patch_sizes,
                   "Longest edge of cells at one patch, model units; repeatable")
        ->type_name("NAME=X")
        ->allow_extra_args(false)
        ->group("refine");
    app.add_option("--patch-level", command.patch_levels,
                   "Halvings of the initial mesh at one patch; repeatable")
        ->type_name("NAME=N")
        ->allow_extra_args(false)
        ->group("refine");
}

} // namespace

void add_mesh(CLI::App& app, Session& session) {
    CLI::App* command = app.add_subcommand("mesh", "Mesh what a surface encloses, with hexahedra");
    const auto options = std::make_shared<MeshCommand>();
    command
        ->add_option("SURFACE", options->surfaces,
                     "STL, OBJ, OFF, PLY or VTP; of several files each is a patch named after it")
        ->type_name("FILE...");
    command
        ->add_option("-o,--output", options->job.output,
                     "Mesh to write: .vtu, .vtk, .mesh, .foam or a folder polyMesh")
        ->type_name("FILE");
    command->add_option("-c,--config", options->config, "Configuration (TOML); flags count more")
        ->type_name("FILE.toml");
    command->add_flag("--dump-config", options->dump,
                      "Print the configuration with all keys, and do nothing");
    command->add_option("--report", options->job.report, "Writes the run as JSON")->type_name("FILE");
    command->add_option("--picture", options->job.picture, "Draws the mesh, whole and cut")
        ->type_name("FILE.png");
    command->add_option("--html", options->job.html, "Writes the run as a web page with pictures")
        ->type_name("FILE.html");
    command->add_flag("--keep-best", options->job.keep_best,
                      "Interrupted while optimizing: write the best mesh so far");
    add_keys(*command, *options);
    session.add_common_options(*command);
    command->callback([options, &session] { run_mesh(*options, session); });
}

} // namespace hexopt::cli
