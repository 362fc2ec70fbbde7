#include "command.hpp"
#include "io/mesh_io.hpp"
#include "io/write_surface.hpp"
#include "quality/mesh_validity.hpp"
#include "quality/report_text.hpp"
#include "samples/geometry/geometries.hpp"
#include "samples/samples.hpp"

#include <fmt/core.h>

#include <map>

namespace hexopt::cli {

namespace {

struct SampleCommand {
    std::string name, output, airfoil;
    SampleOptions sample;
    bool is_binary = false;
    /// Options that say something about hexahedra only.
    std::vector<const CLI::Option*> mesh_only, geometry_only;
};

std::string describe_samples() {
    std::string text = "Meshes (-o .vtu, .vtk, .mesh or .foam):";
    for (const SampleInfo& info : sample_infos())
        text += fmt::format("\n  {:<16} {} (size {}{})", info.name, info.description, info.default_size,
                            info.default_levels > 0 ? fmt::format(", {} levels", info.default_levels) : "");
    text += "\nGeometries (-o .stl or .obj), closed surfaces with named patches:";
    for (const GeometryInfo& info : geometry_infos())
        text += fmt::format("\n  {:<16} {} (size {})", info.name, info.description, info.default_size);
    return text;
}

std::vector<std::string> all_names() {
    std::vector<std::string> names = sample_names();
    for (const std::string& name : geometry_names()) names.push_back(name);
    return names;
}

bool refuse(const std::vector<const CLI::Option*>& options, const char* what, const SampleCommand& command,
            Session& session) {
    for (const CLI::Option* option : options)
        if (*option) {
            session.fail(make_error(ErrorCode::usage, "sample", "",
                                    fmt::format("{} does not go with {}, which is a {}", option->get_name(),
                                                command.name, what)));
            return true;
        }
    return false;
}

void run_geometry(const SampleCommand& options, Session& session) {
    if (refuse(options.mesh_only, "geometry", options, session)) return;
    Context& context = session.context();
    const GeometryOptions geometry{static_cast<int>(options.sample.size), options.airfoil};
    const Result<TriangleSoup> surface = make_geometry(options.name, geometry, context);
    if (!surface) return session.fail(surface.error());
    const Status written = write_surface(options.output, *surface, {options.is_binary}, context);
    if (!written) return session.fail(written.error());
    session.say(
        fmt::format("{} triangles, {} patches", surface->triangles.size(), surface->patch_names.size()));
    session.say("wrote " + options.output);
}

void run_mesh(const SampleCommand& options, Session& session) {
    if (refuse(options.geometry_only, "mesh", options, session)) return;
    Context& context = session.context();
    const Result<HexMesh> mesh = make_sample(options.name, options.sample, context);
    if (!mesh) return session.fail(mesh.error());
    const Status written = write_mesh(options.output, *mesh, {}, {}, context);
    if (!written) return session.fail(written.error());
    session.say(to_line(compute_validity(*mesh, context.parallel())));
    session.say("wrote " + options.output);
}

void run_sample(const SampleCommand& options, Session& session) {
    is_geometry_name(options.name) ? run_geometry(options, session) : run_mesh(options, session);
}

void add_mesh_options(CLI::App& command, SampleCommand& options) {
    static const std::map<std::string, PerturbPattern> kPatterns = {
        {"everywhere", PerturbPattern::everywhere}, {"spots", PerturbPattern::spots}};
    CLI::Option* levels = command.add_option("--levels", options.sample.levels,
                                             "Deepest refinement level; default: the sample's");
    levels->type_name("N")->check(CLI::Range(0, 6));
    CLI::Option* tangled = command.add_option("--tangled", options.sample.tangled,
                                              "Fraction of cells to tangle by moving inner vertices");
    tangled->type_name("X")->check(CLI::Range(0.0, 0.9))->capture_default_str();
    CLI::Option* pattern =
        command.add_option("--pattern", options.sample.pattern, "Where to tangle: everywhere | spots");
    pattern->type_name("NAME")->transform(CLI::CheckedTransformer(kPatterns).description(""));
    CLI::Option* scrambled =
        command.add_flag("--scrambled", options.sample.scrambled, "Put all inner vertices at random places");
    options.mesh_only = {levels, tangled, pattern, scrambled};
}

} // namespace

void add_sample(CLI::App& app, Session& session) {
    CLI::App* command = app.add_subcommand("sample", "Generate a mesh or a surface to try things on");
    command->footer(describe_samples());
    const auto options = std::make_shared<SampleCommand>();
    command->add_option("name", options->name, "What to generate; see below")
        ->required()
        ->type_name("NAME")
        ->check(CLI::IsMember(all_names()).description(""));
    command->add_option("-o,--output", options->output, "File to write; its extension is the format")
        ->required()
        ->type_name("FILE");
    command
        ->add_option(
            "--size", options->sample.size,
            "Cells of the coarsest level along an edge; of a geometry: segments of a full circle; 0: "
            "the sample's default")
        ->type_name("N")
        ->check(CLI::Range(0, 2000))
        ->capture_default_str();
    add_mesh_options(*command, *options);
    CLI::Option* airfoil =
        command->add_option("--airfoil", options->airfoil,
                            "NACA code of 4 or 5 digits, or file of coordinates; airfoil and wing");
    CLI::Option* binary = command->add_flag("--binary", options->is_binary, "STL in binary, without patches");
    options->geometry_only = {airfoil->type_name("CODE|FILE"), binary};
    session.add_common_options(*command);
    command->callback([options, &session] { run_sample(*options, session); });
}

} // namespace hexopt::cli
