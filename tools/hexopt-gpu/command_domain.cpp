#include "command.hpp"
#include "mesh_flags.hpp"

#include <fmt/format.h>

namespace hexopt::cli {

namespace {

struct DomainCommand {
    MeshJob job;
    std::vector<std::string> surfaces;
    MeshFlags flags;
};

void run_domain(DomainCommand& command, Session& session) {
    Context& context = session.context();
    if (Status status = configure(command.flags, command.job, context); !status)
        return session.fail(status.error());
    command.job.surfaces.assign(command.surfaces.begin(), command.surfaces.end());
    if (command.job.output.extension() != ".hxd")
        return session.fail(
            make_error(ErrorCode::usage, "domain", command.job.output.string(), "name the domain file .hxd"));
    const Result<PreparedDomain> prepared = run_domain_job(command.job, context);
    if (!prepared) return session.fail(prepared.error());
    const Domain& domain = prepared->domain;
    session.say(fmt::format("{} patches, {} feature curves, {} corners, {} triangles",
                            domain.model.patch_count(), domain.model.curve_count(),
                            domain.model.corner_count(), domain.model.triangle_count()));
    if (domain.open_edges + domain.nonmanifold_edges > 0)
        session.say(fmt::format("note: {} open and {} non-manifold edges", domain.open_edges,
                                domain.nonmanifold_edges));
    session.say("wrote " + command.job.output.string());
}

} // namespace

void add_domain(CLI::App& app, Session& session) {
    CLI::App* command = app.add_subcommand(
        "domain", "Write what a surface encloses, with its features, as a file to edit and mesh");
    const auto options = std::make_shared<DomainCommand>();
    command
        ->add_option(
            "SURFACE", options->surfaces,
            "STL, OBJ, OFF, PLY, VTP or CAD; of several files each is a patch named after it. Or a domain "
            "file, to be checked and written anew")
        ->required()
        ->type_name("FILE...");
    command->add_option("-o,--output", options->job.output, "Domain file to write")
        ->required()
        ->type_name("FILE.hxd");
    add_config_flag(*command, options->flags);
    add_mesh_flags(*command, MeshFlagSet::of_domain, options->flags);
    session.add_common_options(*command);
    command->callback([options, &session] { run_domain(*options, session); });
}

} // namespace hexopt::cli
