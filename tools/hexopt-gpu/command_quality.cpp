#include "command.hpp"
#include "io/atomic_file.hpp"
#include "load_mesh.hpp"
#include "pipeline/check_outputs.hpp"
#include "quality/report_json.hpp"
#include "quality/report_text.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace hexopt::cli {

namespace {

struct QualityCommand {
    std::string mesh;
    std::string json;
    std::size_t worst = 10;
    bool require_valid = false;
    double min_sj = -1;
};

/// The mesh's own verdict against what the user asked for; does nothing when all of it holds.
void judge(const QualityReport& report, const QualityCommand& options, Session& session) {
    const ValidityCounts& v = report.validity;
    if (options.require_valid && !v.is_valid())
        return session.fail(make_error(ErrorCode::no_valid_mesh, "quality", options.mesh,
                                       fmt::format("{} of {} cells are concave, {} not certified valid",
                                                   v.concave_cells, v.cells, v.cells - v.valid)));
    if (v.min_scaled_jacobian < options.min_sj)
        session.fail(make_error(ErrorCode::below_target, "quality", options.mesh,
                                fmt::format("minimum scaled Jacobian {:.6g} in cell {} is below {:.6g}",
                                            v.min_scaled_jacobian, v.worst_cell, options.min_sj)));
}

void run(const QualityCommand& options, Session& session) {
    Context& context = session.context();
    if (!options.json.empty())
        if (const Status kept = check_not_read(options.json, {options.mesh}); !kept)
            return session.fail(kept.error());
    const Result<LoadedMesh> loaded = load_mesh(options.mesh, context);
    if (!loaded) return session.fail(loaded.error());
    QualityOptions wanted;
    wanted.worst_count = options.worst;
    const Result<QualityReport> report = compute_quality(loaded->mesh, loaded->topology, wanted, context);
    if (!report) return session.fail(report.error());
    std::string text = to_text(*report);
    text.pop_back();
    session.say(text);
    if (!options.json.empty()) {
        nlohmann::json json = to_json(*report);
        json["file"] = options.mesh;
        const Status written = write_atomically(
            options.json, json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n", context);
        if (!written) return session.fail(written.error());
    }
    judge(*report, options, session);
}

} // namespace

void add_quality(CLI::App& app, Session& session) {
    CLI::App* command = app.add_subcommand("quality", "Measure a mesh: validity, quality, worst cells");
    const auto options = std::make_shared<QualityCommand>();
    command->add_option("mesh", options->mesh, "Mesh to measure: .vtk, .vtu, .mesh or .msh")
        ->required()
        ->type_name("MESH");
    command->add_option("--json", options->json, "Write all figures as JSON")->type_name("FILE");
    command->add_option("--worst", options->worst, "Cells to list, the worst first")
        ->type_name("N")
        ->check(CLI::Range(0u, 1000000000u))
        ->capture_default_str();
    command->add_flag("--require-valid", options->require_valid,
                      "Exit with 5 unless all tetrahedra are positive and every cell is certified valid");
    command
        ->add_option("--min-sj", options->min_sj, "Exit with 9 if the minimum scaled Jacobian is below this")
        ->check(CLI::Range(-1.0, 1.0));
    session.add_common_options(*command);
    command->callback([options, &session] { run(*options, session); });
}

} // namespace hexopt::cli
