#include "command.hpp"
#include "io/mesh_io.hpp"
#include "quality/mesh_validity.hpp"
#include "quality/report_text.hpp"
#include "samples/samples.hpp"

#include <fmt/core.h>

#include <map>

namespace hexopt::cli {

namespace {

struct SampleCommand {
    std::string name, output;
    SampleOptions sample;
};

std::string describe_samples() {
    std::string text = "Samples:";
    for (const SampleInfo& info : sample_infos())
        text += fmt::format("\n  {:<16} {} (size {}{})", info.name, info.description, info.default_size,
                            info.default_levels > 0 ? fmt::format(", {} levels", info.default_levels) : "");
    return text;
}

void run_sample(const SampleCommand& options, Session& session) {
    Context& context = session.context();
    const Result<HexMesh> mesh = make_sample(options.name, options.sample, context);
    if (!mesh) return session.fail(mesh.error());
    const Status written = write_mesh(options.output, *mesh, {}, {}, context);
    if (!written) return session.fail(written.error());
    session.say(to_line(compute_validity(*mesh, context.parallel())));
    session.say("wrote " + options.output);
}

} // namespace

void add_sample(CLI::App& app, Session& session) {
    CLI::App* command = app.add_subcommand("sample", "Generate a mesh to try things on");
    command->footer(describe_samples());
    const auto options = std::make_shared<SampleCommand>();
    static const std::map<std::string, PerturbPattern> kPatterns = {
        {"everywhere", PerturbPattern::everywhere}, {"spots", PerturbPattern::spots}};
    command->add_option("name", options->name, "What to generate; see below")
        ->required()
        ->type_name("NAME")
        ->check(CLI::IsMember(sample_names()).description(""));
    command->add_option("-o,--output", options->output, "Mesh to write: .vtu, .vtk or .mesh")
        ->required()
        ->type_name("FILE");
    command
        ->add_option("--size", options->sample.size,
                     "Cells of the coarsest level along an edge; 0: the sample's default")
        ->type_name("N")
        ->check(CLI::Range(0, 2000))
        ->capture_default_str();
    command->add_option("--levels", options->sample.levels, "Deepest refinement level; default: the sample's")
        ->type_name("N")
        ->check(CLI::Range(0, 6));
    command
        ->add_option("--tangled", options->sample.tangled,
                     "Fraction of cells to tangle by moving inner vertices")
        ->type_name("X")
        ->check(CLI::Range(0.0, 0.9))
        ->capture_default_str();
    command->add_option("--pattern", options->sample.pattern, "Where to tangle: everywhere | spots")
        ->type_name("NAME")
        ->transform(CLI::CheckedTransformer(kPatterns).description(""));
    command->add_flag("--scrambled", options->sample.scrambled, "Put all inner vertices at random places");
    session.add_common_options(*command);
    command->callback([options, &session] { run_sample(*options, session); });
}

} // namespace hexopt::cli
