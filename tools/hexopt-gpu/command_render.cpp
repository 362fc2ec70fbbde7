#include "choice.hpp"
#include "command.hpp"
#include "load_mesh.hpp"
#include "render/png.hpp"
#include "render/render_mesh.hpp"

#include <fmt/format.h>

namespace hexopt::cli {

namespace {

struct RenderCommand {
    std::string mesh, output, view = "iso", size = "1600x1200";
    std::vector<std::string> clips, patches;
    bool without_box = false;
    ColorBy color = ColorBy::quality;
    std::size_t worst = 0;
};

Result<RenderOptions> parse(const RenderCommand& command) {
    RenderOptions options;
    const Result<View> view = parse_view(command.view);
    if (!view) return view.error();
    const Result<PictureSize> size = parse_picture_size(command.size);
    if (!size) return size.error();
    for (const std::string& text : command.clips) {
        const Result<Clip> clip = parse_clip(text);
        if (!clip) return clip.error();
        options.clips.push_back(*clip);
    }
    options.view = *view;
    options.size = *size;
    options.color = command.color;
    options.patches = command.patches;
    options.without_box = command.without_box;
    options.worst_count = command.worst;
    return options;
}

void run(const RenderCommand& command, Session& session) {
    Context& context = session.context();
    const Result<RenderOptions> options = parse(command);
    if (!options) return session.fail(options.error());
    if (const Status named = check_png_name(command.output); !named) return session.fail(named.error());
    const Result<LoadedMesh> loaded = load_mesh(command.mesh, context);
    if (!loaded) return session.fail(loaded.error());
    const Result<Image> image = render_mesh(loaded->mesh, loaded->topology, *options, context);
    if (!image) return session.fail(image.error());
    const Status written = write_png(command.output, *image, context);
    if (!written) return session.fail(written.error());
    session.say(fmt::format("wrote {} ({} x {})", command.output, image->width(), image->height()));
}

} // namespace

void add_render(CLI::App& app, Session& session) {
    CLI::App* command = app.add_subcommand("render", "Draw a mesh as a PNG picture, without X server or GPU");
    const auto options = std::make_shared<RenderCommand>();
    command->add_option("mesh", options->mesh, "Mesh to draw: .vtk, .vtu, .mesh or .msh")
        ->required()
        ->type_name("MESH");
    command->add_option("-o,--output", options->output, "Picture to write")
        ->required()
        ->type_name("FILE.png");
    command
        ->add_option(
            "--clip", options->clips,
            "Keep the cells below a fraction of the box along an axis (x=0.5), or above it (-x=0.5); "
            "may be repeated")
        ->type_name("[-]AXIS=FRACTION")
        ->take_all();
    command
        ->add_option("--patches", options->patches,
                     "Draw only the surfaces of these patches; may be repeated")
        ->type_name("NAME")
        ->delimiter(',');
    command->add_flag(
        "--without-box", options->without_box,
        "Leave out what lies in the sides of the bounding box, as the outer box of a flow does");
    add_choice<ColorBy>(*command, "--color", options->color,
                        {{"quality", ColorBy::quality},
                         {"level", ColorBy::level},
                         {"patch", ColorBy::patch},
                         {"none", ColorBy::none}},
                        "What colours mean [quality]");
    command->add_option("--view", options->view, "iso, [-]x, [-]y, [-]z, or azimuth,elevation in degrees")
        ->type_name("VIEW")
        ->capture_default_str();
    command->add_option("--size", options->size, "Width x height in pixels")
        ->type_name("WxH")
        ->capture_default_str();
    command->add_option("--worst", options->worst, "Close-ups of the N worst cells instead of the whole mesh")
        ->type_name("N")
        ->check(CLI::Range(1u, 100u));
    session.add_common_options(*command);
    command->callback([options, &session] { run(*options, session); });
}

} // namespace hexopt::cli
