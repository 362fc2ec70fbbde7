#include "command.hpp"
#include "io/atomic_file.hpp"
#include "io/file_bytes.hpp"
#include "load_mesh.hpp"
#include "pipeline/check_outputs.hpp"
#include "pipeline/mesh_pictures.hpp"
#include "render/html_report.hpp"
#include "render/png.hpp"
#include "render/render_mesh.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace hexopt::cli {

namespace {

struct ReportCommand {
    std::string report, output;
    bool no_pictures = false;
};

Result<nlohmann::json> read_json(const std::string& file, Context& context) {
    const Result<FileBytes> bytes = read_file(file, context);
    if (!bytes) return bytes.error();
    try {
        return nlohmann::json::parse(bytes->view());
    } catch (const nlohmann::json::parse_error& error) {
        return make_error(ErrorCode::bad_input, "report", fmt::format("{}: byte {}", file, error.byte),
                          "is not JSON");
    } catch (const nlohmann::json::exception&) {
        return make_error(ErrorCode::bad_input, "report", file,
                          "holds a number that is too large to be kept");
    }
}

Result<LoadedMesh> load_named_mesh(const std::string& file, Context& context) {
    Result<LoadedMesh> loaded = load_mesh(file, context);
    if (loaded) return loaded;
    Error error = loaded.error();
    error.reasons.push_back("--no-pictures makes the report without the meshes it names");
    return error;
}

/// The mesh from outside and cut in half.
Status add_pictures(std::vector<ReportPicture>& pictures, const std::string& title, const std::string& file,
                    Context& context) {
    const Result<LoadedMesh> loaded = load_named_mesh(file, context);
    if (!loaded) return loaded.error();
    for (bool cut : {false, true}) {
        RenderOptions options;
        options.size = {1000, 750};
        if (cut) options.clips.push_back({.axis = 1, .fraction = 0.5, .keep_above = true});
        const Result<Image> image = render_mesh(loaded->mesh, loaded->topology, options, context);
        if (!image) return image.error();
        pictures.push_back({title + (cut ? ", cut in half" : ""), encode_png(*image)});
    }
    return Done{};
}

/// Pictures of the meshes that a report names.
Result<std::vector<ReportPicture>> draw_pictures(const nlohmann::json& report, Context& context) {
    std::vector<ReportPicture> pictures;
    constexpr std::pair<const char*, const char*> kMeshes[] = {
        {"input", "before"}, {"output", "after"}, {"file", "mesh"}};
    for (const auto& [key, title] : kMeshes) {
        const auto found = report.find(key);
        if (found == report.end() || !found->is_string() || found->get<std::string>().empty()) continue;
        const Status drawn = add_pictures(pictures, title, found->get<std::string>(), context);
        if (!drawn) return drawn.error();
    }
    return pictures;
}

Result<std::string> make_page(const nlohmann::json& report, bool has_pictures, Context& context) {
    if (!has_pictures || !report.is_object()) return make_html_report(report, {});
    // Only `mesh` has attempts; its input is a surface.
    if (report.contains("attempts")) {
        const auto output = report.find("output");
        if (output == report.end() || !output->is_string()) return make_html_report(report, {});
        const Result<LoadedMesh> loaded = load_named_mesh(output->get<std::string>(), context);
        if (!loaded) return loaded.error();
        return make_mesh_page(report, loaded->mesh, context);
    }
    const Result<std::vector<ReportPicture>> pictures = draw_pictures(report, context);
    if (!pictures) return pictures.error();
    return make_html_report(report, *pictures);
}

void run(const ReportCommand& command, Session& session) {
    Context& context = session.context();
    if (const Status kept = check_not_read(command.output, {command.report}); !kept)
        return session.fail(kept.error());
    const Result<nlohmann::json> report = read_json(command.report, context);
    if (!report) return session.fail(report.error());
    const Result<std::string> html = make_page(*report, !command.no_pictures, context);
    if (!html) return session.fail(html.error());
    const Status written = write_atomically(command.output, *html, context);
    if (!written) return session.fail(written.error());
    session.say(
        fmt::format("wrote {} ({:.0f} kB)", command.output, static_cast<double>(html->size()) / 1000));
}

} // namespace

void add_report(CLI::App& app, Session& session) {
    CLI::App* command =
        app.add_subcommand("report", "Turn a JSON report into one web page with histograms and pictures");
    const auto options = std::make_shared<ReportCommand>();
    command
        ->add_option("report", options->report,
                     "What 'mesh --report', 'optimize --report' or 'quality --json' wrote")
        ->required()
        ->type_name("REPORT.json");
    command->add_option("-o,--output", options->output, "Page to write")->required()->type_name("FILE.html");
    command->add_flag("--no-pictures", options->no_pictures, "Do not draw the meshes that the report names");
    session.add_common_options(*command);
    command->callback([options, &session] { run(*options, session); });
}

} // namespace hexopt::cli
